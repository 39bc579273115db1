// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What becomes of the returns of a scan when they are registered.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "placed_returns.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/inference/inference_config.hpp"
#include "tessera/inference/internal/kernel_reach.hpp"
#include "tessera/inference/internal/teammate_filter.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

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

  /// What place_returns_by_fours() needs to know. What it places is in range and as place() has it,
  /// if may_be_hit() holds.
  void begin(const ScanView& scan, PlacedReturns& returns) const noexcept {
    returns.stride = scan.stride_floats;
    for (int i = 0; i < 12; ++i) returns.pose[i] = scan.T_map_sensor(i / 4, i % 4);
    returns.resolution_m = lattice_.resolution_m();
    returns.least_square = min_square_;
    returns.above_square = body_.farthest_square_m2();
    returns.most_square = std::min(max_square_, farthest_square_);
    returns.limit = static_cast<double>(voxel_limit_);
  }
  /// Whether a return that is not too near, too far or out of the grid, or may be on the body, is
  /// in range.
  [[nodiscard]] bool may_be_hit(const ScanView& scan, std::size_t i,
                                const ScanPoint& point) const noexcept {
    return (scan.no_return == nullptr || scan.no_return[i] == 0) && point.weight >= 0.0F &&
           point.weight <= kMaxWeight &&
           !(teammates_.any() && teammates_.share_before(point.p_map).has_value());
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

/// The next returns of a scan, so many at a time as this machine has lanes for.
class NextReturns {
 public:
  static constexpr auto kCount = static_cast<std::uint64_t>(PlacedReturns::kCount);

  /// lanes: null: none are placed by these.
  NextReturns(const Limits& limits, const ScanView& scan, PlaceReturns lanes) noexcept
      : limits_(limits), scan_(scan), lanes_(lanes) {
    if (lanes_ != nullptr) limits.begin(scan, returns_);
  }
  /// Those from number first on. Returns which of them hit_at() has, a bit each; of the others some
  /// may be hits too, and Limits::place() tells what they are. O(kCount).
  [[nodiscard]] unsigned hits_from(std::uint64_t first) noexcept {
    if (lanes_ == nullptr || scan_.count - first < kCount) return 0;
    returns_.points = scan_.points + static_cast<std::size_t>(first) * scan_.stride_floats;
    lanes_(returns_);
    return returns_.is_placed;
  }
  /// False: it is none.
  [[nodiscard]] bool hit_at(std::size_t lane, std::size_t i, ScanPoint& point) const noexcept {
    point.p_map = {returns_.at[0][lane], returns_.at[1][lane], returns_.at[2][lane]};
    point.weight = scan_.weights == nullptr ? 1.0F : scan_.weights[i];
    point.voxel = {returns_.voxel[0][lane], returns_.voxel[1][lane], returns_.voxel[2][lane]};
    return limits_.may_be_hit(scan_, i, point);
  }

 private:
  const Limits& limits_;
  const ScanView& scan_;
  PlaceReturns lanes_;
  PlacedReturns returns_;
};

}  // namespace tessera
