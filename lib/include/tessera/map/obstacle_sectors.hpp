// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a controller wants to know before it drives on: for each direction around a body, how near
// the nearest occupied voxel is, and how far the map knows that there is none. These are two
// numbers, because what was never seen is not free: behind free_up_to_m anything may be, whether an
// obstacle was found further out or not.
//
// A sweep goes through the blocks around the body, near ones first, as many in a call as the caller
// allows; the last finished sweep stays readable meanwhile.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/map/map_reader.hpp"

namespace tessera {

/// The sectors around the body, and what counts as an obstacle in them.
struct ObstacleSectorsConfig {
  int count = 16;             ///< Sectors: 8, 16 or 32.
  double max_range_m = 20.0;  ///< Horizontally.
  /// Voxels whose centres are so high above the body's origin, along the map's z axis.
  double min_height_m = -1.0;
  double max_height_m = 1.0;
  double own_radius_m = 0.0;  ///< Nearer than this is the vehicle: no obstacle, and not unknown.
  double ring_m = 1.0;        ///< Width of the rings in which is counted what is known.
  double known_share = 0.8;   ///< A ring of a sector is known if so many of its columns are.
};

/// Sector i covers the directions [i - 1/2, i + 1/2) * 360 / count degrees, from the body's x axis
/// towards its y axis: 0 is straight ahead, count / 4 to the left.
struct ObstacleSector {
  bool available = false;  ///< False iff the map could not be read there (kBusy, again and again).
  bool occupied = false;   ///< Whether there is an occupied voxel in it.
  /// Of the nearest: horizontally from the body's origin to the voxel's centre, less half the
  /// diagonal of its square, at least 0; so no point of the voxel is nearer. A voxel counts in
  /// every sector that its square is in a part of.
  double distance_m = 0.0;
  VoxelCoord voxel{};
  int label = 0;             ///< As Estimate has them.
  double probability = 0.0;  ///< Of the label.
  double occupancy = 0.0;    ///< Above 0.5, else it would not be occupied.
  /// Up to here, in whole rings, enough columns of voxels are known and none is occupied. A column
  /// is known if any voxel of it in the band of heights was observed, and belongs to the ring and
  /// the sector that its centre is in. A ring of a sector in which there is no centre, as it is
  /// narrower than the voxels, goes together with the next that has one, and is unknown if none
  /// has.
  double free_up_to_m = 0.0;
};

/// The sectors of one sweep, and when and where it was.
struct ObstacleSummary {
  static constexpr std::size_t kMostSectors = 32;
  std::array<ObstacleSector, kMostSectors> sectors{};
  int count = 0;  ///< Of sectors; 0 iff no sweep has ended yet.
  std::int64_t stamp_us = 0;
  Matrix34d T_map_body = Matrix34d::Identity();
  // What it cost.
  std::uint32_t columns = 0;      ///< Columns of blocks that were in range.
  std::uint32_t blocks = 0;       ///< Look-ups.
  std::uint32_t present = 0;      ///< Of these, blocks that the map has, which are copied.
  std::uint32_t voxels_read = 0;  ///< Of these, voxels whose evidence was summed up.
  std::uint32_t busy = 0;         ///< Look-ups that failed with kBusy.
};

class ObstacleSectors {
 public:
  static constexpr int kMostRings = 64;
  static constexpr std::uint32_t kVoxelsPerBlock = 8;  ///< They take about as long.
  /// Calls in a row that may find a column busy before its sectors are given up for this sweep.
  static constexpr int kMostBusy = 16;

  /// Nothing is made: begin() refuses, step() does nothing.
  ObstacleSectors() noexcept = default;
  /// For the arena.
  [[nodiscard]] static std::size_t required_bytes(const LocalMap& map) noexcept;
  /// Fails with kInvalidArgument iff count is not 8, 16 or 32, a number is not finite,
  /// max_range_m <= 0, max_height_m < min_height_m, own_radius_m < 0, known_share is not in (0, 1],
  /// ring_m is not within max_range_m / kMostRings .. max_range_m, or range, radius or heights are
  /// more than 4,096 voxels; kResourceExhausted iff the arena has no room. Of the map it keeps what
  /// does not change.
  [[nodiscard]] static Result<ObstacleSectors> make(const ObstacleSectorsConfig& config,
                                                    const LocalMap& map, Arena& arena) noexcept;

