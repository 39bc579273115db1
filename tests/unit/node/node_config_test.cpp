// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/node_config.hpp"

#include <catch2/catch.hpp>

#include "node/robot_setup.hpp"
#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

constexpr const char* kLeast = "[robot]\nid = 3\nstate = 'state'\n[replay]\ndataset = 'street'\n";

TEST_CASE("NodeConfig: with the least that is needed all else is as documented") {
  const Outcome<NodeConfig> config = parse_node_config(kLeast, "node.toml");
  REQUIRE(config.ok());
  CHECK(config->robot == 3);
  CHECK(config->map.robot == 3U);
  CHECK(config->rate_hz == Approx(10.0));
  CHECK(config->tick_ms == 50);
  CHECK(config->link.url == kDefaultUrl);
}

TEST_CASE("NodeConfig: a robot with sensors maps in submaps of 20 m, unless it is told otherwise") {
  const auto submap_m = [](const std::string& lines) {
    const Outcome<NodeConfig> config =
        parse_node_config("[robot]\nid = 3\nstate = 'state'\n" + lines, "node.toml");
    REQUIRE(config.ok());
    return config->map.in_submaps() ? *config->map.submap_length_m : 0.0;
  };
  CHECK(submap_m("[sensors]\n") == 20.0);
  CHECK(submap_m("[sensors]\n[map]\nmemory = '96M'\n") == 20.0);
  CHECK(submap_m("[sensors]\n[map]\nsubmap_m = 7\n") == 7.0);
  CHECK(submap_m("[sensors]\n[map]\nsubmap_m = 0\n") == 0.0);
  CHECK(submap_m("[sensors]\n[map]\nwindow_m = 45\narchive = 'a'\n") == 0.0);
  CHECK(submap_m("[sensors]\n[map]\narchive = 'a'\n") == 0.0);
  CHECK(submap_m("[replay]\ndataset = 'street'\n") == 0.0);
}

TEST_CASE("NodeConfig: what settings say together is refused with the line of the first") {
  const auto refused = [](const std::string& lines) {
    const Outcome<NodeConfig> config = parse_node_config(kLeast + lines, "node.toml");
    if (!config.ok()) return config.failure().text();
    const Outcome<MapSetup> setup = set_up(config->map);
    REQUIRE_FALSE(setup.ok());
    return config->places.worded(setup.failure()).text();
  };
  CHECK(refused("[map]\nmax_range_m = 3\n\nmin_range_m = 5\n") ==
        "node.toml, line 9: [map] min_range_m: 5 is not allowed; give metres, under max_range_m");
  CHECK(refused("[publish]\nstaleness_s = 9\nfree_staleness_s = 5\n") ==
        "node.toml, line 8: [publish] free_staleness_s: 5 is not allowed; give seconds from "
        "staleness_s");
  CHECK(refused("[map]\narchive = 'a'\nmax_range_m = 0\n") ==
        "node.toml, line 7: [map] archive: needs window_m where max_range_m is 0; give window_m "
        "too");
}

TEST_CASE("NodeConfig: the robot's body is in its table") {
  const std::string table =
      "[robot]\nid = 3\nstate = 'state'\nbody = [-1, -1, -0.5,\n  1, 1, 0.5]\n"
      "[replay]\ndataset = 'street'\n";
  const Outcome<NodeConfig> config = parse_node_config(table, "node.toml");
  REQUIRE(config.ok());
  CHECK(config->map.body == std::vector<double>{-1, -1, -0.5, 1, 1, 0.5});
}

