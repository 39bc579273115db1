// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How a contribution to a block is added up: where its voxels go, and what counts of them.
#pragma once

#include <algorithm>
#include <array>

#include "tessera/fusion/internal/block_sums.hpp"

namespace tessera {

/// The voxels of one block that a voxel of a local block goes to, without hidden ones. In a turned
/// frame each voxel of the block takes one local voxel, which is looked up once for all; what no
/// voxel takes goes to the one that contains its centre. Entries of a voxel follow each other, so
/// the last answer is mostly the next.
class BlockSums::RowTargets {
 public:
  RowTargets(BlockSums& sums, const VoxelMask& hidden, const GridTransform& T_global_local,
             BlockCoord local, BlockCoord global) noexcept
      : sums_(sums),
        hidden_(hidden),
        frame_(T_global_local),
        local_(local),
        global_(global),
        box_(T_global_local.local_box(global)) {
    if (frame_.shift_only()) return;
    std::fill(sums_.first_.begin(), sums_.first_.end(), kNone);
    for (int row = kBlockVoxels - 1; row >= 0; --row) {
      const VoxelCoord taken = sums_.taken_[static_cast<std::size_t>(row)];
      if (block_of(taken) != local_) continue;
      std::int16_t& first = sums_.first_[static_cast<std::size_t>(row_order(taken))];
      sums_.next_[static_cast<std::size_t>(row)] = first;
      first = static_cast<std::int16_t>(row);
    }
  }
  /// layers: others have no targets from now on.
  void set_layers(unsigned layers) noexcept {
    layers_ = layers;
    row_ = kNone;
  }
  [[nodiscard]] std::span<const int> of(int row) noexcept {
    if (row != row_) {
      row_ = row;
      count_ = 0;
      if (((layers_ >> layer_of_row(row)) & 1U) != 0) find(row);
    }
    return std::span(rows_).first(count_);
  }

 private:
  static constexpr std::int16_t kNone = -1;

  void find(int row) noexcept {
    if (frame_.shift_only())
      return frame_.for_targets(voxel_of_row(local_, row), [this](VoxelCoord to) { take(to); });
    std::int16_t taker = sums_.first_[static_cast<std::size_t>(row)];
    if (taker == kNone) return find_untaken(voxel_of_row(local_, row));  // mostly not even near
    for (; taker != kNone; taker = sums_.next_[static_cast<std::size_t>(taker)])
      if (!has_row(hidden_, taker)) rows_[count_++] = taker;
  }
  /// Nothing in this block takes it. If its centre is in another block it is none of this one's.
  void find_untaken(VoxelCoord local) noexcept {
    const bool is_near = local.x >= box_.first.x && local.x <= box_.last.x &&
                         local.y >= box_.first.y && local.y <= box_.last.y &&
                         local.z >= box_.first.z && local.z <= box_.last.z;
    if (!is_near) return;
    const std::array<double, 3> center = frame_.to_global(local);
    const VoxelCoord own{floor_to_int(center[0]), floor_to_int(center[1]), floor_to_int(center[2])};
    if (block_of(own) != global_) return;
    frame_.for_targets(local, center, [this](VoxelCoord to) { take(to); });
  }
  void take(VoxelCoord to) noexcept {
    const int row = row_order(to);
    if (block_of(to) == global_ && !has_row(hidden_, row)) rows_[count_++] = row;
  }

  BlockSums& sums_;
  const VoxelMask& hidden_;
  const GridTransform& frame_;
  BlockCoord local_;
  BlockCoord global_;
  GridTransform::VoxelBox box_;
  unsigned layers_ = 0;
  int row_ = kNone;
  std::size_t count_ = 0;
  std::array<int, 8> rows_{};
};

/// What a robot says today goes to the sums at once.
class BlockSums::ToRobot {
 public:
  ToRobot(BlockSums& sums, BlockContent& content) noexcept
      : sums_(sums), content_(content), omega_(sums.omega_), last_class_(sums.last_class_) {}
  void enter() noexcept { sums_.share_.enter(content_); }
  [[nodiscard]] const VoxelMask& hidden() const noexcept { return sums_.share_.hidden(); }
  void observe(int row) noexcept {
    sums_.share_.observe(row);
    std::uint8_t& count = sums_.observers_[static_cast<std::size_t>(row)];
    count = static_cast<std::uint8_t>(count + (count < 255 ? 1 : 0));
  }
  void add_labels(int row, int component, float count) noexcept {
    sums_.share_.add_labels(row, count);
    if (component == 0) {
      content_.add_rest(row, omega_ * count);
    } else {
      content_.add(component, row, omega_ * count);
      labelled_ = labelled_ || component <= last_class_;
    }
  }
  void add_passes(int row, unsigned passes) noexcept {
    sums_.share_.add_passes(row, passes);
    content_.add_passes(row, passes);
  }
  /// Whether a class has evidence.
  [[nodiscard]] bool labelled() const noexcept { return labelled_; }

 private:
  BlockSums& sums_;
  BlockContent& content_;
  float omega_;
  int last_class_;
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
