// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// OctoMap's files byte by byte, and those that are none.
#include "maps/octree_reader.hpp"

#include <bit>
#include <catch2/catch.hpp>

namespace tessera {
namespace {

using Catch::Matchers::Contains;

std::string header(const std::string& first, std::uint64_t size, const std::string& id = "OcTree") {
  return first + "\n# a comment\n#\nid " + id + "\nsize " + std::to_string(size) +
         "\nres 0.25\ndata\n";
}
std::string binary(std::uint64_t size) { return header("# Octomap OcTree binary file", size); }
std::string full(std::uint64_t size, const std::string& id = "OcTree") {
  return header("# Octomap OcTree file", size, id);
}

std::string node(float log_odds, int children) {
  const auto bits = std::bit_cast<std::uint32_t>(log_odds);
  std::string bytes;
  for (unsigned shift = 0; shift < 32; shift += 8)
    bytes += static_cast<char>((bits >> shift) & 0xFFU);
  return bytes + static_cast<char>(children);
}
std::string two(int first, int second) {
  return {static_cast<char>(first), static_cast<char>(second)};
}

std::vector<OctreeLeaf> leaves_of(const std::string& file) {
  const Outcome<Octree> octree = Octree::parse("a.bt", file);
  INFO(octree.failure().text());
  REQUIRE(octree.ok());
  std::vector<OctreeLeaf> leaves;
  octree->for_each_leaf([&](const OctreeLeaf& leaf) { leaves.push_back(leaf); });
  return leaves;
}

std::string refusal(const std::string& file) {
  const Outcome<Octree> octree = Octree::parse("a.bt", file);
  REQUIRE_FALSE(octree.ok());
  CHECK(octree.failure().kind == FailureKind::kUsage);
  CHECK_THAT(octree.failure().text(), Contains("a.bt: "));
  return octree.failure().text();
}

TEST_CASE("octree: two bits a child of a .bt file") {
  // Child 0 free, child 1 (+x) occupied, child 7 inner with child 2 (+y) occupied.
  const std::vector<OctreeLeaf> leaves =
      leaves_of(binary(5) + two(0b1001, 0b11000000) + two(0b100000, 0));
  REQUIRE(leaves.size() == 3);
  CHECK_FALSE(leaves[0].occupied);
  CHECK(leaves[0].level == 15);
  CHECK(leaves[0].corner == VoxelCoord{-32768, -32768, -32768});
  CHECK(leaves[1].occupied);
  CHECK(leaves[1].corner == VoxelCoord{0, -32768, -32768});
  CHECK(leaves[2].level == 14);
  CHECK(leaves[2].corner == VoxelCoord{0, 16384, 0});
}

TEST_CASE("octree: a float and a byte a node of a .ot file") {
  const std::string root = node(2.0F, 0b10000001);
  const std::vector<OctreeLeaf> leaves = leaves_of(full(3) + root + node(-1.0F, 0) + node(0.0F, 0));
  REQUIRE(leaves.size() == 2);
  CHECK_FALSE(leaves[0].occupied);
  CHECK(leaves[1].occupied);
  CHECK(leaves[1].corner == VoxelCoord{0, 0, 0});
  const Outcome<Octree> octree = Octree::parse("a.ot", full(1) + node(1.0F, 0));
  REQUIRE(octree.ok());
  CHECK(octree->num_occupied() == std::uint64_t{1} << 48U);
}

TEST_CASE("octree: colours of a ColorOcTree are passed over") {
  const std::string colored = node(1.0F, 0).insert(4, "rgb");
  CHECK(leaves_of(full(1, "ColorOcTree") + colored).size() == 1);
}

TEST_CASE("octree: a chain down to a voxel, and no further") {
  std::string chain;
  for (int level = 0; level < 15; ++level) chain += two(3, 0);
  const std::vector<OctreeLeaf> leaves = leaves_of(binary(17) + chain + two(2, 0));
  REQUIRE(leaves.size() == 1);
  CHECK(leaves[0].level == 0);
  CHECK_THAT(refusal(binary(18) + chain + two(3, 0) + two(2, 0)), Contains("16 levels"));
  std::string deep = full(4000000);
  for (int level = 0; level < 100000; ++level) deep += node(1.0F, 1);
  CHECK_THAT(refusal(deep), Contains("16 levels"));
}

TEST_CASE("octree: counts that lie, and trees that end early or late") {
  const std::string tree = two(1, 0);
  CHECK(leaves_of(binary(2) + tree).size() == 1);
  CHECK_THAT(refusal(binary(3) + tree), Contains("says 3 nodes, but it has 2"));
  CHECK_THAT(refusal(binary(18446744073709551615U) + tree), Contains("but it has 2"));
  CHECK_THAT(refusal(binary(0) + tree), Contains("after its tree"));
  CHECK_THAT(refusal(binary(2) + tree + "x"), Contains("after its tree"));
  CHECK_THAT(refusal(binary(2) + tree.substr(1)), Contains("ends too early"));
  CHECK_THAT(refusal(binary(2)), Contains("ends too early"));
  CHECK_THAT(refusal(full(2) + node(1.0F, 1) + "abcd"), Contains("ends too early"));
  CHECK_THAT(refusal(binary(2) + two(3, 0) + two(0, 0)), Contains("without children"));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK_THAT(refusal(full(1) + node(nan, 0)), Contains("not a number"));
}

TEST_CASE("octree: headers that are none") {
  const std::string good = binary(0);
  CHECK(leaves_of(good).empty());
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    return text.replace(text.find(from), from.size(), to);
  };
  CHECK_THAT(refusal(""), Contains("does not begin"));
  CHECK_THAT(refusal("\x89PNG"), Contains("does not begin"));
  CHECK_THAT(refusal(with("id OcTree", "id OcTreeStamped")), Contains("'OcTreeStamped'"));
  CHECK_THAT(refusal(with("id OcTree\n", "")), Contains("no line id"));
  CHECK_THAT(refusal(with("size 0", "size -1")), Contains("'-1'"));
  CHECK_THAT(refusal(with("size 0", "size 99999999999999999999")),
             Contains("not a number of nodes"));
  CHECK_THAT(refusal(with("res 0.25", "res 0")), Contains("not a resolution"));
  CHECK_THAT(refusal(with("res 0.25", "res nan")), Contains("not a resolution"));
  CHECK_THAT(refusal(with("res 0.25", "res 1\nres 1")), Contains("duplicate line"));
  CHECK_THAT(refusal(with("res 0.25", "what \x1b[2J")), Contains("'what'"));
  CHECK_THAT(refusal(with("data\n", "")), Contains("no line 'data'"));
  CHECK_THAT(refusal(with("a comment", std::string(5000, 'x'))), Contains("no line 'data'"));
}

}  // namespace
}  // namespace tessera
