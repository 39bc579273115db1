// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What lies on disk after a simulation, and what happens when it cannot.
#include "simulator/dataset_writer.hpp"

#include <catch2/catch.hpp>
#include <fstream>
#include <limits>
#include <sstream>
#include <vector>

#include "support/temporary_folder.hpp"

namespace {

namespace fs = std::filesystem;
using tessera::DatasetWriterOptions;
using tessera::FailureKind;
using tessera::SimulatorConfig;
using tessera::StreetSimulator;
using tessera::write_dataset;
using tessera::test::TemporaryFolder;

/// The second robot's 16 beams are what keeps these tests quick, but the first one always comes
/// along.
StreetSimulator street(int robots, int scans) {
  SimulatorConfig config;
  config.seed = 8;
  config.robots = robots;
  config.scans = scans;
  auto simulator = StreetSimulator::make(config);
  REQUIRE(simulator.ok());
  return std::move(*simulator);
}

std::string content(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  REQUIRE(stream);
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  return bytes.str();
}

std::vector<double> numbers(const fs::path& path) {
  std::istringstream stream(content(path));
  std::vector<double> values;
  for (double value = 0.0; stream >> value;) values.push_back(value);
  return values;
}

}  // namespace

TEST_CASE("write_dataset: a folder a robot in the KITTI layout, of matching lengths") {
  const TemporaryFolder scratch;
  const StreetSimulator simulator = street(2, 2);
  REQUIRE(write_dataset(simulator, scratch.path() / "out", {}).ok());
  for (const char* robot : {"robot_0", "robot_1"}) {
    const fs::path folder = scratch.path() / "out" / robot;
    for (const std::string scan : {"000000", "000001"}) {
      const auto points = fs::file_size(folder / "velodyne" / (scan + ".bin"));
      CHECK(points > 0);
      CHECK(points == 4 * fs::file_size(folder / "labels" / (scan + ".label")));
      CHECK(points == 4 * fs::file_size(folder / "predictions" / (scan + ".label")));
    }
    CHECK(numbers(folder / "poses.txt").size() == 24);
    CHECK(numbers(folder / "times.txt").size() == 2);
    CHECK(numbers(folder / "T_global_map.txt").size() == 16);
    CHECK_FALSE(fs::exists(folder / "calib.txt"));
    CHECK_FALSE(fs::exists(folder / "T_global_map_perturbed.txt"));
  }
}

TEST_CASE("write_dataset: the first pose is the identity and the poses read back exactly") {
  const TemporaryFolder scratch;
  const StreetSimulator simulator = street(1, 2);
  REQUIRE(write_dataset(simulator, scratch.path() / "out", {}).ok());
  const auto poses = numbers(scratch.path() / "out" / "robot_0" / "poses.txt");
  const Eigen::Matrix4d expected[] = {Eigen::Matrix4d::Identity(),
                                      simulator.T_map_sensor(0, 1).matrix()};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i % 12 / 4);
    CHECK(poses[i] == expected[i / 12](row, static_cast<Eigen::Index>(i % 4)));
  }
}

TEST_CASE("write_dataset: points and labels on disk are those of the scan") {
  const TemporaryFolder scratch;
  const StreetSimulator simulator = street(1, 1);
  REQUIRE(write_dataset(simulator, scratch.path() / "out", {}).ok());
  const auto scan = simulator.scan(0, 0);
  const std::string bytes =
      content(scratch.path() / "out" / "robot_0" / "predictions" / "000000.label");
  REQUIRE(bytes.size() == 4 * scan.predictions.size());
  bool same = true;
  for (std::size_t i = 0; i < scan.predictions.size(); ++i) {
    same = same && static_cast<unsigned char>(bytes[4 * i]) == scan.predictions[i] % 256;
  }
  CHECK(same);
}

TEST_CASE("write_dataset: labels with weights in a folder of their own, which goes with them") {
  const TemporaryFolder scratch;
  const fs::path folder = scratch.path() / "out" / "robot_0";
  SimulatorConfig config{.robots = 1, .scans = 2, .weighted_labels = 2};
  REQUIRE(write_dataset(*StreetSimulator::make(config), scratch.path() / "out", {}).ok());
  for (const char* const scan : {"000000", "000001"}) {
    CHECK(fs::file_size(folder / "topk" / (std::string(scan) + ".topk")) ==
          2 * fs::file_size(folder / "predictions" / (std::string(scan) + ".label")));
  }
  config.scans = 1;
  REQUIRE(write_dataset(*StreetSimulator::make(config), scratch.path() / "out", {}).ok());
  CHECK_FALSE(fs::exists(folder / "topk" / "000001.topk"));
  config.weighted_labels = 0;
  REQUIRE(write_dataset(*StreetSimulator::make(config), scratch.path() / "out", {}).ok());
  CHECK_FALSE(fs::exists(folder / "topk"));
}

TEST_CASE("write_dataset: the same configuration gives the same bytes") {
  const TemporaryFolder scratch;
  REQUIRE(write_dataset(street(1, 1), scratch.path() / "a", {}).ok());
  REQUIRE(write_dataset(street(1, 1), scratch.path() / "b", {}).ok());
  for (const char* file :
       {"velodyne/000000.bin", "labels/000000.label", "predictions/000000.label", "poses.txt"}) {
    CHECK(content(scratch.path() / "a" / "robot_0" / file) ==
          content(scratch.path() / "b" / "robot_0" / file));
  }
}

