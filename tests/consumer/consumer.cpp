// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <cstdlib>

#include "tessera/base/version.hpp"
#include "tessera/map/local_map.hpp"

int main() {
  constexpr tessera::MapConfig kConfig{.storage_bytes = 1U << 20U};
  void* const memory =
      std::aligned_alloc(tessera::kArenaAlignment, tessera::required_bytes(kConfig));
  tessera::ClassTable classes;
  if (classes.add("road", {}) != tessera::Status::kOk) return 1;
  tessera::Arena arena({static_cast<std::byte*>(memory), tessera::required_bytes(kConfig)});
  const auto map = tessera::LocalMap::make(arena, kConfig, classes);
  if (!map.ok() ||
      map->query(tessera::Point3f(1.0F, 2.0F, 3.0F)).state != tessera::VoxelState::kUnknown)
    return 2;
  std::printf("tessera %s\n", tessera::kVersion);
  std::free(memory);
  return 0;
}
