// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What write_ply promises: headers and byte counts that readers rely on, closed surfaces without
// inner faces, and clean failures.
#include "pictures/ply.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "pictures/ply_mesh.hpp"
#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

using test::TemporaryFolder;

constexpr Color kRed{255, 30, 30};
constexpr Color kBlue{100, 150, 245};
constexpr std::size_t kPointBytes = 28;
constexpr std::size_t kCornerBytes = 15;
constexpr std::size_t kQuadBytes = 17;

PlyVoxel voxel(int x, int y, int z, Color color = kRed) {
  const auto centre = [](int k) { return (static_cast<float>(k) + 0.5F) * 0.1F; };
  return {centre(x), centre(y), centre(z), color, 7, 0.75F, 0.0625F, 12.5F};
}

struct PlyFile {
  std::string header;
  std::string body;
};

PlyFile write(const std::vector<PlyVoxel>& voxels, PlyForm form) {
  const TemporaryFolder folder;
  REQUIRE(write_ply(voxels, 0.1F, folder.file("map.ply"), form).ok());
  REQUIRE(folder.num_entries() == 1);
  const std::string bytes = folder.read("map.ply");
  const std::string last_line = "end_header\n";
  const std::size_t end = bytes.find(last_line) + last_line.size();
  return {bytes.substr(0, end), bytes.substr(end)};
}

/// Little-endian, whatever the machine that runs the test.
float float_at(const std::string& bytes, std::size_t offset) {
  std::uint32_t bits = 0;
  for (std::size_t i = 4; i-- > 0;)
    bits = bits << 8U | static_cast<unsigned char>(bytes[offset + i]);
  return std::bit_cast<float>(bits);
}

TEST_CASE("write_ply: points tell the number of robots where any voxel has some") {
  PlyVoxel seen = voxel(0, 0, 0);
  seen.robots = 3;
  const PlyFile file = write({seen, voxel(5, 0, 0)}, PlyForm::kPoints);
  CHECK(file.header.find("property float evidence\nproperty uchar robots\nend_header\n") !=
        std::string::npos);
  REQUIRE(file.body.size() == 2 * (kPointBytes + 1));
  CHECK(file.body[kPointBytes] == 3);
  CHECK(file.body[2 * kPointBytes + 1] == 0);
}

TEST_CASE("write_ply: the header of points names every property in the order of the bytes") {
  REQUIRE(
      write({voxel(0, 0, 0), voxel(5, 0, 0)}, PlyForm::kPoints).header ==
      "ply\nformat binary_little_endian 1.0\ncomment voxels of a tessera map, metres, map frame\n"
      "comment label: the most likely class; probability, variance: of that class\n"
      "comment evidence: the sum of all counts, free and unlabelled ones too\n"
      "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar label\n"
      "property float probability\nproperty float variance\nproperty float evidence\nend_header\n");
}

TEST_CASE("write_ply: comments name the labels, each on one line") {
  const TemporaryFolder folder;
  const std::vector<PlyVoxel> voxels(1, voxel(1, 2, 3));
  const std::vector<std::string> names{"", "car", "two\nlines"};
  REQUIRE(write_ply(voxels, 0.1F, folder.file("map.ply"), PlyForm::kPoints, names).ok());
  const std::string bytes = folder.read("map.ply");
  REQUIRE(bytes.find("\ncomment label 1 car\ncomment label 2 two lines\nelement ") <
          bytes.find("end_header\n"));
  REQUIRE(bytes.find("comment label 0") == std::string::npos);
}

TEST_CASE("write_ply: points take 28 bytes each and nothing more") {
  const std::size_t count = GENERATE(0U, 1U, 2U, 100'000U);
  const std::vector<PlyVoxel> voxels(count, voxel(1, 2, 3));
  REQUIRE(write(voxels, PlyForm::kPoints).body.size() == count * kPointBytes);
}

TEST_CASE("write_ply: a point's bytes are its centre, colour, label and estimate") {
  const std::string body = write({voxel(-1, 2, 3, kBlue)}, PlyForm::kPoints).body;
  REQUIRE(float_at(body, 0) == Approx(-0.05));
  REQUIRE(float_at(body, 4) == Approx(0.25));
  REQUIRE(float_at(body, 8) == Approx(0.35));
  REQUIRE(body.substr(12, 4) == std::string("\x64\x96\xF5\x07", 4));
  REQUIRE(float_at(body, 16) == 0.75F);
  REQUIRE(float_at(body, 20) == 0.0625F);
  REQUIRE(float_at(body, 24) == 12.5F);
}

TEST_CASE("write_ply: the mesh of one voxel has 8 vertices and 6 quads") {
  const PlyFile file = write({voxel(0, 0, 0)}, PlyForm::kCubes);
  REQUIRE_THAT(file.header, Catch::Contains("element vertex 8\n"));
  REQUIRE_THAT(file.header,
               Catch::Contains("element face 6\nproperty list uchar int vertex_indices\n"));
  REQUIRE(file.body.size() == 8 * kCornerBytes + 6 * kQuadBytes);
}

TEST_CASE("write_ply: a mesh's vertices are half a voxel away from the centre") {
  const std::string body = write({voxel(3, 3, 3)}, PlyForm::kCubes).body;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float distance = std::abs(float_at(body, corner * kCornerBytes + 4 * axis) - 0.35F);
      REQUIRE(distance == Approx(0.05).margin(1.0e-6));
    }
  }
}

