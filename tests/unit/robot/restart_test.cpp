// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot that is started again in the middle of its submaps, and one that has heard all of it.
#include <catch2/catch.hpp>
#include <memory>
#include <numeric>
#include <vector>

#include "member.hpp"
#include "submap_course.hpp"
#include "support/small_map.hpp"
#include "tessera/map/stored_block.hpp"

namespace tessera {
namespace {

RobotConfig config_in_submaps(std::uint32_t number) {
  RobotConfig config = config_at_first(8);
  config.submap_cuts.length_m = 8.0;
  // By the image, what a scan contradicts depends on which submap has it, and so would the sums.
  config.inference.free_space.carving = Carving::kRays;
  config.exchange.robot = number;
  config.exchange.contributions = config.global.replicas.contributions = 24;
  config.exchange.contributions_per_robot = 8;
  config.exchange.listen_us = 0;
  return config;
}

/// Ticks of both, who hear each other.
void exchange(Robot& a, Robot& b, std::int64_t& now_us, int ticks) {
  std::array<std::byte, kMostDatagramBytes> datagram{};
  const auto tell = [&](Robot& from, Robot& to) {
    while (const std::size_t bytes = from.send(now_us, datagram))
      to.receive(std::span(datagram).first(bytes), now_us);
  };
  for (int i = 0; i < ticks; ++i) {
    now_us += kTick_us;
    static_cast<void>(a.tick(now_us));
    static_cast<void>(b.tick(now_us));
    tell(a, b);
    tell(b, a);
    a.finish();
    b.finish();
  }
}

void drive(Robot& robot, Robot& other, std::int64_t& now_us, int from, int to) {
  const StreetPart part(1);
  ScanView view = part.view();
  for (int step = from; step < to; ++step) {
    view.T_map_sensor = shift_of(2.0 * step, 0.0);
    robot.integrate(view, now_us);
    exchange(robot, other, now_us, 20);
  }
}

void copy_blocks(const LocalMap& from, LocalMap& to) {
  std::vector<KeyedIndex> workspace(2 * from.block_count());
  std::vector<std::byte> bytes(most_block_bytes(from.num_components()));
  for (const KeyedIndex& item : from.blocks_in_order(workspace)) {
    const std::size_t size = save_block(from, from.block_at(item.index), bytes);
    REQUIRE(restore_block(std::span(bytes).first(size), to).ok());
  }
  to.restore_revision(from.revision());
}

/// What a robot keeps over a restart, in another process of it.
std::unique_ptr<Member> restarted(Robot& before, bool signs) {
  RobotConfig config = config_in_submaps(1);
  config.epoch = 2;
  config.floor = 1;
  config.exchange.session = std::uint64_t{2} << 32U;
  config.first_submap = config.submaps_before = before.maps().number();
  auto after = std::make_unique<Member>(config, signs);
  copy_blocks(before.map(), after->robot().mapper().map());
  after->robot().mapper().resume(before.mapper().submap_note());
  const SubmapFrames& frames = before.sharer().frames();
  std::vector<SubmapFrame> saved;
  for (std::uint32_t i = frames.first(); i <= frames.last(); ++i) saved.push_back(frames.saved(i));
  REQUIRE(after->robot().sharer().restore_frames(saved, frames.revision(), true) == Status::kOk);
  return after;
}

/// The same but for when a robot publishes what has changed: a voxel that counts twice is not. Of
/// free voxels nothing but the state is published.
void check_alike(const LocalMap& a, const LocalMap& b) {
  const Content first = content_of(a);
  const Content second = content_of(b);
  REQUIRE(first.evidence.size() == second.evidence.size());
  // By how much evidence may grow before it is published again.
  const auto kFactor = static_cast<double>(PublisherConfig{}.evidence_factor);
  double total = 0.0;
  double others_total = 0.0;
  for (const auto& [voxel, counts] : first.evidence) {
    const auto other = second.evidence.find(voxel);
    REQUIRE(other != second.evidence.end());
    const double sum = std::accumulate(counts.begin() + 1, counts.end(), 0.0);
    const double others = std::accumulate(other->second.begin() + 1, other->second.end(), 0.0);
    REQUIRE(others <= kFactor * sum + 0.1);
    REQUIRE(sum <= kFactor * others + 0.1);
    total += sum;
    others_total += others;
  }
  REQUIRE(others_total == Approx(total).epsilon(0.03));
}

TEST_CASE("Restart: submaps that had ended stay as they were published, and can be corrected") {
  const bool signs = GENERATE(false, true);
  CAPTURE(signs);
  std::int64_t now_us = 0;
  Member never_ended(config_in_submaps(1), signs);
  Member alone(config_in_submaps(2), signs);
  drive(never_ended.robot(), alone.robot(), now_us, 0, 16);
  exchange(never_ended.robot(), alone.robot(), now_us, 200);

  now_us = 0;
  RobotConfig config = config_in_submaps(1);
  config.exchange.session = std::uint64_t{1} << 32U;
  auto robot = std::make_unique<Member>(config, signs);
  Member observer(config_in_submaps(2), signs);
  drive(robot->robot(), observer.robot(), now_us, 0, 11);
  REQUIRE(robot->robot().maps().number() == 2);
  std::unique_ptr<Member> again = restarted(robot->robot(), signs);
  robot.reset();
  exchange(again->robot(), observer.robot(), now_us, 400);
  CHECK(again->robot().exchange().digest() == observer.robot().exchange().digest());
  drive(again->robot(), observer.robot(), now_us, 11, 16);
  exchange(again->robot(), observer.robot(), now_us, 200);
  REQUIRE(again->robot().maps().number() == never_ended.robot().maps().number());
  CHECK(again->robot().exchange().digest() == observer.robot().exchange().digest());
  CHECK(digest_of(again->robot().global().map()) == digest_of(observer.robot().global().map()));
  // Nothing counts twice, and nothing is lost.
  check_alike(again->robot().global().map(), never_ended.robot().global().map());

  // Of the submaps of the first process, and one of the second; that ends a scan earlier or later.
  std::vector<std::uint32_t> submaps{0, 2, 3};
  std::vector<double> numbers;
  for (const double x_m : {0.4, 1.2, 1.2}) {
    const Matrix34d T = shift_of(x_m, 0.2);
    for (int k = 0; k < 12; ++k) numbers.push_back(T(k / 4, k % 4));
  }
  const std::uint64_t taken = observer.robot().exchange().report().records_taken;
  for (Robot* const moved : {&again->robot(), &never_ended.robot()})
    REQUIRE(moved->correct(CorrectedFrames{submaps, numbers}, 1).status == Status::kOk);
  CHECK(again->robot().sharer().submap().refused_frames == 0);
  exchange(again->robot(), observer.robot(), now_us, 200);
  never_ended.robot().finish();
  CHECK(observer.robot().exchange().report().records_taken == taken);
  CHECK(again->robot().exchange().digest() == observer.robot().exchange().digest());
  CHECK(digest_of(again->robot().global().map()) == digest_of(observer.robot().global().map()));
  check_alike(again->robot().global().map(), never_ended.robot().global().map());
  // Who comes later gets them where they are now.
  Member late(config_in_submaps(3), signs);
  exchange(observer.robot(), late.robot(), now_us, 400);
  CHECK(late.robot().exchange().digest() == observer.robot().exchange().digest());
  // Another start moves nothing back, though it hears of its own what others have.
  std::unique_ptr<Member> third = restarted(again->robot(), signs);
  CHECK(third->robot().sharer().frames().revision() == 1);
}

/// All blocks of a map, as an index.
std::vector<KeyedIndex> blocks_of(const LocalMap& map) {
  std::vector<KeyedIndex> blocks(2 * map.block_count());
  const std::span<const KeyedIndex> sorted = map.blocks_in_order(blocks);
  return {sorted.begin(), sorted.end()};
}

TEST_CASE("Restart: a submap that nobody has is published again, once, and moves as all do") {
  const bool signs = GENERATE(false, true);
  CAPTURE(signs);
  std::int64_t now_us = 0;
  RobotConfig config = config_in_submaps(1);
  config.exchange.session = std::uint64_t{1} << 32U;
  auto robot = std::make_unique<Member>(config, signs);
  auto nobody = std::make_unique<Member>(config_in_submaps(3), signs);
  drive(robot->robot(), *nobody->one.robot, now_us, 0, 5);
  REQUIRE(robot->robot().maps().number() == 1);
  // As it is kept in a file.
  SmallMap kept(robot->robot().map().config(), 2);
  copy_blocks(robot->robot().maps().of(0), kept.map);
  std::unique_ptr<Member> again = restarted(robot->robot(), signs);
  const std::uint64_t whole = digest_of(robot->robot().global().map());
  robot.reset();
  Member newcomer(config_in_submaps(2), signs);
  Sharer& sharer = again->robot().sharer();
  exchange(again->robot(), newcomer.robot(), now_us, 100);
  CHECK(digest_of(again->robot().global().map()) != whole);
  CHECK(sharer.is_missing(0));
  CHECK_FALSE(sharer.is_missing(1));
  CHECK_FALSE(sharer.is_missing(7));

  const std::vector<KeyedIndex> blocks = blocks_of(kept.map);
  CHECK(sharer.publish_earlier(1, kept.map, blocks, 0, 10).status() == Status::kInvalidArgument);
  for (std::size_t at = 0, done = 1; done != 0; at += done) {
    const Result<std::size_t> published = sharer.publish_earlier(0, kept.map, blocks, at, 10);
    REQUIRE(published.ok());
    done = *published;
    exchange(again->robot(), newcomer.robot(), now_us, 2);
  }
  CHECK_FALSE(sharer.is_missing(0));
  CHECK(sharer.publish_earlier(0, kept.map, blocks, 0, 10).status() == Status::kInvalidArgument);
  exchange(again->robot(), newcomer.robot(), now_us, 200);
  CHECK(again->robot().exchange().digest() == newcomer.robot().exchange().digest());
  CHECK(digest_of(newcomer.robot().global().map()) == digest_of(again->robot().global().map()));

  // Who had the earlier epoch's all along has the same evidence from both, and counts it once.
  exchange(nobody->robot(), newcomer.robot(), now_us, 400);
  exchange(nobody->robot(), again->robot(), now_us, 400);
  CHECK(again->robot().exchange().digest() == nobody->robot().exchange().digest());
  Member never_ended(config_in_submaps(1), signs);
  Member alone(config_in_submaps(2), signs);
  std::int64_t other_us = 0;
  drive(never_ended.robot(), alone.robot(), other_us, 0, 5);
  exchange(never_ended.robot(), alone.robot(), other_us, 200);
  check_alike(again->robot().global().map(), never_ended.robot().global().map());

  const std::vector<std::uint32_t> submaps{0, 1};
  std::vector<double> numbers;
  for (int k = 0; k < 24; ++k) numbers.push_back(shift_of(0.4, 0.2)(k % 12 / 4, k % 4));
  for (Robot* const moved : {&again->robot(), &never_ended.robot()})
    REQUIRE(moved->correct(CorrectedFrames{submaps, numbers}, 1).status == Status::kOk);
  exchange(again->robot(), nobody->robot(), now_us, 200);
  never_ended.robot().finish();
  CHECK(again->robot().exchange().digest() == nobody->robot().exchange().digest());
  check_alike(nobody->robot().global().map(), never_ended.robot().global().map());
}

TEST_CASE("Restart: frames that are none, or not of these submaps, are refused") {
  RobotConfig config = config_in_submaps(1);
  config.first_submap = config.submaps_before = 2;
  SmallRobotMemory one(config);
  Sharer& sharer = one.robot->sharer();
  SubmapFrame good;
  good.frame = *encode_rigid(shift_of(1.0, 0.0));
  std::vector<SubmapFrame> frames(3, good);
  CHECK(sharer.restore_frames(std::span(frames).first(2), 1, true) == Status::kInvalidArgument);
  CHECK(sharer.restore_frames(std::vector<SubmapFrame>(20, good), 1, true) ==
        Status::kResourceExhausted);
  for (const auto spoil : {+[](SubmapFrame& frame) { frame.count = SubmapFrame::kPoses + 1; },
                           +[](SubmapFrame& frame) { frame.stride = 0; },
                           +[](SubmapFrame& frame) { frame.revision = 0; },
                           +[](SubmapFrame& frame) { frame.frame.largest = 200; },
                           +[](SubmapFrame& frame) { frame.count = 2; }}) {
    std::vector<SubmapFrame> spoilt = frames;
    spoil(spoilt[1]);
    CHECK(sharer.restore_frames(spoilt, 1, true) == Status::kInvalidArgument);
  }
  CHECK(sharer.frames().first() == 2);
  REQUIRE(sharer.restore_frames(frames, 5, true) == Status::kOk);
  CHECK(sharer.frames().first() == 0);
  CHECK(sharer.frames().last() == 2);
  CHECK(sharer.frames().revision() == 5);
  CHECK(sharer.submap().revision == 5);
}

}  // namespace
}  // namespace tessera
