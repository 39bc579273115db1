// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "laws/scan_laws.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <set>
#include <sstream>

#include "laws/crossed_voxels.hpp"
#include "laws/map_content.hpp"
#include "laws/moved_clocks.hpp"
#include "laws/scan_registration.hpp"

namespace tessera::oracle {

namespace {

using Broken = std::optional<std::string>;

/// What is checked of one scan.
struct Seen {
  const ScanCase& scan_case;
  const std::vector<Return>& returns;
  const Integrator& integrator;
  const ScanReport& report;
  const MapContent& before;
  const MapContent& after;
};

bool has_deadline(const ScanCase& scan_case) { return scan_case.due_us > 0; }

/// The mapper under test: everything as scarce as the case says.
Mapper scarce_mapper(const ScanCase& scan_case) {
  return {scan_case.map, scan_case.inference, kCaseClasses, scan_case.capacity};
}

/// What scarce_mapper is held against: nothing is scarce.
Mapper roomy_mapper(const ScanCase& scan_case) {
  MapConfig map = scan_case.map;
  map.storage_bytes = std::size_t{4} << 20U;
  InferenceConfig inference = scan_case.inference;
  inference.work_budget = 0;
  return {map, inference, kCaseClasses, {.points = 64, .tiles = 4096, .ray_blocks = 4096}};
}

/// Opens empty blocks, from the sensor outwards, until the index or the storage refuses one.
void fill_index(LocalMap& map, const Matrix34d& T_map_sensor) {
  const Result<VoxelCoord> sensor = map.lattice().voxel_of(T_map_sensor.col(3).cast<float>());
  if (!sensor.ok()) return;
  const BlockCoord at = block_of(*sensor);
  for (int n = 0; n < 1024; ++n) {
    // Every other block, so that scans find some open.
    const BlockCoord block =
        at + BlockCoord{(n & 15) - 8, ((n >> 4) & 7) - 4, 2 * (((n >> 7) & 7) - 4)};
    if (in_grid(block) && !map.open_block(block).ok()) return;
  }
}

bool same_point(const ScanPoint& x, const ScanPoint& y) {
  return x.p_map == y.p_map && x.weight == y.weight && x.component == y.component;
}

/// Points are added in an order, which sums depend on.
bool same_points(std::span<const ScanPoint> a, std::span<const ScanPoint> b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same_point);
}

/// Rays are a set.
bool same_rays(std::span<const ScanPoint> a, std::span<const ScanPoint> b) {
  return std::is_permutation(a.begin(), a.end(), b.begin(), b.end(), same_point);
}

Broken check_returns(const Seen& seen, const Registration& registered) {
  const ScanReport& r = seen.report;
  const auto points = static_cast<std::uint32_t>(seen.returns.size());
  if (r.points != points) return "points are not the returns handed in";
  const std::uint32_t capacity = seen.scan_case.capacity.points;
  if (r.over_capacity != (points > capacity ? points - capacity : 0))
    return "over_capacity is not the returns beyond the capacity";
  const std::uint32_t refused = r.non_finite + r.too_near + r.beyond_range + r.out_of_grid;
  if (r.returns_cut > 0) {
    const bool nothing_else = refused == 0 && r.thinned == 0 && r.admitted == 0;
    return nothing_else && r.returns_cut + r.over_capacity == points
               ? Broken{}
               : "a scan that was not registered in time is not counted as returns_cut";
  }
  if (r.over_capacity > 0) {  // not thinned: what is in range is what there is after thinning
    return refused + r.over_capacity + r.in_range == points && r.thinned == r.in_range
               ? Broken{}
               : "points are not the sum of their reasons, returns in range and over_capacity";
  }
  const ScanReport& all = registered.report;
  if (r.non_finite != all.non_finite || r.too_near != all.too_near ||
      r.beyond_range != all.beyond_range || r.out_of_grid != all.out_of_grid)
    return "a return's fate depends on more than the return";
  if (refused + r.in_range != points || r.in_range != registered.in_range)
    return "points are not the sum of their reasons and returns in range";
  if (r.thinned != registered.points.size()) return "thinned is not the number of cells";
  return {};
}

Broken check_thinned(const Seen& seen, const Registration& registered) {
  const ScanReport& r = seen.report;
  const Integrator& integrator = seen.integrator;
  if (r.thinned != r.admitted + r.refused_memory() + r.refused_work + r.refused_deadline)
    return "thinned is not admitted and refused by each reason";
  if (r.admitted != integrator.admitted().size()) return "admitted is not the points admitted";
  if (r.write_faults != 0) return "something admitted could not be written";
  if (r.points_cut > r.admitted) return "more points are cut than were admitted";
  const std::size_t rays = integrator.admitted_rays().size();
  const std::size_t refused = r.rays_refused_memory + r.rays_refused_work + r.rays_refused_deadline;
  if (r.returns_cut == 0 && r.over_capacity == 0 && rays + refused != registered.rays.size())
    return "directions beyond the range are not rays admitted and refused by each reason";
  const FreeSpaceConfig& free_space = seen.scan_case.inference.free_space;
  if (!free_space.uses_image() &&
      r.rays + r.rays_cut != (free_space.enabled ? r.admitted + rays : 0))
    return "rays and rays_cut are not the rays of what was admitted";
  const bool timed = has_deadline(seen.scan_case);
  if (!timed && r.left_out_deadline() + r.tiles_cut + r.ray_blocks_cut > 0)
    return "something was cut without a deadline";
  return {};
}

/// No voxel is freed but those that a ray to an admitted point crosses, none that holds a hit. By
/// the image other returns free voxels too (carve_image_test.cpp has which).
Broken check_freed(const Seen& seen, CaseTally& tally) {
  const double voxel_m = seen.scan_case.map.resolution_m;
  CrossedVoxels crossed(seen.scan_case.T_map_sensor.col(3), voxel_m);
  for (const ScanPoint& point : seen.integrator.admitted()) crossed.add_hit(point.p_map);
  for (const ScanPoint& ray : seen.integrator.admitted_rays()) crossed.add_ray(ray.p_map);
  for (const BlockEvidenceCopy& block : seen.after) {
    const BlockEvidenceCopy* const old = find_block(seen.before, block.at);
    for (int i = 0; i < kBlockVoxels; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const std::byte was = old == nullptr ? std::byte{0} : old->passes[at];
      if (block.passes[at] <= was) continue;
      ++tally.freed_voxels;
      const VoxelCoord voxel = voxel_at(block.at, i / kOctetVoxels, i % kOctetVoxels);
      const bool may_be_free =
          seen.scan_case.inference.free_space.uses_image() || crossed.is_crossed(voxel);
      const char* const wrong = crossed.is_hit(voxel) ? "holds a hit"
                                : may_be_free         ? nullptr
                                                      : "is crossed by no ray";
      if (wrong == nullptr) continue;
      std::ostringstream out;
      out << "voxel " << voxel.x << ' ' << voxel.y << ' ' << voxel.z << " is freed and " << wrong;
      return out.str();
    }
  }
  return {};
}

/// Each point that counts as kept is in its own voxel, in the mode where that is all it does.
Broken check_counted(const Seen& seen) {
  if (seen.scan_case.inference.mode != InferenceMode::kCounting || seen.report.tiles_cut > 0)
    return {};
  for (const ScanPoint& point : seen.integrator.admitted()) {
    if (point.weight < seen.scan_case.inference.min_weight) continue;
    const Point3d q = point.p_map.cast<double>() / seen.scan_case.map.resolution_m;
    const VoxelCoord voxel{static_cast<int>(std::floor(q.x())), static_cast<int>(std::floor(q.y())),
                           static_cast<int>(std::floor(q.z()))};
    const BlockEvidenceCopy* const block = find_block(seen.after, block_of(voxel));
    const int place = octet_in_block(voxel) * kOctetVoxels + voxel_in_octet(voxel);
    const bool labelled =
        block != nullptr && std::any_of(block->labels.begin(), block->labels.end(),
                                        [&](const LabelCounts& l) { return l.place == place; });
    if (!labelled) return "an admitted point has left no label in its voxel";
  }
  return {};
}

/// The part of a deadline's law that a voxel's labels belong to: its tile.
std::array<int, 3> tile_of(const VoxelCoord& voxel, int tile_edge) {
  const auto down = [&](int v) { return static_cast<int>(std::floor(1.0 * v / tile_edge)); };
  return {down(voxel.x), down(voxel.y), down(voxel.z)};
}

/// Tiles in which two maps' labels differ.
std::set<std::array<int, 3>> differing_tiles(const MapContent& a, const MapContent& b,
                                             int tile_edge) {
  std::set<std::array<int, 3>> tiles;
  const auto compare = [&](const MapContent& one, const MapContent& other) {
    for (const BlockEvidenceCopy& block : one) {
      const BlockEvidenceCopy* const twin = find_block(other, block.at);
      for (const LabelCounts& counts : block.labels) {
        const bool same = twin != nullptr && std::find(twin->labels.begin(), twin->labels.end(),
                                                       counts) != twin->labels.end();
        const VoxelCoord v =
            voxel_at(block.at, counts.place / kOctetVoxels, counts.place % kOctetVoxels);
        if (!same) tiles.insert(tile_of(v, tile_edge));
      }
    }
  };
  compare(a, b);
  compare(b, a);
  return tiles;
}

std::array<std::byte, kBlockVoxels> passes_at(const MapContent& content, BlockCoord at) {
  const BlockEvidenceCopy* const block = find_block(content, at);
  return block == nullptr ? std::array<std::byte, kBlockVoxels>{} : block->passes;
}

/// The law of Integrator::integrate with a deadline; whole: the map with nothing cut.
Broken check_parts(const Seen& seen, const MapContent& whole) {
  const InferenceConfig& config = seen.scan_case.inference;
  const int edge = config.mode == InferenceMode::kMultiEntropy ? config.entropy.block_edge : 2;
  const auto left = differing_tiles(seen.after, whole, 4 * edge);
  const auto written = differing_tiles(seen.after, seen.before, 4 * edge);
  for (const auto& tile : left) {
    if (written.count(tile) != 0) return "a tile's labels are neither as before nor whole";
  }
  if (left.size() > seen.report.tiles_cut) return "more tiles are left out than tiles_cut";
  std::size_t blocks_left = 0;
  for (const BlockEvidenceCopy& block : whole) {
    const auto now = passes_at(seen.after, block.at);
    const bool as_before = now == passes_at(seen.before, block.at);
    const bool as_whole = now == block.passes;
    if (seen.report.tiles_cut > 0 && !as_before) return "free space is written before labels";
    // Which rays were traced is not known from outside; but none beyond the whole.
    if (seen.report.rays_cut == 0 && !as_before && !as_whole)
      return "a block's free space is neither as before nor whole";
    blocks_left += as_whole ? 0U : 1U;
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (now[i] > block.passes[i]) return "more free space than that of all rays";
    }
  }
  if (seen.report.rays_cut == 0 && blocks_left > seen.report.ray_blocks_cut)
    return "more blocks of free space are left out than ray_blocks_cut";
  return {};
}

