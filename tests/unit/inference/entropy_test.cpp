// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The multi-entropy policy, case by case.
#include "tessera/inference/internal/entropy.hpp"

#include <bit>
#include <catch2/catch.hpp>

namespace tessera {
namespace {

UnitSample unit_of(std::uint8_t label, float entropy = 0.0F) {
  return {.begin = 0, .end = 1, .class_entropy = entropy, .label = label};
}

/// Which of the three things a unit can do: learn nothing, from its own points, from its own and
/// its neighbours', be filled.
enum class Learns { kNothing, kOwn, kOwnAndNeighbours, kFilled };

Learns learns(const EntropyDecision& decision) {
  if (!(decision.length_voxels > 0.0F)) return Learns::kNothing;
  if (!decision.own) return Learns::kFilled;
  return decision.neighbours ? Learns::kOwnAndNeighbours : Learns::kOwn;
}

}  // namespace

TEST_CASE(
    "class entropy: 0 for one class, 1 for one point of each of N - 1 classes and one more "
    "outcome") {
  CHECK(class_entropy(0, 0, 0, 19) == 0.0F);
  CHECK(class_entropy(1, 1, 1, 19) == 0.0F);
  CHECK(class_entropy(1000, 1000, 1, 19) == 0.0F);
  for (const unsigned n : {2U, 5U, 20U, 60U}) {
    CAPTURE(n);
    // Uniform over N = n outcomes, C = n - 1.
    CHECK(class_entropy(n, 1, n, static_cast<int>(n) - 1) == Approx(1.0).epsilon(1e-6));
  }
}

TEST_CASE("class entropy: the formula by hand") {
  CHECK(class_entropy(4, 3, 2, 10) == Approx(0.25 * 1.01));
  CHECK(class_entropy(4, 2, 3, 10) == Approx(0.5 * 1.02));
  CHECK(class_entropy(3, 1, 3, 20) == Approx(2.0 / 3.0 * (1.0 + 2.0 / 400.0)));
}

TEST_CASE(
    "decide: a unit with points learns from its own, and above the threshold from its neighbours "
    "too") {
  const EntropyConfig config;
  const std::array<const UnitSample*, 6> alone{};
  const UnitSample pure = unit_of(3, 0.0F);
  const UnitSample at_threshold = unit_of(UnitSample::kMixed, 0.3F);
  const UnitSample mixed = unit_of(UnitSample::kMixed, 0.5F);
  CHECK(learns(decide(config, &pure, alone)) == Learns::kOwn);
  CHECK(learns(decide(config, &at_threshold, alone)) == Learns::kOwn);
  CHECK(learns(decide(config, &mixed, alone)) == Learns::kOwnAndNeighbours);
  CHECK(decide(config, &pure, alone).length_voxels == 3.0F);
  CHECK(decide(config, &at_threshold, alone).length_voxels == Approx(3.6F));
  CHECK(decide(config, &mixed, alone).length_voxels == Approx(4.0F));
}

TEST_CASE(
    "decide: an empty unit is filled by enough neighbours, of one label if that is asked for") {
  const UnitSample a = unit_of(2);
  const UnitSample b = unit_of(5);
  const UnitSample none = unit_of(UnitSample::kNoLabel);
  const UnitSample mixed = unit_of(UnitSample::kMixed);
  struct Case {
    std::array<const UnitSample*, 6> faces;
    Learns one_label;
    Learns any_label;
  };
  constexpr const UnitSample* kNone = nullptr;
  using L = Learns;
  const std::array cases{
      Case{{kNone, kNone, kNone, kNone, kNone, kNone}, L::kNothing, L::kNothing},
      Case{{&a, kNone, kNone, kNone, kNone, kNone}, L::kNothing, L::kNothing},
      Case{{&a, &a, kNone, kNone, kNone, kNone}, L::kFilled, L::kFilled},
      Case{{kNone, &a, kNone, kNone, kNone, &a}, L::kFilled, L::kFilled},
      Case{{&a, &b, kNone, kNone, kNone, kNone}, L::kNothing, L::kFilled},
      Case{{&a, &mixed, kNone, kNone, kNone, kNone}, L::kNothing, L::kFilled},
      Case{{&mixed, &a, kNone, kNone, kNone, kNone}, L::kNothing, L::kFilled},
      Case{{&a, &none, kNone, kNone, kNone, kNone}, L::kFilled, L::kFilled},
      Case{{&none, kNone, kNone, kNone, &none, kNone}, L::kFilled, L::kFilled},
      Case{{&none, &none, &a, &b, kNone, kNone}, L::kNothing, L::kFilled},
      Case{{&a, &a, &a, &a, &a, &a}, L::kFilled, L::kFilled},
      Case{{&a, &a, &a, &a, &a, &b}, L::kNothing, L::kFilled},
  };
  for (std::size_t i = 0; i < cases.size(); ++i) {
    CAPTURE(i);
    EntropyConfig config;
    CHECK(learns(decide(config, nullptr, cases[i].faces)) == cases[i].one_label);
    config.fill_one_label = false;
    CHECK(learns(decide(config, nullptr, cases[i].faces)) == cases[i].any_label);
    config.fill_neighbours = 7;
    CHECK(learns(decide(config, nullptr, cases[i].faces)) == L::kNothing);
  }
}

TEST_CASE("decide: for all 64 sets of neighbours and every threshold, filling counts them") {
  const UnitSample a = unit_of(2);
  for (int least = 1; least <= 7; ++least) {
    EntropyConfig config;
    config.fill_neighbours = least;
    for (unsigned set = 0; set < 64; ++set) {
      std::array<const UnitSample*, 6> faces{};
      for (unsigned face = 0; face < 6; ++face)
        faces[face] = ((set >> face) & 1U) != 0 ? &a : nullptr;
      const bool filled = learns(decide(config, nullptr, faces)) == Learns::kFilled;
      CAPTURE(least, set);
      REQUIRE(filled == (std::popcount(set) >= least));
    }
  }
}

}  // namespace tessera
