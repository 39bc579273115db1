// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The free layer: passes of rays saturate, free any voxel however old, and give storage back.
#include <array>
#include <catch2/catch.hpp>

#include "support/random.hpp"
#include "support/small_map.hpp"

namespace tessera {
namespace {

constexpr VoxelCoord kVoxel{-8, 7, -1};

SmallMap with_caps(float max_evidence, float free_weight) {
  MapConfig config = config_of_pages(16);
  config.max_evidence = max_evidence;
  config.free_weight = free_weight;
  return SmallMap(config, 19);
}

TEST_CASE("free layer: a pass adds the free weight to the voxels of the mask and to no others") {
  SmallMap small(config_of_pages(8));
  const SlabHandle block = *small.map.open_block({-1, 0, 0});
  VoxelMask mask{};
  oracle::Random random(111);
  for (std::uint64_t& word : mask) word = random.bits();
  REQUIRE(small.map.add_free_pass(block, mask) == Status::kOk);
  for (int i = 0; i < kBlockVoxels; ++i) {
    const bool carved = ((mask[static_cast<std::size_t>(i / 64)] >> (i % 64)) & 1U) != 0;
    const VoxelCoord v{i % 8 - 8, i / 8 % 8, i / 64};
    REQUIRE(small.map.evidence(v).sigma[0] == (carved ? 0.4F : 0.0F));
  }
}

TEST_CASE("free layer: a pass makes an unknown voxel free, counted as such") {
  SmallMap small(config_of_pages(8));
  REQUIRE(carve(small.map, kVoxel) == Status::kOk);
  CHECK(small.map.query(kVoxel).state == VoxelState::kFree);
  CHECK(small.map.count_free_voxels() == 1);
  CHECK(small.map.usage().label_voxels == 0);
}

TEST_CASE("free layer: saturates at max_passes and stays there") {
  SmallMap small(config_of_pages(8));
  for (int i = 1; i <= 600; ++i) {
    REQUIRE(carve(small.map, kVoxel) == Status::kOk);
    const int expected = i < 250 ? i : 250;
    REQUIRE(small.map.evidence(kVoxel).sigma[0] == static_cast<float>(expected) * 0.4F);
  }
}

TEST_CASE("free layer: below the cap a pass leaves label evidence as it is") {
  SmallMap small(config_of_pages(8));
  REQUIRE(hit(small.map, kVoxel, 1, 60.0F) == Status::kOk);
  for (int i = 0; i < 100; ++i) REQUIRE(carve(small.map, kVoxel) == Status::kOk);
  CHECK(label_evidence(small.map, kVoxel) == 60.0);
  CHECK(small.map.query(kVoxel).state == VoxelState::kOccupied);
}

TEST_CASE("free layer: max_evidence / free_weight passes free any voxel, however much it held") {
  struct Case {
    float max_evidence;
    float free_weight;
    int passes;
  };
  for (const Case& c : {Case{100.0F, 0.4F, 250}, Case{25.0F, 0.1F, 250}, Case{15.0F, 0.3F, 50},
                        Case{10.0F, 3.0F, 3}, Case{5.0F, 0.7F, 7}, Case{1.0F, 1.0F, 1}}) {
    INFO("cap " << c.max_evidence << ", weight " << c.free_weight);
    SmallMap small = with_caps(c.max_evidence, c.free_weight);
    for (int i = 0; i < 50; ++i) {
      REQUIRE(hit(small.map, kVoxel, 1 + i % 20, c.max_evidence) == Status::kOk);
    }
    REQUIRE(small.map.query(kVoxel).state == VoxelState::kOccupied);
    for (int i = 0; i < c.passes; ++i) REQUIRE(carve(small.map, kVoxel) == Status::kOk);
    CHECK(small.map.query(kVoxel).state == VoxelState::kFree);
    CHECK(label_evidence(small.map, kVoxel) == 0.0);
    CHECK(small.map.usage().label_voxels == 0);
  }
}

TEST_CASE(
    "free layer: a voxel whose labels are gone is free only, and its octet and label page are "
    "taken back") {
  SmallMap small(config_of_pages(16));
  REQUIRE(hit(small.map, kVoxel, 1, 100.0F) == Status::kOk);
  for (int i = 0; i < 250; ++i) REQUIRE(carve(small.map, kVoxel) == Status::kOk);
  const Block* const block = small.map.find(block_of(kVoxel));
  REQUIRE(block != nullptr);
  CHECK(block->label_voxels == 0);
  CHECK_FALSE(block->has_labels());
  CHECK(small.map.octet_handle(*block, octet_in_block(kVoxel)) == 0);
  CHECK(small.map.count_free_voxels() == 1);
}

TEST_CASE("free layer: an octet stays while one of its voxels has labels") {
  SmallMap small(config_of_pages(16));
  const VoxelCoord neighbour{kVoxel.x + 1, kVoxel.y, kVoxel.z};
  REQUIRE(octet_in_block(neighbour) == octet_in_block(kVoxel));
  REQUIRE(hit(small.map, kVoxel, 1, 100.0F) == Status::kOk);
  REQUIRE(hit(small.map, neighbour, 2, 3.0F) == Status::kOk);
  for (int i = 0; i < 250; ++i) REQUIRE(carve(small.map, kVoxel) == Status::kOk);
  CHECK(label_evidence(small.map, neighbour) == 3.0);
  CHECK(small.map.usage().label_voxels == 1);
}

TEST_CASE("free layer: memory does not grow while things come and go") {
  SmallMap small(config_of_pages(16));
  std::size_t used_bytes = 0;
  for (int cycle = 0; cycle < 40; ++cycle) {
    for (std::int32_t i = 0; i < 8; ++i) {
      const VoxelCoord v{2 * ((i + cycle) % 8) - 8, 2 * (cycle % 3), -1};
      REQUIRE(hit(small.map, v, 1 + cycle % 4, 100.0F) == Status::kOk);
      for (int pass = 0; pass < 250; ++pass) REQUIRE(carve(small.map, v) == Status::kOk);
    }
    REQUIRE(small.map.usage().label_voxels == 0);
    if (cycle == 0) used_bytes = small.map.usage().used_bytes;
    REQUIRE(small.map.usage().used_bytes == used_bytes);
  }
  CHECK(small.map.usage().peak_bytes == used_bytes);
}

TEST_CASE("free layer: label evidence of zero leaves no trace") {
  SmallMap small(config_of_pages(8));
  REQUIRE(hit(small.map, kVoxel, 1, 0.0F) == Status::kOk);
  CHECK(small.map.usage().label_voxels == 0);
  CHECK_FALSE(small.map.find(block_of(kVoxel))->has_labels());
  CHECK(small.map.query(kVoxel).state == VoxelState::kUnknown);
}

TEST_CASE("free layer: free evidence offered as a label component is ignored") {
  SmallMap small(config_of_pages(8));
  REQUIRE(hit(small.map, kVoxel, 0, 5.0F) == Status::kOk);
  CHECK(small.map.evidence(kVoxel).total() == 0.0);
}

}  // namespace
}  // namespace tessera
