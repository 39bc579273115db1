// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots that look at one place, each with a frame and a clock of its own.
#pragma once

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <vector>

#include "member.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

/// A wall 12 m ahead of all robots, and before it, 8 m ahead, a box or none. All stand in one place
/// of the global frame, each in a map frame of its own.
class Watchers {
 public:
  /// The first one makes objections or none.
  explicit Watchers(int robots, bool signs = true, bool first_objects = true) {
    for (int i = 0; i < robots; ++i) {
      RobotConfig config = small_robot_config(static_cast<std::uint32_t>(i));
      config.T_global_map = shift_of(1.2 * i, -0.8 * i);
      config.inference.thinning_m = 0.0;
      config.inference.mode = InferenceMode::kCounting;
      if (i == 0 && !first_objects) config.objections = 0;
      config.exchange.contributions = 12;
      config.global.replicas.contributions = 12;
      members_.push_back(std::make_unique<Member>(config, signs));
      REQUIRE(members_.back()->one.robot != nullptr);
      // Nobody's clock is another one's.
      clocks_us_.push_back(1'000'000 + i * 3'600'000'000);
    }
  }
  [[nodiscard]] Robot& robot(int i) const { return members_[static_cast<std::size_t>(i)]->robot(); }
  ScanReport scan(int i, bool has_box) {
    std::vector<float> points;
    std::vector<std::uint8_t> components;
    for (double e = -5.0; e <= 5.0; e += 0.4) {
      for (double a = -8.0; a <= 8.0; a += 0.15) {
        const double y = std::tan(a * kRadian);
        const double z = std::tan(e * kRadian) / std::cos(a * kRadian);
        const bool is_box = has_box && std::fabs(8.0 * y) < 0.5 && std::fabs(8.0 * z) < 0.5;
        const double x = is_box ? 8.0 : 12.0;
        for (const double c : {x, x * y, x * z}) points.push_back(static_cast<float>(c));
        components.push_back(is_box ? 1 : 2);
      }
    }
    const ScanView view{
        .T_map_sensor = product(inverse(robot(i).config().T_global_map), shift_of(0.1, 0.1)),
        .points = points.data(),
        .stride_floats = 3,
        .count = components.size(),
        .components = components.data()};
    return robot(i).integrate(view, clocks_us_[static_cast<std::size_t>(i)]);
  }
  /// All tick and hear each other, for so many ticks. Each clock goes at a rate of its own.
  void talk(int ticks) {
    for (; ticks > 0; --ticks) {
      for (std::size_t i = 0; i < members_.size(); ++i) {
        clocks_us_[i] += kTick_us + static_cast<std::int64_t>(i) * 400;
        static_cast<void>(members_[i]->robot().tick(clocks_us_[i]));
      }
      for (std::size_t from = 0; from < members_.size(); ++from) {
        std::array<std::byte, kMostDatagramBytes> datagram;
        while (const std::size_t size = members_[from]->robot().send(clocks_us_[from], datagram))
          for (std::size_t to = 0; to < members_.size(); ++to)
            if (to != from)
              members_[to]->robot().receive(std::span(datagram).first(size), clocks_us_[to]);
      }
    }
    for (const auto& member : members_) member->robot().finish();
  }
  void set_back(int i, std::int64_t by_us) { clocks_us_[static_cast<std::size_t>(i)] -= by_us; }
  /// It objects to all that the others have, in the versions that it hears.
  void lie(int i) const {
    const Replicas& replicas = robot(i).global().replicas();
    for (const Replicas::Slot slot : replicas.in_order()) {
      const Replicas::Contribution& one = replicas.contribution(slot);
      if (!has_blocks(one.id)) continue;
      for (std::uint32_t number = one.first_block; number != 0;
           number = replicas.record(number).next) {
        Objection lie{.against = one.id,
                      .key = BlockKey{replicas.record(number).key},
                      .version = replicas.record(number).newest};
        lie.voxels.fill(~std::uint64_t{0});
        REQUIRE(robot(i).exchange().object(lie).ok());
      }
    }
  }
  void scan_and_talk(int i, bool has_box, int scans) {
    for (; scans > 0; --scans) {
      static_cast<void>(scan(i, has_box));
      talk(2);
    }
  }
  [[nodiscard]] VoxelState state(int i, double x, double y, double z) const {
    return robot(i)
        .global()
        .map()
        .query(Point3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)))
        .state;
  }
  /// In the global map of robot i: of the box, and of the wall behind it.
  [[nodiscard]] int box_voxels(int i) const { return occupied(i, 8.1); }
  [[nodiscard]] int wall_voxels(int i) const { return occupied(i, 12.1); }
  [[nodiscard]] bool agree() const {
    for (const auto& member : members_) {
      if (digest_of(member->robot().global().map()) != digest_of(robot(0).global().map()))
        return false;
    }
    return true;
  }

 private:
  static constexpr double kRadian = 3.14159265358979323846 / 180.0;
  [[nodiscard]] int occupied(int i, double x) const {
    int count = 0;
    for (double y = -0.7; y < 0.8; y += 0.2)
      for (double z = -0.7; z < 0.8; z += 0.2)
        for (const double at : {x - 0.2, x, x + 0.2})
          count += state(i, at, y, z) == VoxelState::kOccupied ? 1 : 0;
    return count;
  }
  std::vector<std::unique_ptr<Member>> members_;
  std::vector<std::int64_t> clocks_us_;
};

}  // namespace tessera
