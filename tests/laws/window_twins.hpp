// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map with a window and one without, for laws that say that they are the same.
#pragma once

#include <catch2/catch.hpp>
#include <vector>

#include "support/digest_by_rows.hpp"
#include "support/memory_archive.hpp"
#include "tessera/map/queries.hpp"

namespace tessera::oracle {

struct Setting {
  InferenceMode mode;
  TuplePolicy tuple;
  float max_evidence;
  /// By the image, what is archived is not contradicted, so the order of scans matters.
  Carving carving = Carving::kRays;
};

/// A map with a window over an archive, and one without, that see the same scans.
struct Twins {
  Twins(const Setting& setting, const WindowConfig& config)
      : Twins(map_of(setting), inference_of(setting), test_capacity(), config) {}
  Twins(const MapConfig& map, const InferenceConfig& inference, const ScanCapacity& capacity,
        const WindowConfig& config)
      : bounded(map, inference, 5, capacity),
        whole(map, inference, 5, capacity),
        archive(bounded.map()),
        window(*MovingWindow::make(config, map.resolution_m)),
        limits(config) {}

  static MapConfig map_of(const Setting& setting) {
    MapConfig map = uncapped_map(0.1);
    map.max_evidence = setting.max_evidence;
    map.tuple = setting.tuple;
    return map;
  }
  static InferenceConfig inference_of(const Setting& setting) {
    InferenceConfig config;
    config.mode = setting.mode;
    config.free_space.carving = setting.carving;
    config.max_range_m = 3.5F;
    config.thinning_m = 0.1;
    return config;
  }

  /// A step without a scan.
  WindowStep stand(double x) {
    return window.step(bounded.map(), {x, 0, 0.3}, archive.interface());
  }
  WindowStep drive(const Cloud& cloud, double x, double y) {
    Matrix34d T_map_sensor = Matrix34d::Identity();
    T_map_sensor.col(3) = Point3d(x, y, 0.3);
    const WindowStep step = window.step(bounded.map(), T_map_sensor.col(3), archive.interface());
    REQUIRE(step.position == Status::kOk);
    // Rounds of the index and blocks that leave: of the far ones, and again of near ones.
    const std::uint32_t rounds = limits.evicts_near ? 6 : 1;
    CHECK(step.entries <= rounds * (limits.entries_per_step + 7));
    CHECK(step.evicted <= limits.pressed_evictions_per_step * (limits.evicts_near ? 2 : 1));
    if (!limits.evicts_near)
      CHECK(step.evicted + step.evictions_refused <= limits.pressed_evictions_per_step);
    CHECK(step.regions <= limits.regions_per_step);
    CHECK(step.reloaded + step.reloads_failed <= limits.reloads_per_step);
    REQUIRE(bounded.integrate(cloud, T_map_sensor).left_out() == 0);
    REQUIRE(whole.integrate(cloud, T_map_sensor).left_out() == 0);
    return step;
  }

  Mapper bounded;
  Mapper whole;
  MemoryArchive archive;
  MovingWindow window;
  WindowConfig limits;
};

/// Of counts and passes: centroids begin anew where a block has left the memory, and are joined
/// when it comes back.
inline std::uint64_t digest_of(const LocalMap& map) { return digest_by_rows(map); }

/// All of window and archive in the map.
inline void gather(Twins& twins) {
  for (const std::uint64_t key : twins.archive.keys())
    REQUIRE(twins.archive.reload(twins.bounded.map(), BlockKey{key}) == Status::kOk);
}

inline double total_evidence(const LocalMap& map) {
  double total = 0.0;
  for (const auto& [voxel, evidence] : observed_voxels(map)) total += evidence.total();
  return total;
}

}  // namespace tessera::oracle
