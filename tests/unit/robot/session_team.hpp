// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map of an earlier day, and robots that hear each other and may load it.
#pragma once

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "member.hpp"

namespace tessera {

inline RobotConfig session_config(std::uint32_t number, std::uint32_t epoch = 1) {
  RobotConfig config = small_robot_config(number);
  config.epoch = epoch;
  config.floor = 1;
  config.exchange.session = std::uint64_t{epoch} << 32U;
  config.exchange.contributions = config.global.replicas.contributions = 40;
  config.exchange.listen_us = 0;
  config.exchange.frame_us = 100'000;
  return config;
}

/// A map of an earlier day.
struct Yesterday {
  explicit Yesterday(int part, RobotConfig config = small_robot_config(9)) : one(config) {
    for (int i = part; i < part + 3; ++i) one.robot->integrate(StreetPart(i).view(), 0);
    workspace.resize(2 * map().block_count());
    blocks = map().blocks_in_order(workspace);
    session = {.digest = digest_of(map()), .date_s = 1'764'115'200, .weight = 16384};
  }
  [[nodiscard]] const LocalMap& map() const { return one.robot->map(); }
  SmallRobotMemory one;
  std::vector<KeyedIndex> workspace;
  std::span<const KeyedIndex> blocks;
  MapSession session;
};

inline std::uint32_t load(MapSessions& sessions, const Yesterday& map) {
  const Result<std::uint32_t> number = sessions.open(map.map(), map.session, Matrix34d::Identity());
  REQUIRE(number.ok());
  for (std::size_t done = 0;;) {
    const Result<std::size_t> more = sessions.publish(*number, map.map(), map.blocks, done, 7);
    REQUIRE(more.ok());
    if (*more == 0) break;
    done += *more;
    CHECK(sessions.all().back().state == MapSessions::State::kPublishing);
  }
  return *number;
}

/// Robots that hear each other.
class TeamOfMembers {
 public:
  explicit TeamOfMembers(bool signs) : signs_(signs) {}
  Member& start(const RobotConfig& config) {
    const std::uint32_t number = config.exchange.robot;
    if (members_.size() <= number) members_.resize(number + 1);
    members_[number].reset();
    members_[number] = std::make_unique<Member>(config, signs_);
    members_[number]->robot().integrate(StreetPart(static_cast<int>(number)).view(), now_us_);
    return *members_[number];
  }
  [[nodiscard]] Member& operator[](std::size_t number) { return *members_[number]; }
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      now_us_ += kTick_us;
      for (const auto& one : members_)
        if (one) static_cast<void>(one->robot().tick(now_us_));
      for (std::size_t from = 0; from < members_.size(); ++from) tell_all(from);
    }
    for (const auto& one : members_)
      if (one) one->robot().finish();
  }
  /// Until all hold the same, and then some.
  void settle() {
    for (int i = 0; i < 60 && !agree(); ++i) run(20);
    run(40);
    REQUIRE(agree());
  }
  [[nodiscard]] bool agree() const {
    std::vector<std::uint64_t> digests;
    for (const auto& one : members_) {
      if (!one) continue;
      const ExchangeReport report = one->robot().exchange().report();
      if (report.complete != report.contributions) return false;
      digests.push_back(one->robot().exchange().digest());
    }
    return std::all_of(digests.begin(), digests.end(),
                       [&](std::uint64_t digest) { return digest == digests.front(); });
  }
  /// Of the global map, which is that of all.
  [[nodiscard]] std::uint64_t digest() {
    std::optional<std::uint64_t> digest;
    for (const auto& one : members_) {
      if (!one) continue;
      one->robot().finish();
      const std::uint64_t of_one = digest_of(one->robot().global().map());
      CHECK(of_one == digest.value_or(of_one));
      digest = of_one;
    }
    return digest.value();
  }
  /// Of a robot's sessions, as robot number holder has them.
  [[nodiscard]] std::vector<ContributionState> held(std::size_t holder, std::uint32_t robot) {
    std::vector<ContributionState> states(64);
    states.resize(members_[holder]->robot().exchange().contributions(states));
    std::vector<ContributionState> found;
    for (const ContributionState& state : states)
      if (state.id.robot == robot && MapSession::is(state.id.submap)) found.push_back(state);
    return found;
  }

 private:
  void tell_all(std::size_t from) {
    std::array<std::byte, kMostDatagramBytes> datagram{};
    if (!members_[from]) return;
    while (const std::size_t bytes = members_[from]->robot().send(now_us_, datagram))
      for (std::size_t to = 0; to < members_.size(); ++to)
        if (to != from && members_[to])
          members_[to]->robot().receive(std::span(datagram).first(bytes), now_us_);
  }
  bool signs_;
  std::vector<std::unique_ptr<Member>> members_;
  std::int64_t now_us_ = 0;
};

}  // namespace tessera
