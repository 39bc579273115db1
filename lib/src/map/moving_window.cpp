// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/moving_window.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace tessera {

namespace {

/// Half the diagonal of the robot's block and half of the other's: no two of their points are
/// farther apart than their centres and this, nor nearer than their centres less this.
constexpr double kDiagonal = 1.7320508075688773;

/// The reach of a window is drawn in by whole ones of so many rings of the same area.
constexpr std::int64_t kRings = 64;

/// Items of the storage that a block has at most.
constexpr SlabPool::Counts kMostOfBlock{1, kBlockLayers, kBlockLayers, kBlockOctets};

SlabPool::Counts ample_of(const SlabPool::Counts& reserve) noexcept {
  SlabPool::Counts ample = kMostOfBlock;
  for (std::size_t i = 0; i < ample.size(); ++i) ample[i] += reserve[i] + reserve[i] / 8;
  return ample;
}

std::uint64_t larger(std::uint64_t a, std::uint64_t b) noexcept { return a < b ? b : a; }

/// The root of a square, rounded down; 0 of what is below 0.
std::uint32_t edges_of(std::int64_t square) noexcept {
  return square <= 0 ? 0 : static_cast<std::uint32_t>(std::sqrt(static_cast<double>(square)));
}

}  // namespace

void WindowReport::add(const WindowStep& step) noexcept {
  evicted += step.evicted;
  near_evicted += step.near_evicted;
  reach_blocks = step.reach_blocks;
  evictions_refused += step.evictions_refused;
  reloaded += step.reloaded;
  merged += step.merged;
  reloads_failed += step.reloads_failed;
  steps_without_room += step.no_room ? 1U : 0U;
  backlog = std::uint64_t{step.eviction_backlog} + step.reload_backlog;
  most_backlog = larger(most_backlog, backlog);
  most_evicted = larger(most_evicted, step.evicted);
  most_reloaded = larger(most_reloaded, step.reloaded);
}

Result<MovingWindow> MovingWindow::make(const WindowConfig& config, double resolution_m) noexcept {
  const bool work = config.entries_per_step > 0 && config.evictions_per_step > 0 &&
                    config.pressed_evictions_per_step >= config.evictions_per_step &&
                    config.regions_per_step > 0 && config.reloads_per_step > 0 &&
                    config.label_voxels_per_step > 0;
  if (!(resolution_m > 0.0) || !(config.radius_m > 0.0) || !(config.hysteresis_m >= 0.0) || !work) {
    return Status::kInvalidArgument;
  }
  const double edge_m = resolution_m * kBlockEdge;
  const double far = (config.radius_m + config.hysteresis_m) / edge_m;
  if (!(far <= WindowConfig::kMaxRadiusBlocks)) return Status::kInvalidArgument;
  const auto square = [](double blocks) { return floor_to_int64(blocks * blocks); };
  MovingWindow window;
  window.config_ = config;
  window.reserve_ = config.reserve;
  window.ample_ = ample_of(config.reserve);
  window.near_square_ = square(config.radius_m / edge_m + kDiagonal);
  window.far_square_ = square(far + kDiagonal);
  window.held_square_ = window.near_square_;
  window.reach_blocks_ = floor_to_int(config.radius_m / edge_m + kDiagonal);
  return window;
}

std::int64_t MovingWindow::square_distance(BlockCoord block) const noexcept {
  const std::int64_t x = std::int64_t{block.x} - robot_.x;
  const std::int64_t y = std::int64_t{block.y} - robot_.y;
  const std::int64_t z = std::int64_t{block.z} - robot_.z;
  return x * x + y * y + z * z;
}

WindowStep MovingWindow::step(LocalMap& map, const Point3d& p_map,
                              const BlockArchive& archive) noexcept {
  WindowStep report;
  const Result<VoxelCoord> voxel = map.lattice().voxel_of(p_map);
  report.position = voxel.status();
  if (!voxel.ok()) return report;
  robot_ = block_of(*voxel);
  if (draws_in()) learn(map);
  evict_far(map, archive, report);
  if (config_.evicts_near) evict_near(map, archive, report);
  report.reach_blocks = edges_of(held_square_);
  if (archive.archived != nullptr && !near_left_) {
    reload_near(map, archive, report);
    // What came back may have taken the room that the scan needs.
    if (config_.keep_while_room && !keeps_all(map)) {
      evict_far(map, archive, report);
      report.reload_backlog = 0;
      report.no_room = false;
      reload_near(map, archive, report);
    }
  }
  if (draws_in()) left_ = map.items();
  return report;
}

