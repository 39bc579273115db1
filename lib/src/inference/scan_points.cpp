// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/scan_points.hpp"

#include <algorithm>
#include <cmath>

#include "tessera/base/rigid.hpp"
#include "tessera/inference/internal/admission_order.hpp"
#include "tessera/inference/internal/kernel_reach.hpp"
#include "tessera/inference/internal/teammate_filter.hpp"
#include "tessera/inference/internal/thinning.hpp"
#include "tessera/registration/point_labels.hpp"

namespace tessera {

namespace {

enum class Fate : std::uint8_t {
  kNonFinite,
  kTooNear,
  kOnBody,
  kOnTeammate,
  kNoReturn,
  kOutOfGrid,
  kInRange,
  kBeyondRange
};

/// The limits that every return of a scan is compared with.
class Limits {
 public:
  /// A return beyond the range limit that is farther than this is no measurement: some drivers give
  /// FLT_MAX for "no return". What is nearer is a finite float after a pose in the grid.
  static constexpr double kFarthest_m = 1e7;

  Limits(const InferenceConfig& config, const Lattice& lattice, const Point3d& origin_map,
         const ScanView& scan) noexcept
      : lattice_(lattice),
        body_(config.body, scan.T_body_sensor),
        teammates_(scan.teammates, origin_map),
        origin_map_(origin_map),
        min_square_(squared(static_cast<double>(config.min_range_m))),
        max_m_(static_cast<double>(config.max_range_m)),
        // A tile of units of one voxel is half a block, so that tile numbers end at half the grid.
        voxel_limit_(unit_edge_of(config) == 1 ? kVoxelLimit / 2 : kVoxelLimit) {
    // So that differences of cell and tile numbers within a scan fit 21 bits an axis.
    const double cell_m = config.thinning_m;
    const double resolution_m = lattice_.resolution_m();
    const double finest_m = cell_m > 0.0 && cell_m < resolution_m ? cell_m : resolution_m;
    const double reach_m = 0.5 * kBlockLimit * finest_m;
    const bool clamps = max_m_ > 0.0 && max_m_ <= reach_m;
    max_square_ = squared(clamps ? max_m_ : reach_m);
    farthest_square_ = squared(clamps ? kFarthest_m : reach_m);
    const auto no_return_m = static_cast<double>(config.no_return_range_m);
    no_return_m_ = std::min(no_return_m, clamps ? max_m_ : reach_m);
  }

  /// Classifies return i and, if it is in range or beyond it, sets point; a return beyond the range
  /// limit is moved to that limit, one on a teammate to where its ray comes to it. Its component is
  /// kSightEnds there, and else as it is.
  [[nodiscard]] Fate place(const ScanView& scan, std::size_t i, ScanPoint& point) const noexcept {
    const float* const p_sensor = scan.points + i * scan.stride_floats;
    const Point3d p{static_cast<double>(p_sensor[0]), static_cast<double>(p_sensor[1]),
                    static_cast<double>(p_sensor[2])};
    const double square = squared_norm(p);
    if (scan.no_return != nullptr && scan.no_return[i] != 0)
      return place_no_return(scan.T_map_sensor, p, square, point);
    const float weight = scan.weights == nullptr ? 1.0F : scan.weights[i];
    // The square of a finite float does not overflow a double. Both conditions fail for NaN.
    if (!(square < 1e300) || !(weight >= 0.0F && weight <= kMaxWeight)) return Fate::kNonFinite;
    if (square < min_square_) return Fate::kTooNear;
    if (body_.holds(p, square)) return Fate::kOnBody;
    if (square > farthest_square_) return Fate::kOutOfGrid;
    const Point3f p_map = transform(scan.T_map_sensor, p_sensor);
    if (teammates_.any()) {
      if (const std::optional<double> share = teammates_.share_before(p_map))
        return place_end(p_map.cast<double>() - origin_map_, *share, weight, point);
    }
    const bool beyond = square > max_square_;
    const Result<ScanPoint> placed = place_point(lattice_, beyond ? clamped(p_map) : p_map, weight);
    if (!placed.ok() || !is_within(voxel_limit_, placed->voxel)) return Fate::kOutOfGrid;
    point = *placed;
    return beyond ? Fate::kBeyondRange : Fate::kInRange;
  }

  [[nodiscard]] std::uint32_t teammates() const noexcept { return teammates_.count(); }
  /// Directions from which nothing came back are rays.
  [[nodiscard]] bool traces_no_return() const noexcept { return no_return_m_ > 0.0; }