TEST_CASE("fit_global_map: what is made never takes more than it was given, and uses most of it") {
  constexpr int kComponents = 21;
  constexpr std::size_t kMiB = std::size_t{1} << 20U;
  GlobalMapConfig config;
  config.map.tuple = TuplePolicy::kCompact;
  std::size_t largest_map = 0;
  for (const std::size_t mib :
       {std::size_t{64}, std::size_t{200}, std::size_t{256}, std::size_t{3000}}) {
    INFO(mib);
    const Outcome<GlobalMapConfig> fitted = fit_global_map(config, mib * kMiB, 0.5, kComponents);
    REQUIRE(fitted.ok());
    const std::size_t bytes = GlobalMap::required_bytes(*fitted, kComponents);
    CHECK(bytes <= mib * kMiB);
    CHECK(bytes >= mib * kMiB - kMiB);
    CHECK(fitted->map.storage_bytes > largest_map);
    largest_map = fitted->map.storage_bytes;
  }
  const Outcome<GlobalMapConfig> none = fit_global_map(config, 2 * kMiB, 0.5, kComponents);
  REQUIRE_FALSE(none.ok());
  CHECK(none.failure().text().find("give at least") != std::string::npos);
}

TEST_CASE("sectors_of: every range that a file may give makes sectors") {
  MapConfig map_config;
  map_config.storage_bytes = 4 * SlabPool::kPageBytes;
  ClassTable classes;
  REQUIRE(classes.add("road", {}) == Status::kOk);
  Outcome<ArenaMemory> memory = ArenaMemory::allocate(required_bytes(map_config));
  REQUIRE(memory.ok());
  Arena arena(memory->span());
  const Result<LocalMap> map = LocalMap::make(arena, map_config, classes);
  REQUIRE(map.ok());
  Outcome<ArenaMemory> own = ArenaMemory::allocate(ObstacleSectors::required_bytes(*map));
  REQUIRE(own.ok());
  const std::string vehicle = std::string(kLeast) + "[vehicle]\ncan = 'can0'\nsector_range_m = ";
  for (const char* const range : {"0.5", "0.75", "0.99", "1.0", "1.01", "20.0", "60.0"}) {
    INFO(range << " m");
    const Outcome<NodeConfig> config = parse_node_config(vehicle + range + "\n", "node.toml");
    REQUIRE(config.ok());
    Arena own_arena(own->span());
    CHECK(ObstacleSectors::make(sectors_of(config->vehicle), *map, own_arena).ok());
  }
  for (const char* const range : {"0.49", "60.1"})
    CHECK_FALSE(parse_node_config(vehicle + range + "\n", "node.toml").ok());
}

std::string with_robot_line(const char* line) {
  return std::string("[robot]\nid = 3\nstate = 'state'\n") + line +
         "\n[replay]\ndataset = 'street'\n";
}

TEST_CASE("[robot] earlier: keep unless told otherwise") {
  const auto earlier = [](const char* line) {
    return parse_node_config(with_robot_line(line), "node.toml");
  };
  CHECK(earlier("")->earlier == EarlierEpochs::kKeep);
  CHECK(earlier("earlier = 'keep'")->earlier == EarlierEpochs::kKeep);
  CHECK(earlier("earlier = 'drop'")->earlier == EarlierEpochs::kDrop);
  CHECK_FALSE(earlier("earlier = 'some'").ok());
  CHECK_FALSE(earlier("earlier = true").ok());
}

TEST_CASE("[security] mission: 1 to 64 bytes, and only where there is a key") {
  const std::string least = std::string(kLeast) + "[security]\n";
  const auto said = [&least](const std::string& lines) {
    const Outcome<NodeConfig> config = parse_node_config(least + lines, "node.toml");
    return config.ok() ? config->keys.mission : config.failure().text();
  };
  const std::string key = "fleet_key = 'fleet.key'\n";
  CHECK(said(key).empty());
  CHECK(said(key + "mission = 'harbour 7'\n") == "harbour 7");
  CHECK(said(key + "mission = ''\n").find("is empty") != std::string::npos);
  CHECK(said(key + "mission = '" + std::string(65, 'x') + "'\n").find("over 64") !=
        std::string::npos);
  CHECK(said("mission = 'harbour 7'\n").find("without a key") != std::string::npos);
}

}  // namespace
}  // namespace tessera
