// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What robots state about frames: places, whose they are, and what is collected of them.
#include "tessera/frames/frame_statements.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "drawn_links.hpp"

namespace tessera {
namespace {

FrameLink simple_link(std::uint32_t from, std::uint32_t epoch, std::uint32_t to,
                      std::uint32_t revision = 1) {
  FrameLink link;
  link.from = from;
  link.from_epoch = epoch;
  link.to = to;
  link.revision = revision;
  return link;
}

TEST_CASE("frame statements: each robot that a link is to has a place of its own") {
  std::set<std::uint64_t> places{kPlaceOfPrior.bits};
  oracle::Random random(265);
  std::set<std::uint32_t> robots{0, 1, 0xffff, 0x10000, 0xffff0000U, 0xffffffffU};
  while (robots.size() < 1000) robots.insert(static_cast<std::uint32_t>(random.bits()));
  for (const std::uint32_t robot : robots) {
    CHECK(places.insert(place_of_link(robot).bits).second);
    CHECK(pack(unpack(place_of_link(robot))).ok());
  }
}

TEST_CASE("frame statements: a robot states for itself, of its epoch, where it belongs") {
  const ContributionId id{7, 3, FrameStatements::kNumber};
  const FrameLink good = simple_link(7, 3, 9);
  REQUIRE(is_frame_statement(id, place_of_link(9), bytes_of(good)));
  const auto refused = [&](const auto& change) {
    FrameLink link = good;
    change(link);
    return !is_frame_statement(id, place_of_link(link.to), bytes_of(link));
  };
  CHECK(refused([](FrameLink& link) { link.from = 8; }));
  CHECK(refused([](FrameLink& link) { link.from_epoch = 2; }));
  CHECK_FALSE(refused([](FrameLink& link) { link.to = 70'000; }));
  CHECK_FALSE(refused([](FrameLink& link) { link.withdrawn = true; }));
  const LinkBytes link = bytes_of(good);
  CHECK_FALSE(is_frame_statement(id, place_of_link(8), link));
  CHECK_FALSE(is_frame_statement(id, kPlaceOfPrior, link));
  // Places of nothing, whose x, y or z another robot would have.
  for (const BlockCoord& at :
       {BlockCoord{9, 0, 2}, {9, 0, -1}, {9 - 65'536, 1, 0}, {9 + 65'536, 0, 0}, {9, -1, 0}})
    CHECK_FALSE(is_frame_statement(id, *pack(at), link));
  CHECK_FALSE(is_frame_statement(id, place_of_link(9), std::span(link).first(122)));
  CHECK_FALSE(is_frame_statement(id, place_of_link(9), {}));

  const StatedPrior prior{.robot = 7, .epoch = 3, .kind = PriorKind::kExact};
  CHECK(is_frame_statement(id, kPlaceOfPrior, bytes_of(prior)));
  CHECK_FALSE(is_frame_statement(id, place_of_link(9), bytes_of(prior)));
  CHECK_FALSE(is_frame_statement(id, kPlaceOfPrior, bytes_of(StatedPrior{.robot = 8, .epoch = 3})));
  CHECK_FALSE(is_frame_statement(id, kPlaceOfPrior, bytes_of(StatedPrior{.robot = 7, .epoch = 4})));
}

// --- Collecting ---

struct Held {
  explicit Held(std::uint32_t records = 4096) : memory(Replicas::required_bytes(config(records))) {
    Arena arena = memory.arena();
    replicas = *Replicas::make(arena, config(records));
  }
  static ReplicasConfig config(std::uint32_t records) {
    return {.segments = records, .blocks = records, .contributions = 64, .robot_segments = records};
  }
  Replicas::Slot open(std::uint32_t robot, std::uint32_t epoch) {
    return *replicas.open({robot, epoch, FrameStatements::kNumber});
  }
  template <class Statement>
  void state(Replicas::Slot slot, BlockKey place, const Statement& statement) {
    REQUIRE(replicas.put(slot, place, ++version, bytes_of(statement)).ok());
  }
  void state(const FrameLink& link) {
    state(open(link.from, link.from_epoch), place_of_link(link.to), link);
  }
  void state(const StatedPrior& prior) {
    state(open(prior.robot, prior.epoch), kPlaceOfPrior, prior);
  }
  AlignedMemory memory;
  Replicas replicas;
  std::uint32_t version = 0;
};

using LinkNames = std::vector<std::array<std::uint32_t, 4>>;

/// All that is collected: from, epoch, to, revision.
LinkNames collected(const Held& held, std::size_t room, CollectedStatements& found) {
  std::vector<FrameLink> links(room);
  std::vector<StatedPrior> priors(64);
  found = collect(held.replicas, links, priors);
  LinkNames names;
  for (const FrameLink& link : std::span(links).first(found.links))
    names.push_back({link.from, link.from_epoch, link.to, link.revision});
  return names;
}

/// What should be: rounds in which each contribution that has more gives its next one.
LinkNames expected_of(const std::map<std::array<std::uint32_t, 3>, std::uint32_t>& stated,
                      std::size_t room) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, LinkNames> by_contribution;
  for (const auto& [name, revision] : stated)
    by_contribution[{name[0], name[1]}].push_back({name[0], name[1], name[2], revision});
  LinkNames taken;
  for (std::size_t round = 0; round < FrameStatements::kMostLinks; ++round)
    for (const auto& one : by_contribution)
      if (round < one.second.size() && taken.size() < room) taken.push_back(one.second[round]);
  std::sort(taken.begin(), taken.end());
  return taken;
}

TEST_CASE("frame statements: what is collected is what counting all by hand gives") {
  oracle::Random random(266);
  for (int round = 0; round < 60; ++round) {
    Held held;
    std::map<std::array<std::uint32_t, 3>, std::uint32_t> stated;
    const int robots = 1 + random.below(8);
    const int most_to = 1 + random.below(100);
    for (int i = random.below(400); i > 0; --i) {
      const auto from = static_cast<std::uint32_t>(random.below(robots));
      const auto epoch = static_cast<std::uint32_t>(1 + random.below(2));
      const auto to = static_cast<std::uint32_t>(200 + 40'000 * random.below(most_to));
      const std::uint32_t revision = ++stated[{from, epoch, to}];
      held.state(simple_link(from, epoch, to, revision));
      if (random.below(10) == 0) held.state(StatedPrior{.robot = from, .epoch = epoch});
    }
    // Contributions that are no statements are as if they were not there.
    REQUIRE(held.replicas.open({3, 1, 0}).ok());
    REQUIRE(held.replicas.open({3, 1, Objection::kNumber}).ok());
    for (const std::size_t room : {std::size_t{0}, std::size_t{1}, std::size_t{7}, std::size_t{100},
                                   std::size_t{512}, std::size_t{2000}}) {
      CAPTURE(round, room);
      CollectedStatements found;
      REQUIRE(collected(held, room, found) == expected_of(stated, room));
      REQUIRE(found.links + found.links_left_out == stated.size());
      REQUIRE(found.priors_left_out == 0);
    }
  }
}

TEST_CASE("frame statements: who states many links crowds out no others") {
  Held held;
  for (std::uint32_t to = 10; to < 70; ++to) held.state(simple_link(1, 1, to));
  held.state(simple_link(2, 1, 1));
  held.state(simple_link(2, 1, 3));
  held.state(simple_link(3, 1, 1));
  CollectedStatements found;
  CHECK(collected(held, 6, found) ==
        LinkNames{
            {1, 1, 10, 1}, {1, 1, 11, 1}, {1, 1, 12, 1}, {2, 1, 1, 1}, {2, 1, 3, 1}, {3, 1, 1, 1}});
  CHECK(found.links_left_out == 57);
  // Of one alone no more than there may be, however much room there is.
  for (std::uint32_t to = 70; to < 100; ++to) held.state(simple_link(1, 1, to));
  CHECK(collected(held, 1000, found).size() == FrameStatements::kMostLinks + 3);
  CHECK(found.links_left_out == 90 - FrameStatements::kMostLinks);
}

TEST_CASE("frame statements: priors come in the order of robots and epochs") {
  Held held;
  for (const std::uint32_t robot : {5U, 2U, 9U})
    held.state(StatedPrior{.robot = robot, .epoch = 4, .kind = PriorKind::kExact});
  held.state(StatedPrior{.robot = 5, .epoch = 1});
  std::array<StatedPrior, 3> priors{};
  const CollectedStatements found = collect(held.replicas, {}, priors);
  REQUIRE(found.priors == 3);
  CHECK(found.priors_left_out == 1);
  CHECK(priors[0].robot == 2);
  CHECK((priors[1].robot == 5 && priors[1].epoch == 1 && priors[1].kind == PriorKind::kUnknown));
  CHECK((priors[2].robot == 5 && priors[2].epoch == 4 && priors[2].kind == PriorKind::kExact));
}

TEST_CASE("frame statements: whether anything changed is known without looking") {
  Held held;
  auto changes = [&, before = held.replicas.frame_changes()](auto&& what) mutable {
    what();
    const bool any = held.replicas.frame_changes() != before;
    before = held.replicas.frame_changes();
    return any;
  };
  const Replicas::Slot slot = held.open(1, 1);
  CHECK(changes([&] { held.state(simple_link(1, 1, 2)); }));
  CHECK(changes([&] { held.state(simple_link(1, 1, 2, 2)); }));
  CHECK(changes([&] { held.state(StatedPrior{.robot = 1, .epoch = 1}); }));
  const LinkBytes late = bytes_of(simple_link(1, 1, 2));
  CHECK_FALSE(changes([&] { REQUIRE(held.replicas.put(slot, place_of_link(2), 1, late).ok()); }));
  CHECK_FALSE(changes([&] {
    const Replicas::Slot map = *held.replicas.open({1, 1, 0});
    REQUIRE(held.replicas.put(map, kPlaceOfPrior, 1, late).ok());
    held.replicas.drop(held.replicas.contribution(map).first_block);
    held.replicas.set_leaving(map);
  }));
  CollectedStatements found;
  CHECK(collected(held, 9, found).size() == 1);
  CHECK(changes([&] { held.replicas.set_leaving(slot); }));
  CHECK(collected(held, 9, found).empty());
  CHECK(found.priors + found.links_left_out == 0);
}

}  // namespace
}  // namespace tessera
