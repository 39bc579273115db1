// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What one robot has of a block. In each voxel a submap of a newer epoch takes the
// place of those of older epochs that have its number, and what the robot says of a voxel is held
// to the cap that the robots' maps have.
#pragma once

#include <array>
#include <span>
#include <utility>

#include "tessera/map/block_content.hpp"

namespace tessera {

class RobotShare {
 public:
  /// num_components: C + 2; contributions: of one robot, at most.
  [[nodiscard]] static constexpr std::size_t required_bytes(int num_components,
                                                            std::uint32_t contributions) noexcept {
    return BlockContent::required_bytes(num_components) + arena_bytes<Voxels>(1) +
           arena_bytes<Seen>(contributions);
  }
  /// max_evidence, free_weight: of the robots' maps, as MapConfig has them. Fails with
  /// kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<RobotShare> make(Arena& arena, int num_components,
                                               std::uint32_t contributions, float max_evidence,
                                               float free_weight) noexcept;
  /// Holds nothing and takes nothing.
  RobotShare() noexcept = default;

  /// Begins with a robot that has nothing in the block yet. O(1).
  void begin_robot() noexcept {
    entered_ = false;
    seen_count_ = newer_count_ = 0;
  }
  /// To be called before any of it is added. The first call for a robot takes O(512 + rows touched
  /// by the one before it * components), the others O(1).
  void enter() noexcept {
    if (!entered_) clear();
  }
  /// Whether it has anything.
  [[nodiscard]] bool entered() const noexcept { return entered_; }
  /// Begins with an epoch, an older one than those before it. O(1).
  void begin_epoch() noexcept { newer_count_ = seen_count_; }
  /// Begins with a submap of it. Returns the work: submaps of newer epochs that have evidence in
  /// the block.
  std::uint64_t begin_submap(std::uint32_t submap) noexcept;
  /// After the last call of observe() for it; not needed in the robot's oldest epoch. O(1).
  void end_submap(std::uint32_t submap) noexcept;
  /// Voxels of which what takes the place of this submap has evidence, so that this one counts
  /// nothing there.
  [[nodiscard]] const VoxelMask& hidden() const noexcept { return voxels_->newer; }
  /// Notes that this submap has evidence of the voxel, of whatever kind. row: a voxel's row order,
  /// as below. O(1).
  void observe(int row) noexcept { add_row(voxels_->observed, row); }
  /// Adds label evidence; component 0: a rest. O(1).
  void add_labels(int row, int component, float count) noexcept {
    voxels_->labels[static_cast<std::size_t>(row)] += count;
    if (component == 0) {
      content_.add_rest(row, count);
    } else {
      content_.add(component, row, count);
    }
  }
  void add_passes(int row, unsigned passes) noexcept { content_.add_passes(row, passes); }
  /// Scales what the robot has where that is too much: all label evidence of a voxel in proportion,
  /// to the cap; passes to those of the cap. Returns the components of voxels that were too full,
  /// and one: at most 512 (C + 1) + 1. O(512 + that).
  std::uint64_t end_robot() noexcept;
  /// Gives what it has away, for another content that is as large. O(1).
  void swap_content(BlockContent& other) noexcept { std::swap(content_, other); }
  /// What it has of the block, once it has entered.
  [[nodiscard]] const BlockContent& content() const noexcept { return content_; }

  /// The most label evidence of a voxel that is left as it is: the cap, an eighth of it and 2^-10.
  /// Rounding to the wire's levels makes of a sum at the cap at most 10 / 9 of it, and of counts
  /// that are next to nothing 2^-12 each (quantise).
  [[nodiscard]] float most_labels() const noexcept { return cap_ * 1.125F + 0x1p-10F; }
  /// The most free passes that are left as they are: those of the cap and an eighth.
  [[nodiscard]] unsigned most_passes() const noexcept { return passes_ + passes_ / 8; }

 private:
  struct Voxels {
    VoxelMask newer{};     ///< Of what takes the place of the submap at hand.
    VoxelMask observed{};  ///< Of this submap.
    std::array<float, kBlockVoxels> labels{};
  };
  /// Voxels of which a submap has evidence.
  struct Seen {
    std::uint32_t submap = 0;
    VoxelMask voxels{};
  };
  void clear() noexcept;
  [[nodiscard]] bool any_too_full() const noexcept;
  std::uint64_t scale_labels(int row) noexcept;

  BlockContent content_{};
  Voxels* voxels_ = nullptr;
  std::span<Seen> seen_;  ///< Of the robot's submaps with evidence in the block, newest first.
  std::size_t seen_count_ = 0;
  std::size_t newer_count_ = 0;  ///< Of these, of newer epochs than the one at hand.
  float cap_ = 0.0F;
  unsigned passes_ = 0;  ///< At the cap.
  bool entered_ = false;
};

}  // namespace tessera
