// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Ghosts and holes in the map of a sequence with true labels: of the points on moving things
// through which a later scan looks, how many are not occupied any more (DA); of all other labelled
// points, how many still are (SA). And what a scan costs with either way of carving.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <numbers>
#include <set>

#include "scenes.hpp"

namespace tessera::bench {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kRange_m = 40.0;
constexpr double kFarther_m = 0.3;

/// SemanticKITTI's ids of things that moved while they were seen.
bool is_moving(std::uint32_t id) { return id >= 252 && id <= 259; }
/// Without a label, or an outlier.
bool is_unknown(std::uint32_t id) { return id <= 1; }

/// Returns of a scan by their direction.
class Directions {
 public:
  explicit Directions(const Scan& scan) {
    for (std::size_t i = 0; i < scan.components.size(); ++i) {
      const float* const p = scan.points_xyzi.data() + 4 * i;
      add({static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
    }
  }
  /// The window around p, a point in the sensor's frame, holds a return, and all in it are farther.
  [[nodiscard]] bool sees_through(const Point3d& p) const {
    constexpr double kHalfAzimuth = 0.09 * kDegree;
    constexpr double kHalfElevation = 0.115 * kDegree;
    const Direction d = direction_of(p);
    bool any = false;
    bool all_farther = true;
    for (int row = cell(d.elevation - kHalfElevation); row <= cell(d.elevation + kHalfElevation);
         ++row) {
      for (int column = cell(d.azimuth - kHalfAzimuth); column <= cell(d.azimuth + kHalfAzimuth);
           ++column) {
        const auto found = cells_.find({row, (column + kColumns) % kColumns});
        if (found == cells_.end()) continue;
        for (const Direction& other : found->second) {
          const double beside = std::remainder(other.azimuth - d.azimuth, 2.0 * std::numbers::pi);
          if (std::fabs(beside) > kHalfAzimuth ||
              std::fabs(other.elevation - d.elevation) > kHalfElevation)
            continue;
          any = true;
          all_farther = all_farther && other.range_m >= d.range_m + kFarther_m;
        }
      }
    }
    return any && all_farther;
  }

 private:
  struct Direction {
    double azimuth = 0.0;
    double elevation = 0.0;
    double range_m = 0.0;
  };
  static constexpr int kColumns = 720;
  static int cell(double angle) { return static_cast<int>(std::floor(angle / (0.5 * kDegree))); }
  static Direction direction_of(const Point3d& p) {
    const double range_m = norm(p);
    return {std::atan2(p.y(), p.x()), std::asin(p.z() / range_m), range_m};
  }
  void add(const Point3d& p) {
    if (norm(p) < 0.5) return;
    const Direction d = direction_of(p);
    cells_[{cell(d.elevation), (cell(d.azimuth) + kColumns) % kColumns}].push_back(d);
  }
  std::map<std::pair<int, int>, std::vector<Direction>> cells_;
};

struct Judged {
  Point3d p_map;
  std::uint32_t id = 0;
  int seen_through = 0;  ///< By so many later scans.
};

struct Truth {
  std::vector<Judged> moving;
  std::vector<Judged> standing;
  std::size_t left_out = 0;  ///< On moving things, in a voxel with others.
};

Outcome<std::vector<std::uint32_t>> ids_of(const std::string& dataset, int scan) {
  char name[32];
  std::snprintf(name, sizeof(name), "/labels/%06d.label", scan);
  std::ifstream file(dataset + name, std::ios::binary);
  std::vector<std::uint32_t> ids;
  for (std::uint32_t value = 0; file.read(reinterpret_cast<char*>(&value), sizeof(value));)
    ids.push_back(value & 0xffffU);
  if (ids.empty()) return Failure{"cannot read " + dataset + name};
  return ids;
}

Point3d to_sensor(const Matrix34d& T_map_sensor, const Point3d& p_map) {
  return T_map_sensor.leftCols<3>().transpose() * (p_map - Point3d(T_map_sensor.col(3)));
}

Outcome<Truth> truth_of(const Scene& scene, const std::string& dataset, int first,
                        const Lattice& lattice) {
  std::vector<Directions> directions;
  std::vector<std::vector<Judged>> points;
  std::map<std::uint64_t, std::set<std::uint32_t>> ids_in;
  const auto voxel_of = [&](const Point3d& p) {
    const VoxelCoord voxel = *lattice.voxel_of(p);
    const auto part = [](std::int32_t v) { return static_cast<std::uint64_t>(v + (1 << 20)); };
    return part(voxel.x) << 42U | part(voxel.y) << 21U | part(voxel.z);
  };
  for (std::size_t s = 0; s < scene.scans.size(); ++s) {
    const Scan& scan = scene.scans[s];
    directions.emplace_back(scan);
    TESSERA_TRY_ASSIGN(const std::vector<std::uint32_t> ids,
                       ids_of(dataset, first + static_cast<int>(s)));
    if (ids.size() != scan.components.size()) return Failure{"labels are not those of the scans"};
    points.emplace_back();
    for (std::size_t i = 0; i < ids.size(); ++i) {
      const float* const p = scan.points_xyzi.data() + 4 * i;
      if (norm(Point3d(static_cast<double>(p[0]), static_cast<double>(p[1]),
                       static_cast<double>(p[2]))) > kRange_m)
        continue;
      const Point3d p_map = transform(scan.T_map_sensor, p).cast<double>();
      points.back().push_back({p_map, ids[i]});
      ids_in[voxel_of(p_map)].insert(ids[i]);
    }
  }
  Truth truth;
  for (std::size_t s = 0; s < points.size(); ++s) {
    for (Judged point : points[s]) {
      const std::set<std::uint32_t>& ids = ids_in[voxel_of(point.p_map)];
      if (!is_moving(point.id)) {
        const bool holds_moving = std::any_of(ids.begin(), ids.end(), is_moving);
        if (!is_unknown(point.id) && !holds_moving) truth.standing.push_back(point);
        continue;
      }
      for (std::size_t later = s + 1; later < points.size(); ++later)
        point.seen_through +=
            directions[later].sees_through(to_sensor(scene.scans[later].T_map_sensor, point.p_map))
                ? 1
                : 0;
      if (point.seen_through == 0) continue;
      if (ids.size() > 1) {
        ++truth.left_out;
      } else {
        truth.moving.push_back(point);
      }
    }
  }
  return truth;
}

struct Count {
  std::size_t occupied = 0;
  std::size_t all = 0;
  [[nodiscard]] double part() const {
    return all == 0 ? 0.0 : 100.0 * static_cast<double>(occupied) / static_cast<double>(all);
  }
};

void print_ids(const char* what, const std::map<std::uint32_t, Count>& by_id, bool occupied) {
  std::printf("    %s:", what);
  for (const auto& [id, count] : by_id) {
    const std::size_t some = occupied ? count.occupied : count.all - count.occupied;
    if (some != 0) std::printf(" %u: %zu of %zu", id, some, count.all);
  }
  std::printf("\n");
}

Outcome<void> judge(const char* name, Carving carving, const Scene& scene, const Truth& truth,
                    double resolution_m) {
  Mode mode = kFreeSpaceMode;
  mode.max_range_m = static_cast<float>(kRange_m);
  mode.carving = carving;
  TESSERA_TRY_ASSIGN(Mapper mapper, Mapper::make(mode, scene, resolution_m));
  Times times;
  for (const Scan& scan : scene.scans) {
    ScanReport report;
    times.measure([&] { report = mapper.integrate(scan); });
    if (report.pose != Status::kOk || report.left_out() > 0)
      return Failure{"a scan did not fit as a whole", FailureKind::kFailure};
  }
  const auto is_occupied = [&](const Judged& point) {
    return mapper.map().query(point.p_map.cast<float>()).state == VoxelState::kOccupied;
  };
  Count moving;
  Count twice;
  Count standing;
  std::map<std::uint32_t, Count> ghosts;
  std::map<std::uint32_t, Count> holes;
  const auto count = [](Count& into, bool occupied) {
    ++into.all;
    into.occupied += occupied ? 1 : 0;
  };
  for (const Judged& point : truth.moving) {
    const bool occupied = is_occupied(point);
    count(moving, occupied);
    count(ghosts[point.id], occupied);
    if (point.seen_through >= 2) count(twice, occupied);
  }
  for (const Judged& point : truth.standing) {
    const bool occupied = is_occupied(point);
    count(standing, occupied);
    count(holes[point.id], occupied);
  }
  const double cleared = 100.0 - moving.part();
  const double kept = standing.part();
  std::printf("| %s | %.1f | %.1f | %.2f | %.1f | %.1f |\n", name, cleared, 100.0 - twice.part(),
              kept, cleared + kept == 0.0 ? 0.0 : 2.0 * cleared * kept / (cleared + kept),
              median(times.cpu_ms));
  print_ids("still there", ghosts, true);
  print_ids("lost", holes, false);
  return {};
}

Outcome<void> compare(const std::string& dataset, int first, int last, double resolution_m) {
  TESSERA_TRY_ASSIGN(const Scene scene, load_scene(dataset, {.first = first, .last = last}));
  TESSERA_TRY_ASSIGN(const Truth truth, truth_of(scene, dataset, first, Lattice(resolution_m)));
  const auto twice = std::count_if(truth.moving.begin(), truth.moving.end(),
                                   [](const Judged& point) { return point.seen_through >= 2; });
  std::printf(
      "%zu scans; %zu points on moving things seen through, %td by two scans or more, %zu "
      "left out; %zu others\n",
      scene.scans.size(), truth.moving.size(), twice, truth.left_out, truth.standing.size());
  std::printf(
      "| carving | cleared, %% | seen through twice, %% | kept, %% | harmonic mean, %% | "
      "ms a scan, CPU |\n|---|---|---|---|---|---|\n");
  for (const Carving carving : {Carving::kRays, Carving::kImage})
    TESSERA_TRY(judge(to_string(carving), carving, scene, truth, resolution_m));
  return {};
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  CLI::App app{"Ghosts of what moved, and holes in what stands, by true labels"};
  std::string dataset;
  int first = 0;
  int last = 5;
  double resolution_m = 0.1;
  app.add_option("--dataset", dataset, "Sequence in the KITTI layout with labels and predictions")
      ->required();
  app.add_option("--first", first);
  app.add_option("--last", last);
  app.add_option("--resolution", resolution_m);
  CLI11_PARSE(app, argc, argv);
  const tessera::Outcome<void> done = tessera::bench::compare(dataset, first, last, resolution_m);
  if (done.ok()) return 0;
  std::fprintf(stderr, "%s\n", done.failure().text().c_str());
  return 1;
}
