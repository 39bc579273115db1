// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What one who has the fleet's key, or a recording, can have another robot send or check.
#include <algorithm>

#include "network/forger.hpp"
#include "network/team.hpp"

namespace tessera::network {
namespace {

constexpr std::uint32_t kMember = 9;
constexpr std::uint64_t kSession = std::uint64_t{1} << 32U;

ExchangeConfig with_rate(std::uint32_t bytes_per_s) {
  ExchangeConfig config;
  config.bytes_per_s = bytes_per_s;
  return config;
}

/// A team whose robot 0 has said to a member all that it is to hear for now.
struct Asked : Team {
  Asked(int robots, std::uint64_t seed, std::uint32_t bytes_per_s)
      : Team(robots, seed, true, {}, with_rate(bytes_per_s)), share(bytes_per_s / 25) {}
  /// A member asks robot 0 for everything of these contributions in turn, 20 times a second.
  void ask(std::uint32_t member, const std::vector<ContributionId>& of, std::int64_t for_us) {
    for (const std::int64_t end_us = now_us() + for_us; now_us() < end_us; run(kSecond / 20)) {
      ++sequence;
      say(0, Forger::request_for_all(member, kSession, sequence, of[sequence % of.size()]));
    }
  }
  std::uint64_t share;  ///< Of the rate, of who has had everything.
  std::uint64_t sequence = 0;
};

TEST_CASE("limits: what a robot publishes earns it no answers, and earns others some") {
  const bool by_asker = GENERATE(true, false);
  Asked team(1, 530, 200'000);
  team.publish(0, 300);
  const std::vector<ContributionId> all{{0, 1, 0}};
  team.ask(kMember, all, 20 * kSecond);
  REQUIRE(team.report(0).refused_answers > 0);

  // It has these itself.
  const std::uint32_t origin = by_asker ? kMember : kMember + 1;
  Robot publishing(origin, 1, Network::default_replicas(), {}, {.key = origin});
  for (std::int32_t i = 0; i < 1000; ++i)
    REQUIRE(publishing.publish(*pack({i, 9, 0}), team.random(), 30).ok());
  std::uint64_t published = 0;
  for (const auto& datagram : said(publishing, 0, 2 * kSecond)) {
    ByteReader from(datagram);
    DatagramHeader header;
    REQUIRE(read_header(from, header));
    // What it says as a process would make the member's requests another one's.
    if (is_control(header.kind)) continue;
    team.say(0, datagram);
    published += datagram.size();
  }
  REQUIRE(team.report(0).records_taken == 1000);
  const std::uint64_t before = team.report(0).answer_bytes;
  team.ask(kMember, all, 5 * kSecond);
  const std::uint64_t answered = team.report(0).answer_bytes - before;
  if (by_asker) {
    CHECK(answered < 2 * 5 * team.share);
  } else {
    REQUIRE(published > 2 * 5 * team.share);
    CHECK(answered > published);
  }
}

/// What robot 0 has sent of frames and statements.
std::uint64_t frames_and_statements(Team& team) {
  const ExchangeReport report = team.report(0);
  return report.frames + report.statements;
}

TEST_CASE("limits: who has used up its answers gets a frame and a statement once in 8 s") {
  // Of another robot, which is gone: nothing of it goes out unasked.
  Asked team(2, 531, 5'000);
  team.publish(1, 300);
  REQUIRE(team.settle(300 * kSecond));
  team.switch_off(1);
  const std::vector<ContributionId> all{{1, 1, 0}};
  team.ask(kMember, all, 100 * kSecond);
  REQUIRE(team.report(0).refused_answers > 0);
  constexpr std::uint64_t kSeconds = 80;
  const auto sent_in = [&](auto&& run) {
    const std::uint64_t before = frames_and_statements(team);
    run();
    return frames_and_statements(team) - before;
  };
  const std::uint64_t unasked = sent_in([&] { team.run(kSeconds * kSecond); });
  const std::uint64_t sent = sent_in([&] { team.ask(kMember, all, kSeconds * kSecond); });
  CHECK(sent >= unasked + 2 * kSeconds / 8 - 2);
  // More of them, of over 200 bytes, are its share of the rate.
  CHECK(sent < unasked + 2 * kSeconds / 8 + 2 + kSeconds * team.share / 200);

  // Another one that asks has both at once.
  const std::uint64_t of_other = frames_and_statements(team);
  team.say(0, Forger::request_for_statement(kMember + 1, kSession, 1, all[0]));
  team.run(kSecond);
  CHECK(frames_and_statements(team) - of_other >= 2);
}

TEST_CASE("limits: frames and statements are answers, also to who asks for nothing else") {
  constexpr int kRobots = 8;
  Asked team(kRobots, 534, 20'000);
  for (int i = 0; i < kRobots; ++i) team.publish(i, 5);
  REQUIRE(team.settle(30 * kSecond));
  for (int i = 1; i < kRobots; ++i) team.switch_off(i);
  constexpr std::int64_t kSeconds = 60;
  const std::uint64_t quiet = team.sent_bytes();
  team.run(kSeconds * kSecond);
  const std::uint64_t unasked = team.sent_bytes() - quiet;
  const auto ask = [&](std::int64_t for_us) {
    for (const std::int64_t end_us = team.now_us() + for_us; team.now_us() < end_us;) {
      const auto of = static_cast<std::uint32_t>(++team.sequence % kRobots);
      team.say(0, Forger::request_for_statement(kMember, kSession, team.sequence, {of, 1, 0}));
      team.run(2 * kTickUs);
    }
  };
  ask(200 * kSecond);
  const std::uint64_t before = team.sent_bytes();
  ask(kSeconds * kSecond);
  const std::uint64_t caused = team.sent_bytes() - before - unasked;
  constexpr std::uint64_t kSeldom = 2 * kRobots * 300 * kSeconds / 8;
  CHECK(caused < kSeconds * team.share + kSeldom);
}

/// Datagrams of a robot's process that is over.
struct Recorded : Team {
  explicit Recorded(std::uint64_t seed) : Team(2, seed) {
    publish(1, 20);
    recorded = said(robot(1), clock_us(1, 0), 20 * kSecond);
  }
  /// Those of control messages, or the others.
  [[nodiscard]] std::vector<std::vector<std::byte>> of_control(bool wanted) const {
    std::vector<std::vector<std::byte>> chosen;
    for (const auto& datagram : recorded) {
      ByteReader from(datagram);
      DatagramHeader header;
      REQUIRE(read_header(from, header));
      if (is_control(header.kind) == wanted) chosen.push_back(datagram);
    }
    return chosen;
  }
  std::vector<std::vector<std::byte>> recorded;
};

TEST_CASE("limits: nothing of an epoch that is over is worth the check of a signature") {
  Recorded team(532);
  team.restart(1, 2);
  REQUIRE(team.settle(10 * kSecond));
  const auto data = team.of_control(false);
  const auto has = [&](DatagramKind kind) {
    return std::any_of(data.begin(), data.end(), [kind](const auto& datagram) {
      return (datagram[3] & std::byte{0x7f}) == static_cast<std::byte>(kind);
    });
  };
  REQUIRE(has(DatagramKind::kFrame));
  REQUIRE(has(DatagramKind::kStatement));
  REQUIRE(has(DatagramKind::kChunk));
  const std::uint64_t refused = team.report(0).refused_epochs;
  const std::uint64_t checks = team.robot(0).signature_checks();
  for (const auto& datagram : data) team.say(0, datagram);
  CHECK(team.robot(0).signature_checks() == checks);
  CHECK(team.report(0).refused_epochs - refused == data.size());
}

TEST_CASE("limits: recordings of an earlier process cost a number of checks, and its robot none") {
  Recorded team(533);
  team.restart(1);
  REQUIRE(team.settle(10 * kSecond));
  const auto control = team.of_control(true);
  REQUIRE_FALSE(control.empty());
  const std::uint64_t checks = team.robot(0).signature_checks();
  const std::uint64_t refused = team.report(0).refused_rate;
  constexpr std::int64_t kSeconds = 20;
  const std::int64_t begin_us = team.now_us();
  while (team.now_us() < begin_us + kSeconds * kSecond) {
    for (int i = 0; i < 20; ++i) team.say(0, control[static_cast<std::size_t>(i) % control.size()]);
    team.run(kTickUs);
    // The robot is heard all the while.
    const Peer& peer = *team.robot(0).exchange().peers().find(1);
    const Instant now = Instant::at_us(Network::clock_us(0, team.now_us()));
    REQUIRE(now - peer.heard < Duration{2 * kSecond});
  }
  CHECK(team.report(0).refused_rate - refused > 1'000);
  // 50 a second and as many at once, and a few of what robot 1 says now.
  CHECK(team.robot(0).signature_checks() - checks < 60 * (kSeconds + 1));
}

}  // namespace
}  // namespace tessera::network
