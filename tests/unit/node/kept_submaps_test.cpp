// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/kept_submaps.hpp"

#include <catch2/catch.hpp>
#include <filesystem>

#include "support/small_map.hpp"
#include "support/temporary_folder.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {
namespace {

/// Two maps that take turns, with a voxel each in every submap.
struct Driven {
  Driven() : memory(LocalMaps::required_bytes(config_of_pages(64), true)) {
    Arena arena(memory.span());
    REQUIRE(maps.set_up(arena, config_of_pages(64), table_of(3), true, 0) == Status::kOk);
    maps.require(LocalMaps::User::kKeeping);
    map_one();
  }
  void map_one() {
    const auto at = static_cast<std::int32_t>(maps.number());
    REQUIRE(hit(maps.map(), {10 * at, 0, 0}, 1, 2.0F) == Status::kOk);
  }
  void cut() {
    maps.begin(true, {.first_scan = maps.number(), .last_scan = maps.number(), .length_m = 20.0});
    map_one();
  }
  [[nodiscard]] KeptSubmaps::CurrentSubmap current() const {
    return {maps.map(), maps.number(), {}};
  }
  AlignedMemory memory;
  LocalMaps maps;
};

TEST_CASE("KeptSubmaps: one file has all of them, with frames, also where the epoch has changed") {
  const test::TemporaryFolder folder;
  Driven driven;
  const auto kept = std::move(*KeptSubmaps::make(folder.file("robot_1"), driven.maps.map()));
  MapIdentity identity{.robot = 1, .epoch = 5};
  REQUIRE(kept->keep_ended(driven.maps, identity).ok());  // none has ended
  CHECK(kept->rows().empty());
  for (const std::uint32_t epoch : {5U, 6U}) {
    identity.epoch = epoch;
    driven.cut();
    CHECK_FALSE(driven.maps.may_begin());
    REQUIRE(kept->keep_ended(driven.maps, identity).ok());
    CHECK(driven.maps.may_begin());
  }
  CHECK(kept->rows().size() == 2);
  CHECK(folder.num_entries() == 2);
  std::vector<KeptSubmaps::Frame> frames(2);
  Matrix34d T = Matrix34d::Identity();
  T(1, 3) = 3.0;
  frames[0].T_map_submap = *encode_rigid(Matrix34d::Identity());
  frames[1] = {1, *encode_rigid(T), 4};
  const std::string path = folder.file("all.tsm");
  const Outcome<MapSummary> saved = kept->save_as(path, driven.current(), frames, identity);
  REQUIRE(saved.ok());
  CHECK(saved->digest == kept->digest_with(driven.current(), frames));

  const Outcome<StoredSubmaps> read = load_submaps(path, *load_map_header(path));
  REQUIRE(read.ok());
  REQUIRE(read->rows.size() == 3);
  CHECK(read->rows[1].revision == 4);
  // The last one had no frame yet: it continues the one before.
  CHECK(read->rows[2].T_map_submap == frames[1].T_map_submap);
  for (const SubmapRow& row : read->rows) {
    const auto stored = load_submap(*read, row);
    INFO(stored.failure().text());
    REQUIRE(stored.ok());
    const auto at = static_cast<std::int32_t>(row.number);
    CHECK(label_evidence((*stored)->map, {10 * at, 0, 0}) == 2.0);
    CHECK((*stored)->map.usage().label_voxels == 1);
  }
  kept->remove();
  CHECK(folder.num_entries() == 1);
}

TEST_CASE("KeptSubmaps: what cannot be written still waits, and a file that was changed is named") {
  const test::TemporaryFolder folder;
  Driven driven;
  const std::string place = folder.file("later");
  const auto kept = std::move(*KeptSubmaps::make(place + "/robot_1", driven.maps.map()));
  driven.cut();
  CHECK_FALSE(kept->keep_ended(driven.maps, {}).ok());
  CHECK(driven.maps.ended(LocalMaps::User::kKeeping).has_value());
  CHECK_FALSE(driven.maps.may_begin());
  std::filesystem::create_directory(place);
  REQUIRE(kept->keep_ended(driven.maps, {}).ok());
  CHECK(driven.maps.may_begin());
  folder.write("later/robot_1.submap-0.tsm", "something else");
  const Outcome<MapSummary> saved = kept->save_as(folder.file("all.tsm"), driven.current(), {}, {});
  REQUIRE_FALSE(saved.ok());
  CHECK(saved.failure().text().find("submap-0.tsm") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(folder.file("all.tsm")));
}

}  // namespace
}  // namespace tessera
