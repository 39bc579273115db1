// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots that say where they are, in a fleet that signs: what goes over the network, and what is
// not believed.
#include <algorithm>

#include "network/forger.hpp"
#include "network/team.hpp"

namespace tessera::network {
namespace {

const BodyBox kBox{{-1, -0.5F, 0}, {1, 0.5F, 1.5F}};

/// Robots that drive along x, each on its own lane, and say so.
struct DrivingTeam : Team {
  explicit DrivingTeam(int robots, std::uint64_t seed, bool with_signatures = true,
                       const Link& link = {})
      : Team(robots, seed, with_signatures, link) {
    for (int i = 0; i < robots; ++i) REQUIRE(robot(i).exchange().set_body(kBox) == Status::kOk);
  }
  void drive(std::int64_t for_us, double speed_m_per_s = 4.0, const std::vector<int>& silent = {}) {
    for (std::int64_t at_us = 0; at_us < for_us; at_us += 100'000) {
      for (int i = 0; i < size(); ++i) {
        if (std::count(silent.begin(), silent.end(), i) == 0) note(i, speed_m_per_s);
      }
      run(100'000);
    }
  }
  void note(int i, double speed_m_per_s) {
    Matrix34d T = Matrix34d::Identity();
    T(0, 3) = 1e-6 * static_cast<double>(now_us()) * speed_m_per_s;
    T(1, 3) = 5.0 * i;
    const std::int64_t clock = clock_us(i, now_us());
    robot(i).exchange().note_place(T, clock, clock);
  }
  [[nodiscard]] std::size_t count(int i) {
    return robot(i).exchange().teammates().count(Instant::at_us(clock_us(i, now_us())));
  }
  [[nodiscard]] TeammatePlace place(int i, std::size_t index) {
    return *robot(i).exchange().teammates().at(index, 0.2, Instant::at_us(clock_us(i, now_us())));
  }
};

/// What the robot says within a second in which it drives.
std::vector<std::vector<std::byte>> said_in_a_second(DrivingTeam& team, double speed_m_per_s) {
  Exchange& exchange = team.robot(0).exchange();
  std::vector<std::vector<std::byte>> all;
  std::vector<std::byte> datagram(kMostDatagramBytes);
  for (std::int64_t us = 0; us < 1'000'000; us += 10'000) {
    const std::int64_t now_us = team.now_us() + us;
    Matrix34d T = Matrix34d::Identity();
    T(0, 3) = 1e-6 * static_cast<double>(now_us) * speed_m_per_s;
    exchange.note_place(T, now_us, now_us);
    while (const std::size_t size = exchange.send(now_us, datagram))
      all.emplace_back(datagram.begin(), datagram.begin() + static_cast<std::ptrdiff_t>(size));
  }
  return all;
}

}  // namespace

TEST_CASE("presence: ten datagrams of 144 bytes a second, one of them with the announcement") {
  DrivingTeam team(1, 901);
  team.drive(3 * kSecond);
  const auto all = said_in_a_second(team, 4.0);
  std::size_t alone = 0;
  std::size_t together = 0;
  for (const std::vector<std::byte>& datagram : all) {
    CHECK(kind_of(datagram) != DatagramKind::kAnnounce);
    if (kind_of(datagram) != DatagramKind::kPresence) continue;
    alone += datagram.size() == 144 ? 1U : 0U;
    together += datagram.size() > 144 ? 1U : 0U;
  }
  CHECK((alone >= 8 && alone <= 10));
  CHECK((together >= 1 && together <= 2));
  // One that stands says it in its announcements.
  DrivingTeam stands(1, 902);
  stands.drive(3 * kSecond, 0.0);
  const ExchangeReport before = stands.report(0);
  stands.drive(10 * kSecond, 0.0);
  const ExchangeReport after = stands.report(0);
  CHECK((after.presences - before.presences >= 9 && after.presences - before.presences <= 12));
  CHECK(after.announcements - before.announcements <= after.presences - before.presences + 1);
}

TEST_CASE("presence: all know where all are, over a bad network, and announcements still count") {
  const bool with_signatures = GENERATE(true, false);
  DrivingTeam team(4, 903, with_signatures, {.loss = 0.3, .jitter_us = 60'000, .duplicate = 0.1});
  for (int i = 0; i < 4; ++i) team.publish(i, 8);
  team.drive(20 * kSecond);
  CHECK(team.all_complete());
  for (int i = 0; i < 4; ++i) {
    REQUIRE(team.count(i) == 3);
    for (std::size_t k = 0; k < 3; ++k) {
      const TeammatePlace place = team.place(i, k);
      const double x_m = 4e-6 * static_cast<double>(team.now_us());
      CHECK(std::abs(place.T_map_body(0, 3) - x_m) < 0.6);
      CHECK(std::abs(place.T_map_body(0, 3) - x_m) < place.margin_m);
      CHECK(place.T_map_body(1, 3) == Approx(5.0 * place.robot).margin(0.001));
      CHECK(place.speed_m_per_s >= 4);
    }
    const ExchangeReport report = team.report(i);
    CHECK(report.refused_presences == 0);
    CHECK(report.refused_rate == 0);
    CHECK(report.refused_body == 0);
    CHECK(report.presences_taken > 3 * 100);
  }
}

TEST_CASE(
    "presence: a robot that is gone, leaves, is excluded or does not know its place is none") {
  DrivingTeam team(5, 904);
  team.drive(5 * kSecond);
  REQUIRE(team.count(0) == 4);
  team.switch_off(1);
  team.robot(2).exchange().leave();
  team.drive(20'000, 4.0, {2});
  REQUIRE(team.robot(0).exchange().exclude(3) == Status::kOk);
  CHECK(team.count(0) == 2);  // 1 was heard just now, 4 is there
  team.drive(2 * kSecond, 4.0, {2, 4});
  CHECK(team.count(0) == 0);
  team.drive(1 * kSecond, 4.0);
  CHECK(team.count(0) >= 1);
}

TEST_CASE("presence: what a robot did not sign, or signed before, moves nobody") {
  DrivingTeam team(2, 905);
  team.drive(2 * kSecond);
  REQUIRE(team.count(1) == 1);
  std::vector<std::vector<std::byte>> recorded = said_in_a_second(team, 4.0);
  std::erase_if(recorded, [](const std::vector<std::byte>& datagram) {
    return kind_of(datagram) != DatagramKind::kPresence;
  });
  REQUIRE(recorded.size() >= 9);
  for (const auto& datagram : recorded) team.say(1, datagram);
  const ExchangeReport heard = team.report(1);
  const double x_m = team.place(1, 0).T_map_body(0, 3);
  for (const auto& datagram : recorded) team.say(1, datagram);
  CHECK(team.report(1).presences_taken == heard.presences_taken);
  CHECK(team.report(1).refused_replay == heard.refused_replay + recorded.size());
  // The fleet's key is not enough.
  Forger forger(0, std::uint64_t{team.robot(0).session()} << 32U, 1'000'000);
  const auto forged = forger.datagram(DatagramKind::kPresence, [](ByteWriter& to) {
    Presence presence;
    presence.box = kBox;
    presence.T_global_body(0, 3) = 77.0;
    presence.stamp_ms = Presence::kMostStamp_ms;
    REQUIRE(write_presence(to, presence));
  });
  team.say(1, forged);
  for (std::size_t i = 32; i < 64; ++i) {
    auto changed = recorded.back();
    changed[i] ^= std::byte{1};
    Forger::seal(changed);
    team.say(1, changed);
  }
  CHECK(team.report(1).presences_taken == heard.presences_taken);
  CHECK(team.place(1, 0).T_map_body(0, 3) == x_m);
}

TEST_CASE("presence: bodies that are none are refused, and what comes with them still counts") {
  DrivingTeam team(1, 906, false);
  team.drive(1 * kSecond);
  Forger forger(9);
  const auto say = [&](auto&& change, bool is_whole = true) {
    team.say(0, forger.datagram(DatagramKind::kPresence, [&](ByteWriter& to) {
      Presence presence;
      presence.box = kBox;
      std::array<std::byte, Presence::kBytes> bytes{};
      ByteWriter body(bytes);
      REQUIRE(write_presence(body, presence));
      change(bytes);
      to.bytes(std::span(bytes).first(is_whole ? bytes.size() : bytes.size() - 1));
    }));
  };
  say([](auto&) {});
  CHECK(team.count(0) == 1);
  CHECK(team.report(0).presences_taken == 1);
  say([](auto&) {}, false);
  CHECK(team.report(0).refused_body == 1);
  say([](auto& bytes) { bytes[25] |= std::byte{0x80}; });  // A rotation's number that is none.
  CHECK(team.report(0).refused_body == 2);
  say([](auto& bytes) { bytes[26] = bytes[29]; });  // Low and high are the same.
  CHECK(team.report(0).refused_presences == 1);
  say([](auto& bytes) {
    bytes[0] |= std::byte{3};
    bytes[26] = std::byte{static_cast<std::uint8_t>(-127)};
    bytes[29] = std::byte{127};
  });
  CHECK(team.report(0).refused_presences == 2);
  CHECK(team.report(0).presences_taken == 1);
  // More than an announcement behind it is none, and neither is half of one.
  team.say(0, forger.datagram(DatagramKind::kPresence, [](ByteWriter& to) {
    Presence presence;
    presence.box = kBox;
    REQUIRE(write_presence(to, presence));
    to.u32(7);
  }));
  CHECK(team.report(0).refused_body == 3);
  CHECK(team.report(0).presences_taken == 1);
}

TEST_CASE("presence: of one robot so many signatures are checked a second, and no more") {
  DrivingTeam team(2, 907);
  team.drive(2 * kSecond);
  // One that says it a hundred times a second.
  Robot& hasty = team.robot(0);
  std::uint64_t said = 0;
  const std::uint64_t before = team.robot(1).signature_checks();
  std::vector<std::byte> datagram(kMostDatagramBytes);
  for (std::int64_t s = 1; s <= 200; ++s) {
    const std::int64_t now_us = team.now_us() + s * 100'000;
    Matrix34d T = Matrix34d::Identity();
    T(0, 3) = static_cast<double>(s);
    hasty.exchange().note_place(T, now_us, now_us);
    while (const std::size_t size = hasty.exchange().send(now_us, datagram)) {
      std::vector<std::byte> copy(datagram.begin(),
                                  datagram.begin() + static_cast<std::ptrdiff_t>(size));
      if (kind_of(copy) != DatagramKind::kPresence) continue;
      ++said;
      team.say(1, copy);  // All at one time of its clock.
    }
  }
  CHECK(said > 150);
  CHECK(team.robot(1).signature_checks() - before <= 2 * Gate::kPresencesPerSecond + 50);
  CHECK(team.report(1).refused_rate > 50);
}

}  // namespace tessera::network
