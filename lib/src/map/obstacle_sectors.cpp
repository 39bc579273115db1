// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/obstacle_sectors.hpp"

#include <algorithm>
#include <limits>

namespace tessera {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr double kMostVoxels = 4096.0;
constexpr std::size_t kShares =
    ObstacleSummary::kMostSectors * static_cast<std::size_t>(ObstacleSectors::kMostRings);

bool is_config(const ObstacleSectorsConfig& c, double resolution_m) noexcept {
  const bool sectors = c.count == 8 || c.count == 16 || c.count == 32;
  // Written so that NaN fails.
  const double most_m = kMostVoxels * resolution_m;
  const bool range = c.max_range_m > 0.0 && c.max_range_m <= most_m;
  const bool heights =
      c.max_height_m >= c.min_height_m && c.max_height_m <= most_m && c.min_height_m >= -most_m;
  const bool rings =
      c.ring_m * ObstacleSectors::kMostRings >= c.max_range_m && c.ring_m <= c.max_range_m;
  const bool rest = c.own_radius_m >= 0.0 && c.own_radius_m <= most_m && c.known_share > 0.0 &&
                    c.known_share <= 1.0;
  return sectors && range && heights && rings && rest;
}

}  // namespace

std::size_t ObstacleSectors::required_bytes(const LocalMap& map) noexcept {
  return arena_bytes<Share>(kShares) + arena_bytes<ObstacleSummary>(2) +
         arena_bytes<std::byte>(MapReader(map).snapshot_bytes());
}

Result<ObstacleSectors> ObstacleSectors::make(const ObstacleSectorsConfig& config,
                                              const LocalMap& map, Arena& arena) noexcept {
  if (!is_config(config, map.lattice().resolution_m())) return Status::kInvalidArgument;
  ObstacleSectors made;
  made.config_ = config;
  made.lattice_ = map.lattice();
  made.reading_ = map.reading();
  made.only_labels_occupy_ = map.only_labels_occupy();
  made.make_directions();
  made.shares_ = arena.take<Share>(kShares);
  made.summaries_ = arena.take<ObstacleSummary>(2);
  made.workspace_ = arena.take_untouched(MapReader(map).snapshot_bytes());
  if (made.shares_.empty() || made.summaries_.empty() || made.workspace_.empty())
    return Status::kResourceExhausted;
  made.made_ = true;
  return made;
}

/// By halving right angles: square roots are the same everywhere, sines are not.
void ObstacleSectors::make_directions() noexcept {
  const auto half_of = [](const Direction& d) {
    return Direction{std::sqrt((1.0 + d.x) / 2.0), std::sqrt((1.0 - d.x) / 2.0)};
  };
  Direction step{0.0, 1.0};
  for (int parts = 4; parts < config_.count; parts *= 2) step = half_of(step);
  half_ = half_of(step);
  Direction border{};
  for (std::size_t i = 0; i < static_cast<std::size_t>(config_.count / 4); ++i) {
    borders_[i] = border;
    border = {border.x * step.x - border.y * step.y, border.x * step.y + border.y * step.x};
  }
}

