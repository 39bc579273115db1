// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots that find each other's frames over a network that loses, in virtual time.
#pragma once

#include <catch2/catch.hpp>
#include <memory>
#include <vector>

#include "small_team.hpp"
#include "support/cloud.hpp"
#include "support/solid_world.hpp"

namespace tessera {

inline constexpr std::int64_t kOneSecond_us = 1'000'000;

struct FramesTeam {
  explicit FramesTeam(std::uint64_t seed, double loss_share = 0.0)
      : random(oracle::announce_seed(seed)), loss(loss_share) {}

  static RobotConfig config_of(std::uint32_t number, FrameMode mode) {
    RobotConfig config = small_robot_config(number);
    config.map.storage_bytes = 12U << 20U;
    config.global.map.storage_bytes = 24U << 20U;
    config.global.replicas.segments = config.global.replicas.robot_segments = 1U << 17U;
    config.global.sum_segments = 1U << 16U;
    config.exchange.contributions = config.global.replicas.contributions = 32;
    config.exchange.peers = 16;
    config.publisher.staleness_us = 200'000;
    config.publisher.free_staleness_us = 200'000;
    config.budget.label_bytes = config.budget.free_bytes = 400'000;
    config.exchange.bytes_per_s = 20'000'000;
    config.exchange.burst_bytes = 2'000'000;
    config.frames.mode = mode;
    return config;
  }
  Robot& add(const RobotConfig& config) {
    memory.push_back(std::make_unique<SmallRobotMemory>(config));
    REQUIRE(memory.back()->robot != nullptr);
    p_world.push_back(Point3d::Zero());
    is_on.push_back(true);
    return *memory.back()->robot;
  }
  /// Takes the place of one that is there: a process that has started anew.
  Robot& replace(std::size_t i, const RobotConfig& config) {
    memory[i] = std::make_unique<SmallRobotMemory>(config);
    REQUIRE(memory[i]->robot != nullptr);
    return *memory[i]->robot;
  }
  [[nodiscard]] Robot& robot(std::size_t i) const { return *memory[i]->robot; }
  [[nodiscard]] const SharedFrames& frames(std::size_t i) const {
    return *robot(i).sharer().shared_frames();
  }
  [[nodiscard]] std::size_t size() const { return memory.size(); }

  /// Goes on for so long; after each tick of all, each() is called.
  template <class Each>
  void run(std::int64_t for_us, Each&& each) {
    std::array<std::byte, kMostDatagramBytes> datagram;
    for (const std::int64_t end_us = now_us + for_us; now_us < end_us; now_us += kTick_us) {
      for (std::size_t from = 0; from < size(); ++from) {
        if (!is_on[from]) continue;
        static_cast<void>(robot(from).tick(now_us));
        while (const std::size_t bytes = robot(from).send(now_us, datagram)) {
          for (std::size_t to = 0; to < size(); ++to) {
            if (to == from || !is_on[to] || random.uniform(0.0, 1.0) < loss) continue;
            robot(to).receive(std::span(datagram).first(bytes), now_us);
          }
        }
        for (int i = 0; i < spare && robot(from).fuse_in_spare_time(); ++i) continue;
      }
      each();
    }
  }
  void run(std::int64_t for_us) {
    run(for_us, [] {});
  }

  oracle::Random random;
  double loss;
  int spare = 40;  ///< Pieces of work that a robot does between two ticks.
  std::vector<std::unique_ptr<SmallRobotMemory>> memory;
  std::vector<Point3d> p_world;
  std::vector<bool> is_on;
  std::int64_t now_us = 1'000'000;
};

}  // namespace tessera
