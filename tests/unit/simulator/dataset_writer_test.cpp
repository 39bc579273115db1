// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What lies on disk after a simulation, and what happens when it cannot.
#include "simulator/dataset_writer.hpp"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <limits>
#include <sstream>
#include <vector>

namespace {

namespace fs = std::filesystem;
using tessera::DatasetWriterOptions;
using tessera::FailureKind;
using tessera::SimulatorConfig;
using tessera::StreetSimulator;
using tessera::write_dataset;

/// A folder of its own for each test, gone afterwards.
class Scratch {
 public:
  Scratch() {
    std::string name =
        (fs::temp_directory_path() / "tessera-simulator-").string() + std::string(6, 'X');
    path_ = mkdtemp(name.data());
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  [[nodiscard]] fs::path operator/(const std::string& name) const { return path_ / name; }

 private:
  fs::path path_;
};

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
  const Scratch scratch;
  const StreetSimulator simulator = street(2, 2);
  REQUIRE(write_dataset(simulator, scratch / "out", {}).ok());
  for (const char* robot : {"robot_0", "robot_1"}) {
    const fs::path folder = scratch / "out" / robot;
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
  const Scratch scratch;
  const StreetSimulator simulator = street(1, 2);
  REQUIRE(write_dataset(simulator, scratch / "out", {}).ok());
  const auto poses = numbers(scratch / "out" / "robot_0" / "poses.txt");
  const Eigen::Matrix4d expected[] = {Eigen::Matrix4d::Identity(),
                                      simulator.T_map_sensor(0, 1).matrix()};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i % 12 / 4);
    CHECK(poses[i] == expected[i / 12](row, static_cast<Eigen::Index>(i % 4)));
  }
}

TEST_CASE("write_dataset: points and labels on disk are those of the scan") {
  const Scratch scratch;
  const StreetSimulator simulator = street(1, 1);
  REQUIRE(write_dataset(simulator, scratch / "out", {}).ok());
  const auto scan = simulator.scan(0, 0);
  const std::string bytes = content(scratch / "out" / "robot_0" / "predictions" / "000000.label");
  REQUIRE(bytes.size() == 4 * scan.predictions.size());
  bool same = true;
  for (std::size_t i = 0; i < scan.predictions.size(); ++i) {
    same = same && static_cast<unsigned char>(bytes[4 * i]) == scan.predictions[i] % 256;
  }
  CHECK(same);
}

TEST_CASE("write_dataset: the same configuration gives the same bytes") {
  const Scratch scratch;
  REQUIRE(write_dataset(street(1, 1), scratch / "a", {}).ok());
  REQUIRE(write_dataset(street(1, 1), scratch / "b", {}).ok());
  for (const char* file :
       {"velodyne/000000.bin", "labels/000000.label", "predictions/000000.label", "poses.txt"}) {
    CHECK(content(scratch / "a" / "robot_0" / file) == content(scratch / "b" / "robot_0" / file));
  }
}

TEST_CASE("write_dataset: a pose error adds a perturbed transform and leaves the true one") {
  const Scratch scratch;
  const StreetSimulator simulator = street(1, 1);
  DatasetWriterOptions options;
  options.pose_error = {0.5, 2.0};
  REQUIRE(write_dataset(simulator, scratch / "out", options).ok());
  const auto truth = numbers(scratch / "out" / "robot_0" / "T_global_map.txt");
  const auto wrong = numbers(scratch / "out" / "robot_0" / "T_global_map_perturbed.txt");
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
  const Scratch scratch;
  std::vector<std::pair<int, int>> calls;
  DatasetWriterOptions options;
  options.progress = [&](int done, int total) { calls.emplace_back(done, total); };
  REQUIRE(write_dataset(street(2, 1), scratch / "out", options).ok());
  CHECK(calls == std::vector<std::pair<int, int>>{{1, 2}, {2, 2}});
}

TEST_CASE(
    "write_dataset: a shorter run leaves no scans of a longer one, and touches nothing else") {
  const Scratch scratch;
  REQUIRE(write_dataset(street(1, 2), scratch / "out", {}).ok());
  std::ofstream(scratch / "out" / "robot_0" / "velodyne" / "notes.txt") << "mine";
  REQUIRE(write_dataset(street(1, 1), scratch / "out", {}).ok());
  CHECK(fs::exists(scratch / "out" / "robot_0" / "velodyne" / "000000.bin"));
  CHECK_FALSE(fs::exists(scratch / "out" / "robot_0" / "velodyne" / "000001.bin"));
  CHECK_FALSE(fs::exists(scratch / "out" / "robot_0" / "labels" / "000001.label"));
  CHECK(fs::exists(scratch / "out" / "robot_0" / "velodyne" / "notes.txt"));
}

TEST_CASE("write_dataset: a folder with more robots than configured is refused") {
  const Scratch scratch;
  fs::create_directories(scratch / "out" / "robot_1");
  const auto outcome = write_dataset(street(1, 1), scratch / "out", {});
  REQUIRE_FALSE(outcome.ok());
  CHECK(outcome.failure().kind == FailureKind::kUsage);
  CHECK(outcome.failure().message.find("robot_1") != std::string::npos);
}

TEST_CASE("write_dataset: a file in the place of the output folder is refused") {
  const Scratch scratch;
  std::ofstream(scratch / "out") << "x";
  const auto outcome = write_dataset(street(1, 1), scratch / "out", {});
  REQUIRE_FALSE(outcome.ok());
  CHECK(outcome.failure().kind == FailureKind::kUsage);
}

TEST_CASE("write_dataset: a folder that cannot be made is a failure that names it") {
  const fs::path nowhere = "/proc/tessera-cannot-write-here";
  const auto outcome = write_dataset(street(1, 1), nowhere, {});
  REQUIRE_FALSE(outcome.ok());
  CHECK(outcome.failure().kind == FailureKind::kFailure);
  CHECK(outcome.failure().message.find(nowhere.string()) != std::string::npos);
  CHECK(outcome.failure().message.find('\n') == std::string::npos);
}

TEST_CASE(
    "write_dataset: a file that cannot be replaced is a failure, without poses and without a stray "
    "part") {
  const Scratch scratch;
  const fs::path folder = scratch / "out" / "robot_0";
  fs::create_directories(folder / "velodyne" / "000000.bin");
  const auto outcome = write_dataset(street(1, 1), scratch / "out", {});
  REQUIRE_FALSE(outcome.ok());
  CHECK(outcome.failure().kind == FailureKind::kFailure);
  CHECK_FALSE(fs::exists(folder / "poses.txt"));
  CHECK_FALSE(fs::exists(folder / "velodyne" / "000000.bin.part"));
}

TEST_CASE("write_dataset: negative and infinite pose errors are refused") {
  const Scratch scratch;
  DatasetWriterOptions options;
  options.pose_error.translation_m = -0.1;
  CHECK_FALSE(write_dataset(street(1, 1), scratch / "out", options).ok());
  options.pose_error = {0.0, std::numeric_limits<double>::infinity()};
  CHECK_FALSE(write_dataset(street(1, 1), scratch / "out", options).ok());
  CHECK_FALSE(fs::exists(scratch / "out"));
}
