// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot whose memory is too small for all that others publish holds what is near it.
#include <algorithm>
#include <catch2/catch.hpp>
#include <memory>

#include "network/held.hpp"
#include "network/simulated_network.hpp"

namespace tessera::network {
namespace {

constexpr std::int64_t kSecond = 1'000'000;
constexpr std::uint32_t kSubmaps = 8;
constexpr int kBlocks = 40;             // Of a submap, in a row along y.
constexpr double kBetween_m = 30.0;     // Submaps of a robot, along x.
constexpr double kBetweenRows_m = 300;  // Robots, along y.

ReplicasConfig room(std::uint32_t segments, std::uint32_t contributions) {
  return {.segments = segments,
          .blocks = segments / 2,
          .contributions = contributions,
          .robot_segments = segments};
}

std::unique_ptr<Robot> robot(std::uint32_t number, bool signs, const ReplicasConfig& replicas,
                             std::uint32_t far = 0, std::uint32_t session = 1) {
  RobotOptions options;
  if (signs) options.key = number;
  ExchangeConfig config;
  config.contributions = replicas.contributions;
  config.contributions_per_robot = kSubmaps + 1;
  config.own_contributions = kSubmaps + 1;
  config.far_contributions = far;
  return std::make_unique<Robot>(number, session, replicas, config, options);
}

Matrix34d frame_of(std::uint32_t number, std::uint32_t submap) {
  Matrix34d T_global_map = Matrix34d::Identity();
  T_global_map(0, 3) = kBetween_m * submap;
  T_global_map(1, 3) = kBetweenRows_m * number;
  return T_global_map;
}
Point3d place_of(std::uint32_t number, std::uint32_t submap) {
  return Point3d(frame_of(number, submap).col(3)) + Point3d(0.0, 5.0, 0.0);
}

/// A robot with submaps in a row, all of them published.
std::unique_ptr<Robot> origin(std::uint32_t number, bool signs, oracle::Random& random) {
  auto made = robot(number, signs, room(1U << 16U, 64));
  for (std::uint32_t submap = 1; submap <= kSubmaps; ++submap) {
    REQUIRE(made->exchange().open(1, submap, frame_of(number, submap)) == Status::kOk);
    for (int y = 0; y < kBlocks; ++y) REQUIRE(made->publish(*pack({0, y, 0}), random, 40).ok());
  }
  return made;
}

/// What two robots hold of one contribution is the same, and not nothing.
void check_same(const Robot& one, const Robot& other, const ContributionId& id) {
  const auto of = [&](const Robot& robot) {
    const std::vector<Held> all = held(robot.replicas(), kClasses + 2);
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const Held& h) { return h.id == id; });
    return found == all.end() ? Held{} : *found;
  };
  CAPTURE(id.robot, id.submap);
  CHECK(of(one).blocks == static_cast<std::uint32_t>(kBlocks));
  CHECK(of(one).digest == of(other).digest);
}

/// For a quarter of what all publish; and for all of it, but without a place for each.
const ReplicasConfig kLittleMemory = room(1000, 64);
const ReplicasConfig kFewPlaces = room(1U << 14U, 22);

struct Fleet {
  explicit Fleet(bool signs, std::uint32_t seed, const ReplicasConfig& replicas = kLittleMemory)
      : random(oracle::announce_seed(seed)) {
    for (std::uint32_t number = 1; number <= 3; ++number)
      origins.push_back(origin(number, signs, random));
    all = robot(4, signs, room(1U << 17U, 64));
    small = robot(5, signs, replicas, 64);
  }
  void stand(std::uint32_t number, std::uint32_t submap) {
    const Point3d place = place_of(number, submap);
    small->exchange().set_reach({&place, 1}, 20.0);
  }
  void run(std::int64_t for_us, int losses_in_ten = 0) {
    std::vector<Robot*> robots{all.get(), small.get()};
    for (const auto& one : origins) robots.push_back(one.get());
    talk(robots, now_us, for_us, [&](const Robot& /*to*/, std::span<const std::byte> /*datagram*/) {
      return random.below(10) < losses_in_ten;
    });
  }
  [[nodiscard]] ExchangeReport report() const { return small->exchange().report(); }

