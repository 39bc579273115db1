// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "submap_course.hpp"

namespace tessera {

RobotConfig config_at_first(std::uint32_t submaps) {
  RobotConfig config = small_robot_config(1);
  config.T_global_map = kFirst;
  config.most_submaps = submaps;
  return config;
}

std::uint64_t digest_by_hand(RobotConfig config, std::initializer_list<int> first, int second) {
  const ClassTable classes = small_robot_classes();
  const int components = classes.num_components();
  AlignedMemory memory(GlobalMap::required_bytes(config.global, components) +
                       Exchange::required_bytes(config.exchange, components) +
                       2 * (Mapper::required_bytes(config) +
                            Publisher::required_bytes(config.publisher, components)));
  Arena arena(memory.span());
  GlobalMap global = *GlobalMap::make(arena, config.global, classes);
  Exchange exchange =
      *Exchange::make(arena, config.exchange, store_of(global), crc_authenticator(), classes);
  for (std::uint32_t submap = 0; submap < 2; ++submap) {
    REQUIRE(exchange.open(config.epoch, submap, submap == 0 ? kFirst : kSecond) == Status::kOk);
    Mapper& mapper = **Mapper::make(arena, config, classes, {});
    Publisher publisher = *Publisher::make(arena, config.publisher, config.map, components);
    if (submap == 0) {
      for (const int part : first) mapper.integrate(StreetPart(part).view(), 0);
    } else {
      mapper.integrate(StreetPart(second).view(), 0);
    }
    for (std::int64_t tick = 0; tick < 200; ++tick)
      publisher.tick(mapper.map(), tick * kTick_us, config.budget, publication_of(exchange));
    REQUIRE(publisher.waiting() == 0);
  }
  while (global.busy()) global.step(100'000);
  return digest_of(global.map());
}

}  // namespace tessera
