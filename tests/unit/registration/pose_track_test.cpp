// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A track gives a pose only where it has one close before and after; what it cannot use it refuses
// and counts.
#include "tessera/registration/pose_track.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "support/aligned_memory.hpp"
#include "support/random.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {
namespace {

constexpr std::int64_t kGap_us = 100'000;

/// x metres along, turned to the left by quarters of a turn.
Matrix34d pose_at(double x, int quarters = 0) {
  Matrix34d T = Matrix34d::Identity();
  for (int i = 0; i < quarters; ++i) {
    Matrix34d quarter;
    quarter << 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0;
    T = product(quarter, T);
  }
  T(0, 3) = x;
  return T;
}

struct Track {
  explicit Track(std::size_t capacity)
      : memory(PoseTrack::required_bytes(capacity)), arena(memory.arena()) {
    Result<PoseTrack> made = PoseTrack::make(capacity, arena);
    REQUIRE(made.ok());
    track = *made;
  }
  AlignedMemory memory;
  Arena arena;
  PoseTrack track;
};

TEST_CASE("pose track: without poses no time has one") {
  Track t(4);
  CHECK(t.track.at(0, kGap_us).status() == Status::kOutOfRange);
  CHECK(t.track.size() == 0);
  CHECK(PoseTrack().at(0, kGap_us).status() == Status::kOutOfRange);
}

TEST_CASE("pose track: a stamp gives the pose as it was added, whatever the gap") {
  Track t(4);
  Matrix34d rough = pose_at(3.0);
  rough(0, 0) = 1.0 - 1e-4;  // Rigid within the tolerance; not a rotation to rounding.
  REQUIRE(t.track.add({1'000'000, pose_at(1.0)}) == Status::kOk);
  REQUIRE(t.track.add({9'000'000, rough}) == Status::kOk);
  CHECK(*t.track.at(1'000'000, 0) == pose_at(1.0));
  CHECK(*t.track.at(9'000'000, -1) == rough);
}

TEST_CASE("pose track: between two poses the translation is linear and the turn is even") {
  Track t(4);
  REQUIRE(t.track.add({1000, pose_at(1.0)}) == Status::kOk);
  REQUIRE(t.track.add({5000, pose_at(3.0, 1)}) == Status::kOk);
  const Result<Matrix34d> middle = t.track.at(3000, kGap_us);
  REQUIRE(middle.ok());
  const double half = 0.70710678118654752;
  CHECK((*middle)(0, 3) == Approx(2.0));
  CHECK((*middle)(0, 0) == Approx(half));
  CHECK((*middle)(1, 0) == Approx(half));
  CHECK((*middle)(0, 1) == Approx(-half));
}

TEST_CASE("pose track: nothing is extrapolated and no gap is bridged") {
  Track t(8);
  for (const std::int64_t stamp : {0, 50'000, 100'000, 200'001, 250'000})
    REQUIRE(t.track.add({stamp, pose_at(static_cast<double>(stamp))}) == Status::kOk);
  CHECK(t.track.at(-1, kGap_us).status() == Status::kOutOfRange);
  CHECK(t.track.at(250'001, kGap_us).status() == Status::kOutOfRange);
  CHECK(t.track.at(99'999, kGap_us).ok());
  CHECK(t.track.at(100'000, kGap_us).ok());
  CHECK(t.track.at(100'001, kGap_us).status() == Status::kOutOfRange);
  CHECK(t.track.at(200'000, kGap_us).status() == Status::kOutOfRange);
  CHECK(t.track.at(200'000, kGap_us + 1).ok());
  CHECK(t.track.at(200'001, kGap_us).ok());
  CHECK(t.track.at(75'000, -1).status() == Status::kOutOfRange);
}

TEST_CASE("pose track: equal and earlier stamps are refused and counted, and change nothing") {
  Track t(4);
  REQUIRE(t.track.add({100, pose_at(1.0)}) == Status::kOk);
  CHECK(t.track.add({100, pose_at(2.0)}) == Status::kMismatch);
  CHECK(t.track.add({99, pose_at(2.0)}) == Status::kMismatch);
  CHECK(*t.track.at(100, 0) == pose_at(1.0));
  CHECK(t.track.report().refused_not_later == 2);
  CHECK(t.track.report().added == 1);
}

TEST_CASE("pose track: what is not rigid is refused and counted") {
  Track t(4);
  Matrix34d bad = pose_at(1.0);
  bad(2, 3) = std::numeric_limits<double>::quiet_NaN();
  CHECK(t.track.add({1, bad}) == Status::kInvalidArgument);
  CHECK(t.track.add({1, Matrix34d::Zero()}) == Status::kInvalidArgument);
  CHECK(t.track.report().refused_not_rigid == 2);
  CHECK(t.track.size() == 0);
}

TEST_CASE("pose track: a full track forgets the oldest") {
  Track t(3);
  for (int i = 0; i < 10; ++i) {
    REQUIRE(t.track.add({i * 10, pose_at(i)}) == Status::kOk);
    REQUIRE(t.track.size() == static_cast<std::size_t>(std::min(i + 1, 3)));
    REQUIRE(t.track.latest_us() == i * 10);
    REQUIRE(t.track.oldest_us() == std::max(0, i - 2) * 10);
    for (std::size_t k = 0; k + 1 < t.track.size(); ++k)
      REQUIRE(t.track[k].stamp_us + 10 == t.track[k + 1].stamp_us);
  }
  CHECK(t.track.report().overwritten == 7);
  CHECK(t.track.at(69, kGap_us).status() == Status::kOutOfRange);
  CHECK((*t.track.at(75, kGap_us))(0, 3) == Approx(7.5));
}

TEST_CASE("pose track: after clear an earlier stamp is taken") {
  Track t(3);
  REQUIRE(t.track.add({1'000'000, pose_at(1.0)}) == Status::kOk);
  t.track.clear();
  CHECK(t.track.at(1'000'000, kGap_us).status() == Status::kOutOfRange);
  CHECK(t.track.add({5, pose_at(2.0)}) == Status::kOk);
  CHECK(*t.track.at(5, 0) == pose_at(2.0));
}

TEST_CASE("pose track: stamps at both ends of the number range do not overflow") {
  constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  Track t(2);
  REQUIRE(t.track.add({kLeast, pose_at(0.0)}) == Status::kOk);
  REQUIRE(t.track.add({kMost, pose_at(1.0)}) == Status::kOk);
  CHECK(t.track.at(0, kMost).status() == Status::kOutOfRange);
  CHECK(t.track.at(kLeast, 0).ok());
  CHECK(t.track.at(kMost, 0).ok());
}

TEST_CASE("pose track: the search finds what looking at every pair finds") {
  constexpr std::uint64_t kSeed = 71;
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  Track t(17);
  std::int64_t stamp = -500;
  for (int i = 0; i < 60; ++i) {
    stamp += 1 + random.below(40);
    REQUIRE(t.track.add({stamp, pose_at(random.uniform(-9, 9))}) == Status::kOk);
    for (std::int64_t at = t.track.oldest_us() - 2; at <= t.track.latest_us() + 2; ++at) {
      const Result<Matrix34d> got = t.track.at(at, 25);
      bool found = false;
      for (std::size_t k = 0; k < t.track.size(); ++k) {
        if (t.track[k].stamp_us == at) {
          found = true;
          REQUIRE(got.ok());
          REQUIRE(*got == t.track[k].T_map_body);
        }
        if (k + 1 == t.track.size()) break;
        const StampedPose& a = t.track[k];
        const StampedPose& b = t.track[k + 1];
        if (a.stamp_us >= at || b.stamp_us <= at || b.stamp_us - a.stamp_us > 25) continue;
        found = true;
        REQUIRE(got.ok());
        const double share =
            static_cast<double>(at - a.stamp_us) / static_cast<double>(b.stamp_us - a.stamp_us);
        REQUIRE((*got)(0, 3) ==
                Approx(a.T_map_body(0, 3) + share * (b.T_map_body(0, 3) - a.T_map_body(0, 3))));
      }
      REQUIRE(found == got.ok());
    }
  }
}

TEST_CASE("pose track: capacities out of range and too small an arena are refused") {
  AlignedMemory memory(PoseTrack::required_bytes(4));
  Arena none(std::span<std::byte>{});
  CHECK(PoseTrack::make(0, none).status() == Status::kInvalidArgument);
  CHECK(PoseTrack::make(PoseTrack::kMostPoses + 1, none).status() == Status::kInvalidArgument);
  CHECK(PoseTrack::make(1, none).status() == Status::kResourceExhausted);
  Arena arena = memory.arena();
  CHECK(PoseTrack::make(4, arena).ok());
  PoseTrack unmade;
  CHECK(unmade.add({1, pose_at(0.0)}) == Status::kResourceExhausted);
}

}  // namespace
}  // namespace tessera
