// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A finder with memory of exactly the size that it asks for, and how far its answers are off.
#pragma once

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <numbers>

#include "support/aligned_memory.hpp"
#include "support/solid_world.hpp"
#include "tessera/frames/frame_finder.hpp"

namespace tessera {

// For the pair at hand, one pair at a time.
static_assert(FrameFinder::required_bytes() <= std::size_t{16} << 20U);

struct FinderRig {
  AlignedMemory memory{FrameFinder::required_bytes()};
  FrameFinder finder;

  FinderRig() {
    Arena arena = memory.arena();
    Result<FrameFinder> made = FrameFinder::make(arena);
    REQUIRE(made.ok());
    REQUIRE(arena.remaining_bytes() == 0);
    finder = *made;
  }
  /// Any heading, and translations up to 16 m: much faster than the whole reach.
  [[nodiscard]] static FrameQuestion nearby() {
    FrameQuestion question;
    question.reach_m = 16.0;
    return question;
  }
  FrameAnswer find(const LocalMap& a, const LocalMap& b, const FrameQuestion& question = nearby()) {
    REQUIRE(finder.begin(a, b, question) == Status::kOk);
    while (!finder.step() && finder.steps() < 100'000) continue;
    REQUIRE(finder.steps() < 100'000);
    const FrameAnswer& answer = finder.answer();
    UNSCOPED_INFO(to_string(answer.verdict)
                  << ": support " << answer.support << ", second " << answer.support_second
                  << ", agreed " << answer.agreement.agreed << ", contradicted "
                  << answer.agreement.contradicted << ", unseen " << answer.agreement.unseen
                  << ", sigma " << answer.worst_sigma_m << " m " << answer.worst_sigma_rad);
    return answer;
  }
};

/// Metres at the middle of the overlap, and degrees.
struct FrameError {
  double shift_m = 0.0;
  double turn_deg = 0.0;
};
inline FrameError error_of(const FrameAnswer& answer, const Matrix34d& T_a_b) {
  const Point3d middle_b = apply(inverse(answer.T_a_b), answer.middle_a);
  const Matrix34d between = product(inverse(T_a_b), answer.T_a_b);
  const double cosine = (between(0, 0) + between(1, 1) + between(2, 2) - 1.0) / 2.0;
  return {norm(Point3d(apply(T_a_b, middle_b) - answer.middle_a)),
          std::acos(std::min(1.0, cosine)) * 180.0 / std::numbers::pi};
}

/// Classes 1 .. 3, of which the last moves where asked.
inline ClassTable room_classes(bool things_move = false) {
  ClassTable table;
  REQUIRE(table.add("floor", {}, false) == Status::kOk);
  REQUIRE(table.add("wall", {}, false) == Status::kOk);
  REQUIRE(table.add("thing", {}, things_move) == Status::kOk);
  return table;
}

/// Most of the large hall: from one side up to so far along x.
inline WorldView left_of(double x_m, const Matrix34d& T_map_world = Matrix34d::Identity()) {
  return {{-0.5, -0.5, -0.5}, {x_m, 18.5, 3.5}, T_map_world, 0.2, false};
}
inline WorldView right_of(double x_m, const Matrix34d& T_map_world) {
  return {{x_m, -0.5, -0.5}, {30.5, 18.5, 3.5}, T_map_world, 0.2, false};
}

}  // namespace tessera
