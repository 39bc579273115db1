// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What scans cost once storage is full, beside the same scans where it is not.
#include "full_map.hpp"

#include "simulator/street_simulator.hpp"

namespace tessera::bench {

namespace {

/// The scans that are measured; those before fill the map.
constexpr std::size_t kFirstMeasured = 3;
constexpr double kResolution_m = 0.1;
constexpr float kMaxRange_m = 40.0F;
constexpr std::size_t kMuch = std::size_t{512} << 20U;

Mode mode_of(bool free_space, std::size_t storage_bytes) {
  Mode mode = free_space ? kFreeSpaceMode : kMultiEntropyMode;
  mode.max_range_m = kMaxRange_m;
  mode.storage_bytes = storage_bytes;
  return mode;
}

void fill(Mapper& mapper, const Scene& scene) {
  mapper.map().clear();
  for (std::size_t i = 0; i < kFirstMeasured; ++i) mapper.integrate(scene.scans[i]);
}

/// So much that the first scans leave no page.
Outcome<std::size_t> exactly_full(const Scene& scene, bool free_space) {
  TESSERA_TRY_ASSIGN(Mapper mapper, Mapper::make(mode_of(free_space, kMuch), scene, kResolution_m));
  mapper.map().clear();
  const std::size_t empty = mapper.map().usage().used_bytes;
  fill(mapper, scene);
  return mapper.map().usage().used_bytes - empty;
}

}  // namespace

Outcome<Json> measure_full_map(Meter& meter, const Scene& scene, const FullMapCase& full) {
  std::size_t storage_bytes = full.storage_bytes == 0 ? kMuch : full.storage_bytes;
  if (full.exactly) {
    TESSERA_TRY_ASSIGN(const std::size_t exactly, exactly_full(scene, full.free_space));
    storage_bytes = exactly;
  }
  TESSERA_TRY_ASSIGN(Mapper mapper,
                     Mapper::make(mode_of(full.free_space, storage_bytes), scene, kResolution_m));
  std::uint64_t refused = 0;
  std::uint64_t thinned = 0;
  bool right = false;
  const auto calls = static_cast<int>(scene.scans.size() - kFirstMeasured);
  meter.measure(
      full.worst, calls, [&] { fill(mapper, scene); },
      [&] {
        refused = thinned = 0;
        for (std::size_t i = kFirstMeasured; i < scene.scans.size(); ++i) {
          const ScanReport report = mapper.integrate(scene.scans[i]);
          refused += report.refused_memory();
          thinned += report.thinned;
        }
        right = full.exactly ? refused != 0 : full.storage_bytes != 0 || refused == 0;
        return fixed(right, static_cast<double>(thinned));
      });
  if (!right)
    return Failure{std::string(full.worst.name) + ": the map is not as full as it should be",
                   FailureKind::kFailure};
  return Json{{"storage_bytes", storage_bytes}, {"thinned", thinned}, {"refused", refused}};
}

Outcome<Scene> simulated_scene(int scans) {
  TESSERA_TRY_ASSIGN(const StreetSimulator street,
                     StreetSimulator::make({.robots = 2, .scans = scans}));
  Scene scene;
  scene.classes = table_of(kSimulatedClasses);
  for (int i = 0; i < scans; ++i) {
    constexpr int kSmallScanner = 1;  // of 16 beams
    const SimulatedScan seen = street.scan(kSmallScanner, i);
    Scan scan;
    for (std::size_t p = 0; p < seen.points.size(); ++p) {
      scan.points_xyzi.insert(scan.points_xyzi.end(), seen.points[p].begin(), seen.points[p].end());
      // Any class does: it is the number of them that costs.
      scan.components.push_back(static_cast<std::uint8_t>(1 + seen.labels[p] % kSimulatedClasses));
    }
    scan.T_map_sensor = street.T_map_sensor(kSmallScanner, i).matrix().topRows<3>();
    scene.max_points = std::max(scene.max_points, scan.components.size());
    scene.scans.push_back(std::move(scan));
  }
  return scene;
}

void measure_full_maps(Meter& meter) {
  const Outcome<Scene> scene = simulated_scene(6);
  constexpr const char* kCall = "Integrator::integrate";
  constexpr const char* kFormula = "points after thinning";
  const std::array<FullMapCase, 4> cases{
      {{{"scans_fit", kCall, "simulated street, scans 3 to 5 of 16 beams, 40 m, 0.1 m", kFormula},
        false},
       {{"scans_full_map", kCall, "the same, and scans 0 to 2 leave no page of storage", kFormula},
        false,
        true},
       {{"carving_scans_fit", kCall, "the same with free space, and room for all", kFormula}, true},
       {{"carving_scans_full_map", kCall,
         "the same with free space, and scans 0 to 2 leave no page of storage", kFormula},
        true,
        true}}};
  for (const FullMapCase& full : cases) {
    const Outcome<Json> done =
        scene.ok() ? measure_full_map(meter, *scene, full) : Outcome<Json>(scene.failure());
    if (!done.ok())
      meter.measure(
          full.worst, 1, [] {}, [] { return fixed(false, 1.0); });
  }
}

}  // namespace tessera::bench
