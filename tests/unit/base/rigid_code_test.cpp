// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A transform in 22 bytes: how far it is from the one that was given, that it is the same to the
// bit for whoever decodes it, and what is no code.
#include "tessera/base/rigid_code.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "support/random.hpp"
#include "tessera/base/internal/digest.hpp"
#include "tessera/base/internal/quaternion.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {
namespace {

constexpr std::uint64_t kSeed = 64;
constexpr std::uint64_t kDigest = 0xd6b92b5ec73804f8;

Matrix34d drawn(oracle::Random& random, double reach_m) {
  Quaternion q;
  for (double& part : q) part = random.uniform(-1.0, 1.0);
  normalise(q);
  return transform_of(q, {random.uniform(-reach_m, reach_m), random.uniform(-reach_m, reach_m),
                          random.uniform(-reach_m, reach_m)});
}

TEST_CASE("rigid code: no point within 200 m moves by more than 0.3 mm") {
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  double farthest_m = 0.0;
  for (int round = 0; round < 20'000; ++round) {
    const Matrix34d T = drawn(random, 5e5);
    const Matrix34d rounded = *round_rigid(T);
    Point3d p(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    p *= 200.0 / norm(p);
    farthest_m = std::max(farthest_m, norm(apply(rounded, p) - apply(T, p)));
  }
  CHECK(farthest_m < 0.0003);
  CHECK(farthest_m > 0.0001);
}

TEST_CASE("rigid code: who rounds what is rounded gets the same bits") {
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  Digest digest;
  for (int round = 0; round < 20'000; ++round) {
    const RigidCode code = *encode_rigid(drawn(random, 1000.0));
    const Matrix34d T = *decode_rigid(code);
    REQUIRE(check_rigid(T) == Status::kOk);
    REQUIRE(*encode_rigid(T) == code);
    for (const double element : T.reshaped()) digest.add(std::bit_cast<std::uint64_t>(element));
  }
  // On every machine and compiler.
  CHECK(digest.value() == kDigest);
}

TEST_CASE("rigid code: what is rounded stays, where parts are as large as each other") {
  oracle::Random random(kSeed + 1);
  for (int round = 0; round < 20'000; ++round) {
    // Quarters of a turn, thirds about a diagonal, and what is next to them.
    Quaternion q{1.0, 0.0, 0.0, 0.0};
    for (std::size_t i = 1; i < 4; ++i) q[i] = random.uniform(0.0, 1.0) < 0.5 ? 1.0 : 0.0;
    for (double& part : q) part += random.uniform(-2e-7, 2e-7);
    normalise(q);
    const Matrix34d T = *round_rigid(transform_of(q, {1.0, 2.0, 3.0}));
    REQUIRE(*round_rigid(T) == T);
  }
}

TEST_CASE("rigid code: whole turns, half turns and the identity") {
  CHECK(*round_rigid(Matrix34d::Identity()) == Matrix34d(Matrix34d::Identity()));
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      Quaternion half{};
      half[static_cast<std::size_t>(axis + 1)] = sign;
      const Matrix34d T = transform_of(half, {1.0, 2.0, 3.0});
      CHECK((*round_rigid(T) - T).cwiseAbs().maxCoeff() < 1e-12);
      Quaternion quarter{1.0, 0.0, 0.0, 0.0};
      quarter[static_cast<std::size_t>(axis + 1)] = sign;
      normalise(quarter);
      const Matrix34d Q = transform_of(quarter, {1.0, 2.0, 3.0});
      CHECK((*round_rigid(Q) - Q).cwiseAbs().maxCoeff() < 1e-6);
    }
  }
}

TEST_CASE("rigid code: what is no transform, or too far, is refused") {
  Matrix34d T = Matrix34d::Identity();
  T(0, 0) = -1.0;
  CHECK(encode_rigid(T).status() == Status::kInvalidArgument);
  for (const double far : {524'287.1, -1e12, std::nan(""), HUGE_VAL}) {
    T = Matrix34d::Identity();
    T(1, 3) = far;
    CHECK(encode_rigid(T).status() == Status::kInvalidArgument);
  }
  T = Matrix34d::Identity();
  T(2, 3) = -524'287.0;
  CHECK(round_rigid(T).ok());
}

TEST_CASE("rigid code: what encoding never gives is no code") {
  const RigidCode code = *encode_rigid(Matrix34d::Identity());
  RigidCode other = code;
  other.largest = 4;
  CHECK(decode_rigid(other).status() == Status::kCorrupt);
  for (const std::int32_t part : {5'931'643, -5'931'643, INT32_MAX, INT32_MIN}) {
    other = code;
    other.rotation[1] = part;
    CHECK(decode_rigid(other).status() == Status::kCorrupt);
  }
  // The part that was left out would not be the largest.
  other = code;
  other.rotation = {4'300'000, 4'300'000, 4'300'000};
  CHECK(decode_rigid(other).status() == Status::kCorrupt);
  for (const std::int32_t part : {INT32_MAX, INT32_MIN}) {
    other = code;
    other.translation[2] = part;
    CHECK(decode_rigid(other).status() == Status::kCorrupt);
  }
}

}  // namespace
}  // namespace tessera
