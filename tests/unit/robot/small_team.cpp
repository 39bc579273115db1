// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "small_team.hpp"

#include "tessera/map/queries.hpp"

namespace tessera {

RobotConfig small_robot_config(std::uint32_t number) {
  RobotConfig config;
  config.map = {.resolution_m = 0.2, .tuple = TuplePolicy::kCompact, .storage_bytes = 2U << 20U};
  config.inference.thinning_m = 0.2;
  config.scan = {.points = 4096, .tiles = 1024, .ray_blocks = 2048};
  config.publisher.blocks = 4096;
  config.publisher.candidates = 2048;
  config.exchange.robot = number;
  config.exchange.resolution_m = 0.2;
  config.exchange.contributions = 8;
  config.exchange.own_contributions = 3;
  config.exchange.peers = 4;
  config.global.map = config.map;
  config.global.map.max_evidence = 0.0F;
  config.global.replicas = {
      .segments = 16384, .blocks = 4096, .contributions = 8, .robot_segments = 16384};
  config.global.diffusion.iterations = 2;
  config.global.diffusion.length_m = 0.4F;
  config.global.blocks = 4096;
  config.global.sum_segments = 4096;
  config.global.staged_bytes = 1U << 20U;
  return config;
}

ClassTable small_robot_classes() {
  ClassTable classes;
  static_cast<void>(classes.add("road", {255, 0, 255}));
  static_cast<void>(classes.add("building", {255, 200, 0}));
  return classes;
}

Matrix34d shift_of(double x_m, double y_m) {
  Matrix34d shift = Matrix34d::Identity();
  shift(0, 3) = x_m;
  shift(1, 3) = y_m;
  return shift;
}

SmallRobotMemory::SmallRobotMemory(const RobotConfig& config, const RobotKeys& keys)
    : memory(Robot::required_bytes(config, small_robot_classes().num_components())) {
  Arena arena(memory.span());
  const Result<Robot*> made = Robot::make(arena, config, small_robot_classes(), keys, {});
  if (made.ok()) robot = *made;
}

StreetPart::StreetPart(int part) {
  oracle::Random random(static_cast<std::uint64_t>(part) + 1);
  for (int i = 0; i < 1500; ++i) {
    points.push_back(static_cast<float>(random.uniform(2.0, 12.0)));
    points.push_back(static_cast<float>(random.uniform(-6.0, 6.0)));
    points.push_back(static_cast<float>(random.uniform(-1.7, -1.3)));
    components.push_back(static_cast<std::uint8_t>(1 + random.below(2)));
  }
}

ScanView StreetPart::view() const {
  return {.points = points.data(),
          .stride_floats = 3,
          .count = components.size(),
          .components = components.data()};
}

int settle(Robot& robot, std::int64_t& now_us) {
  int ticks = 0;
  do {
    static_cast<void>(robot.tick(now_us += kTick_us));
    robot.finish();
  } while (++ticks <= 1000 && !robot.idle());
  return ticks;
}

std::uint64_t digest_of(const LocalMap& map) {
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  return digest(map, workspace);
}

}  // namespace tessera