Status ObstacleSectors::begin(const Matrix34d& T_map_body, std::int64_t stamp_us) noexcept {
  if (!made_) return Status::kResourceExhausted;
  if (check_rigid(T_map_body) != Status::kOk) return Status::kInvalidArgument;
  const double level = std::sqrt(squared_norm(T_map_body(0, 0), T_map_body(1, 0), 0.0));
  constexpr double kSteep = 0.1;
  if (level < kSteep) return Status::kInvalidArgument;
  const Point3d body = T_map_body.col(3);
  const double resolution_m = lattice_.resolution_m();
  const double reach_m = config_.max_range_m + 2 * kBlockEdge * resolution_m;
  const Point3d low = body + Point3d(-reach_m, -reach_m, config_.min_height_m);
  const Point3d high = body + Point3d(reach_m, reach_m, config_.max_height_m);
  const Result<VoxelCoord> center = lattice_.voxel_of(body);
  const Result<VoxelCoord> lowest = lattice_.voxel_of(low);
  const Result<VoxelCoord> highest = lattice_.voxel_of(high);
  if (!center.ok() || !lowest.ok() || !highest.ok()) return Status::kOutOfRange;
  x_m_ = body.x();
  y_m_ = body.y();
  ahead_ = {T_map_body(0, 0) / level, T_map_body(1, 0) / level};
  center_x_ = block_of(*center).x;
  center_y_ = block_of(*center).y;
  // A voxel counts by its centre.
  low_z_ = lowest->z + (lattice_.center_of(*lowest).z() < low.z() ? 1 : 0);
  high_z_ = highest->z - (lattice_.center_of(*highest).z() > high.z() ? 1 : 0);
  first_block_z_ = low_z_ >> 3;
  last_block_z_ = high_z_ >> 3;
  ring_ = place_ = 0;
  busy_in_row_ = 0;
  nearest_m_.fill(kFar);
  for (Share& share : shares_) share = {};
  current() = {};
  current().count = config_.count;
  current().stamp_us = stamp_us;
  current().T_map_body = T_map_body;
  for (ObstacleSector& sector : current().sectors) sector.available = true;
  sweeping_ = true;
  return Status::kOk;
}

/// x_map, y_map: from the body, along the map's axes.
int ObstacleSectors::sector_of(double x_map, double y_map) const noexcept {
  const double forward = x_map * ahead_.x + y_map * ahead_.y;
  const double left = y_map * ahead_.x - x_map * ahead_.y;
  double x = forward * half_.x - left * half_.y;
  double y = forward * half_.y + left * half_.x;
  const int quarter = config_.count / 4;
  int sector = 0;
  if (x <= 0.0 && y > 0.0) {
    sector = quarter;
    std::swap(x, y);
    y = -y;
  } else if (x < 0.0 && y <= 0.0) {
    sector = 2 * quarter;
    x = -x;
    y = -y;
  } else if (x >= 0.0 && y < 0.0) {
    sector = 3 * quarter;
    std::swap(x, y);
    x = -x;
  }
  for (std::size_t i = 1; i < static_cast<std::size_t>(quarter); ++i)
    if (borders_[i].x * y - borders_[i].y * x >= 0.0) ++sector;
  return sector;
}

/// Of a square with its lowest corner there. All of them iff the body is in it. Else the square is
/// less than half a turn wide, from its rightmost corner to its leftmost; which corners these are
/// follows from the side that it is on. Sectors of corners alone do not tell: close to an edge they
/// are half of all sectors apart, on either way around.
ObstacleSectors::Touched ObstacleSectors::touched_by(double x_map, double y_map,
                                                     double edge_m) const noexcept {
  const double x_end = x_map + edge_m;
  const double y_end = y_map + edge_m;
  const int side_x = x_map > 0.0 ? 1 : (x_end < 0.0 ? -1 : 0);
  const int side_y = y_map > 0.0 ? 1 : (y_end < 0.0 ? -1 : 0);
  const int n = config_.count;
  if (side_x == 0 && side_y == 0) return {0, n};
  const bool right_x_end = side_y != 0 ? side_y > 0 : side_x < 0;
  const bool right_y_end = side_x != 0 ? side_x < 0 : side_y < 0;
  const bool left_x_end = side_y != 0 ? side_y < 0 : side_x < 0;
  const bool left_y_end = side_x != 0 ? side_x > 0 : side_y < 0;
  const int first = sector_of(right_x_end ? x_end : x_map, right_y_end ? y_end : y_map);
  const int last = sector_of(left_x_end ? x_end : x_map, left_y_end ? y_end : y_map);
  const int apart = (last - first + n) % n;
  // A narrow square on a border, which rounding has put the wrong way about.
  if (apart == n - 1) return {last, 2};
  return {first, apart + 1};
}

