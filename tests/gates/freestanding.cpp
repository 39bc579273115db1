// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A firmware-like program: static memory only, linked by the C compiler without the C++ library.
// Its success is that it links; it also maps one point and looks it up.
#include "tessera/inference/integrator.hpp"
#include "tessera/map/queries.hpp"

namespace {

constexpr tessera::MapConfig kMap{.storage_bytes = 1U << 20U};
constexpr tessera::ScanCapacity kCapacity{.points = 256, .tiles = 512, .ray_blocks = 2048};
constexpr tessera::InferenceConfig kInference{.free_space = {.carving = tessera::Carving::kRays}};
constexpr std::size_t kBytes =
    tessera::required_bytes(kMap) + tessera::Integrator::required_bytes(kCapacity, kInference);
static_assert(kBytes < (4U << 20U), "the whole of it fits 4 MiB");

alignas(tessera::kArenaAlignment) std::byte memory[kBytes];
tessera::LocalMap map;
tessera::Integrator integrator;
tessera::KeyedIndex workspace[8192];

}  // namespace

int main() {
  tessera::ClassTable classes;
  if (classes.add("road", {128, 64, 128}) != tessera::Status::kOk) return 1;
  tessera::Arena arena(memory);
  tessera::Result<tessera::LocalMap> made = tessera::LocalMap::make(arena, kMap, classes);
  if (!made.ok()) return 2;
  map = std::move(*made);
  tessera::Result<tessera::Integrator> inference =
      tessera::Integrator::make(arena, kInference, kCapacity);
  if (!inference.ok()) return 3;
  integrator = std::move(*inference);
  const float point[3] = {5.05F, 0.05F, 0.05F};
  const std::uint8_t label = 1;
  const tessera::ScanView scan{
      .points = point, .stride_floats = 3, .count = 1, .components = &label};
  if (integrator.integrate(map, scan).admitted != 1) return 4;
  if (map.query(tessera::Point3f(5.05F, 0.05F, 0.05F)).label != 1) return 5;
  return tessera::digest(map, workspace) == 0 ? 6 : 0;
}
