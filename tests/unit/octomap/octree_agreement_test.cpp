// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Maps as OctoMap's files: its own library finds the same state in every voxel, and what it writes
// is read here as it reads it.
#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>

#include <catch2/catch.hpp>
#include <memory>
#include <set>
#include <tuple>

#include "maps/octree_reader.hpp"
#include "maps/octree_writer.hpp"
#include "support/random.hpp"
#include "support/small_map.hpp"
#include "support/temporary_folder.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {
namespace {

using Catch::Matchers::Contains;
using Place = std::tuple<int, int, int>;

struct Cells {
  std::set<Place> occupied;
  std::set<Place> free;
  friend bool operator==(const Cells&, const Cells&) = default;
};

void add_cube(const VoxelCoord& corner, int edge, bool occupied, Cells& cells) {
  for (int z = 0; z < edge; ++z)
    for (int y = 0; y < edge; ++y)
      for (int x = 0; x < edge; ++x)
        (occupied ? cells.occupied : cells.free).insert({corner.x + x, corner.y + y, corner.z + z});
}

Cells cells_of(const LocalMap& map) {
  Cells cells;
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  for_each_observed(map, workspace, [&](const VoxelCoord& voxel, const VoxelEvidence&) {
    add_cube(voxel, 1, map.query(voxel).state == VoxelState::kOccupied, cells);
  });
  return cells;
}

Cells cells_of(const Octree& octree) {
  Cells cells;
  octree.for_each_leaf([&](const OctreeLeaf& leaf) {
    add_cube(leaf.corner, 1 << leaf.level, leaf.occupied, cells);
  });
  return cells;
}

/// As OctoMap's own iterator finds them.
template <class Tree>
Cells cells_of(const Tree& tree) {
  Cells cells;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    const octomap::OcTreeKey key = leaf.getIndexKey();
    const VoxelCoord corner{key[0] - kOctreeVoxelLimit, key[1] - kOctreeVoxelLimit,
                            key[2] - kOctreeVoxelLimit};
    add_cube(corner, 1 << (16U - leaf.getDepth()), tree.isNodeOccupied(*leaf), cells);
  }
  return cells;
}

std::unique_ptr<octomap::OcTree> read_by_octomap(const std::string& path, OctreeForm form) {
  if (form == OctreeForm::kBinary) return std::make_unique<octomap::OcTree>(path);
  return std::unique_ptr<octomap::OcTree>(
      dynamic_cast<octomap::OcTree*>(octomap::AbstractOcTree::read(path)));
}

/// Scattered voxels with evidence for and against them, some blocks that are free as a whole, both
/// sides of the origin and the ends of OctoMap's grid.
void fill(LocalMap& map, std::uint64_t seed) {
  oracle::Random random(seed);
  const auto near = [&] { return random.below(48) - 24; };
  for (int i = 0; i < 3000; ++i) {
    const VoxelCoord voxel{near(), near(), near()};
    if (i % 2 == 0)
      REQUIRE(carve(map, voxel) == Status::kOk);
    else
      REQUIRE(hit(map, voxel, 1 + random.below(4), i % 3 == 0 ? 0.25F : 2.0F) == Status::kOk);
  }
  for (int row = 0; row < kBlockVoxels; ++row)
    REQUIRE(carve(map, voxel_of_row({9, -7, 2}, row)) == Status::kOk);
  for (const int end : {-kOctreeVoxelLimit, kOctreeVoxelLimit - 1}) {
    REQUIRE(carve(map, {end, end, 0}) == Status::kOk);
    REQUIRE(hit(map, {0, end, end}, 2, 1.0F) == Status::kOk);
  }
}

MapConfig config_at(double resolution_m) {
  MapConfig config = config_of_pages(2000);
  config.resolution_m = resolution_m;
  return config;
}

TEST_CASE("octomap: its library finds the map's state in every voxel, and no other voxel") {
  const test::TemporaryFolder folder;
  for (const double resolution_m : {0.1, 0.05, 1.0 / 3.0}) {
    SmallMap small(config_at(resolution_m));
    fill(small.map, 21);
    const Cells expected = cells_of(small.map);
    REQUIRE(expected.occupied.size() > 500);
    REQUIRE(expected.free.size() > 1500);
    for (const OctreeForm form : {OctreeForm::kBinary, OctreeForm::kFull}) {
      const std::string path = folder.file(form == OctreeForm::kBinary ? "map.bt" : "map.ot");
      const Outcome<OctreeReport> written = write_octree(small.map, {.form = form}, path);
      REQUIRE(written.ok());
      CHECK(written->occupied == expected.occupied.size());
      CHECK(written->free == expected.free.size());
      const std::unique_ptr<octomap::OcTree> tree = read_by_octomap(path, form);
      REQUIRE(tree != nullptr);
      CHECK(tree->getResolution() == resolution_m);
      CHECK(tree->size() == written->nodes);
      CHECK(cells_of(*tree) == expected);
      const Outcome<Octree> octree = Octree::read(path);
      REQUIRE(octree.ok());
      CHECK(octree->resolution_m() == resolution_m);
      CHECK(octree->num_nodes() == written->nodes);
      CHECK(octree->num_occupied() == expected.occupied.size());
      CHECK(octree->num_free() == expected.free.size());
      CHECK(cells_of(*octree) == expected);
    }
  }
}

