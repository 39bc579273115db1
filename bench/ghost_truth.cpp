// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "ghost_truth.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>

namespace tessera::bench {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kFarther_m = 0.3;

/// Without a label, or an outlier.
bool is_unknown(std::uint32_t id) { return id <= 1; }

Point3d point(const Scan& scan, std::size_t i) {
  const float* const p = scan.points_xyzi.data() + 4 * i;
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

/// Returns of a scan by their direction.
class Directions {
 public:
  explicit Directions(const Scan& scan) {
    for (std::size_t i = 0; i < scan.components.size(); ++i) add(point(scan, i));
  }
  /// The window around p, a point in the sensor's frame, holds a return, and all in it are farther.
  [[nodiscard]] bool sees_through(const Point3d& p) const {
    constexpr double kHalfAzimuth = 0.09 * kDegree;
    constexpr double kHalfElevation = 0.115 * kDegree;
    const Direction d = direction_of(p);
    bool any = false;
    for (int row = cell(d.elevation - kHalfElevation); row <= cell(d.elevation + kHalfElevation);
         ++row) {
      for (int column = cell(d.azimuth - kHalfAzimuth); column <= cell(d.azimuth + kHalfAzimuth);
           ++column) {
        const auto found = cells_.find(key(row, column));
        if (found == cells_.end()) continue;
        for (const Direction& other : found->second) {
          const double beside = std::remainder(other.azimuth - d.azimuth, 2.0 * std::numbers::pi);
          if (std::fabs(beside) > kHalfAzimuth ||
              std::fabs(other.elevation - d.elevation) > kHalfElevation)
            continue;
          any = true;
          if (other.range_m < d.range_m + kFarther_m) return false;
        }
      }
    }
    return any;
  }

 private:
  struct Direction {
    double azimuth = 0.0;
    double elevation = 0.0;
    double range_m = 0.0;
  };
  static constexpr int kColumns = 720;
  static int cell(double angle) { return static_cast<int>(std::floor(angle / (0.5 * kDegree))); }
  static int key(int row, int column) { return row * kColumns + (column + kColumns) % kColumns; }
  static Direction direction_of(const Point3d& p) {
    const double range_m = norm(p);
    return {std::atan2(p.y(), p.x()), std::asin(p.z() / range_m), range_m};
  }
  void add(const Point3d& p) {
    if (norm(p) < 0.5) return;
    const Direction d = direction_of(p);
    cells_[key(cell(d.elevation), cell(d.azimuth))].push_back(d);
  }
  std::unordered_map<int, std::vector<Direction>> cells_;
};

Point3d to_sensor(const Matrix34d& T_map_sensor, const Point3d& p_map) {
  return T_map_sensor.leftCols<3>().transpose() * (p_map - Point3d(T_map_sensor.col(3)));
}

std::uint64_t key_of(const VoxelCoord& voxel) {
  const auto part = [](std::int32_t v) { return static_cast<std::uint64_t>(v + (1 << 20)); };
  return part(voxel.x) << 42U | part(voxel.y) << 21U | part(voxel.z);
}

/// Judged points of a scan, without what later scans see.
std::vector<Judged> add_scan(const Scene& scene, const TrueIds& ids, std::size_t s,
                             const Lattice& lattice, Truth& truth) {
  const Scan& scan = scene.scans[s];
  std::vector<Judged> points;
  for (std::size_t i = 0; i < ids[s].size(); ++i) {
    if (norm(point(scan, i)) > kGhostRange_m) continue;
    Judged judged;
    judged.p_map = transform(scan.T_map_sensor, scan.points_xyzi.data() + 4 * i);
    judged.id = ids[s][i];
    judged.label_may_move = (scene.classes.moving() >> scan.components[i] & 1U) != 0;
    judged.judged_after = static_cast<std::uint16_t>(scene.scans.size() - 1);
    points.push_back(judged);
    Met& met = truth.voxels[key_of(*lattice.voxel_of(judged.p_map.cast<double>()))];
    met.others = met.others || (!met.scans.empty() && met.id != judged.id);
    met.moving = met.moving || is_moving(judged.id);
    met.id = judged.id;
    if (met.scans.empty() || met.scans.back() != s)
      met.scans.push_back(static_cast<std::uint16_t>(s));
  }
  return points;
}

/// Finds out which scans after s see through a point.
void look_through(const Scene& scene, const std::vector<Directions>& directions, std::size_t s,
                  int within, Judged& judged) {
  std::size_t end = scene.scans.size();
  for (std::size_t later = s + 1; later < end; ++later) {
    if (!directions[later].sees_through(
            to_sensor(scene.scans[later].T_map_sensor, judged.p_map.cast<double>())))
      continue;
    if (++judged.seen_through > 1) continue;
    judged.first_seen = static_cast<std::uint16_t>(later);
    if (within == 0) continue;
    judged.judged_after = static_cast<std::uint16_t>(later + static_cast<std::size_t>(within));
    end = std::min(end, std::size_t{judged.judged_after} + 1);
  }
}

}  // namespace

bool Met::between(int first, int last) const {
  const auto at = std::lower_bound(scans.begin(), scans.end(), first);
  return at != scans.end() && *at <= last;
}

bool Truth::met(const VoxelCoord& voxel, int first, int last) const {
  const auto found = voxels.find(key_of(voxel));
  return found != voxels.end() && found->second.between(first, last);
}

bool Truth::met_beside(const VoxelCoord& voxel, int first, int last) const {
  for (int i = 0; i < 27; ++i) {
    const VoxelCoord beside{voxel.x + i % 3 - 1, voxel.y + i / 3 % 3 - 1, voxel.z + i / 9 - 1};
    if (i != 13 && met(beside, first, last)) return true;
  }
  return false;
}

Outcome<TrueIds> read_true_ids(const std::string& dataset, int first, const Scene& scene) {
  TrueIds all;
  for (const Scan& scan : scene.scans) {
    char name[32];
    std::snprintf(name, sizeof(name), "/labels/%06d.label", first + static_cast<int>(all.size()));
    std::ifstream file(dataset + name, std::ios::binary);
    std::vector<std::uint32_t> ids;
    for (std::uint32_t value = 0; file.read(reinterpret_cast<char*>(&value), sizeof(value));)
      ids.push_back(value & 0xffffU);
    if (ids.empty()) return Failure{"cannot read " + dataset + name};
    if (ids.size() != scan.components.size()) return Failure{"labels are not those of the scans"};
    all.push_back(std::move(ids));
  }
  return all;
}

Truth truth_of(const Scene& scene, const TrueIds& ids, const Lattice& lattice, int within) {
  Truth truth;
  std::vector<Directions> directions;
  std::vector<std::vector<Judged>> points;
  for (std::size_t s = 0; s < scene.scans.size(); ++s) {
    directions.emplace_back(scene.scans[s]);
    points.push_back(add_scan(scene, ids, s, lattice, truth));
  }
  for (std::size_t s = 0; s < points.size(); ++s) {
    for (Judged judged : points[s]) {
      const Met& met = truth.voxels.at(key_of(*lattice.voxel_of(judged.p_map.cast<double>())));
      if (!is_moving(judged.id)) {
        if (!is_unknown(judged.id) && !met.moving) truth.standing.push_back(judged);
        continue;
      }
      look_through(scene, directions, s, within, judged);
      if (judged.seen_through == 0) continue;
      if (met.others) {
        ++truth.left_out;
      } else if (judged.judged_after >= scene.scans.size()) {
        ++truth.too_late;
      } else {
        truth.moving.push_back(judged);
      }
    }
  }
  return truth;
}

}  // namespace tessera::bench