  oracle::Random random;
  std::vector<std::unique_ptr<Robot>> origins;
  std::unique_ptr<Robot> all;    ///< It holds everything.
  std::unique_ptr<Robot> small;  ///< It cannot.
  std::int64_t now_us = 0;
};

TEST_CASE("reach: a robot holds what is near, byte for byte, and the digest of everything") {
  const bool signs = GENERATE(false, true);
  const int losses_in_ten = GENERATE(0, 3);
  const bool is_little = GENERATE(true, false);
  CAPTURE(signs, losses_in_ten, is_little);
  Fleet fleet(signs, 2101, is_little ? kLittleMemory : kFewPlaces);
  fleet.stand(2, 4);
  fleet.run(60 * kSecond, losses_in_ten);
  REQUIRE(fleet.all->exchange().report().complete == 3 * (kSubmaps + 1) + 2);
  check_same(*fleet.small, *fleet.all, {2, 1, 4});
  CHECK(fleet.small->exchange().digest() == fleet.all->exchange().digest());
  const ExchangeReport report = fleet.report();
  CHECK(report.contributions == fleet.all->exchange().report().contributions);
  CHECK(report.complete + report.far_contributions == report.contributions);
  CHECK(report.far_contributions > 6);
  CHECK(fleet.all->replicas().usage().segments > 3 * kLittleMemory.segments);

  // It drives to where another robot has been, and has that within two seconds.
  for (const auto& [number, submap] : {std::pair{1U, 8U}, {3U, 2U}, {2U, 4U}, {3U, 7U}}) {
    fleet.stand(number, submap);
    fleet.run((losses_in_ten == 0 ? 2 : 5) * kSecond, losses_in_ten);
    check_same(*fleet.small, *fleet.all, {number, 1, submap});
  }
  fleet.run(10 * kSecond, losses_in_ten);
  CHECK(fleet.small->exchange().digest() == fleet.all->exchange().digest());
}

TEST_CASE("reach: places of a route are held as what is around the robot is") {
  Fleet fleet(true, 2102);
  const std::array places{place_of(1, 1), place_of(2, 8), place_of(3, 5)};
  fleet.small->exchange().set_reach(places, 20.0);
  fleet.run(30 * kSecond);
  check_same(*fleet.small, *fleet.all, {1, 1, 1});
  check_same(*fleet.small, *fleet.all, {2, 1, 8});
  check_same(*fleet.small, *fleet.all, {3, 1, 5});
}

TEST_CASE("reach: corrections move what is far, and bring it near") {
  const bool signs = GENERATE(false, true);
  Fleet fleet(signs, 2103);
  fleet.stand(1, 1);
  fleet.run(40 * kSecond);
  REQUIRE(fleet.report().far_contributions > 6);
  const ContributionId moved{3, 1, 6};
  REQUIRE(fleet.origins[2]->exchange().move(1, 6, frame_of(1, 1)) == Status::kOk);
  fleet.run(5 * kSecond);
  check_same(*fleet.small, *fleet.all, moved);
  REQUIRE(fleet.origins[2]->exchange().move(1, 6, frame_of(3, 6)) == Status::kOk);
  REQUIRE(fleet.origins[1]->exchange().move(1, 7, frame_of(2, 6)) == Status::kOk);
  fleet.run(20 * kSecond);
  CHECK(fleet.small->exchange().digest() == fleet.all->exchange().digest());
}

TEST_CASE("reach: of what is far each newer statement is known") {
  const bool signs = GENERATE(false, true);
  Fleet fleet(signs, 2104);
  fleet.stand(1, 1);
  fleet.run(40 * kSecond);
  const std::uint64_t before = fleet.all->exchange().digest();
  for (const auto& one : fleet.origins)
    REQUIRE(one->publish(*pack({1, 3, 0}), fleet.random, 40).ok());
  fleet.run(20 * kSecond, 3);
  CHECK(fleet.all->exchange().digest() != before);
  CHECK(fleet.small->exchange().digest() == fleet.all->exchange().digest());
  // What was published beyond its extent is known of too.
  fleet.stand(3, kSubmaps);
  REQUIRE(fleet.origins[2]->publish(*pack({500, 0, 0}), fleet.random, 40).ok());
  fleet.run(10 * kSecond);
  fleet.stand(1, 1);
  fleet.run(30 * kSecond);
  const Point3d place = frame_of(3, kSubmaps).col(3) + Point3d(400.0, 0.0, 0.0);
  fleet.small->exchange().set_reach({&place, 1}, 5.0);
  fleet.run(3 * kSecond);
  const auto slot = fleet.small->replicas().find({3, 1, kSubmaps});
  REQUIRE(slot.ok());
  CHECK(fleet.small->replicas().find(*slot, *pack({500, 0, 0})) != nullptr);
}

