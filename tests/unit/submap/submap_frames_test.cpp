// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/submap/submap_frames.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "support/aligned_memory.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {
namespace {

Matrix34d at(double x_m, double y_m) {
  Matrix34d T = Matrix34d::Identity();
  T(0, 3) = x_m;
  T(1, 3) = y_m;
  return T;
}

/// A quarter of a turn to the left, then a shift.
Matrix34d turned(double x_m, double y_m) {
  Matrix34d T = at(x_m, y_m);
  T.leftCols<3>() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  return T;
}

struct Held {
  explicit Held(std::uint32_t submaps, std::uint32_t first = 0)
      : memory(SubmapFrames::required_bytes(submaps)) {
    Arena arena(memory.span());
    frames = *SubmapFrames::make(arena, submaps, first);
  }
  AlignedMemory memory;
  SubmapFrames frames;
};

struct Trajectory {
  void add(std::int64_t stamp_us, const Matrix34d& T) {
    stamps_us.push_back(stamp_us);
    for (int k = 0; k < 12; ++k) numbers.push_back(T(k / 4, k % 4));
  }
  [[nodiscard]] CorrectedTrajectory view() const { return {stamps_us, numbers}; }
  std::vector<std::int64_t> stamps_us;
  std::vector<double> numbers;
};

TEST_CASE("SubmapFrames: of thousands of scans those that are kept are spread over all") {
  constexpr int kScans = 5000;
  // A trajectory that bends at a place moves the submap by what its part beyond is worth.
  for (const int bend : {500, 2500, 4500}) {
    Trajectory bent;
    bent.add(0, at(0.0, 0.0));
    bent.add(bend, at(0.01 * bend, 0.0));
    bent.add(bend + 1, at(0.01 * bend + 0.01, 4.0));
    bent.add(kScans, at(0.01 * kScans, 4.0));
    Held held(1);
    for (int i = 0; i < kScans; ++i) held.frames.note(0, i, at(0.01 * i, 0.0));
    REQUIRE(held.frames.correct(bent.view(), 1).moved == 1);
    const double expected = 4.0 * (kScans - bend) / kScans;
    CHECK(held.frames.frame(0)(1, 3) == Approx(expected).margin(0.4));
  }
}

TEST_CASE("SubmapFrames: a trajectory is read between its poses, behind its end and before it") {
  Held held(8);
  SubmapFrames& frames = held.frames;
  for (std::uint32_t submap = 0; submap < 5; ++submap) {
    if (submap != 0) REQUIRE(frames.begin(frames.frame(frames.last())) == Status::kOk);
    for (int i = 0; i < 4; ++i) {
      const double x_m = 10.0 * submap + 2.5 * i;
      frames.note(submap, static_cast<std::int64_t>(1000 * x_m), at(x_m, 0.0));
    }
  }
  // It turns all about the origin, and has poses at 10 and 29 alone.
  Trajectory corrected;
  for (const double x_m : {10.0, 29.0})
    corrected.add(static_cast<std::int64_t>(1000 * x_m), product(turned(3.0, 0.0), at(x_m, 0.0)));
  const CorrectionReport report = frames.correct(corrected.view(), 4);
  REQUIRE(report.status == Status::kOk);
  CHECK(report.revision == 4);
  CHECK(report.moved == 4);
  CHECK(report.residual_m < 1e-5);
  CHECK(frames.frame(0) == at(0.0, 0.0));
  CHECK_FALSE(frames.moved(0));
  for (std::uint32_t submap = 1; submap < 5; ++submap) {
    CHECK(frames.moved(submap));
    CHECK(frames.revision_of(submap) == 2);
    CHECK((frames.frame(submap) - turned(3.0, 0.0)).cwiseAbs().maxCoeff() < 1e-3);
    // Rounded before anybody uses it.
    CHECK(*round_rigid(frames.frame(submap)) == frames.frame(submap));
  }
  // The same once more moves nothing.
  CHECK(frames.correct(corrected.view(), 5).moved == 0);
  CHECK_FALSE(frames.moved(3));
}

TEST_CASE("SubmapFrames: a correction that ends before a jump leaves what is beyond it") {
  Held held(3);
  SubmapFrames& frames = held.frames;
  frames.note(0, 1, at(1.0, 0.0));
  frames.note(0, 2, at(2.0, 0.0));
  REQUIRE(frames.begin(at(0.0, 0.0), false) == Status::kOk);
  frames.note(1, 3, at(3.0, 5.0));
  REQUIRE(frames.begin(at(0.0, 0.0)) == Status::kOk);
  frames.note(2, 4, at(4.0, 5.0));
  Trajectory corrected;
  corrected.add(1, at(1.0, 5.0));
  corrected.add(2, at(2.0, 5.0));
  CHECK(frames.correct(corrected.view(), 1).moved == 1);
  CHECK(frames.frame(0) == at(0.0, 5.0));
  CHECK(frames.frame(1) == at(0.0, 0.0));
  CHECK(frames.frame(2) == at(0.0, 0.0));
}

TEST_CASE("SubmapFrames: poses that are none, out of order or of no submap are of no account") {
  Held held(1, 7);
  SubmapFrames& frames = held.frames;
  CHECK(frames.first() == 7);
  CHECK_FALSE(frames.has(6));
  CHECK_FALSE(frames.has(8));
  frames.note(7, 10, at(1.0, 0.0));
  frames.note(7, 10, at(500.0, 0.0));
  frames.note(7, 9, at(500.0, 0.0));
  frames.note(6, 11, at(500.0, 0.0));
  Matrix34d mirrored = at(500.0, 0.0);
  mirrored(0, 0) = -1.0;
  frames.note(7, 11, mirrored);
  Trajectory corrected;
  corrected.add(10, at(3.0, 0.0));
  CHECK(frames.correct(corrected.view(), 1).most_m == Approx(2.0));
  CHECK(frames.begin(at(0.0, 0.0)) == Status::kResourceExhausted);
  CHECK(frames.set(8, at(0.0, 0.0)) == Status::kInvalidArgument);
  CHECK(frames.set(7, mirrored) == Status::kInvalidArgument);
  CHECK(frames.set(7, at(9.0, 0.0)) == Status::kOk);
  CHECK(frames.frame(7) == at(9.0, 0.0));
}

}  // namespace
}  // namespace tessera