/// The columns of a square ring, one after the other around it. False behind the last ring.
bool ObstacleSectors::next_column() noexcept {
  const double edge_m = kBlockEdge * lattice_.resolution_m();
  ++place_;
  if (place_ < 8 * ring_) return true;
  place_ = 0;
  ++ring_;
  // The body is somewhere in its block.
  return (ring_ - 1) * edge_m <= config_.max_range_m;
}

/// The sides of the ring in turn: below to the right, right up, above to the left, left down.
ObstacleSectors::Column ObstacleSectors::current_column() const noexcept {
  const std::int32_t side = ring_ == 0 ? 0 : place_ / (2 * ring_);
  const std::int32_t along = place_ - 2 * ring_ * side - ring_;
  switch (side) {
    case 0:
      return column_at(center_x_ + along, center_y_ - ring_);
    case 1:
      return column_at(center_x_ + ring_, center_y_ + along);
    case 2:
      return column_at(center_x_ - along, center_y_ + ring_);
    default:
      return column_at(center_x_ - ring_, center_y_ - along);
  }
}

ObstacleSectors::Column ObstacleSectors::column_at(std::int32_t x, std::int32_t y) const noexcept {
  const double edge_m = kBlockEdge * lattice_.resolution_m();
  const double x_map = x * edge_m - x_m_;
  const double y_map = y * edge_m - y_m_;
  const double dx = std::max({x_map, -(x_map + edge_m), 0.0});
  const double dy = std::max({y_map, -(y_map + edge_m), 0.0});
  return {x, y, std::sqrt(squared_norm(dx, dy, 0.0)), touched_by(x_map, y_map, edge_m)};
}

bool ObstacleSectors::is_behind(const Column& column) const noexcept {
  for (int i = 0; i < column.touched.count; ++i) {
    const auto sector = static_cast<std::size_t>((column.touched.first + i) % config_.count);
    if (nearest_m_[sector] >= column.nearest_m) return false;
  }
  return true;
}

bool ObstacleSectors::step(MapReader& reader, std::uint32_t max_blocks) noexcept {
  if (!sweeping_) return true;
  std::uint64_t passed = std::uint64_t{16} * max_blocks + 1;
  const std::uint32_t voxels_before = current().voxels_read;
  std::uint32_t looked_up = 0;
  while (passed > 0) {
    const Column column = current_column();
    if (column.nearest_m > config_.max_range_m || is_behind(column)) {
      --passed;
    } else {
      const std::uint32_t work =
          looked_up + (current().voxels_read - voxels_before) / kVoxelsPerBlock;
      if (looked_up > 0 && work + column_blocks() > max_blocks) return false;
      looked_up += column_blocks();
      if (!read_column(reader, column)) {
        if (++busy_in_row_ < kMostBusy) return false;
        give_up(column);
      }
      busy_in_row_ = 0;
    }
    if (!next_column()) {
      finish();
      return true;
    }
  }
  return false;
}

void ObstacleSectors::give_up(const Column& column) noexcept {
  for (int i = 0; i < column.touched.count; ++i)
    current()
        .sectors[static_cast<std::size_t>((column.touched.first + i) % config_.count)]
        .available = false;
}

void ObstacleSectors::finish() noexcept {
  for (std::size_t i = 0; i < static_cast<std::size_t>(config_.count); ++i) {
    ObstacleSector& sector = current().sectors[i];
    const double end_m = std::min(sector.occupied ? sector.distance_m : kFar, config_.max_range_m);
    for (std::size_t ring = 0; ring < kMostRings; ++ring) {
      const double outer_m = static_cast<double>(ring + 1) * config_.ring_m;
      const Share counted = share(i, ring);
      // A ring without a column is the vehicle's own, or narrower than the voxels: then it goes
      // together with the rings behind it, up to the first that has one.
      if (outer_m > end_m) break;
      if (counted.all == 0 && outer_m > config_.own_radius_m) continue;
      if (counted.known < config_.known_share * counted.all) break;
      sector.free_up_to_m = outer_m;
    }
    if (!sector.available) sector = {};
  }
  summaries_[1] = current();
  sweeping_ = false;
}

}  // namespace tessera
