// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a block says of the robots that have labels in it, compared with counting by hand.
#include "tessera/fusion/internal/opinions.hpp"

#include <catch2/catch.hpp>
#include <map>
#include <tuple>
#include <vector>

#include "support/sample_content.hpp"

namespace tessera {
namespace {

constexpr int kOpinionComponents = 7;  // five classes
constexpr float kPassWeight = 0.5F;

struct OwnOpinions {
  explicit OwnOpinions(std::uint32_t robots, int components = kOpinionComponents)
      : memory(Opinions::required_bytes(robots, components)) {
    Arena arena = memory.arena();
    opinions = *Opinions::make(arena, robots, components, kPassWeight);
    CHECK(arena.remaining_bytes() == 0);
  }
  AlignedMemory memory;
  Opinions opinions;
};

/// Robot, majority's class, robot's class; 0 for all others.
using ByMajority = std::map<std::tuple<unsigned, unsigned, unsigned>, unsigned>;
/// Robot, its class: voxels, differing ones.
using ByPair = std::map<std::pair<unsigned, unsigned>, std::pair<unsigned, unsigned>>;

struct Told {
  ByMajority majorities;
  ByPair pairs;
  friend bool operator==(const Told&, const Told&) = default;
};

Told told(std::span<const LabelTally> tallies) {
  Told found;
  for (const LabelTally tally : tallies) {
    if (tally.is_of_pair()) {
      found.pairs[{tally.robot(), tally.label()}] = {tally.voxels(), tally.differing()};
    } else {
      found.majorities[{tally.robot(), tally.label(), tally.said()}] = tally.units();
    }
  }
  return found;
}

struct Spoken {
  unsigned label = 0;
  unsigned units = 0;
};

/// A robot's label in a voxel and its share of the evidence, by what the specification says.
Spoken spoken(const BlockContent& content, int row) {
  float most = 0.0F;
  float all = 0.0F;
  Spoken found;
  for (int c = 1; c <= kOpinionComponents - 2; ++c) {
    const float count = content.count(c, row);
    all += count;
    if (count > most) {
      most = count;
      found.label = static_cast<unsigned>(c);
    }
  }
  const float there = all + content.count(kOpinionComponents - 1, row) + content.rest(row);
  if (found.label == 0 || !(there > kPassWeight * static_cast<float>(content.passes(row))))
    return {};
  found.units = static_cast<unsigned>(LabelTally::kUnits * most / all + 0.5F);
  return found;
}

Told by_hand(std::vector<OwnContent>& contents) {
  Told expected;
  for (int row = 0; row < kBlockVoxels; ++row) {
    std::vector<Spoken> all;
    std::map<unsigned, int> votes;
    int speakers = 0;
    for (OwnContent& content : contents) {
      all.push_back(spoken(*content, row));
      if (all.back().label == 0) continue;
      ++votes[all.back().label];
      ++speakers;
    }
    unsigned majority = 0;
    int most = 1;
    for (const auto& [label, count] : votes) {
      if (count == most) majority = 0;
      if (count <= most) continue;
      most = count;
      majority = label;
    }
    for (unsigned robot = 0; robot < all.size(); ++robot) {
      const auto [label, units] = all[robot];
      if (label == 0) continue;
      if (speakers == 2) {
        auto& [voxels, differing] = expected.pairs[{robot, label}];
        ++voxels;
        if (votes.size() == 2) ++differing;
      } else if (speakers > 2 && majority != 0) {
        expected.majorities[{robot, majority, label}] += units;
        expected.majorities[{robot, majority, 0}] += LabelTally::kUnits - units;
      }
    }
  }
  std::erase_if(expected.majorities, [](const auto& one) { return one.second == 0; });
  return expected;
}

TEST_CASE("Opinions: of random robots, what counting by hand gives") {
  const int robots = GENERATE(1, 2, 3, 4, 8);
  oracle::Random random(static_cast<std::uint64_t>(41 + robots));
  OwnOpinions own(8);
  for (int block = 0; block < 20; ++block) {
    std::vector<OwnContent> contents;
    own.opinions.begin_block();
    for (int robot = 0; robot < robots; ++robot) {
      OwnContent& content = contents.emplace_back(kOpinionComponents);
      for (int n = 0; n < 700; ++n) {
        const int row = random.below(kBlockVoxels);
        // Few classes, so that some agree.
        content->add(1 + random.below(block % 2 == 0 ? 2 : kOpinionComponents - 1), row,
                     static_cast<float>(1 + random.below(8)));
        if (n % 5 == 0) content->add_passes(row, static_cast<unsigned>(random.below(20)));
        if (n % 7 == 0) content->add_rest(row, 2.0F);
      }
      own.opinions.add(static_cast<unsigned>(robot), *content);
    }
    REQUIRE(told(own.opinions.tally()) == by_hand(contents));
  }
}

TEST_CASE("Opinions: nobody is judged by a tie, by one other, or where its voxel is free") {
  OwnOpinions own(8);
  const auto say = [&](unsigned robot, int label, unsigned passes = 0) {
    OwnContent content(kOpinionComponents);
    content->add(label, 5, 4.0F);
    if (passes != 0) content->add_passes(5, passes);
    own.opinions.add(robot, *content);
  };
  own.opinions.begin_block();
  SECTION("one") {
    say(0, 1);
    CHECK(own.opinions.tally().empty());
  }
  SECTION("two that differ") {
    say(0, 1);
    say(3, 2);
    CHECK(told(own.opinions.tally()) == Told{{}, {{{0, 1}, {1, 1}}, {{3, 2}, {1, 1}}}});
  }
  SECTION("three that all differ") {
    say(0, 1);
    say(1, 2);
    say(2, 3);
    CHECK(own.opinions.tally().empty());
  }
  SECTION("two and two") {
    say(0, 1);
    say(1, 2);
    say(2, 1);
    say(3, 2);
    CHECK(own.opinions.tally().empty());
  }
  SECTION("two, two and three") {
    for (unsigned robot = 0; robot < 7; ++robot) say(robot, robot < 2 ? 1 : robot < 4 ? 2 : 3);
    CHECK(own.opinions.tally().size() == 7);
  }
  SECTION("a label in what is rather free does not count") {
    say(0, 1);
    say(1, 1);
    say(2, 2, 8);  // as much as its label
    CHECK(told(own.opinions.tally()) == Told{{}, {{{0, 1}, {1, 0}}, {{1, 1}, {1, 0}}}});
  }
}

TEST_CASE("Opinions: of more than a block keeps, robots with high numbers are left out whole") {
  constexpr int kMany = kMaxComponents;
  OwnOpinions own(64, kMany);
  oracle::Random random(5);
  own.opinions.begin_block();
  for (unsigned robot = 0; robot < 64; ++robot) {
    OwnContent content(kMany);
    for (int row = 0; row < kBlockVoxels; ++row)
      content->add(1 + random.below(kMany - 2), row, 1.0F);
    own.opinions.add(robot, *content);
  }
  const std::span<const LabelTally> tallies = own.opinions.tally();
  CHECK(tallies.size() <= Opinions::kMostTallies);
  std::map<unsigned, unsigned> units;
  for (const LabelTally tally : tallies) units[tally.robot()] += tally.units();
  REQUIRE(units.size() > 1);
  CHECK(units.rbegin()->first == units.size() - 1);
  for (const auto& [robot, sum] : units) CHECK(sum == units.begin()->second);
}

}  // namespace
}  // namespace tessera