/// What is kept is exactly what is in the map: the returns behind the kept points and rays, alone
/// in a map where nothing is scarce, give the same points, rays and map. By the image, returns that
/// are not kept free space too.
Broken check_kept(const Seen& seen, Registration& registered, Mapper& roomy) {
  std::vector<bool> chosen(seen.returns.size(), false);
  if (!choose_returns(registered.points, seen.integrator.admitted(), chosen) ||
      !choose_returns(registered.rays, seen.integrator.admitted_rays(), chosen))
    return "a point or ray was admitted that stands for no returns";
  std::vector<Return> kept;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (chosen[i]) kept.push_back(seen.returns[i]);
  }
  const ScanReport report = roomy.integrate(cloud_of(kept), seen.scan_case.T_map_sensor);
  if (report.left_out() != 0) return "the roomy map leaves something out";
  if (!same_points(roomy.integrator().admitted(), seen.integrator.admitted()))
    return "the points kept are not those of their returns alone";
  if (!same_rays(roomy.integrator().admitted_rays(), seen.integrator.admitted_rays()))
    return "the rays kept are not those of their returns alone";
  const MapContent whole = content_of(roomy.map());
  const ScanReport& r = seen.report;
  if (r.tiles_cut + r.rays_cut + r.ray_blocks_cut > 0) return check_parts(seen, whole);
  if (whole != seen.after) return "the map is not what the points and rays kept alone make";
  return {};
}

