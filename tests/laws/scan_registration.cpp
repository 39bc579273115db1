// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "laws/scan_registration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <sstream>

#include "oracle/label_oracle.hpp"

namespace tessera::oracle {

namespace {

using Vector3 = Eigen::Vector3d;

enum class Fate : std::uint8_t { kNonFinite, kTooNear, kBeyondRange, kOutOfGrid, kInRange };

/// What a return is by definition. Where rounding decides, more than one fate is allowed.
struct Expected {
  std::array<bool, 5> allowed{};
  Vector3 place_map = Vector3::Zero();  ///< Of the return, or of the ray's end.
  double tolerance_m = 0.0;

  void allow(Fate fate) { allowed[static_cast<std::size_t>(fate)] = true; }
};

constexpr double kRounding = 0x1p-23;
/// What is farther than this and than the range limit is no measurement: out of the grid.
constexpr double kAbsurd_m = 1e7;

Vector3 vector_of(const Return& given) {
  return {static_cast<double>(given.p_sensor[0]), static_cast<double>(given.p_sensor[1]),
          static_cast<double>(given.p_sensor[2])};
}

bool is_number(const Return& given) {
  const auto finite = [](float v) { return std::isfinite(v); };
  return std::all_of(given.p_sensor.begin(), given.p_sensor.end(), finite) &&
         given.weight >= 0.0F && given.weight <= kMaxWeight;
}

/// Whether v lies in a grid of that limit: certainly, certainly not, or within rounding.
struct Certainty {
  bool can_be_in = true;
  bool can_be_out = false;
};
Certainty in_grid(const Vector3& p, double face_m, double tolerance_m) {
  Certainty result;
  for (int i = 0; i < 3; ++i) {
    result.can_be_in =
        result.can_be_in && p[i] >= -face_m - tolerance_m && p[i] < face_m + tolerance_m;
    result.can_be_out =
        result.can_be_out || p[i] < -face_m + tolerance_m || p[i] >= face_m - tolerance_m;
  }
  return result;
}

Expected expect(const ScanCase& scan_case, const Return& given) {
  Expected expected;
  if (!is_number(given)) {
    expected.allow(Fate::kNonFinite);
    return expected;
  }
  const InferenceConfig& config = scan_case.inference;
  const Vector3 p = vector_of(given);
  const double range_m = p.norm();
  const auto min_m = static_cast<double>(config.min_range_m);
  const double max_m = config.max_range_m > 0.0F ? static_cast<double>(config.max_range_m) : 1e300;
  constexpr double kTie = 1e-12;
  if (range_m < min_m * (1.0 + kTie)) expected.allow(Fate::kTooNear);
  if (range_m < min_m * (1.0 - kTie)) return expected;
  if (range_m > kAbsurd_m) {
    expected.allow(Fate::kOutOfGrid);
    return expected;
  }
  const bool far = range_m > max_m * (1.0 + kTie);
  const bool tie = !far && range_m > max_m * (1.0 - kTie);
  const Vector3 origin = scan_case.T_map_sensor.col(3);
  const Eigen::Matrix3d R = scan_case.T_map_sensor.leftCols<3>();
  const double length_m = far ? max_m : range_m;
  const Vector3 direction = range_m > 0.0 ? Vector3(R * (p / range_m)) : Vector3::Zero();
  expected.place_map = origin + direction * length_m;
  expected.tolerance_m = kRounding * (expected.place_map.cwiseAbs().maxCoeff() + length_m) + 1e-30;
  const double voxel_m = scan_case.map.resolution_m;
  const Certainty certainty =
      in_grid(expected.place_map, scan_case.grid_limit() * voxel_m, expected.tolerance_m);
  const double reach_m = 0.5 * kBlockLimit * voxel_m;
  if (certainty.can_be_out || length_m > reach_m) expected.allow(Fate::kOutOfGrid);
  if (!certainty.can_be_in || length_m > reach_m) return expected;
  if (far || tie) expected.allow(Fate::kBeyondRange);
  if (!far) expected.allow(Fate::kInRange);
  return expected;
}

/// Registers only: carves nothing, and its kernels reach nowhere.
InferenceConfig registering(const ScanCase& scan_case) {
  InferenceConfig config = scan_case.inference;
  const bool single = config.mode == InferenceMode::kMultiEntropy && config.entropy.block_edge == 1;
  config.mode = single ? InferenceMode::kMultiEntropy : InferenceMode::kCounting;
  config.free_space.neighbour_angle_rad = 0.0F;
  config.free_space.margin_voxels = 64.0F;
  config.thinning_m = 0.0;
  config.work_budget = 0;
  return config;
}

std::string said_of(std::size_t i, const char* what) {
  std::ostringstream out;
  out << "return " << i << ' ' << what;
  return out.str();
}

/// A return that is in range, or whose ray is carved.
struct Registered {
  std::size_t i = 0;
  Point3d p_map = Point3d::Zero();
  float weight = 0.0F;
  std::uint8_t component = 0;
};

/// The returns by cells, in the order of their first returns.
std::vector<Group> grouped(const std::vector<Registered>& places, double cell_m) {
  std::vector<Group> groups;
  std::map<Voxel, std::size_t> group_of;
  for (const auto& [i, p, weight, component] : places) {
    std::size_t at = groups.size();
    if (cell_m > 0.0)
      at = group_of.emplace(cell_of({p.x(), p.y(), p.z()}, cell_m), groups.size()).first->second;
    if (at == groups.size())
      groups.push_back({.returns = {}, .weight = weight, .component = component});
    groups[at].returns.push_back(i);
    groups[at].centroid_map += p;
  }
  for (Group& group : groups) group.centroid_map /= static_cast<double>(group.returns.size());
  return groups;
}

}  // namespace

std::optional<std::string> register_scan(const ScanCase& scan_case,
                                         const std::vector<Return>& returns, Registration& into) {
  std::vector<Return> numbered = returns;
  // The weight tells which return a point is.
  for (std::size_t i = 0; i < returns.size(); ++i) {
    if (is_number(returns[i])) numbered[i].weight = static_cast<float>(i);
  }
  MapConfig map = scan_case.map;
  map.storage_bytes = std::size_t{3} << 20U;
  map.max_evidence = 0.0F;
  Mapper mapper(map, registering(scan_case), kCaseClasses,
                {.points = 64, .tiles = 2048, .ray_blocks = 2048});
  into.report = mapper.integrate(cloud_of(numbered), scan_case.T_map_sensor);
  if (into.report.pose != Status::kOk) return std::nullopt;
  if (into.report.left_out() != 0) return "a roomy integrator leaves something out";
  std::vector<std::optional<Fate>> fates(returns.size());
  std::vector<Registered> points;
  std::vector<Registered> rays;
  const auto note = [&](std::span<const ScanPoint> kept, Fate fate,
                        std::vector<Registered>& places) {
    for (const ScanPoint& point : kept) {
      const auto i = static_cast<std::size_t>(point.weight);
      fates[i] = fate;
      places.push_back({i, point.p_map.cast<double>(), returns[i].weight, point.component});
    }
  };
  note(mapper.integrator().admitted(), Fate::kInRange, points);
  note(mapper.integrator().admitted_rays(), Fate::kBeyondRange, rays);
  std::array<std::uint32_t, 5> certain{};
  std::array<std::uint32_t, 5> possible{};
  for (std::size_t i = 0; i < returns.size(); ++i) {
    const Expected expected = expect(scan_case, returns[i]);
    const auto fates_allowed = std::count(expected.allowed.begin(), expected.allowed.end(), true);
    for (std::size_t f = 0; f < 5; ++f) {
      possible[f] += expected.allowed[f] ? 1U : 0U;
      certain[f] += expected.allowed[f] && fates_allowed == 1 ? 1U : 0U;
    }
    if (fates[i] && !expected.allowed[static_cast<std::size_t>(*fates[i])])
      return said_of(i, "is registered, but by definition is not to be");
  }
  const auto place_is_wrong = [&](const Registered& at) {
    const Expected expected = expect(scan_case, returns[at.i]);
    // Written so that NaN is wrong.
    return !((at.p_map - expected.place_map).cwiseAbs().maxCoeff() <= expected.tolerance_m);
  };
  for (const auto* places : {&points, &rays}) {
    for (const auto& at : *places) {
      if (place_is_wrong(at)) return said_of(at.i, "is registered in another place");
    }
  }
  const std::array<std::uint32_t, 5> counted{into.report.non_finite, into.report.too_near,
                                             into.report.beyond_range, into.report.out_of_grid,
                                             static_cast<std::uint32_t>(points.size())};
  for (std::size_t f = 0; f < 5; ++f) {
    if (counted[f] < certain[f] || counted[f] > possible[f])
      return "returns are not counted by their reason: non-finite, too near, beyond range, out of "
             "grid, in range: number " +
             std::to_string(f) + ", " + std::to_string(counted[f]) + " of " +
             std::to_string(certain[f]) + " to " + std::to_string(possible[f]);
  }
  into.in_range = points.size();
  if (into.report.in_range != points.size()) return "in_range is not the returns registered";
  into.points = grouped(points, scan_case.inference.thinning_m);
  into.rays = grouped(rays, scan_case.inference.thinning_m);
  return std::nullopt;
}

bool choose_returns(std::vector<Group>& groups, std::span<const ScanPoint> kept,
                    std::vector<bool>& chosen) {
  // Of groups that are alike the next, as points keep the order of their returns.
  std::size_t next = 0;
  for (const ScanPoint& point : kept) {
    const Point3d p = point.p_map.cast<double>();
    std::size_t nearest = groups.size();
    // Subnormal floats are as far from each other as the least.
    double least = 2.0 * kRounding * p.cwiseAbs().maxCoeff() +
                   2.0 * static_cast<double>(std::numeric_limits<float>::denorm_min());
    for (std::size_t k = 0; k < groups.size(); ++k) {
      const std::size_t at = (next + k) % groups.size();
      const Group& group = groups[at];
      const bool alike = group.weight == point.weight && group.component == point.component;
      if (group.taken || (group.returns.size() == 1 && !alike)) continue;
      const double distance = (group.centroid_map - p).norm();
      const bool nearer = nearest == groups.size() ? distance <= least : distance < least;
      if (!nearer) continue;
      nearest = at;
      least = distance;
    }
    if (nearest == groups.size()) return false;
    next = nearest + 1;
    groups[nearest].taken = true;
    for (const std::size_t i : groups[nearest].returns) chosen[i] = true;
  }
  return true;
}

}  // namespace tessera::oracle
