// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/places_of_robots.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <map>

#include "support/aligned_memory.hpp"
#include "support/random.hpp"

namespace tessera {
namespace {

PlacesOfRobots made_in(AlignedMemory& memory, std::uint32_t places) {
  Arena arena = memory.arena();
  return *PlacesOfRobots::make(arena, places);
}

}  // namespace

TEST_CASE("PlacesOfRobots: counts as a map of robots does, each kind apart") {
  constexpr std::uint32_t kPlaces = 40;
  AlignedMemory memory(PlacesOfRobots::required_bytes(kPlaces));
  PlacesOfRobots places = made_in(memory, kPlaces);
  oracle::Random random(7);
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> expected;
  constexpr std::array<std::uint32_t, 5> kSubmaps{5, 5, FrameStatements::kNumber,
                                                  Objection::kNumber, MapSession::kFirst};
  std::vector<ContributionId> taken;
  for (int i = 0; i < 4000; ++i) {
    const bool adds = taken.empty() || (taken.size() < kPlaces && random.below(2) == 0);
    if (adds) {
      const auto robot = static_cast<std::uint32_t>(random.below(60));
      const std::uint32_t submap = kSubmaps[static_cast<std::size_t>(random.below(5))];
      taken.push_back({robot, 1, submap});
      places.add(taken.back());
      ++expected[{robot, submap}];
    } else {
      const auto at = static_cast<std::size_t>(random.below(static_cast<int>(taken.size())));
      places.remove(taken[at]);
      --expected[{taken[at].robot, taken[at].submap}];
      taken[at] = taken.back();
      taken.pop_back();
    }
    for (const auto& [key, count] : expected)
      REQUIRE(places.count({key.first, 9, key.second}) == count);
  }
}

TEST_CASE("PlacesOfRobots: there is room for each robot that has a place, whatever its number") {
  constexpr std::uint32_t kPlaces = 64;
  AlignedMemory memory(PlacesOfRobots::required_bytes(kPlaces));
  PlacesOfRobots places = made_in(memory, kPlaces);
  // As if somebody had chosen numbers that a hash table would put together.
  for (std::uint32_t i = 0; i < kPlaces; ++i) places.add({i << 20U, 1, 0});
  for (std::uint32_t i = 0; i < kPlaces; ++i) CHECK(places.count({i << 20U, 1, 0}) == 1);
  CHECK(places.count({7, 1, 0}) == 0);
}

}  // namespace tessera
