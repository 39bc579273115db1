// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What robots state about frames is held by the global map beside what they map, and is no part of
// it: of no sum, no objection, no robot's weight.
#include <catch2/catch.hpp>

#include "support/team.hpp"
#include "tessera/frames/frame_statements.hpp"

namespace tessera::oracle {
namespace {

constexpr ContributionId kId{2, 1, FrameStatements::kNumber};

FrameLink link_to(std::uint32_t to) {
  FrameLink link;
  link.from = kId.robot;
  link.from_epoch = kId.epoch;
  link.to = to;
  link.revision = 1;
  return link;
}

Status state(Team& team, const FrameLink& link, BlockKey place, std::uint32_t version,
             const ContributionId& id = kId) {
  std::array<std::byte, FrameLink::kBytes> bytes{};
  REQUIRE(encode_link(link, bytes) == Status::kOk);
  return team.global()
      .put(*team.global().open(id, GridTransform()), place, version, bytes)
      .status();
}

std::uint32_t links_of(const Team& team) {
  std::array<FrameLink, 16> links{};
  return collect(team.global().replicas(), links, {}).links;
}

}  // namespace

TEST_CASE("frame statements: a global map is the same with them, before, between and after") {
  Random random(announce_seed(3201));
  Team with(team_config());
  Team without(team_config());
  for (std::uint32_t version = 1; version <= 4; ++version) {
    // Their places are keys of blocks in the middle of the maps.
    for (const std::uint32_t to : {0U, 1U, 65'537U})
      REQUIRE(state(with, link_to(to), place_of_link(to), version) == Status::kOk);
    OracleContribution one;
    one.id = {version - 1, 1, 0};
    one.T_global_local = random_transform(random, 10.0, 0.3);
    one.voxels = random_voxels(random, 400, {0, 0, 0});
    for (Team* const team : {&with, &without}) {
      team->publish(one, version);
      team->settle();
    }
    REQUIRE(with.digest() == without.digest());
  }
  CHECK(links_of(with) == 3);
  CHECK(with.global().report().waiting == 0);
  CHECK(with.global().report().blocks == without.global().report().blocks);
  // One that has stated something and mapped nothing is no robot of the map.
  REQUIRE(state(with,
                [] {
                  FrameLink link = link_to(1);
                  link.from = 9;
                  return link;
                }(),
                place_of_link(1), 1, {9, 1, FrameStatements::kNumber}) == Status::kOk);
  CHECK(with.global().reliability(9).status() == Status::kOutOfRange);
  CHECK(with.global().reliability(2).ok());
}

TEST_CASE("frame statements: a contribution that is removed takes them with it") {
  Random random(announce_seed(3202));
  Team team(team_config());
  OracleContribution one;
  one.id = {2, 1, 0};
  one.voxels = random_voxels(random, 400, {0, 0, 0});
  team.publish(one, 1);
  team.settle();
  const std::uint64_t digest = team.digest();
  REQUIRE(state(team, link_to(1), place_of_link(1), 1) == Status::kOk);
  const std::uint64_t before = team.global().replicas().frame_changes();
  const GlobalMap::Slot slot = *team.global().open(kId, GridTransform());
  team.global().remove(slot);
  CHECK(state(team, link_to(1), place_of_link(1), 2) == Status::kBusy);
  team.settle();
  CHECK(links_of(team) == 0);
  CHECK(team.global().replicas().frame_changes() != before);
  CHECK_FALSE(team.global().replicas().find(kId).ok());
  CHECK(team.digest() == digest);
}

TEST_CASE("frame statements: what a robot does not state for itself, of its epoch, is refused") {
  Team team(team_config());
  FrameLink link = link_to(1);
  CHECK(state(team, link, place_of_link(3), 1) == Status::kCorrupt);
  CHECK(state(team, link, kPlaceOfPrior, 1) == Status::kCorrupt);
  link.from = 3;
  CHECK(state(team, link, place_of_link(1), 1) == Status::kCorrupt);
  link = link_to(1);
  link.from_epoch = 2;
  CHECK(state(team, link, place_of_link(1), 1) == Status::kCorrupt);
  const GlobalMap::Slot slot = *team.global().open(kId, GridTransform());
  CHECK(team.global().put(slot, place_of_link(1), 1, {}).status() == Status::kCorrupt);
  CHECK(links_of(team) == 0);
  CHECK(team.global().replicas().frame_changes() == 0);
  CHECK(state(team, link_to(1), place_of_link(1), 1) == Status::kOk);
}

}  // namespace tessera::oracle
