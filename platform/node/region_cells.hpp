// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A box of a map in cells of 1, 2, 4 .. 64 voxels' edge, each a state and a label.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "link/query_messages.hpp"
#include "tessera/map/nearest_occupied.hpp"

namespace tessera {

/// The state of a cell: occupied if any voxel is, with the label that most of these have, ties to
/// the lowest; else free if at least half of them are; else unknown.
class CellSummary {
 public:
  void add(const Estimate& estimate) noexcept {
    if (estimate.state == VoxelState::kFree) ++free_;
    if (estimate.state == VoxelState::kOccupied)
      ++labels_[static_cast<std::size_t>(estimate.label)];
  }
  /// voxels: of the cell, observed or not.
  [[nodiscard]] std::uint8_t cell(std::int64_t voxels) const noexcept {
    const auto most = std::max_element(labels_.begin(), labels_.end());
    if (*most > 0) return cell_of(VoxelState::kOccupied, static_cast<int>(most - labels_.begin()));
    return cell_of(2 * free_ >= voxels ? VoxelState::kFree : VoxelState::kUnknown, 0);
  }

 private:
  std::array<std::int32_t, 64> labels_{};
  std::int64_t free_ = 0;
};

/// Reads cells block by block. A block that the map does not have costs 1, another
/// kNearestBlockWork; cells of one block that are read one after another share its cost.
template <class Reader>
class RegionCells {
 public:
  /// edge: of a cell, 1, 2, 4 .. 64 voxels. workspace: as for snapshot() of the reader.
  RegionCells(Reader& reader, double prior, std::int32_t edge,
              std::span<std::byte> workspace) noexcept
      : reader_(reader), prior_(prior), edge_(edge), workspace_(workspace) {}

  /// The cell whose lowest voxel is low, a multiple of the edge on each axis; false iff the reader
  /// was busy.
  [[nodiscard]] bool read(VoxelCoord low, std::uint8_t& cell) noexcept {
    CellSummary summary;
    const BlockCoord first = block_of(low);
    const std::int32_t blocks = std::max(edge_ / kBlockEdge, 1);
    for (std::int32_t z = 0; z < blocks; ++z) {
      for (std::int32_t y = 0; y < blocks; ++y) {
        for (std::int32_t x = 0; x < blocks; ++x) {
          if (!add_block({first.x + x, first.y + y, first.z + z}, low, summary)) return false;
        }
      }
    }
    cell = summary.cell(std::int64_t{edge_} * edge_ * edge_);
    return true;
  }
  /// Most cost of one call of read().
  [[nodiscard]] int most_work() const noexcept {
    const int blocks = std::max(edge_ / kBlockEdge, 1);
    return blocks * blocks * blocks * kNearestBlockWork;
  }
  [[nodiscard]] int work() const noexcept { return work_; }

 private:
  [[nodiscard]] bool add_block(BlockCoord block, VoxelCoord low, CellSummary& summary) noexcept {
    if (!known_ || !(block == content_.coord())) {
      known_ = false;
      if (!in_grid(block)) return true;
      const Result<BlockSnapshot> content = reader_.snapshot(block, workspace_);
      work_ += content.ok() && content->empty() ? 1 : kNearestBlockWork;
      if (!content.ok()) return false;
      content_ = *content;
      known_ = true;
    }
    if (content_.empty()) return true;
    const std::int32_t edge = std::min(edge_, kBlockEdge);
    const VoxelCoord from = edge_ < kBlockEdge ? low : voxel_of_row(block, 0);
    for (std::int32_t z = 0; z < edge; ++z) {
      for (std::int32_t y = 0; y < edge; ++y) {
        for (std::int32_t x = 0; x < edge; ++x)
          add_voxel({from.x + x, from.y + y, from.z + z}, summary);
      }
    }
    return true;
  }
  void add_voxel(VoxelCoord at, CellSummary& summary) noexcept {
    const int octet = octet_in_block(at);
    const int voxel = voxel_in_octet(at);
    const bool labelled =
        ((unsigned{content_.observed_labels(octet)} >> static_cast<unsigned>(voxel)) & 1U) != 0;
    if (!labelled && content_.free_passes(octet, voxel) == 0) return;
    summary.add(estimate(content_.evidence(octet, voxel), prior_));
  }

  Reader& reader_;
  double prior_;
  std::int32_t edge_;
  std::span<std::byte> workspace_;
  BlockSnapshot content_;
  bool known_ = false;
  int work_ = 0;
};

}  // namespace tessera
