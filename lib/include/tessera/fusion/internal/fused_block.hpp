// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A block of the global map between its sums and the map that is read.
#pragma once

#include "tessera/fusion/global_map_config.hpp"
#include "tessera/fusion/internal/diffusion_brick.hpp"
#include "tessera/fusion/internal/node_statistics.hpp"
#include "tessera/map/block_content.hpp"

namespace tessera {

class FusedBlock {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(int num_components) noexcept {
    return BlockContent::required_bytes(num_components);
  }
  /// num_components: C + 2. Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<FusedBlock> make(Arena& arena, const GlobalMapConfig& config,
                                               int num_components) noexcept;
  FusedBlock() noexcept = default;

  [[nodiscard]] BlockContent& content() noexcept { return content_; }
  /// Takes over packed sums. Returns the entries read. O(512 + rows touched * components).
  std::uint32_t take(std::span<const std::byte> sums) noexcept;
  /// Of its nodes, as they are.
  [[nodiscard]] NodeStatistics measure() const noexcept;
  /// Gives its nodes what the diffusion made of them. Statistics are of before and after. work: as
  /// of DiffusionBrick::result.
  NodeStatistics diffuse(BlockCoord block, DiffusionBrick& brick, std::uint64_t& work) noexcept;
  /// Passes are kept in a byte: where there are more, all of the voxel's evidence gives way in
  /// proportion, as at a local map's cap. Returns the voxels where that was so.
  std::uint64_t scale_to_passes() noexcept;

 private:
  void diffuse_row(int row, unsigned nodes, BlockCoord block, DiffusionBrick& brick,
                   std::uint64_t& work, NodeStatistics& statistics) noexcept;
  void scale(int row, float factor) noexcept;

  BlockContent content_{};
  int num_components_ = 0;
  float omega_ = 1.0F;
  float free_weight_ = 0.0F;
  double prior_ = 0.0;
};

}  // namespace tessera
