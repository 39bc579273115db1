// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The same maps give the same transform between them, to the bit, whatever the compiler, its
// optimisation and the architecture. The digest changes only if the search does.
#include <bit>
#include <catch2/catch.hpp>

#include "support/solid_world.hpp"
#include "tessera/base/internal/digest.hpp"
#include "tessera/frames/frame_finder.hpp"

namespace tessera {
namespace {

/// The turn of a quaternion of whole numbers: no function of libm, so the same everywhere.
Matrix34d frame_by_quaternion(double a, double b, double c, double d, const Point3d& t) {
  const double n = a * a + b * b + c * c + d * d;
  Matrix34d T;
  T << (a * a + b * b - c * c - d * d) / n, 2 * (b * c - a * d) / n, 2 * (b * d + a * c) / n, t.x(),
      2 * (b * c + a * d) / n, (a * a - b * b + c * c - d * d) / n, 2 * (c * d - a * b) / n, t.y(),
      2 * (b * d - a * c) / n, 2 * (c * d + a * b) / n, (a * a - b * b - c * c + d * d) / n, t.z();
  return T;
}

ClassTable classes_of_room() {
  ClassTable table;
  for (const char* const name : {"floor", "wall", "thing"})
    REQUIRE(table.add(name, {}, false) == Status::kOk);
  return table;
}

std::uint64_t digest_of(const FrameAnswer& answer) {
  Digest digest;
  const auto add = [&](double value) { digest.add(std::bit_cast<std::uint64_t>(value)); };
  digest.add(static_cast<std::uint64_t>(answer.verdict));
  for (Eigen::Index i = 0; i < answer.T_a_b.size(); ++i) add(answer.T_a_b.data()[i]);
  for (const double value : answer.covariance) add(value);
  for (const double value : {answer.support, answer.support_second, answer.worst_sigma_m,
                             answer.worst_sigma_rad, answer.middle_a.x()})
    add(value);
  return digest.value();
}

TEST_CASE("golden digest: aligning the same maps gives the same transform on every machine") {
  struct Golden {
    Matrix34d T_b_world;
    std::uint64_t digest;
  };
  const Golden golden = GENERATE(
      Golden{frame_by_quaternion(12.0, 0.0, 0.0, 5.0, {3.0, -4.0, 0.5}), 0x89b729d3530ac219U},
      Golden{frame_by_quaternion(30.0, 1.0, -0.5, 41.0, {-31.0, 17.0, -2.0}), 0x6d6bc829b654e94fU});
  const SolidWorld hall = large_hall();
  const ClassTable classes = classes_of_room();
  const auto a = map_of(
      hall, {{-0.5, -0.5, -0.5}, {22.0, 18.5, 3.5}, Matrix34d::Identity(), 0.2, false}, classes);
  const auto b =
      map_of(hall, {{8.0, -0.5, -0.5}, {30.5, 18.5, 3.5}, golden.T_b_world, 0.2, false}, classes);
  AlignedMemory memory(FrameFinder::required_bytes());
  Arena arena = memory.arena();
  FrameFinder finder = *FrameFinder::make(arena);
  // Near the right one, for machines that are slow.
  FrameQuestion question;
  question.T_a_b_guess = inverse(golden.T_b_world);
  question.is_guess = true;
  question.reach_m = 6.0;
  question.yaw_steps = 3;
  REQUIRE(finder.begin(a->map, b->map, question) == Status::kOk);
  while (!finder.step()) continue;
  CAPTURE(digest_of(finder.answer()));
  CHECK(finder.answer().verdict == FrameVerdict::kFound);
  CHECK(digest_of(finder.answer()) == golden.digest);
}

}  // namespace
}  // namespace tessera
