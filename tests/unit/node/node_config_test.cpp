// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/node_config.hpp"

#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>

#include "node/robot_setup.hpp"
#include "node/start_counter.hpp"
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

TEST_CASE("NodeConfig: every key is described in docs/node.md with its default") {
  const Outcome<NodeConfig> config = parse_node_config(kLeast, "node.toml");
  REQUIRE(config.ok());
  std::ifstream stream(TESSERA_NODE_DOCS);
  const std::string docs{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  std::size_t at = 0;
  for (const auto& table : config->values.items()) {
    at = docs.find("### [" + table.key() + "]", at);
    INFO("[" << table.key() << "]");
    REQUIRE(at != std::string::npos);
    const std::string section = docs.substr(at, docs.find("\n##", at + 1) - at);
    for (const auto& key : table.value().items()) {
      INFO(key.key());
      CHECK(section.find("\n| `" + key.key() + "` | ") != std::string::npos);
    }
  }
}

TEST_CASE("NodeConfig: refusals of map and fuse come in words of the configuration") {
  const test::TemporaryFolder folder;
  folder.write("node.toml", "[map]\nmax_range_m = 3\n\nmin_range_m = 5\n");
  const std::string path = folder.file("node.toml");
  const Failure failure =
      in_words_of_config({"--min-range 5 is not allowed; give metres, under --max-range"}, path);
  CHECK(failure.message == path +
                               ", line 4: [map] min_range_m: min_range_m 5 is not allowed; give "
                               "metres, under max_range_m");
  CHECK(in_words_of_config({"no route to the group"}, path).message == "no route to the group");
}

TEST_CASE("count_start: each start is one more than the last, of each robot by itself") {
  const test::TemporaryFolder folder;
  const std::string state = folder.file("deep/state");
  const Outcome<FileDescriptor> lock = lock_robot(state, 3);
  REQUIRE(lock.ok());
  CHECK(*count_start(state, 3) == 1);
  CHECK(*count_start(state, 3) == 2);
  CHECK(*count_start(state, 4) == 1);
  CHECK(*count_start(state, 3) == 3);
  CHECK(folder.read("deep/state/robot_3.starts") == "3\n");
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
  CHECK(none.failure().message.find("give at least") != std::string::npos);
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

TEST_CASE("lock_robot: a robot is one process at a time") {
  const test::TemporaryFolder folder;
  const std::string state = folder.path().string();
  {
    const Outcome<FileDescriptor> lock = lock_robot(state, 3);
    REQUIRE(lock.ok());
    const Outcome<FileDescriptor> second = lock_robot(state, 3);
    REQUIRE_FALSE(second.ok());
    CHECK(second.failure().message.find("robot 3 is running already") != std::string::npos);
    CHECK(lock_robot(state, 4).ok());
  }
  CHECK(lock_robot(state, 3).ok());
}

TEST_CASE("count_start: what is no count is refused and left as it is") {
  const test::TemporaryFolder folder;
  for (const char* const text : {"", "x\n", "1", "0\n", "-1\n", "4294967296\n", "1\n2\n"}) {
    INFO(text);
    folder.write("robot_0.starts", text);
    const Outcome<std::uint32_t> start = count_start(folder.path().string(), 0);
    REQUIRE_FALSE(start.ok());
    CHECK(folder.read("robot_0.starts") == text);
  }
  folder.write("robot_0.starts", "4294967295\n");
  CHECK_FALSE(count_start(folder.path().string(), 0).ok());
}

}  // namespace
}  // namespace tessera
