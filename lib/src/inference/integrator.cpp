// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/integrator.hpp"

#include "tessera/inference/internal/point_admission.hpp"
#include "tessera/inference/internal/storage_needs.hpp"
#include "tessera/inference/internal/wanted_units.hpp"
#include "tessera/inference/internal/write_in_time.hpp"

namespace tessera {

namespace {

bool valid(const InferenceConfig& config) noexcept {
  if (config.mode > InferenceMode::kLattice || config.thinning_weight > ThinningWeight::kSum) {
    return false;
  }
  const auto within = [](float v, float low, float high) { return v >= low && v <= high; };
  const EntropyConfig& e = config.entropy;
  const bool entropy = within(e.base_length, 0.0F, 16.0F) &&
                       within(e.entropy_length, 0.0F, 16.0F) &&
                       within(e.fill_length, 0.0F, 16.0F) && within(e.smooth_above, 0.0F, 2.0F) &&
                       e.fill_neighbours >= 1 && e.fill_neighbours <= 7 &&
                       (e.block_edge == 1 || e.block_edge == 2 || e.block_edge == 4);
  const ClassKernel one{config.lattice.reach_m, config.lattice.height_m};
  const bool by_class = one.reach_m == 0.0F;
  const bool lattice = (by_class ? ClassKernel{.height_m = one.height_m} : one).is_valid() &&
                       (config.mode != InferenceMode::kLattice || e.block_edge == 2);
  const bool ranges =
      within(config.min_range_m, 0.0F, 1e6F) && within(config.max_range_m, 0.0F, 1e6F) &&
      (config.max_range_m == 0.0F || config.max_range_m > config.min_range_m) &&
      (config.no_return_range_m == 0.0F ||
       within(config.no_return_range_m, config.min_range_m, 1e6F)) &&
      (config.thinning_m == 0.0 || (config.thinning_m >= 1e-3 && config.thinning_m <= 1e3));
  const bool kernel = within(config.kernel_length_m, 1e-3F, 1e3F) &&
                      within(config.kernel_scale, 1e-6F, 1e6F) &&
                      within(config.min_weight, 0.0F, 1.0F);
  const bool carving =
      within(config.free_space.neighbour_angle_rad, 0.0F, RangeImage::kMaxAngle_rad) &&
      within(config.free_space.margin_voxels, 0.0F, 64.0F) &&
      config.free_space.carving <= Carving::kImage &&
      config.free_space.neighbour_pixels <= CarveImage::kMostNeighbours;
  return entropy && lattice && ranges && kernel && carving && config.body.is_valid();
}

}  // namespace

Result<Integrator> Integrator::make(Arena& arena, const InferenceConfig& config,
                                    const ScanCapacity& capacity) noexcept {
  const bool capacities = capacity.points > 0 && capacity.points <= ScanCapacity::kMaxPoints &&
                          capacity.tiles > 0 && capacity.ray_blocks > 0;
  if (!valid(config) || !capacities) return Status::kInvalidArgument;
  if (!arena.aligned() || arena.remaining_bytes() < required_bytes(capacity, config)) {
    return Status::kResourceExhausted;
  }
  Integrator result;
  result.config_ = config;
  result.points_ = ScanPoints::make(arena, capacity.points);
  const Result<ScanTiles> tiles = ScanTiles::make(arena, capacity);
  if (!tiles.ok()) return tiles.status();
  result.scratch_.tiles = *tiles;
  const Result<LabelWriter> labels = LabelWriter::make(arena, config);
  if (!labels.ok()) return labels.status();
  result.labels_ = *labels;
  if (config.free_space.enabled) {
    const Result<FreeSpace> free_space =
        FreeSpace::make(arena, capacity, config.free_space.carving);
    if (!free_space.ok()) return free_space.status();
    result.scratch_.free_space = *free_space;
  }
  if (config.free_space.uses_image()) {
    const Result<ImageCarver> carver = ImageCarver::make(arena);
    if (!carver.ok()) return carver.status();
    result.carver_ = *carver;
  }
  return result;
}

ScanReport Integrator::integrate(LocalMap& map, const ScanView& scan) noexcept {
  return integrate_scan(map, scan, nullptr);
}

ScanReport Integrator::integrate(LocalMap& map, const ScanView& scan, Deadline& deadline,
                                 std::int64_t due_us) noexcept {
  deadline.begin(due_us);
  ScanReport report = integrate_scan(map, scan, &deadline);
  deadline.end(work_.done(report, admitted().size(), rays_predicted_));
  work_.learn_from(report, admitted().size());
  report.overshoot_us = deadline.overshoot_us();
  return report;
}

ScanReport Integrator::integrate_scan(LocalMap& map, const ScanView& scan,
                                      Deadline* deadline) noexcept {
  ScanReport report;
  report.points = static_cast<std::uint32_t>(scan.count);
  work_.begin(deadline, config_.free_space.uses_image());
  tracer_.forget_cut();
  report.pose = check_rigid(scan.T_map_sensor);
  if (report.pose != Status::kOk) {
    points_.drop_all();
    return report;
  }
  if (!points_.begin(map.lattice(), scan.T_map_sensor.col(3)) ||
      !config_.body.allows(scan.T_body_sensor)) {
    report.pose = Status::kInvalidArgument;
    return report;
  }
  map.begin_revision();
  if (!register_scan(map, scan, report)) return report;
  begin_scratch(map);
  open_failed_ = image_made_ = carving_cut_ = emptied_ = false;
  carve_steps_ = 0;
  const bool all_fit = admit(map, report);
  if (work_.cut()) {
    leave_out_all(report);
  } else {
    labels_.write(map, scratch_.tiles, points_.origin_voxel(), work_, report);
    if (config_.free_space.enabled) write_free_space(map, report);
  }
  close_unwritten_blocks(map, all_fit && !work_.cut());
  if (image_made_) look_at_watched(map.lattice(), scan.watched);
  report.admitted = static_cast<std::uint32_t>(admitted().size());
  return report;
}

bool Integrator::register_scan(const LocalMap& map, const ScanView& scan,
                               ScanReport& report) noexcept {
  const auto unlabelled = static_cast<std::uint8_t>(map.classes().unlabelled());
  points_.register_returns(map.lattice(), scan, config_, unlabelled, work_, report);
  if (work_.cut()) return false;
  points_.thin(map.lattice(), scan, config_, unlabelled);
  report.thinned = static_cast<std::uint32_t>(admitted().size());
  const double resolution_m = map.lattice().resolution_m();
  reach_ = kernel_reach(config_, resolution_m, points_.largest_weight());
  labels_.begin(map, reach_);
  work_.set_most_per_point(most_evaluations(config_, reach_));
  if (!work_.in_time()) leave_out_all(report);
  return !work_.cut();
}

bool Integrator::admit(LocalMap& map, ScanReport& report) noexcept {
  work_.set_limit(config_.work_budget, report);
  if (!work_.cut()) shed_points(report);
  const bool tried = !work_.cut() && within_limit(report) && !memory_was_short_;
  const bool all_fit = tried && fill_scratch(map) && fits_whole(map) && open_blocks(map);
  if (!all_fit && !work_.cut()) {
    if (open_failed_) map.close_empty_blocks();
    report.ray_steps = scratch_.free_space.steps();  // on trial
    if (tried) begin_scratch(map);
    admit_one_by_one(map, report);
    const bool filled = work_.in_time() && fill_scratch(map);
    if (filled && config_.free_space.uses_image()) drop_what_does_not_fit(map, report);
    if (!(filled && open_blocks(map)) && !work_.cut()) refuse_all(map, report);
  }
  memory_was_short_ =
      report.refused_memory() + report.rays_refused_memory + report.free_blocks_refused > 0;
  report.carving_cut = carving_cut_ ? 1 : 0;
  report.tiles = static_cast<std::uint32_t>(scratch_.tiles.tiles().size());
  report.ray_blocks = static_cast<std::uint32_t>(scratch_.free_space.blocks().size());
  report.ray_steps += scratch_.free_space.steps();
  report.ray_steps += carve_steps_;
  if (report.work_limit != 0) report.work_predicted += carve_steps_;
  return all_fit;
}

void Integrator::admit_one_by_one(LocalMap& map, ScanReport& report) noexcept {
  PointAdmission admission(map, points_, scratch_, config_, reach_);
  admission.admit(work_, over_limit_, report);
  rays_predicted_ = admission.rays_predicted();
  reserved_ = admission.reserved();
  open_failed_ = open_failed_ || admission.index_refused();
  scratch_.tiles.forget_points();
  scratch_.free_space.forget_marks();
}

/// Rays are traced while there is time, and no longer, so only labels must be foreseen; where they
/// take all of the time that there is, a quarter of it is kept for rays.
void Integrator::shed_points(ScanReport& report) noexcept {
  const std::uint64_t per_point = work_.foreseen_per_point();
  const std::uint64_t limit = work_.limit();
  const std::uint64_t most = config_.free_space.enabled ? limit / 4 * 3 : limit;
  if (!work_.limit_is_deadline() || admitted().size() * per_point <= most) return;
  std::uint64_t left = most / per_point;
  for (const KeyedIndex& item : points_.in_order(unit_edge_of(config_), false, true)) {
    if (left > 0) {
      --left;
      continue;
    }
    points_.refuse(item.index);
    ++report.refused_deadline;
  }
  points_.drop_refused();
}

bool Integrator::within_limit(ScanReport& report) noexcept {
  over_limit_ = false;
  rays_predicted_ = 0;
  if (!work_.has_limit()) return true;
  if (config_.free_space.walks_rays()) {
    for (const std::span<const ScanPoint> ends : {admitted(), admitted_rays()}) {
      for (const ScanPoint& end : ends)
        rays_predicted_ += scratch_.free_space.most_steps(end.p_map);
    }
  }
  const std::uint64_t work = admitted().size() * work_.most_per_point() + rays_predicted_;
  // What a deadline has room for was seen to by shed_points(), and the clock does the rest.
  over_limit_ = config_.work_budget != 0 && work > config_.work_budget;
  if (!over_limit_) report.work_predicted = work;
  return !over_limit_;
}

void Integrator::begin_scratch(const LocalMap& map) noexcept {
  const bool compact = map.config().tuple == TuplePolicy::kCompact;
  const auto unlabelled = static_cast<std::uint8_t>(map.classes().unlabelled());
  scratch_.tiles.reset(unit_edge_of(config_), compact
                                                  ? RestOfLabels{0, CompactTuple::kLeastLabelWeight}
                                                  : RestOfLabels{unlabelled, 0});
  if (config_.free_space.enabled)
    scratch_.free_space.begin(config_.free_space, map.lattice(), points_.origin_map());
}

bool Integrator::fill_scratch(const LocalMap& map) noexcept {
  tracer_.forget_cut();
  const auto find_free = [&] {
    if (config_.free_space.uses_image()) carve(map);
    return !config_.free_space.walks_rays() || tracer_.trace(points_, scratch_.free_space, work_);
  };
  return scratch_.tiles.build(admitted(), map.lattice(), points_.scratch()) == Status::kOk &&
         work_.in_time() &&
         want_units(scratch_.tiles, config_, reach_, map.classes().num_classes()) &&
         work_.in_time() && find_free() && work_.in_time();
}

/// Asked before blocks are opened: one opened in vain would keep its page from other uses.
bool Integrator::fits_whole(const LocalMap& map) noexcept {
  SlabPool::Counts wanted{};
  const auto prefetch = [&map](const auto& items, std::size_t i) {
    constexpr std::size_t kAhead = 4;  // of those that are looked up
    if (i + kAhead < items.size()) map.index().prefetch(pack_in_grid(items[i + kAhead].coord));
  };
  const std::span<Tile> tiles = scratch_.tiles.tiles();
  const int edge = scratch_.tiles.unit_edge();
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    if (edge == 2) prefetch(tiles, i);
    if (tiles[i].wanted != 0) count_tile(map, edge, tiles[i], tiles[i].wanted, 0, wanted);
  }
  const std::span<RayBlock> blocks = scratch_.free_space.blocks();
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    prefetch(blocks, i);
    if (blocks[i].carves()) count_ray_block(map, blocks[i], wanted);
  }
  return map.fits(wanted);
}