TEST_CASE("reach: what its robot ends, or who is excluded, is not far but gone") {
  const bool signs = GENERATE(false, true);
  Fleet fleet(signs, 2105);
  fleet.stand(1, 1);
  fleet.run(40 * kSecond);
  const std::uint32_t known = fleet.report().contributions;
  REQUIRE(fleet.small->exchange().exclude(3) == Status::kOk);
  CHECK(fleet.report().contributions == known - (kSubmaps + 1));
  fleet.origins[1]->exchange().set_floor(2);
  REQUIRE(fleet.origins[1]->exchange().open(2, 0, frame_of(2, 0)) == Status::kOk);
  fleet.run(10 * kSecond);
  CHECK(fleet.report().contributions == known - 2 * (kSubmaps + 1) + 1);
}

TEST_CASE("reach: the last robot that has something keeps it, if nothing near needs the room") {
  const bool signs = GENERATE(false, true);
  Fleet fleet(signs, 2106, kFewPlaces);
  fleet.all.reset();
  std::vector<Robot*> robots{fleet.origins[0].get(), fleet.small.get()};
  const Point3d there = place_of(1, 1);
  fleet.small->exchange().set_reach({&there, 1}, 300.0);
  talk(robots, fleet.now_us, 20 * kSecond);
  const std::vector<Held> before = held(fleet.small->replicas(), kClasses + 2);
  // Robot 1 is gone. What robot 3 has does not find places beside all of this, and is far.
  robots = {fleet.small.get()};
  talk(robots, fleet.now_us, 200 * kSecond);
  const Point3d far_away = place_of(3, 8) + Point3d(500.0, 0.0, 0.0);
  fleet.small->exchange().set_reach({&far_away, 1}, 20.0);
  robots = {fleet.origins[2].get(), fleet.small.get()};
  talk(robots, fleet.now_us, 30 * kSecond);
  CHECK(fleet.report().made_far > 0);
  const std::vector<Held> after = held(fleet.small->replicas(), kClasses + 2);
  for (const Held& one : before) {
    if (one.id.robot != 1) continue;
    CAPTURE(one.id.submap);
    CHECK(std::any_of(after.begin(), after.end(), [&](const Held& other) {
      return one.id == other.id && one.digest == other.digest;
    }));
  }
}

TEST_CASE("reach: a frame that its robot did not sign moves nothing that is far") {
  Fleet fleet(true, 2107);
  fleet.stand(1, 1);
  fleet.run(40 * kSecond);
  const std::uint64_t digest = fleet.small->exchange().digest();
  // A robot with the fleet's key that signs as another one.
  RobotOptions options;
  options.key = 9;
  const auto forger = std::make_unique<Robot>(3, 7, room(1U << 12U, 16), ExchangeConfig{}, options);
  REQUIRE(forger->exchange().open(1, 6, frame_of(1, 1)) == Status::kOk);
  REQUIRE(forger->exchange().move(1, 6, frame_of(1, 2)) == Status::kOk);
  for (const auto& datagram : said(*forger, fleet.now_us, 10 * kSecond))
    fleet.small->exchange().receive(datagram, fleet.now_us);
  CHECK(fleet.report().refused_signature > 0);
  CHECK(fleet.small->exchange().digest() == digest);
}

TEST_CASE("reach: without places that matter nothing is dropped") {
  Fleet fleet(true, 2108);
  fleet.run(40 * kSecond);
  CHECK(fleet.report().made_far == 0);
  CHECK(fleet.report().far_contributions == 0);
  CHECK(fleet.report().records_refused > 0);
  CHECK(fleet.small->replicas().usage().segments > kLittleMemory.segments * 9 / 10);
}

}  // namespace
}  // namespace tessera::network
