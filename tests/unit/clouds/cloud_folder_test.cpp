// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A folder of clouds as a source of scans: the order of its files, their poses and labels.
#include "scans/cloud_folder.hpp"

#include <catch2/catch.hpp>

#include "sample_clouds.hpp"
#include "support/read_scan.hpp"
#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

using namespace test;
using Catch::Matchers::Contains;

/// One labelled point at x.
std::string one_point(int x, const std::string& label) {
  PcdLines lines;
  lines.fields = "x y z label";
  lines.sizes = "4 4 4 4";
  lines.types = "F F F U";
  lines.counts = "1 1 1 1";
  lines.points = lines.width = "1";
  return pcd_header(lines) + std::to_string(x) + " 0 0 " + label + "\n";
}

std::string poses(int count) {
  std::string text;
  for (int i = 0; i < count; ++i) text += "1 0 0 " + std::to_string(i) + " 0 1 0 0 0 0 1 0\n";
  return text;
}

/// scan_8 .. scan_11, their points at x = 8 .. 11.
void write_four(const TemporaryFolder& folder) {
  for (int i = 8; i < 12; ++i)
    folder.write("clouds/scan_" + std::to_string(i) + ".pcd", one_point(i, "40"));
  folder.write("clouds/notes.txt", "not a cloud");
  folder.write("poses.txt", poses(4));
}

Outcome<CloudFolder> open(const TemporaryFolder& folder, std::optional<int> first = {},
                          std::optional<int> last = {}) {
  CloudOptions options;
  options.poses = folder.file("poses.txt");
  options.first = first;
  options.last = last;
  return CloudFolder::open(folder.file("clouds"), options);
}

TEST_CASE("clouds: names are ordered by their numbers") {
  const std::vector<std::string> sorted{"a.pcd",
                                        "scan_9.pcd",
                                        "scan_10.pcd",
                                        "scan_010a.pcd",
                                        "scan_99999999999999999999998.pcd",
                                        "scan_99999999999999999999999.pcd",
                                        "scan_a.pcd"};
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    for (std::size_t j = 0; j < sorted.size(); ++j)
      CHECK(is_before_by_number(sorted[i], sorted[j]) == (i < j));
  }
  CHECK(is_before_by_number("01", "1"));
  CHECK_FALSE(is_before_by_number("1", "01"));
}

TEST_CASE("clouds: scans come in order, each with its pose and labels") {
  const TemporaryFolder folder;
  write_four(folder);
  const Outcome<CloudFolder> clouds = open(folder, 1, 7);
  REQUIRE(clouds.ok());
  REQUIRE(clouds->num_scans() == 3);
  CHECK(clouds->num_files() == 4);
  CHECK(clouds->num_labelled() == 3);
  CHECK(clouds->max_points() == 1);
  for (std::size_t i = 0; i < 3; ++i) {
    const Outcome<test::ReadScan> scan = test::read_scan(*clouds, i);
    REQUIRE(scan.ok());
    CHECK(scan->number == static_cast<int>(i) + 1);
    CHECK(scan->points_xyzi[0] == 9.0F + static_cast<float>(i));
    CHECK(scan->T_map_sensor(0, 3) == 1.0 + static_cast<double>(i));
    REQUIRE(scan->num_points() == 1);
    CHECK(scan->components[0] == 9);  // road
  }
}

TEST_CASE("clouds: ids in no class are counted, the instance above 16 bits is not looked at") {
  const TemporaryFolder folder;
  folder.write("clouds/0.pcd", one_point(1, "777"));
  folder.write("clouds/1.pcd", one_point(1, std::to_string((3 << 16) + 40)));
  folder.write("poses.txt", poses(2));
  const Outcome<CloudFolder> clouds = open(folder);
  REQUIRE(clouds.ok());
  const Outcome<test::ReadScan> unknown = test::read_scan(*clouds, 0);
  REQUIRE(unknown.ok());
  CHECK(unknown->unknown.points == 1);
  CHECK(unknown->unknown.examples[0] == 777);
  CHECK(unknown->components[0] == clouds->classes().unlabelled());
  const Outcome<test::ReadScan> instance = test::read_scan(*clouds, 1);
  REQUIRE(instance.ok());
  CHECK(instance->unknown.points == 0);
  CHECK(instance->components[0] == 9);
}