TEST_CASE("make_voxel_mesh: adjacent voxels of one colour share corners and have no inner faces") {
  const PlyVoxel neighbour = GENERATE(voxel(1, 0, 0), voxel(-1, 0, 0), voxel(0, 1, 0),
                                      voxel(0, -1, 0), voxel(0, 0, 1), voxel(0, 0, -1));
  const VoxelMesh mesh = make_voxel_mesh(std::vector<PlyVoxel>{voxel(0, 0, 0), neighbour}, 0.1F);
  REQUIRE(mesh.corners.size() == 12);
  REQUIRE(mesh.quads.size() == 10);
}

TEST_CASE(
    "make_voxel_mesh: adjacent voxels of two colours keep their own corners, still without inner "
    "faces") {
  const std::vector<PlyVoxel> voxels{voxel(0, 0, 0, kRed), voxel(1, 0, 0, kBlue)};
  const VoxelMesh mesh = make_voxel_mesh(voxels, 0.1F);
  REQUIRE(mesh.corners.size() == 16);
  REQUIRE(mesh.quads.size() == 10);
}

TEST_CASE("make_voxel_mesh: a block of voxels shows its surface only") {
  std::vector<PlyVoxel> voxels;
  for (int i = 0; i < 1000; ++i) voxels.push_back(voxel(i % 10 - 5, i / 10 % 10 - 5, i / 100 - 5));
  const VoxelMesh mesh = make_voxel_mesh(voxels, 0.1F);
  REQUIRE(mesh.quads.size() == 600);
  REQUIRE(mesh.corners.size() == 602);
}

TEST_CASE(
    "make_voxel_mesh: quads are counter-clockwise from outside, so the enclosed volume is "
    "positive") {
  const std::vector<PlyVoxel> voxels{voxel(0, 0, 0), voxel(1, 0, 0), voxel(1, 1, 0),
                                     voxel(7, 7, 7, kBlue)};
  const VoxelMesh mesh = make_voxel_mesh(voxels, 0.1F);
  std::int64_t six_volumes = 0;
  const auto add = [&](const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
    six_volumes += a.x * (b.y * c.z - b.z * c.y) + a.y * (b.z * c.x - b.x * c.z) +
                   a.z * (b.x * c.y - b.y * c.x);
  };
  for (const auto& quad : mesh.quads) {
    add(mesh.corners[quad[0]].at, mesh.corners[quad[1]].at, mesh.corners[quad[2]].at);
    add(mesh.corners[quad[0]].at, mesh.corners[quad[2]].at, mesh.corners[quad[3]].at);
  }
  REQUIRE(six_volumes == 6 * 4);
}

TEST_CASE("make_voxel_mesh: repeated voxels and voxels out of reach are left out and counted") {
  std::vector<PlyVoxel> voxels{voxel(0, 0, 0), voxel(0, 0, 0, kBlue)};
  voxels.push_back({1.0e30F, 0.0F, 0.0F, kRed});
  const VoxelMesh mesh = make_voxel_mesh(voxels, 0.1F);
  REQUIRE(mesh.voxels == 1);
  REQUIRE(mesh.left_out == 2);
}

TEST_CASE("write_ply: voxels that are not finite are left out and counted") {
  const TemporaryFolder folder;
  const PlyForm form = GENERATE(PlyForm::kPoints, PlyForm::kCubes);
  std::vector<PlyVoxel> voxels{voxel(0, 0, 0), voxel(1, 1, 1), voxel(2, 2, 2)};
  voxels[0].x = std::numeric_limits<float>::quiet_NaN();
  voxels[1].z = std::numeric_limits<float>::infinity();
  const Outcome<WriteReport> report = write_ply(voxels, 0.1F, folder.file("map.ply"), form);
  REQUIRE(report.ok());
  REQUIRE((*report).voxels == 1);
  REQUIRE((*report).left_out == 2);
}

TEST_CASE("write_ply: without voxels the file is valid and has no elements") {
  const PlyForm form = GENERATE(PlyForm::kPoints, PlyForm::kCubes);
  const PlyFile file = write({}, form);
  REQUIRE_THAT(file.header, Catch::Contains("element vertex 0\n"));
  REQUIRE(file.body.empty());
}

TEST_CASE("write_ply: a resolution that is not positive is refused and nothing is written") {
  const TemporaryFolder folder;
  const float resolution_m = GENERATE(0.0F, -0.1F, std::numeric_limits<float>::quiet_NaN());
  REQUIRE_FALSE(write_ply({}, resolution_m, folder.file("map.ply")).ok());
  REQUIRE(folder.num_entries() == 0);
}

TEST_CASE("write_ply: a folder that does not exist is refused with the path in the message") {
  const TemporaryFolder folder;
  const std::string path = folder.file("missing/map.ply");
  const Outcome<WriteReport> report = write_ply({}, 0.1F, path);
  REQUIRE_FALSE(report.ok());
  REQUIRE_THAT(report.failure().text(), Catch::Contains(path));
  REQUIRE(folder.num_entries() == 0);
}

}  // namespace
}  // namespace tessera
