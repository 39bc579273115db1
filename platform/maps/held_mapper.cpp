// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/held_mapper.hpp"

#include <string>

#include "base/monotonic_clock.hpp"

namespace tessera {

Outcome<HeldMapper> make_mapper(const MapSetup& setup, const ScanCapacity& capacity,
                                const ClassTable& classes) {
  RobotConfig config;
  config.map = setup.map;
  config.inference = setup.inference;
  config.scan = capacity;
  config.deadline_us = setup.deadline_us;
  config.window = setup.window;
  if (setup.submap_length_m > 0.0) {
    config.most_submaps = kMostSubmapsOfRobot;
    config.submap_cuts.length_m = setup.submap_length_m;
  }
  TESSERA_TRY_ASSIGN(ArenaMemory memory,
                     ArenaMemory::allocate(Mapper::required_bytes(config),
                                           "give a smaller " + Message(kMapSettings["--memory"])));
  Arena arena(memory.span());
  const Clock clock{nullptr, [](void*) { return MonotonicClock::now_us(); }};
  TESSERA_TRY_ASSIGN(const ClassTable table,
                     with_kernels(classes, setup.kernels, setup.kernels_path));
  const Result<Mapper*> mapper = Mapper::make(arena, config, table, clock);
  if (!mapper.ok())
    return Failure{std::string("the map cannot be made: ") + to_string(mapper.status())};
  return HeldMapper(std::move(memory), **mapper);
}

}  // namespace tessera