 private:
  /// Sets point, if there is a range for it, to the end of the ray.
  [[nodiscard]] Fate place_no_return(const Matrix34d& T_map_sensor, const Point3d& p, double square,
                                     ScanPoint& point) const noexcept {
    if (!(square > 0.0 && square < 1e300)) return Fate::kNonFinite;
    if (!traces_no_return()) return Fate::kNoReturn;
    // Of black parts of the body, and of those nearer than the sensor measures, nothing comes back.
    if (body_.is_met_by(p)) return Fate::kOnBody;
    const Point3d end = apply(T_map_sensor, p * (no_return_m_ / std::sqrt(square)));
    // Nor is what came back from a teammate missed.
    if (teammates_.any()) {
      if (const double share = teammates_.share_clear(end); share < 1.0) {
        static_cast<void>(place_end(end - origin_map_, share, 1.0F, point));
        return Fate::kNoReturn;
      }
    }
    const Result<ScanPoint> placed = place_point(lattice_, round_to_float(end));
    if (!placed.ok() || !is_within(voxel_limit_, placed->voxel)) return Fate::kOutOfGrid;
    point = *placed;
    return Fate::kNoReturn;
  }
  /// Sets point to that share of the ray, or to the range limit; if it is in the grid.
  [[nodiscard]] Fate place_end(const Point3d& ray, double share, float weight,
                               ScanPoint& point) const noexcept {
    const double length_m = share * norm(ray);
    const bool clamps = max_m_ > 0.0 && length_m > max_m_;
    const Point3d end = origin_map_ + ray * (clamps ? share * max_m_ / length_m : share);
    const Result<ScanPoint> placed = place_point(lattice_, round_to_float(end), weight, kSightEnds);
    if (placed.ok() && is_within(voxel_limit_, placed->voxel)) point = *placed;
    return Fate::kOnTeammate;
  }
  static constexpr double squared(double v) noexcept { return v * v; }
  /// The end at the range limit of the ray through p_map. Not finite if p_map is the origin.
  [[nodiscard]] Point3f clamped(const Point3f& p_map) const noexcept {
    const Point3d ray = p_map.cast<double>() - origin_map_;
    return round_to_float(origin_map_ + ray * (max_m_ / norm(ray)));
  }

  Lattice lattice_;
  BodyView body_;
  TeammateFilter teammates_;
  Point3d origin_map_;
  double min_square_;
  double max_m_;
  double max_square_ = 0.0;       ///< Beyond it a return frees space and is no hit.
  double farthest_square_ = 0.0;  ///< Beyond it a return is refused.
  double no_return_m_ = 0.0;      ///< 0: what did not come back frees nothing.
  std::int32_t voxel_limit_;
};

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

ScanPoints ScanPoints::make(Arena& arena, std::size_t capacity) noexcept {
  ScanPoints points;
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

void ScanPoints::register_returns(const Lattice& lattice, const ScanView& scan,
                                  const InferenceConfig& config, std::uint8_t unlabelled,
                                  ScanWork& work, ScanReport& report) noexcept {
  const std::uint64_t kept = scan.count < registered_.size() ? scan.count : registered_.size();
  report.over_capacity = static_cast<std::uint32_t>(scan.count - kept);
  const Limits limits(config, lattice, origin_map_, scan);
  report.teammates = limits.teammates();
  const PointLabeller labeller(scan, unlabelled);
  const bool weighted = labeller.weighted();
  for (std::uint64_t k = 0; k < kept; ++k) {
    if (k % kReturnBatch == 0 && !work.in_time()) {
      report = {.points = report.points,
                .over_capacity = report.over_capacity,
                .returns_cut = static_cast<std::uint32_t>(kept),
                .teammates = report.teammates};
      registered_count_ = far_count_ = 0;
      return;
    }
    const auto i = static_cast<std::size_t>(kept == scan.count ? k : k * scan.count / kept);
    ScanPoint point;
    const Fate fate = limits.place(scan, i, point);
    count_fate(fate, report);
    const bool is_ray = fate == Fate::kBeyondRange ||
                        (fate == Fate::kNoReturn && limits.traces_no_return()) ||
                        (fate == Fate::kOnTeammate && point.component == kSightEnds);
    if (is_ray && config.free_space.enabled) registered_[registered_.size() - ++far_count_] = point;
    if (fate != Fate::kInRange) continue;
    Labelling labelling{};
    if (weighted) {
      labelling = labeller.label_best(i, point);
      report.weighted_labels += point.has_one_label() ? 0U : 1U;
      // Only the points that are left after thinning need their other labels.
      point.label_weights = static_cast<std::uint32_t>(i);
    } else {
      labelling = labeller.label(i, point);
    }
    report.unlabelled += labelling == Labelling::kLabelled ? 0U : 1U;
    report.wrong_labels += labelling == Labelling::kWrong ? 1U : 0U;
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