TEST_CASE("write_dataset: a pose error adds a perturbed transform and leaves the true one") {
  const TemporaryFolder scratch;
  const StreetSimulator simulator = street(1, 1);
  DatasetWriterOptions options;
  options.pose_error = {0.5, 2.0};
  REQUIRE(write_dataset(simulator, scratch.path() / "out", options).ok());
  const auto truth = numbers(scratch.path() / "out" / "robot_0" / "T_global_map.txt");
  const auto wrong = numbers(scratch.path() / "out" / "robot_0" / "T_global_map_perturbed.txt");
  REQUIRE(wrong.size() == 16);
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> T(truth.data());
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> P(wrong.data());
  CHECK(T == simulator.T_global_map(0).matrix());
  CHECK((P.block<3, 1>(0, 3) - T.block<3, 1>(0, 3)).norm() < 3.0);
  CHECK((P.block<3, 1>(0, 3) - T.block<3, 1>(0, 3)).norm() > 0.01);
  CHECK(
      (P.block<3, 3>(0, 0) * P.block<3, 3>(0, 0).transpose() - Eigen::Matrix3d::Identity()).norm() <
      1e-9);
  CHECK(P.row(3) == Eigen::RowVector4d(0, 0, 0, 1));
}

TEST_CASE("write_dataset: progress counts the scans of all robots up to the total") {
  const TemporaryFolder scratch;
  std::vector<std::pair<int, int>> calls;
  DatasetWriterOptions options;
  options.progress = [&](int done, int total) { calls.emplace_back(done, total); };
  REQUIRE(write_dataset(street(2, 1), scratch.path() / "out", options).ok());
  CHECK(calls == std::vector<std::pair<int, int>>{{1, 2}, {2, 2}});
}

TEST_CASE(
    "write_dataset: a shorter run leaves no scans of a longer one, and touches nothing else") {
  const TemporaryFolder scratch;
  REQUIRE(write_dataset(street(1, 2), scratch.path() / "out", {}).ok());
  std::ofstream(scratch.path() / "out" / "robot_0" / "velodyne" / "notes.txt") << "mine";
  REQUIRE(write_dataset(street(1, 1), scratch.path() / "out", {}).ok());
  CHECK(fs::exists(scratch.path() / "out" / "robot_0" / "velodyne" / "000000.bin"));
  CHECK_FALSE(fs::exists(scratch.path() / "out" / "robot_0" / "velodyne" / "000001.bin"));
  CHECK_FALSE(fs::exists(scratch.path() / "out" / "robot_0" / "labels" / "000001.label"));
  CHECK(fs::exists(scratch.path() / "out" / "robot_0" / "velodyne" / "notes.txt"));
}

TEST_CASE("write_dataset: a folder with more robots than configured is refused") {
  const TemporaryFolder scratch;
  fs::create_directories(scratch.path() / "out" / "robot_1");
  const auto outcome = write_dataset(street(1, 1), scratch.path() / "out", {});
  REQUIRE_FALSE(outcome.ok());
  CHECK(outcome.failure().kind == FailureKind::kUsage);
  CHECK(outcome.failure().text().find("robot_1") != std::string::npos);
}

TEST_CASE("write_dataset: a file in the place of the output folder is refused") {
  const TemporaryFolder scratch;
  std::ofstream(scratch.path() / "out") << "x";
  const auto outcome = write_dataset(street(1, 1), scratch.path() / "out", {});
  REQUIRE_FALSE(outcome.ok());
  CHECK(outcome.failure().kind == FailureKind::kUsage);
}

TEST_CASE("write_dataset: a folder that cannot be made is refused by name") {
  const fs::path nowhere = "/proc/tessera-cannot-write-here";
  const auto outcome = write_dataset(street(1, 1), nowhere, {});
  REQUIRE_FALSE(outcome.ok());
  CHECK(outcome.failure().kind == FailureKind::kUsage);
  CHECK(outcome.failure().text().find(nowhere.string()) != std::string::npos);
  CHECK(outcome.failure().text().find('\n') == std::string::npos);
}

TEST_CASE(
    "write_dataset: a file that cannot be replaced is refused, without poses and without a stray "
    "part") {
  const TemporaryFolder scratch;
  const fs::path folder = scratch.path() / "out" / "robot_0";
  fs::create_directories(folder / "velodyne" / "000000.bin");
  const auto outcome = write_dataset(street(1, 1), scratch.path() / "out", {});
  REQUIRE_FALSE(outcome.ok());
  CHECK(outcome.failure().kind == FailureKind::kUsage);
  CHECK_FALSE(fs::exists(folder / "poses.txt"));
  CHECK(std::distance(fs::directory_iterator(folder / "velodyne"), {}) == 1);
}

TEST_CASE("write_dataset: negative and infinite pose errors are refused") {
  const TemporaryFolder scratch;
  DatasetWriterOptions options;
  options.pose_error.translation_m = -0.1;
  CHECK_FALSE(write_dataset(street(1, 1), scratch.path() / "out", options).ok());
  options.pose_error = {0.0, std::numeric_limits<double>::infinity()};
  CHECK_FALSE(write_dataset(street(1, 1), scratch.path() / "out", options).ok());
  CHECK_FALSE(fs::exists(scratch.path() / "out"));
}