/// As what the last scan added says, or as much of that as three quarters of the map hold: with
/// more nothing would ever stay.
void MovingWindow::learn(const LocalMap& map) noexcept {
  if (!left_) return;
  const SlabPool::Counts now = map.items();
  constexpr std::uint64_t kEighths = 8;
  for (std::uint64_t part = kEighths; part != 0; --part) {
    SlabPool::Counts learnt{};
    SlabPool::Counts with_rest{};
    for (std::size_t i = 0; i < now.size(); ++i) {
      const std::uint64_t added = now[i] > (*left_)[i] ? now[i] - (*left_)[i] : 0;
      const std::uint64_t wanted =
          std::min<std::uint64_t>((added + added / 2) * part / kEighths, UINT32_MAX / 2);
      learnt[i] = static_cast<std::uint32_t>(wanted);
      with_rest[i] = learnt[i] + learnt[i] / 3;
    }
    if (!map.fits_empty(with_rest)) continue;
    for (std::size_t i = 0; i < now.size(); ++i) reserve_[i] = std::max(reserve_[i], learnt[i]);
    ample_ = ample_of(reserve_);
    return;
  }
}

void MovingWindow::evict_far(LocalMap& map, const BlockArchive& archive,
                             WindowStep& report) noexcept {
  report.eviction_backlog = 0;
  if (keeps_all(map)) return;
  Allowance far = allowance(map);
  evict(Which::kFar, map, archive, far, report);
  if (keeps_all(map)) return;
  // What is left of them: counted in a round of its own, as the first may have gone around.
  SweepCursor cursor = cursor_;
  map.visit_blocks(cursor, config_.entries_per_step, [&](BlockKey key, SlabHandle) {
    report.eviction_backlog += square_distance(unpack(key)) > far_square_ ? 1U : 0U;
    return true;
  });
}

MovingWindow::Allowance MovingWindow::allowance(const LocalMap& map) const noexcept {
  const bool pressed = !has_room(map);
  const std::uint32_t left =
      pressed ? config_.pressed_evictions_per_step : config_.evictions_per_step;
  // Refusals of their own, and a bucket of the index at least: a block that is refused for ever
  // must not keep those beside it waiting.
  return {.left = left, .refusals_left = left + BlockIndex::kBucketSlots - 1, .pressed = pressed};
}

/// What scans have added beyond the reach of before leaves first.
void MovingWindow::evict_near(LocalMap& map, const BlockArchive& archive,
                              WindowStep& report) noexcept {
  if (has_room(map)) {
    if (has_ample_room(map))
      held_square_ = std::min(near_square_, held_square_ + near_square_ / kRings + 1);
    return;
  }
  if (config_.keep_while_room) {
    near_left_ = true;
    held_square_ = -1;
  }
  Allowance near = allowance(map);
  evict(Which::kNear, map, archive, near, report);
  for (int drawing = 0; drawing < kDrawings; ++drawing) {
    const bool spent = near.left == 0 || near.refusals_left == 0;
    if (spent || held_square_ < 0 || has_room(map)) return;
    draw_in(map, 1 << drawing);
    evict(Which::kNear, map, archive, near, report);
  }
}

/// Makes the reach so much less that this share of the near blocks is beyond it, and all of 8.
void MovingWindow::draw_in(const LocalMap& map, int eighths) noexcept {
  std::array<std::uint32_t, kRings> blocks{};
  std::uint64_t total = 0;
  SweepCursor cursor = cursor_;
  map.visit_blocks(cursor, config_.entries_per_step, [&](BlockKey key, SlabHandle) {
    const std::int64_t square = square_distance(unpack(key));
    if (square > held_square_) return true;
    ++blocks[static_cast<std::size_t>(square * kRings / (near_square_ + 1))];
    ++total;
    return true;
  });
  std::uint64_t beyond = 0;
  std::int64_t ring = kRings;
  while (ring > 0 && (beyond == 0 || beyond * 8 < total * static_cast<std::uint64_t>(eighths)))
    beyond += blocks[static_cast<std::size_t>(--ring)];
  // The last place that is nearer than the ring.
  held_square_ = std::min(held_square_ - 1, (ring * (near_square_ + 1) + kRings - 1) / kRings - 1);
}

