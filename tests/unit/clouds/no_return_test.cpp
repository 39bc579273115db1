// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The field no_return: what it names are directions, which nobody gets as points.
#include <catch2/catch.hpp>
#include <string>

#include "scans/pcd_reader.hpp"
#include "scans/ply_reader.hpp"

namespace tessera {
namespace {

constexpr const char* kRows = "1 2 3 0 5\n0.6 0 0.8 1 0\n4 5 6 0 7\nnan 0 1 255 0\n0 0 0 0.5 0\n";

std::string pcd(const std::string& field) {
  return "VERSION 0.7\nFIELDS x y z " + field +
         " label\nSIZE 4 4 4 4 4\nTYPE F F F F U\nCOUNT 1 1 1 1 1\nWIDTH 5\nHEIGHT 1\nPOINTS 5\n"
         "DATA ascii\n" +
         kRows;
}
std::string ply(const std::string& field) {
  return "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty "
         "float z\nproperty float " +
         field + "\nproperty uint label\nend_header\n" + kRows;
}

Cloud read(bool is_pcd, const std::string& field, bool with_no_returns) {
  const std::string bytes = is_pcd ? pcd(field) : ply(field);
  const CloudBytes file{"a", bytes, true, with_no_returns};
  Cloud cloud;
  cloud.no_return = {9, 9};  // Of the file before.
  const Outcome<void> done = is_pcd ? read_pcd(file, cloud) : read_ply(file, cloud);
  REQUIRE(done.ok());
  return cloud;
}

}  // namespace

TEST_CASE("no_return: who does not ask for directions gets the returns alone") {
  const Cloud cloud = read(GENERATE(true, false), "no_return", false);
  CHECK(cloud.points_xyzi == std::vector<float>{1, 2, 3, 0, 4, 5, 6, 0});
  CHECK(cloud.raw_ids == std::vector<std::int64_t>{5, 7});
  CHECK(cloud.no_return.empty());
}

TEST_CASE("no_return: who asks gets each point with its flag, whatever its place") {
  const Cloud cloud = read(GENERATE(true, false), "no_return", true);
  CHECK(cloud.num_points() == 5);
  CHECK(cloud.no_return == std::vector<std::uint8_t>{0, 1, 0, 1, 1});
  CHECK(cloud.points_xyzi[4] == 0.6F);
  CHECK(cloud.raw_ids == std::vector<std::int64_t>{5, 0, 7, 0, 0});
}

TEST_CASE("no_return: a cloud without the field is all returns") {
  const Cloud cloud = read(GENERATE(true, false), "quality", GENERATE(true, false));
  CHECK(cloud.num_points() == 5);
  CHECK(cloud.no_return.empty());
}

}  // namespace tessera