bool Integrator::open_blocks(LocalMap& map) noexcept {
  for (Tile& tile : scratch_.tiles.tiles()) {
    if (tile.wanted == 0 || open_tile(map, scratch_.tiles.unit_edge(), tile, tile.wanted)) continue;
    open_failed_ = true;
    return false;
  }
  for (RayBlock& ray_block : scratch_.free_space.blocks()) {
    const bool carves = ray_block.carves();
    if (!carves) ray_block.block = 0;
    if (!carves || ray_block.block != 0) continue;
    const Result<SlabHandle> block = map.open_block(ray_block.coord);
    if (!block.ok()) {
      open_failed_ = true;
      return false;
    }
    ray_block.block = *block;
  }
  return true;
}

/// What admission reserved was not there: nothing of the scan is written, and that is counted.
void Integrator::refuse_all(const LocalMap& map, ScanReport& report) noexcept {
  TESSERA_ASSERT(false);
  ++report.write_faults;
  report.refused_storage += static_cast<std::uint32_t>(admitted().size());
  report.rays_refused_memory += static_cast<std::uint32_t>(admitted_rays().size());
  points_.drop_all();
  tracer_.forget_cut();
  open_failed_ = true;
  begin_scratch(map);
}

void Integrator::leave_out_all(ScanReport& report) noexcept {
  report.refused_deadline += static_cast<std::uint32_t>(admitted().size());
  report.rays_refused_deadline += static_cast<std::uint32_t>(admitted_rays().size());
  points_.drop_all();
  tracer_.forget_cut();
}

}  // namespace tessera