TEST_CASE("octomap: a point names the same voxel there") {
  const test::TemporaryFolder folder;
  SmallMap small(config_at(0.1));
  fill(small.map, 22);
  const std::string path = folder.file("map.ot");
  REQUIRE(write_octree(small.map, {.form = OctreeForm::kFull}, path).ok());
  const std::unique_ptr<octomap::OcTree> tree = read_by_octomap(path, OctreeForm::kFull);
  oracle::Random random(5);
  for (int i = 0; i < 5000; ++i) {
    const auto at = [&] { return static_cast<float>(random.below(48) - 24) * 0.1F + 0.05F; };
    const Point3f p_map(at(), at(), at());
    const Estimate here = small.map.query(p_map);
    const octomap::OcTreeNode* const node =
        tree->search(octomap::point3d(p_map.x(), p_map.y(), p_map.z()));
    REQUIRE((node != nullptr) == (here.state != VoxelState::kUnknown));
    if (node == nullptr) continue;
    CHECK(tree->isNodeOccupied(node) == (here.state == VoxelState::kOccupied));
    CHECK(node->getOccupancy() == Approx(here.occupancy).margin(1e-5));
  }
}

TEST_CASE("octomap: equal neighbours are one leaf") {
  const test::TemporaryFolder folder;
  SmallMap small(config_at(0.1));
  for (int row = 0; row < kBlockVoxels; ++row)
    REQUIRE(carve(small.map, voxel_of_row({1, 0, 0}, row)) == Status::kOk);
  const Outcome<OctreeReport> written = write_octree(small.map, {}, folder.file("map.bt"));
  REQUIRE(written.ok());
  CHECK(written->free == 512);
  // The root, and one on each of the 13 levels down to a block.
  CHECK(written->nodes == 14);
}

TEST_CASE("octomap: an empty map is an empty tree") {
  const test::TemporaryFolder folder;
  const SmallMap small(config_at(0.1));
  for (const OctreeForm form : {OctreeForm::kBinary, OctreeForm::kFull}) {
    REQUIRE(write_octree(small.map, {.form = form}, folder.file("map")).ok());
    const Outcome<Octree> octree = Octree::read(folder.file("map"));
    REQUIRE(octree.ok());
    CHECK(octree->num_nodes() == 0);
  }
}

TEST_CASE("octomap: voxels with little evidence can be left out") {
  const test::TemporaryFolder folder;
  SmallMap small(config_at(0.1));
  REQUIRE(hit(small.map, {1, 1, 1}, 1, 2.0F) == Status::kOk);
  REQUIRE(hit(small.map, {5, 1, 1}, 1, 0.5F) == Status::kOk);
  const Outcome<OctreeReport> written =
      write_octree(small.map, {.min_evidence = 1.0}, folder.file("map.bt"));
  REQUIRE(written.ok());
  CHECK(written->occupied == 1);
}

TEST_CASE("octomap: a map beyond its sixteen levels is refused, and nothing is written") {
  const test::TemporaryFolder folder;
  for (const int beyond : {kOctreeVoxelLimit, -kOctreeVoxelLimit - 1}) {
    SmallMap small(config_at(0.1));
    REQUIRE(hit(small.map, {0, beyond, 0}, 1, 1.0F) == Status::kOk);
    const Outcome<OctreeReport> written = write_octree(small.map, {}, folder.file("map.bt"));
    REQUIRE_FALSE(written.ok());
    CHECK_THAT(written.failure().text(), Contains("3276.8") && Contains("16 levels"));
  }
  CHECK(folder.num_entries() == 0);
}

template <class Tree>
void check_read_alike(Tree& tree, const test::TemporaryFolder& folder) {
  REQUIRE(tree.write(folder.file("tree.ot")));
  const Outcome<Octree> full = Octree::read(folder.file("tree.ot"));
  REQUIRE(full.ok());
  CHECK(cells_of(*full) == cells_of(tree));
  REQUIRE(tree.writeBinary(folder.file("tree.bt")));
  const Outcome<Octree> binary = Octree::read(folder.file("tree.bt"));
  REQUIRE(binary.ok());
  CHECK(cells_of(*binary) == cells_of(tree));
}

TEST_CASE("octomap: trees that it made itself are read as it reads them") {
  const test::TemporaryFolder folder;
  octomap::OcTree tree(0.2);
  octomap::ColorOcTree colors(0.2);
  octomap::Pointcloud cloud;
  oracle::Random random(9);
  for (int i = 0; i < 300; ++i) {
    const auto at = [&] { return static_cast<float>(random.below(800) - 400) * 0.01F; };
    cloud.push_back(at(), at(), at());
  }
  tree.insertPointCloud(cloud, octomap::point3d(0.1F, 0.1F, 0.1F));
  colors.insertPointCloud(cloud, octomap::point3d(0.1F, 0.1F, 0.1F));
  for (int i = 0; i < 40; ++i) tree.insertPointCloud(cloud, octomap::point3d(0.1F, 0.1F, 0.1F));
  check_read_alike(tree, folder);
  check_read_alike(colors, folder);
  tree.prune();
  check_read_alike(tree, folder);
}

}  // namespace
}  // namespace tessera