/// With WindowConfig::keep_while_room far blocks go until there is room; near ones whatever room
/// there is.
void MovingWindow::evict(Which which, LocalMap& map, const BlockArchive& archive,
                         Allowance& allowance, WindowStep& report) noexcept {
  const std::size_t seen =
      map.visit_blocks(cursor_, config_.entries_per_step, [&](BlockKey key, SlabHandle handle) {
        const std::int64_t square = square_distance(unpack(key));
        const bool is_far = square > far_square_;
        if (which == Which::kFar ? !is_far : is_far || square <= held_square_) return true;
        const bool spent =
            allowance.left == 0 || allowance.refusals_left == 0 || (is_far && keeps_all(map)) ||
            (!allowance.pressed && allowance.voxels >= config_.label_voxels_per_step);
        if (spent) return false;
        const Block& block = map.block_at(handle);
        const std::uint32_t label_voxels = block.label_voxels;
        if (archive.evict(archive.context, map, block)) {
          map.remove_block(handle);
          ++report.evicted;
          report.near_evicted += is_far ? 0U : 1U;
          --allowance.left;
          allowance.voxels += label_voxels;
        } else {
          ++report.evictions_refused;
          --allowance.refusals_left;
        }
        return true;
      });
  report.entries += static_cast<std::uint32_t>(seen);
}

void MovingWindow::reload_region(LocalMap& map, const BlockArchive& archive, BlockCoord region,
                                 WindowStep& report) noexcept {
  const RegionMask* const archived = archive.archived(archive.context, region);
  if (archived == nullptr) return;
  const RegionMask mask = *archived;  // reload changes it
  for (std::int32_t z = 0; z < 8; ++z) {
    for (std::uint64_t rest = mask[static_cast<std::size_t>(z)]; rest != 0; rest &= rest - 1) {
      const int yx = std::countr_zero(rest);
      const BlockCoord block{region.x * 8 + (yx & 7), region.y * 8 + (yx >> 3), region.z * 8 + z};
      if (square_distance(block) > held_square_) continue;
      report.no_room = report.no_room || !has_ample_room(map);
      const bool spent = report.no_room || reloaded_voxels_ >= config_.label_voxels_per_step ||
                         report.reloaded + report.reloads_failed == config_.reloads_per_step;
      if (spent) {
        ++report.reload_backlog;
        continue;
      }
      reload_block(map, archive, block, report);
    }
  }
}

void MovingWindow::reload_block(LocalMap& map, const BlockArchive& archive, BlockCoord block,
                                WindowStep& report) noexcept {
  const bool open = map.find(block) != nullptr;
  const Status status = archive.reload(archive.context, map, pack_in_grid(block));
  if (status != Status::kOk) {
    ++report.reload_backlog;
    report.no_room = status == Status::kResourceExhausted;
    report.reloads_failed += report.no_room ? 0U : 1U;
    return;
  }
  ++report.reloaded;
  report.merged += open ? 1U : 0U;
  const Block* const reloaded = map.find(block);
  reloaded_voxels_ += reloaded == nullptr ? 0U : reloaded->label_voxels;
}

void MovingWindow::reload_near(LocalMap& map, const BlockArchive& archive,
                               WindowStep& report) noexcept {
  const std::int32_t reach = reach_blocks_;
  const BlockCoord low = region_of({robot_.x - reach, robot_.y - reach, robot_.z - reach});
  const BlockCoord high = region_of({robot_.x + reach, robot_.y + reach, robot_.z + reach});
  const auto extent = [](std::int32_t a, std::int32_t b) {
    return static_cast<std::uint64_t>(b - a) + 1;
  };
  const std::uint64_t nx = extent(low.x, high.x);
  const std::uint64_t ny = extent(low.y, high.y);
  const std::uint64_t total = nx * ny * extent(low.z, high.z);
  const std::uint64_t most = total < config_.regions_per_step ? total : config_.regions_per_step;
  std::uint64_t resume = total;
  reloaded_voxels_ = 0;
  for (std::uint64_t n = 0; n < most; ++n) {
    if (region_cursor_ >= total) region_cursor_ = 0;
    const BlockCoord region{low.x + static_cast<std::int32_t>(region_cursor_ % nx),
                            low.y + static_cast<std::int32_t>(region_cursor_ / nx % ny),
                            low.z + static_cast<std::int32_t>(region_cursor_ / (nx * ny))};
    reload_region(map, archive, region, report);
    if (report.reload_backlog > 0 && resume == total) resume = region_cursor_;
    ++region_cursor_;
  }
  report.regions += static_cast<std::uint32_t>(most);
  // Begins with what had to wait; a block that fails again and again must not hold the others up.
  if (resume != total && report.reloads_failed == 0) region_cursor_ = resume;
}

}  // namespace tessera
