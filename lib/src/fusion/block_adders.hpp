// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How a contribution to a block is added up: where its voxels go, and what counts of them.
#pragma once

#include <algorithm>
#include <array>

#include "row_targets.hpp"
#include "tessera/fusion/internal/block_sums.hpp"

namespace tessera {

/// Where the voxels of a local block go in a frame that is shifted by whole voxels: each to one
/// voxel, in the block that is added up or in another.
class BlockSums::ShiftedRows {
 public:
  /// layers: of the local block; the others go nowhere.
  ShiftedRows(VoxelCoord shift, BlockCoord local, BlockCoord global, unsigned layers) noexcept {
    // From a local voxel's place in its block to its target's in the other.
    const VoxelCoord corner = voxel_at(local, 0, 0);
    const VoxelCoord to = voxel_at(global, 0, 0);
    const int dx = corner.x + shift.x - to.x;
    const int dy = corner.y + shift.y - to.y;
    const int dz = corner.z + shift.z - to.z;
    offset_ = dx + kBlockEdge * (dy + kBlockEdge * dz);
    const auto is_inside = [](int at) { return at >= 0 && at < kBlockEdge; };
    std::uint64_t row = 0;
    for (int x = 0; x < kBlockEdge; ++x) row |= std::uint64_t{is_inside(x + dx) ? 1U : 0U} << x;
    std::uint64_t slice = 0;
    for (int y = 0; y < kBlockEdge; ++y)
      if (is_inside(y + dy)) slice |= row << (kBlockEdge * y);
    for (int z = 0; z < kBlockEdge; ++z)
      if (is_inside(z + dz) && ((layers >> (z / 2)) & 1U) != 0)
        go_[static_cast<std::size_t>(z)] = slice;
  }
  [[nodiscard]] bool goes(int row) const noexcept { return has_row(go_, row); }
  /// Of one that goes to the block.
  [[nodiscard]] int target(int row) const noexcept { return row + offset_; }

 private:
  VoxelMask go_{};
  int offset_ = 0;
};

template <class Adder>
std::uint64_t BlockSums::add_shifted(const Source& source, const Replicas::Replica& replica,
                                     BlockCoord local, Adder& adder) noexcept {
  const ShiftedRows rows(source.contribution.T_global_local.shift(), local, source.block,
                         replica.live);
  const VoxelMask& hidden = adder.hidden();
  VoxelMask labelled{};
  bool counts = false;
  const auto begin_voxel = [&](int row, Centroid) {
    counts = rows.goes(row) && !has_row(hidden, rows.target(row));
    if (!counts) return;
    add_row(labelled, row);
    adder.observe(rows.target(row));
  };
  const auto add_labels = [&](int row, int component, float count) {
    if (counts) adder.add_labels(rows.target(row), component, count);
  };
  const auto add_passes = [&](int row, unsigned count) {
    if (!rows.goes(row) || has_row(hidden, rows.target(row))) return;
    if (!has_row(labelled, row)) adder.observe(rows.target(row));
    adder.add_passes(rows.target(row), count);
  };
  return unpack_block(source.replicas.read(replica, scratch_), begin_voxel, add_labels, add_passes);
}

/// The free passes of one contribution, given when all of it is known. In a turned frame a voxel
/// that enough of a surface goes to has no more of them than the voxels that the surface comes
/// from.
class BlockSums::TurnedPasses {
 public:
  explicit TurnedPasses(BlockSums& sums) noexcept : sums_(sums) {}

  /// surface: what goes there counts.
  void add(const RowTargets::Target& target, unsigned passes, bool surface) noexcept {
    Passes& here = at(target.row);
    if (target.takes) here.taken += passes;
    if (surface) here.of_surface += target.share * static_cast<float>(passes);
  }
  void add_surface(const RowTargets::Target& target) noexcept {
    if (target.share > 0.0F) at(target.row).share += target.share;
  }
  template <class Adder>
  void give(Adder& adder) const noexcept {
    for_rows(any_, [&](int row) {
      const Passes& here = sums_.turned_->passes[static_cast<std::size_t>(row)];
      unsigned passes = here.taken;
      const auto of_surface =
          static_cast<unsigned>(floor_to_int(static_cast<double>(here.of_surface) + 0.5));
      if (here.share >= kLeastShare && of_surface < passes) passes = of_surface;
      if (passes != 0) adder.add_passes(row, passes);
    });
  }

 private:
  static constexpr float kLeastShare = 0.3F;

  [[nodiscard]] Passes& at(int row) noexcept {
    Passes& here = sums_.turned_->passes[static_cast<std::size_t>(row)];
    if (!has_row(any_, row)) here = {};
    add_row(any_, row);
    return here;
  }

  BlockSums& sums_;
  VoxelMask any_{};
};

/// What a robot says today, until all of it is known.
class BlockSums::ToRobot {
 public:
  explicit ToRobot(BlockSums& sums) noexcept : sums_(sums) {}
  void enter() noexcept { sums_.share_.enter(); }
  [[nodiscard]] const VoxelMask& hidden() const noexcept { return sums_.share_.hidden(); }
  void observe(int row) noexcept {
    sums_.share_.observe(row);
    std::uint8_t& count = sums_.observers_[static_cast<std::size_t>(row)];
    count = static_cast<std::uint8_t>(count + (count < 255 ? 1 : 0));
  }
  void add_labels(int row, int component, float count) noexcept {
    sums_.share_.add_labels(row, component, count);
    labelled_ = labelled_ || (component != 0 && component <= sums_.last_class_);
  }
  void add_passes(int row, unsigned passes) noexcept { sums_.share_.add_passes(row, passes); }
  /// Whether a class has evidence.
  [[nodiscard]] bool labelled() const noexcept { return labelled_; }

 private:
  BlockSums& sums_;
  bool labelled_ = false;
};

/// How much more labels than passes weigh in each voxel.
class BlockSums::ToHolders {
 public:
  ToHolders(BlockSums& sums, VoxelMask& any) noexcept : sums_(sums), any_(any) {}
  static void enter() noexcept {}
  [[nodiscard]] const VoxelMask& hidden() const noexcept { return none_; }
  static void observe(int /*row*/) noexcept {}
  void add_labels(int row, int /*component*/, float count) noexcept { add(row, count); }
  void add_passes(int row, unsigned passes) noexcept {
    add(row, -sums_.free_weight_ * static_cast<float>(passes));
  }

 private:
  void add(int row, float evidence) noexcept {
    float& weight = sums_.weights_[static_cast<std::size_t>(row)];
    weight = (has_row(any_, row) ? weight : 0.0F) + evidence;
    add_row(any_, row);
  }
  BlockSums& sums_;
  VoxelMask& any_;
  VoxelMask none_{};
};

/// Sessions are added up first: what of them counts depends on all of them.
class BlockSums::ToSessions {
 public:
  explicit ToSessions(SessionShare& share) noexcept : share_(share) {}
  static void enter() noexcept {}
  [[nodiscard]] const VoxelMask& hidden() const noexcept { return share_.hidden(); }
  void observe(int row) noexcept { share_.observe(row); }
  void add_labels(int row, int component, float count) noexcept {
    share_.add_labels(row, component, count);
  }
  void add_passes(int row, unsigned passes) noexcept { share_.add_passes(row, passes); }

 private:
  SessionShare& share_;
};

}  // namespace tessera