TEST_CASE("clouds: without labels, wanted or there, points are unlabelled") {
  const TemporaryFolder folder;
  folder.write("clouds/0.pcd", one_point(1, "40"));
  folder.write("clouds/1.pcd", one_point(1, "0.5"));  // None of ours, and nobody asks.
  folder.write("poses.txt", poses(2));
  CloudOptions options;
  options.poses = folder.file("poses.txt");
  options.with_labels = false;
  const Outcome<CloudFolder> clouds = CloudFolder::open(folder.file("clouds"), options);
  REQUIRE(clouds.ok());
  for (std::size_t i = 0; i < 2; ++i) {
    const Outcome<test::ReadScan> scan = test::read_scan(*clouds, i);
    REQUIRE(scan.ok());
    CHECK(scan->components[0] == clouds->classes().unlabelled());
  }
  options.with_labels = true;
  CHECK_THAT(
      test::read_scan(*CloudFolder::open(folder.file("clouds"), options), 1).failure().text(),
      Contains("1.pcd") && Contains("the label is not a whole number"));
}

TEST_CASE(
    "clouds: each chosen file needs its row of the poses, and what else is there is no matter") {
  const TemporaryFolder folder;
  write_four(folder);
  for (const int count : {0, 3}) {
    folder.write("poses.txt", poses(count));
    const Outcome<CloudFolder> clouds = open(folder);
    REQUIRE_FALSE(clouds.ok());
    CHECK_THAT(clouds.failure().text(), Contains("clouds has 4 .pcd files, but "));
    CHECK_THAT(clouds.failure().text(),
               Contains("poses.txt has " + std::to_string(count) + " poses"));
  }
  CHECK(open(folder, 0, 2)->num_scans() == 3);
  CHECK_FALSE(open(folder, 1, 3).ok());
  folder.write("poses.txt", poses(5));
  const Outcome<CloudFolder> more = open(folder);
  REQUIRE(more.ok());
  CHECK(more->num_scans() == 4);
  CHECK(more->num_poses() == 5);
}

TEST_CASE("clouds: what is missing or out of range is refused") {
  const TemporaryFolder folder;
  CHECK_THAT(open(folder).failure().text(), Contains("cannot list"));
  folder.write("clouds/0.ply", "ply\n");
  CHECK_THAT(open(folder).failure().text(), Contains("there are no .pcd files"));
  write_four(folder);
  CHECK_THAT(open(folder, 4).failure().text(), Contains("from 0 to 3"));
  CHECK_THAT(open(folder, 2, 1).failure().text(), Contains("from 0 to 3"));
  CHECK_THAT(open(folder, -1).failure().text(), Contains("negative"));
}

TEST_CASE(
    "clouds: a damaged header is refused before any scan is read, a damaged row with its file") {
  const TemporaryFolder folder;
  write_four(folder);
  const std::string good = one_point(11, "40");
  folder.write("clouds/scan_11.pcd", good.substr(0, good.size() / 2));
  CHECK_THAT(open(folder).failure().text(), Contains("scan_11.pcd"));
  folder.write("clouds/scan_11.pcd", good.substr(0, good.size() - 4) + "x40\n");
  const Outcome<CloudFolder> clouds = open(folder);
  REQUIRE(clouds.ok());
  const Outcome<test::ReadScan> scan = test::read_scan(*clouds, 3);
  REQUIRE_FALSE(scan.ok());
  CHECK_THAT(scan.failure().text(), Contains("scan_11.pcd, line 12"));
}

TEST_CASE("clouds: a file that has grown since it was looked at is refused") {
  const TemporaryFolder folder;
  folder.write("clouds/0.pcd", one_point(1, "40"));
  folder.write("poses.txt", poses(1));
  const Outcome<CloudFolder> clouds = open(folder);
  REQUIRE(clouds.ok());
  folder.write("clouds/0.pcd", pcd_header({}) + "1 2 3\n4 5 6\n");
  const Outcome<test::ReadScan> scan = test::read_scan(*clouds, 0);
  REQUIRE_FALSE(scan.ok());
  CHECK(scan.failure().kind == FailureKind::kFailure);
}

}  // namespace
}  // namespace tessera
