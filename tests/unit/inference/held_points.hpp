// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Points of scans, and scratch for them, with memory of their own.
#pragma once

#include <array>
#include <vector>

#include "support/aligned_memory.hpp"
#include "tessera/inference/internal/scan_points.hpp"
#include "tessera/inference/internal/scan_scratch.hpp"

namespace tessera {

inline constexpr std::uint8_t kUnlabelledInTests = 4;

struct HeldPoints {
  explicit HeldPoints(std::size_t capacity) : memory(ScanPoints::required_bytes(capacity)) {
    Arena arena = memory.arena();
    points = ScanPoints::make(arena, capacity);
  }
  /// Registers and thins returns (x, y, z in turn), seen from the origin, all of component 1.
  ScanReport take(const Lattice& lattice, const std::vector<float>& xyz,
                  const InferenceConfig& config, ScanWork& work) {
    ScanReport report;
    ScanView view;
    view.T_map_sensor = Matrix34d::Identity();
    view.points = xyz.data();
    view.stride_floats = 3;
    view.count = xyz.size() / 3;
    const std::vector<std::uint8_t> components(xyz.size() / 3, 1);
    view.components = components.data();
    report.points = static_cast<std::uint32_t>(view.count);
    if (!points.begin(lattice, Point3d::Zero())) return report;
    points.register_returns(lattice, view, config, kUnlabelledInTests, work, report);
    points.thin(lattice, view, config, kUnlabelledInTests);
    return report;
  }

  AlignedMemory memory;
  ScanPoints points;
};

struct HeldScratch {
  explicit HeldScratch(const ScanCapacity& capacity)
      : memory(ScanTiles::required_bytes(capacity) + FreeSpace::required_bytes(capacity) +
               2 * kArenaAlignment) {
    Arena arena = memory.arena();
    scratch.tiles = *ScanTiles::make(arena, capacity);
    scratch.free_space = *FreeSpace::make(arena, capacity);
  }

  AlignedMemory memory;
  ScanScratch scratch;
};

/// Every return is a point, at any range.
inline InferenceConfig config_without_thinning() {
  InferenceConfig config;
  config.thinning_m = 0.0;
  config.min_range_m = 0.0F;
  config.max_range_m = 0.0F;
  config.free_space.carving = Carving::kRays;
  return config;
}

}  // namespace tessera
