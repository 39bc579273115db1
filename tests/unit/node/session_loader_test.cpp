// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/session_loader.hpp"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "support/small_map.hpp"
#include "support/temporary_folder.hpp"
#include "tessera/robot/robot.hpp"
#include "unit/robot/small_team.hpp"

namespace tessera {
namespace {

/// A robot that loads sessions as a node does, all in one thread.
struct Loading {
  explicit Loading(const std::vector<SessionOptions>& wanted, RobotConfig config = first_config())
      : one(config), loader(wanted) {}
  static RobotConfig first_config() {
    RobotConfig config = small_robot_config(1);
    config.keep_sessions = true;
    config.exchange.contributions = config.global.replicas.contributions = 16;
    return config;
  }
  void run(int ticks) {
    const LocalMap& map = one.robot->map();
    for (int i = 0; i < ticks; ++i) {
      static_cast<void>(one.robot->tick(now_us += kTick_us));
      loader.tick(one.robot->sharer());
      SessionLoader::News news = loader.look(map.config(), map.classes());
      if (!news.text.empty()) lines.push_back(news.text);
    }
    one.robot->finish();
  }
  [[nodiscard]] std::uint64_t labels() const {
    return one.robot->global().map().usage().label_voxels;
  }
  [[nodiscard]] std::string state_of(std::size_t file) const {
    return loader.report()["files"][file]["state"];
  }
  SmallRobotMemory one;
  SessionLoader loader;
  std::vector<std::string> lines;
  std::int64_t now_us = 0;
};

/// A file with so many labelled voxels, a block each, in a row of its own.
std::string write(const std::string& path, int voxels, int row,
                  MapConfig config = small_robot_config(1).map, int classes = 0) {
  AlignedMemory memory(required_bytes(config));
  Arena arena(memory.span());
  const ClassTable table = classes == 0 ? small_robot_classes() : table_of(classes);
  Result<LocalMap> made = LocalMap::make(arena, config, table);
  REQUIRE(made.ok());
  LocalMap& map = *made;
  for (int i = 0; i < voxels; ++i) REQUIRE(hit(map, {8 * i, 8 * row, 0}, 1, 2.0F) == Status::kOk);
  std::vector<KeyedIndex> workspace = workspace_for(map);
  REQUIRE(save_map(map, {.robot = 4, .epoch = 1}, workspace, path).ok());
  return path;
}

TEST_CASE("SessionLoader: files are shared one after the other, in slices, and named as by info") {
  const test::TemporaryFolder folder;
  const std::string a = write(folder.file("a.tsm"), 200, 0);
  const std::string b = write(folder.file("b.tsm"), 50, 1);
  Loading node({{.file = a}, {.file = b, .weight = 0.25}});
  node.run(3);
  CHECK(node.labels() < 200);
  CHECK_FALSE(node.loader.is_settled());
  node.run(20);
  CHECK(node.labels() == 250);
  CHECK(node.loader.is_settled());
  REQUIRE(node.lines.size() == 2);
  const Json report = node.loader.report();
  CHECK(report["left_out"] == 0);
  REQUIRE(report["files"].size() == 2);
  CHECK(report["files"][0]["blocks"] == 200);
  CHECK(report["files"][1]["weight"] == 0.25);
  CHECK(report["files"][1]["state"] == "shared");
  const Outcome<MapFileHeader> header = load_map_header(a);
  REQUIRE(header.ok());
  REQUIRE(header->summary.has_value());
  const std::string digest = hex64(header->summary->digest);
  CHECK(report["files"][0]["digest"] == digest);
  CHECK(node.lines[0].starts_with("session " + a + " of 20"));
  CHECK(node.lines[0].ends_with(", digest " + digest + ": 200 blocks with weight 0.5 are shared"));
  // Those of earlier starts have ended.
  CHECK(node.one.robot->exchange().epochs().own_sessions() == 1);
}

TEST_CASE(
    "SessionLoader: what cannot be loaded is left out with its reason, and the rest is shared") {
  const test::TemporaryFolder folder;
  const std::string good = write(folder.file("good.tsm"), 30, 0);
  const std::string cut = write(folder.file("cut.tsm"), 30, 1);
  std::filesystem::resize_file(cut, std::filesystem::file_size(cut) / 2);
  const std::string damaged = write(folder.file("damaged.tsm"), 30, 2);
  {
    std::fstream file(damaged, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(std::filesystem::file_size(damaged)) - 100);
    file.put('x');
  }
  const std::string text = folder.file("text.tsm");
  std::ofstream(text) << "yesterday";
  MapConfig coarse = small_robot_config(1).map;
  coarse.resolution_m = 0.4;
  const std::string resolution = write(folder.file("resolution.tsm"), 30, 3, coarse);
  MapConfig heavy = small_robot_config(1).map;
  heavy.free_weight = 0.5F;
  const std::string weight = write(folder.file("weight.tsm"), 30, 4, heavy);
  const std::string classes =
      write(folder.file("classes.tsm"), 30, 5, small_robot_config(1).map, 3);
  const std::string same = folder.file("same.tsm");
  std::filesystem::copy_file(good, same);
  const std::string frame = folder.file("frame.txt");
  std::ofstream(frame) << "1 0 0 1e9 0 1 0 0 0 0 1 0 0 0 0 1";
  const std::string far = write(folder.file("far.tsm"), 31, 0);
  const std::string last = write(folder.file("last.tsm"), 32, 0);
  const std::vector<std::pair<SessionOptions, std::string>> bad = {
      {{.file = folder.file("none.tsm")}, "none.tsm"},
      {{.file = cut}, "cut.tsm"},
      {{.file = damaged}, "damaged.tsm"},
      {{.file = text}, "text.tsm"},
      {{.file = resolution}, "has resolution 0.4, but the maps here have 0.2"},
      {{.file = weight}, "has free weight 0.5, but the maps here have 0.4"},
      {{.file = classes}, "has other classes than the maps here"},
      {{.file = same}, "has the same content as " + good},
      {{.file = last, .frame = folder.file("no.txt")}, "no.txt"},
      {{.file = far, .frame = frame}, "its frame puts it outside of the grid"}};
  for (const auto& [options, why] : bad) {
    CAPTURE(options.file);
    Loading node({{.file = good}, options, {.file = last}});
    node.run(40);
    CHECK(node.state_of(0) == "shared");
    CHECK(node.state_of(1) == "left out");
    CHECK(node.state_of(2) == "shared");
    CHECK(node.labels() == 32);  // the last one has all of the first, and two more
    const Json report = node.loader.report();
    CHECK(report["left_out"] == 1);
    CHECK(report["files"][1]["why"].get<std::string>().find(why) != std::string::npos);
    REQUIRE(node.lines.size() == 3);
    CHECK(node.lines[1].starts_with("a session is left out: "));
    CHECK(node.lines[1].find(why) != std::string::npos);
    CHECK(node.loader.is_settled());
  }
}

TEST_CASE("SessionLoader: a robot that finds its frame leaves out what a reload names") {
  const test::TemporaryFolder folder;
  RobotConfig config = Loading::first_config();
  config.frames.mode = FrameMode::kFound;
  Loading node({{.file = write(folder.file("good.tsm"), 30, 0)}}, config);
  node.run(20);
  CHECK(node.state_of(0) == "left out");
  REQUIRE(node.lines.size() == 1);
  CHECK(node.lines[0].find("good.tsm needs a robot whose frame is known") != std::string::npos);
}

TEST_CASE("SessionLoader: what is no longer wanted is removed, and what is new is loaded") {
  const test::TemporaryFolder folder;
  const SessionOptions a{.file = write(folder.file("a.tsm"), 200, 0)};
  const SessionOptions b{.file = write(folder.file("b.tsm"), 50, 1)};
  Loading node({a});
  // Taken out while it is being published.
  node.run(4);
  node.loader.want({b});
  node.run(40);
  CHECK(node.labels() == 50);
  CHECK(node.loader.report()["files"].size() == 1);
  node.loader.want({a, b});
  node.run(40);
  CHECK(node.labels() == 250);
  node.loader.want({a, b});
  node.run(40);
  CHECK(node.labels() == 250);
  SessionOptions heavier = b;
  heavier.weight = 1.0;
  node.loader.want({heavier});
  node.run(60);
  CHECK(node.labels() == 50);
  CHECK(node.one.robot->sharer().sessions().all().front().session.weight == 32768);
  node.loader.want({});
  node.run(40);
  CHECK(node.labels() == 0);
  CHECK(node.loader.report()["files"].empty());
}

TEST_CASE("SessionLoader: where the robot leaves its epoch, all is loaded again") {
  const test::TemporaryFolder folder;
  const SessionOptions a{.file = write(folder.file("a.tsm"), 200, 0)};
  const SessionOptions b{.file = write(folder.file("b.tsm"), 50, 1)};
  const int ticks = GENERATE(2, 4, 40);
  Loading node({a, b});
  node.run(ticks);
  REQUIRE(node.one.robot->sharer().reopen(5, 5) == Status::kOk);
  node.run(60);
  CHECK(node.labels() == 250);
  CHECK(node.loader.is_settled());
  CHECK(node.one.robot->sharer().sessions().all().size() == 2);
  CHECK(node.one.robot->exchange().epochs().own_sessions() == 5);
}

TEST_CASE("SessionLoader: blocks that have no room are counted and said") {
  const test::TemporaryFolder folder;
  const SessionOptions a{.file = write(folder.file("a.tsm"), 200, 0)};
  RobotConfig config = Loading::first_config();
  config.global.replicas.robot_segments = 50;
  Loading node({a}, config);
  node.run(40);
  const Json report = node.loader.report();
  CHECK(report["refused_blocks"] == 150);
  CHECK(report["files"][0]["blocks"] == 50);
  REQUIRE(node.lines.size() == 1);
  CHECK(node.lines[0].ends_with("150 have no room; give a larger [fusion] memory or robot_share"));
}

}  // namespace
}  // namespace tessera