Broken check_scan(const Seen& seen, Registration& registered, Mapper& roomy, CaseTally& tally) {
  if (seen.report.pose != registered.report.pose) return "poses are judged by more than the pose";
  if (seen.report.pose != Status::kOk) {
    return seen.before == seen.after ? Broken{} : "a scan with a bad pose changes the map";
  }
  Broken broken = check_returns(seen, registered);
  if (!broken) broken = check_thinned(seen, registered);
  if (!broken) broken = check_freed(seen, tally);
  if (!broken) broken = check_counted(seen);
  if (!broken && !seen.scan_case.inference.free_space.uses_image())
    broken = check_kept(seen, registered, roomy);
  tally.kept_points += static_cast<int>(seen.report.points_kept());
  tally.left_out += seen.report.left_out() > 0 ? 1 : 0;
  tally.cut += seen.report.tiles_cut + seen.report.rays_cut + seen.report.ray_blocks_cut > 0;
  return broken;
}

}  // namespace

std::optional<std::string> broken_law(const ScanCase& scan_case, Digest& digest, CaseTally& tally) {
  Mapper mapper = scarce_mapper(scan_case);
  Mapper roomy = roomy_mapper(scan_case);
  if (scan_case.fill_index) fill_index(mapper.map(), scan_case.T_map_sensor);
  MapContent before = content_of(mapper.map());
  for (const std::vector<Return>* const returns : {&scan_case.before, &scan_case.returns}) {
    const bool under_test = returns == &scan_case.returns;
    if (returns->empty() && !under_test) continue;
    Registration registered;
    if (Broken broken = register_scan(scan_case, *returns, registered)) return broken;
    const Cloud cloud = cloud_of(*returns);
    const ScanView view = cloud.view(scan_case.T_map_sensor);
    ScanReport report;
    if (under_test && has_deadline(scan_case)) {
      StepClock steps;
      Deadline deadline(steps.clock(), scan_case.rate);
      report = mapper.integrator().integrate(mapper.map(), view, deadline, scan_case.due_us);
      if (report.overshoot_us > 1) return "more than a quantum is done after the deadline";
    } else {
      report = mapper.integrator().integrate(mapper.map(), view);
    }
    MapContent after = content_of(mapper.map());
    const Seen seen{scan_case, *returns, mapper.integrator(), report, before, after};
    if (Broken broken = check_scan(seen, registered, roomy, tally)) return broken;
    if (mapper.map().usage().label_voxels != label_voxels(after))
      return "usage counts other label voxels than there are";
    if (!scan_case.fill_index && mapper.map().block_count() != after.size())
      return "a block without evidence stays open";
    before = std::move(after);
  }
  add_to(digest, before);
  return std::nullopt;
}

}  // namespace tessera::oracle