  /// Starts a sweep around a pose, and forgets one that has not ended. Fails with kInvalidArgument
  /// iff the pose is not rigid or its x axis is steeper than 84 degrees; kOutOfRange iff range and
  /// heights reach out of the grid; kResourceExhausted iff nothing was made.
  Status begin(const Matrix34d& T_map_body, std::int64_t stamp_us) noexcept;
  /// Goes on with it; true iff it has ended, by this call or before. reader: of the map that this
  /// was made for. Looks up at most max(max_blocks, column_blocks()) blocks, where kVoxelsPerBlock
  /// voxels that are read count as one more (but not in the last column of a call), and passes at
  /// most 16 * max_blocks + 1 columns that are out of range or behind what was found. A block that
  /// the map has costs a snapshot and at most 512 estimates (O(C)), each column 64 times at most
  /// count / 4 comparisons; a sweep has at most (2 * range / block + 3)^2 columns.
  bool step(MapReader& reader, std::uint32_t max_blocks) noexcept;
  /// Blocks of one column, so the least that step can do.
  [[nodiscard]] std::uint32_t column_blocks() const noexcept {
    return static_cast<std::uint32_t>(last_block_z_ - first_block_z_ + 1);
  }

  /// The last sweep that ended. A caller bug where nothing was made.
  [[nodiscard]] const ObstacleSummary& latest() const noexcept {
    TESSERA_ASSERT(made_);
    return summaries_[1];
  }
  [[nodiscard]] bool is_sweeping() const noexcept { return sweeping_; }

 private:
  struct Direction {
    double x = 1.0;
    double y = 0.0;
  };
  /// Sectors first .. first + count - 1, around.
  struct Touched {
    int first = 0;
    int count = 0;
  };
  struct Column {
    std::int32_t x = 0;
    std::int32_t y = 0;
    double nearest_m = 0.0;  ///< Of its square.
    Touched touched{};
  };

  void make_directions() noexcept;
  [[nodiscard]] int sector_of(double x_map, double y_map) const noexcept;
  [[nodiscard]] Touched touched_by(double x_map, double y_map, double edge_m) const noexcept;
  [[nodiscard]] bool next_column() noexcept;
  [[nodiscard]] Column current_column() const noexcept;
  [[nodiscard]] Column column_at(std::int32_t x, std::int32_t y) const noexcept;
  [[nodiscard]] bool is_behind(const Column& column) const noexcept;
  [[nodiscard]] bool read_column(MapReader& reader, const Column& column) noexcept;
  void read_block(const BlockSnapshot& block, std::uint64_t& known) noexcept;
  void read_voxel(const BlockSnapshot& block, VoxelCoord voxel) noexcept;
  void count_known(const Column& column, std::uint64_t known) noexcept;
  void give_up(const Column& column) noexcept;
  void finish() noexcept;

  ObstacleSectorsConfig config_{};
  Lattice lattice_{1.0};
  Reading reading_;
  bool only_labels_occupy_ = false;
  std::array<Direction, ObstacleSummary::kMostSectors / 4> borders_{};  ///< Of the first quadrant.
  Direction half_{};                                                    ///< Half a sector.

  bool sweeping_ = false;
  double x_m_ = 0.0;  ///< The body, map frame.
  double y_m_ = 0.0;
  Direction ahead_{};
  std::int32_t center_x_ = 0;  ///< The body's block.
  std::int32_t center_y_ = 0;
  std::int32_t low_z_ = 0;  ///< Voxels of the band, both included.
  std::int32_t high_z_ = -1;
  std::int32_t first_block_z_ = 0;
  std::int32_t last_block_z_ = -1;
  std::int32_t ring_ = 0;  ///< Squares of blocks around the body's, and the place in one.
  std::int32_t place_ = 0;
  int busy_in_row_ = 0;
  std::array<double, ObstacleSummary::kMostSectors> nearest_m_{};  ///< To centres; or infinite.
  /// Of a ring of a sector.
  struct Share {
    std::uint32_t known = 0;  ///< Columns of voxels.
    std::uint32_t all = 0;
  };
  [[nodiscard]] Share& share(std::size_t sector, std::size_t ring) noexcept {
    return shares_[sector * kMostRings + ring];
  }
  [[nodiscard]] ObstacleSummary& current() noexcept { return summaries_[0]; }

  bool made_ = false;
  std::span<Share> shares_;
  std::span<ObstacleSummary> summaries_;  ///< Of the sweep that goes on, and of the last one.
  std::span<std::byte> workspace_;
};

}  // namespace tessera
