// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// B of a block: what all robots say of it, added up in the order of their numbers, and what maps of
// earlier days say, as one more robot.
#pragma once

#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/fusion/global_map_config.hpp"
#include "tessera/fusion/internal/opinions.hpp"
#include "tessera/fusion/internal/robot_share.hpp"
#include "tessera/fusion/internal/robot_weights.hpp"
#include "tessera/fusion/internal/session_share.hpp"
#include "tessera/map/internal/packed_block.hpp"
#include "tessera/replica/objection.hpp"

namespace tessera {

class BlockSums {
 public:
  using Slot = Replicas::Slot;
  /// What was added up.
  struct Added {
    std::uint64_t work = 0;  ///< Entries read and places looked up.
    /// With label evidence, a bit each; sessions together have the lowest that no robot has.
    std::uint64_t robots = 0;
    std::uint64_t classes = 0;   ///< That any of them has, a bit each.
    std::uint16_t objected = 0;  ///< Voxels, as GlobalRecord has them.
    std::uint16_t disputed = 0;
    /// What the block says of the robots' labels, until the next one.
    std::span<const LabelTally> tallies;
  };

  /// Without scratch.
  [[nodiscard]] static constexpr std::size_t required_bytes(const GlobalMapConfig& config,
                                                            int num_components) noexcept {
    return RobotShare::required_bytes(num_components, config.replicas.contributions) +
           SessionShare::required_bytes(num_components, config.replicas.contributions) +
           arena_bytes<std::uint8_t>(kBlockVoxels) + arena_bytes<VoxelCoord>(kBlockVoxels) +
           3 * arena_bytes<std::uint8_t>(kBlockVoxels) + 2 * arena_bytes<float>(kBlockVoxels) +
           2 * arena_bytes<std::int16_t>(kBlockVoxels) + arena_bytes<Turned>(1) +
           arena_bytes<float>(static_cast<std::size_t>(num_components)) +
           Opinions::required_bytes(most_robots(config.replicas), num_components);
  }
  /// num_components: C + 2; scratch: for one packed block. Fails with kResourceExhausted iff the
  /// arena is too small.
  [[nodiscard]] static Result<BlockSums> make(Arena& arena, const GlobalMapConfig& config,
                                              int num_components,
                                              std::span<std::byte> scratch) noexcept;
  BlockSums() noexcept = default;

  /// Adds up all contributions to a block of the global grid. content: cleared before.
  /// A voxel of a contribution to which at least as many robots object (objection.hpp) as have
  /// occupied the voxel to which it goes keeps its passes alone. O(contributions * 27 * (1 + robots
  /// that object) look-ups + entries); twice the entries where there is an objection.
  /// A robot's labels count by their weights. What of them does not is evidence that something is
  /// there, of no known class.
  [[nodiscard]] Added add_up(const Replicas& replicas, const RobotWeights& weights,
                             BlockCoord block, BlockContent& content) noexcept;
  /// Eq. (10): S_i lambda_i of every local voxel counts the prior too. To be called after add_up,
  /// with what it gave. O(512 C).
  void add_priors(BlockContent& content) const noexcept;

 private:
  /// One contribution to one block.
  struct Source {
    const Replicas& replicas;
    const Replicas::Contribution& contribution;
    BlockCoord block;
  };
  /// Of a voxel that is added up, from one contribution in a turned frame.
  struct Passes {
    unsigned taken = 0;       ///< Of the local voxels that it takes.
    float share = 0.0F;       ///< Boxes around returns that are in it.
    float of_surface = 0.0F;  ///< Passes of the voxels that these come from, by their share.
  };
  /// Of the contribution, and the replica of it, that is added up.
  struct Turned {
    std::array<Passes, kBlockVoxels> passes{};
    std::array<Centroid, kBlockVoxels> centroids{};
  };
  class RowTargets;
  class ShiftedRows;
  class TurnedPasses;
  class ToRobot;
  class ToSessions;
  class ToHolders;
  template <class Adder>
  std::uint64_t add_blocks(const Source& source, Slot slot, Adder& adder,
                           TurnedPasses* passes) noexcept;
  template <class Adder>
  std::uint64_t add_contribution(const Source& source, Slot slot, Adder& adder) noexcept;
  template <class Adder>
  std::uint64_t add_local_block(const Source& source, Slot slot, BlockCoord local, Adder& adder,
                                TurnedPasses* passes) noexcept;
  template <class Adder>
  std::uint64_t add_replica(const Source& source, const Replicas::Replica& replica,
                            RowTargets& targets, Adder& adder, TurnedPasses* passes) noexcept;
  /// The same where whole voxels go to whole voxels and nobody objects.
  template <class Adder>
  std::uint64_t add_shifted(const Source& source, const Replicas::Replica& replica,
                            BlockCoord local, Adder& adder) noexcept;
  /// Whether any robot objects to what a contribution has in the block.
  static std::uint64_t look_for_objections(const Source& source, Slot slot, bool& any) noexcept;
  /// Where a block is in a range, from the first of its blocks, of three on an axis at most.
  [[nodiscard]] static std::uint8_t place_in(BlockCoord first, BlockCoord block) noexcept {
    return static_cast<std::uint8_t>((block.x - first.x) + 3 * (block.y - first.y) +
                                     9 * (block.z - first.z));
  }
  void count_holders(const Replicas& replicas, BlockCoord block, Added& added) noexcept;
  void count_objectors(const Source& source, const Replicas::Replica& replica) noexcept;
  [[nodiscard]] bool is_objected(int row, int target) noexcept;
  std::uint64_t gather_robot(const Replicas& replicas, std::span<const Slot> contributions,
                             BlockCoord block, std::uint64_t& robots) noexcept;
  void add_robot(const RobotWeights& weights, unsigned robot_bit, BlockContent& content) noexcept;
  void add_doubted(BlockContent& content) const noexcept;
  std::uint64_t add_sessions(const Replicas& replicas, std::span<const Slot> contributions,
                             BlockCoord block) noexcept;
  template <class Begin, class Use>
  static void by_epochs(const Replicas& replicas, std::span<const Slot> contributions,
                        Begin&& begin, Use&& use) noexcept;

  float omega_ = 1.0F;
  float prior_ = 0.0F;
  int last_class_ = 0;
  RobotShare share_{};
  SessionShare sessions_{};
  Opinions opinions_{};
  std::span<float> factors_;  ///< Of the robot at hand, by components.
  std::span<float> doubted_;  ///< Label evidence, by voxels, that does not count as its class.
  bool any_doubted_ = false;
  std::span<std::uint8_t> observers_;  ///< Local voxels that went to each voxel.
  bool any_objections_ = false;        ///< To what goes to the block that is added up.
  float free_weight_ = 0.0F;
  std::span<float> weights_;           ///< Of one robot, by voxels.
  std::span<std::uint8_t> holders_;    ///< Robots that have each voxel occupied.
  std::span<std::uint8_t> objectors_;  ///< To each voxel of a replica.
  VoxelMask objected_{};
  VoxelMask disputed_{};
  // Of the current contribution, and of its local block: by rows of the block that is added up.
  std::span<VoxelCoord> taken_;       ///< The local voxel that each voxel takes.
  std::span<std::uint8_t> taken_in_;  ///< Where that one's block is among those that may go here.
  std::span<std::int16_t> next_;      ///< The next voxel that takes the same one; -1: none.
  std::span<std::int16_t> first_;     ///< By rows of the local block: the first that takes it.
  Turned* turned_ = nullptr;
  std::span<std::byte> scratch_;
};

}  // namespace tessera
