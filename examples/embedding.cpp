// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The library in a program of one's own: all memory is known at compile time, a scan goes in, a
// voxel is asked for its class.
#include <cstdio>

#include "tessera/inference/integrator.hpp"

constexpr tessera::MapConfig kMap{.resolution_m = 0.2, .storage_bytes = std::size_t{16} << 20U};
constexpr tessera::InferenceConfig kInference{.thinning_m = 0.2F};
constexpr tessera::ScanCapacity kScan{.points = 16384, .tiles = 4096, .ray_blocks = 8192};
constexpr std::size_t kBytes =
    tessera::required_bytes(kMap) + tessera::Integrator::required_bytes(kScan, true);
alignas(tessera::kArenaAlignment) std::byte memory[kBytes];

int main() {
  tessera::ClassTable classes;
  if (classes.add("road", {255, 0, 255}) != tessera::Status::kOk) return 1;
  tessera::Arena arena(memory);
  auto map = tessera::LocalMap::make(arena, kMap, classes);
  auto integrator = tessera::Integrator::make(arena, kInference, kScan);
  if (!map.ok() || !integrator.ok()) return 1;

  const float points[] = {5.0F, 0.0F, -1.7F, 6.0F, 0.5F, -1.7F};  // x y z, metres, sensor frame
  const std::uint8_t labels[] = {1, 1};                           // both are road
  const tessera::ScanView scan{
      .points = points, .stride_floats = 3, .count = 2, .components = labels};
  const tessera::ScanReport report = integrator->integrate(*map, scan);
  const tessera::Estimate here = map->query(tessera::Point3f(5.0F, 0.0F, -1.7F));
  std::printf("%u points; the voxel is %s, its label %d, with probability %.3f\n", report.admitted,
              to_string(here.state), here.label, here.probability);
}
