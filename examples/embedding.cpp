// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The library in another program: all memory is known at compile time; integrates a scan, and
// queries the class of a voxel. docs/tasks/embedding.md quotes what follows.
#include <cstdio>

#include "tessera/inference/integrator.hpp"

using namespace tessera;

constexpr MapConfig kMap{
    .resolution_m = 0.2, .label_votes = true, .storage_bytes = std::size_t{16} << 20U};
constexpr InferenceConfig kInference{.thinning_m = 0.2};
constexpr ScanCapacity kScan{.points = 16384, .tiles = 4096, .ray_blocks = 8192};
constexpr std::size_t kBytes = required_bytes(kMap) + Integrator::required_bytes(kScan, kInference);
alignas(kArenaAlignment) std::byte memory[kBytes];

int main() {
  ClassTable classes;
  if (classes.add("road", {255, 0, 255}) != Status::kOk) return 1;
  Arena arena(memory);
  auto map = LocalMap::make(arena, kMap, classes);
  auto integrator = Integrator::make(arena, kInference, kScan);
  if (!map.ok() || !integrator.ok()) return 1;

  const float points[] = {5.0F, 0.0F, -1.7F, 6.0F, 0.5F, -1.7F};  // x y z, metres, sensor frame
  const std::uint8_t labels[] = {1, 1};                           // both are road
  const ScanReport report = integrator->integrate(
      *map, {.points = points, .stride_floats = 3, .count = 2, .components = labels});
  const Estimate here = map->query(Point3f(5.0F, 0.0F, -1.7F));
  std::printf("%u points; the voxel is %s, its label %d, with probability %.3f\n", report.admitted,
              to_string(here.state), here.label, here.probability);
}
