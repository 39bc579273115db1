// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/scan_points.hpp"

#include <algorithm>

#include "return_limits.hpp"
#include "tessera/inference/internal/admission_order.hpp"
#include "tessera/inference/internal/thinning.hpp"
#include "tessera/registration/point_labels.hpp"

namespace tessera {

namespace {

void count_fate(Fate fate, ScanReport& report) noexcept {
  switch (fate) {
    case Fate::kNonFinite:
      ++report.non_finite;
      return;
    case Fate::kTooNear:
      ++report.too_near;
      return;
    case Fate::kOnBody:
      ++report.on_body;
      return;
    case Fate::kOnTeammate:
      ++report.on_teammate;
      return;
    case Fate::kNoReturn:
      ++report.no_return;
      return;
    case Fate::kOutOfGrid:
      ++report.out_of_grid;
      return;
    case Fate::kInRange:
      ++report.in_range;
      return;
    case Fate::kBeyondRange:
      ++report.beyond_range;
      return;
  }
}

}  // namespace

ScanPoints ScanPoints::make(Arena& arena, std::size_t capacity, LaneWidth lanes) noexcept {
  ScanPoints points;
  points.by_fours_ = lanes == LaneWidth::kWidest && has_avx2();
  points.registered_ = arena.take<ScanPoint>(capacity);
  points.thinned_ = arena.take<ScanPoint>(capacity);
  points.sort_ = arena.take<KeyedIndex>(2 * capacity);
  return points;
}

/// Asked in double first: rounding a coordinate beyond the floats would be undefined.
bool ScanPoints::begin(const Lattice& lattice, const Point3d& origin_map) noexcept {
  registered_count_ = far_count_ = 0;
  drop_all();
  if (!lattice.voxel_of(origin_map).ok()) return false;
  const Result<VoxelCoord> voxel = lattice.voxel_of(round_to_float(origin_map));
  if (!voxel.ok()) return false;
  origin_map_ = origin_map;
  origin_voxel_ = *voxel;
  return true;
}

namespace {

void label_return(const PointLabeller& labeller, std::size_t i, ScanPoint& point,
                  ScanReport& report) noexcept {
  Labelling labelling{};
  if (labeller.weighted()) {
    labelling = labeller.label_best(i, point);
    report.weighted_labels += point.has_one_label() ? 0U : 1U;
    // Only the points that are left after thinning need their other labels.
    point.label_weights = static_cast<std::uint32_t>(i);
  } else {
    labelling = labeller.label(i, point);
  }
  if (labelling == Labelling::kLabelled) return;
  ++report.unlabelled;
  report.wrong_labels += labelling == Labelling::kWrong ? 1U : 0U;
}

}  // namespace

void ScanPoints::register_returns(const Lattice& lattice, const ScanView& scan,
                                  const InferenceConfig& config, std::uint8_t unlabelled,
                                  ScanWork& work, ScanReport& report) noexcept {
  const std::uint64_t kept = scan.count < registered_.size() ? scan.count : registered_.size();
  report.over_capacity = static_cast<std::uint32_t>(scan.count - kept);
  const Limits limits(config, lattice, origin_map_, scan);
  report.teammates = limits.teammates();
  const PointLabeller labeller(scan, unlabelled);
  const bool all = kept == scan.count;
  NextReturns next(limits, scan, by_fours_ && all ? place_returns_by_fours() : nullptr);
  unsigned hits = 0;
  for (std::uint64_t k = 0; k < kept; ++k) {
    if (k % kReturnBatch == 0 && !work.in_time()) {
      report = {.points = report.points,
                .over_capacity = report.over_capacity,
                .returns_cut = static_cast<std::uint32_t>(kept),
                .teammates = report.teammates};
      registered_count_ = far_count_ = 0;
      return;
    }
    const auto i = static_cast<std::size_t>(all ? k : k * scan.count / kept);
    const auto lane = static_cast<std::size_t>(k % NextReturns::kCount);
    if (lane == 0) hits = next.hits_from(k);
    ScanPoint& hit = registered_[registered_count_];
    hit = ScanPoint{};
    if ((hits >> lane & 1U) != 0 && next.hit_at(lane, i, hit)) {
      ++report.in_range;
      label_return(labeller, i, hit, report);
      ++registered_count_;
      continue;
    }
    ScanPoint point;
    const Fate fate = limits.place(scan, i, point);
    count_fate(fate, report);
    const bool is_ray = fate == Fate::kBeyondRange ||
                        (fate == Fate::kNoReturn && limits.traces_no_return()) ||
                        (fate == Fate::kOnTeammate && point.component == kSightEnds);
    if (is_ray && config.free_space.enabled) registered_[registered_.size() - ++far_count_] = point;
    if (fate != Fate::kInRange) continue;
    label_return(labeller, i, point, report);
    registered_[registered_count_++] = point;
  }
}

void ScanPoints::thin(const Lattice& lattice, const ScanView& scan, const InferenceConfig& config,
                      std::uint8_t unlabelled) noexcept {
  const auto thin_or_copy = [&](std::span<const ScanPoint> from, std::span<ScanPoint> to) {
    if (config.thinning_m > 0.0)
      return tessera::thin(from, lattice, config.thinning_m, unlabelled, to, sort_,
                           config.thinning_weight);
    for (std::size_t i = 0; i < from.size(); ++i) to[i] = from[i];
    return from.size();
  };
  admitted_count_ = thin_or_copy(registered_.first(registered_count_), thinned_);
  if (const PointLabeller labeller(scan, unlabelled); labeller.weighted()) {
    for (ScanPoint& point : thinned_.first(admitted_count_))
      static_cast<void>(labeller.label(point.label_weights, point));
  }
  rays_ = thinned_.subspan(admitted_count_);
  ray_count_ = thin_or_copy(registered_.last(far_count_), rays_);
  largest_weight_ = 0.0F;
  for (const ScanPoint& point : admitted())
    largest_weight_ = point.weight > largest_weight_ ? point.weight : largest_weight_;
}

std::span<const KeyedIndex> ScanPoints::in_order(int unit_edge, bool with_rays,
                                                 bool spread) noexcept {
  const AdmissionScene scene{.points = admitted(),
                             .rays = with_rays ? rays() : std::span<const ScanPoint>{},
                             .origin_map = origin_map_,
                             .origin_voxel = origin_voxel_,
                             .unit_edge = unit_edge,
                             .spread = spread};
  return order_of_admission(scene, sort_);
}

void ScanPoints::drop_refused() noexcept {
  const auto keep = [](std::span<ScanPoint> points) {
    std::size_t kept = 0;
    for (const ScanPoint& point : points) {
      if (point.component != kRefused) points[kept++] = point;
    }
    return kept;
  };
  admitted_count_ = keep(thinned_.first(admitted_count_));
  ray_count_ = keep(rays_.first(ray_count_));
}

}  // namespace tessera
