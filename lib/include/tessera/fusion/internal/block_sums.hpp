// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// B of a block: what all robots say of it, added up in the order of their numbers.
#pragma once

#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/fusion/global_map_config.hpp"
#include "tessera/fusion/internal/robot_share.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace tessera {

class BlockSums {
 public:
  using Slot = Replicas::Slot;
  /// What was added up.
  struct Added {
    std::uint64_t work = 0;    ///< Entries read and places looked up.
    std::uint64_t robots = 0;  ///< With label evidence, a bit each.
  };

  /// Without scratch.
  [[nodiscard]] static constexpr std::size_t required_bytes(int num_components) noexcept {
    return RobotShare::required_bytes(num_components) + arena_bytes<std::uint8_t>(kBlockVoxels);
  }
  /// num_components: C + 2; scratch: for one packed block. Fails with kResourceExhausted iff the
  /// arena is too small.
  [[nodiscard]] static Result<BlockSums> make(Arena& arena, const GlobalMapConfig& config,
                                              int num_components,
                                              std::span<std::byte> scratch) noexcept;
  BlockSums() noexcept = default;

  /// Adds up all contributions to a block of the global grid. content: cleared before.
  /// O(contributions * (27 look-ups + entries)).
  [[nodiscard]] Added add_up(const Replicas& replicas, BlockCoord block,
                             BlockContent& content) noexcept;
  /// Eq. (10): S_i lambda_i of every local voxel counts the prior too. To be called after add_up,
  /// with what it gave. O(512 C).
  void add_priors(BlockContent& content) const noexcept;

 private:
  /// One block of one contribution, and where it goes.
  struct Source {
    const Replicas& replicas;
    const Replicas::Contribution& contribution;
    BlockCoord block;
    BlockContent& content;
    bool& labelled;  ///< Set if a class has evidence here.
  };
  std::uint64_t add_robot(const Replicas& replicas, std::span<const Slot> contributions,
                          BlockCoord block, BlockContent& content, std::uint64_t& robots) noexcept;
  std::uint64_t add_contribution(const Source& source, Slot slot) noexcept;
  std::uint64_t add_local_block(const Source& source, Slot slot, BlockCoord local) noexcept;
  std::uint64_t add_replica(const Source& source, const Replicas::Replica& replica) noexcept;

  float omega_ = 1.0F;
  float prior_ = 0.0F;
  int last_class_ = 0;
  RobotShare share_{};
  std::span<std::uint8_t> observers_;  ///< Local voxels that went to each voxel.
  std::span<std::byte> scratch_;
};

}  // namespace tessera
