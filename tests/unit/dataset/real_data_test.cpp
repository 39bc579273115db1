// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The recorded street, where it is at hand: that the reading of real files makes sense as a whole.
// Without it the tests say "skipped: no given data", which ctest reports as skipped. A
// $TESSERA_DATA that holds no data set is a mistake and fails them.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

#include "scans/dataset.hpp"
#include "support/read_scan.hpp"

namespace tessera {
namespace {

/// The folder of that name under $TESSERA_DATA, or beside the sources.
std::optional<std::string> real_dataset(const std::string& name) {
  const char* given = std::getenv("TESSERA_DATA");
  const std::filesystem::path root = given != nullptr ? given : TESSERA_DATA_BESIDE_SOURCES;
  const std::filesystem::path dir = root / name;
  if (std::filesystem::is_directory(dir)) return dir.string();
  if (given != nullptr && !std::filesystem::is_directory(root / "semantickitti_08")) {
    FAIL("TESSERA_DATA is " << root.string() << ", which does not hold semantickitti_08");
  }
  WARN("skipped: no given data: " << dir.string() << " is not there; set TESSERA_DATA");
  return std::nullopt;
}

TEST_CASE("Real data: six labelled scans of SemanticKITTI 08") {
  const std::optional<std::string> dir = real_dataset("semantickitti_08");
  if (!dir) return;
  const Outcome<Dataset> dataset = Dataset::open(*dir);
  REQUIRE(dataset.ok());
  CHECK(dataset->num_scans() == 6);
  CHECK(dataset->max_points() > 100000);
  CHECK(dataset->missing().empty());
  CHECK(dataset->check_labels("labels").ok());
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 0);
  REQUIRE(scan.ok());
  CHECK(scan->num_points() == dataset->num_points(0));
  CHECK(scan->unknown.points == 0);
}

TEST_CASE("Real data: the first pose is the identity and the robot drives forward, level") {
  const std::optional<std::string> dir = real_dataset("semantickitti_08");
  if (!dir) return;
  const Outcome<Dataset> dataset = Dataset::open(*dir);
  REQUIRE(dataset.ok());
  const Outcome<test::ReadScan> first = test::read_scan(*dataset, 0);
  REQUIRE(first.ok());
  const Matrix34d T_map_first = first->T_map_sensor;
  CHECK((T_map_first - Matrix34d(Matrix34d::Identity())).cwiseAbs().maxCoeff() < 1e-6);
  const Outcome<test::ReadScan> last = test::read_scan(*dataset, 5);
  REQUIRE(last.ok());
  const Matrix34d T_map_last = last->T_map_sensor;
  CHECK(check_rigid(T_map_last) == Status::kOk);
  CHECK(T_map_last(0, 3) > 1.0);
  CHECK(std::abs(T_map_last(2, 3)) < 0.3);
  CHECK(T_map_last(2, 2) > 0.99);
}

TEST_CASE("Real data: z is up in the map frame, the road lies below the sensor") {
  const std::optional<std::string> dir = real_dataset("semantickitti_08");
  if (!dir) return;
  const Outcome<Dataset> dataset =
      Dataset::open(*dir, {.first = {}, .last = {}, .labels = "labels"});
  REQUIRE(dataset.ok());
  constexpr std::uint8_t kRoad = 9;
  constexpr std::uint8_t kVegetation = 15;
  for (std::size_t i = 0; i < dataset->num_scans(); ++i) {
    const Outcome<test::ReadScan> scan = test::read_scan(*dataset, i);
    REQUIRE(scan.ok());
    double sum_z_m[2] = {0.0, 0.0};
    double count[2] = {0.0, 0.0};
    for (std::size_t p = 0; p < scan->num_points(); ++p) {
      const std::uint8_t component = scan->components[p];
      if (component != kRoad && component != kVegetation) continue;
      const Point3f p_map = transform(scan->T_map_sensor, &scan->points_xyzi[4 * p]);
      sum_z_m[component == kRoad ? 0 : 1] += static_cast<double>(p_map.z());
      count[component == kRoad ? 0 : 1] += 1.0;
    }
    REQUIRE((count[0] > 1000.0 && count[1] > 1000.0));
    // The sensor stands 1.73 m above the road.
    CHECK(sum_z_m[0] / count[0] == Approx(-1.73).margin(0.4));
    CHECK(sum_z_m[1] / count[1] > sum_z_m[0] / count[0] + 0.5);
  }
}

TEST_CASE("Real data: an unlabelled drive without calibration") {
  const std::optional<std::string> dir = real_dataset("kitti_raw_0013");
  if (!dir) return;
  CHECK_FALSE(Dataset::open(*dir).ok());
  const Outcome<Dataset> dataset = Dataset::open(*dir, {.first = {}, .last = {}, .labels = "none"});
  REQUIRE(dataset.ok());
  CHECK(dataset->num_scans() == 36);
  const Outcome<test::ReadScan> scan = test::read_scan(*dataset, 35);
  REQUIRE(scan.ok());
  CHECK(scan->components.front() == dataset->classes().unlabelled());
  CHECK(scan->T_map_sensor.col(3).norm() == Approx(173.0).margin(5.0));
}

}  // namespace
}  // namespace tessera
