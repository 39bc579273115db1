// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Restoring voxels as a file holds them: exactly, or not at all.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "support/small_map.hpp"

namespace tessera {
namespace {

constexpr VoxelCoord kVoxel{-1, 8, -16};

Status restore(LocalMap& map, VoxelCoord voxel, const VoxelEvidence& evidence, int passes) {
  const Result<SlabHandle> block = map.open_block(block_of(voxel));
  if (!block.ok()) return block.status();
  return map.restore(*block, octet_in_block(voxel), voxel_in_octet(voxel), evidence,
                     static_cast<std::uint8_t>(passes));
}

VoxelEvidence labels(float first, float unlabelled) {
  VoxelEvidence evidence;
  evidence.num_components = 5;
  evidence.sigma[1] = first;
  evidence.sigma[4] = unlabelled;
  return evidence;
}

TEST_CASE("restore: a voxel has afterwards what it was given") {
  SmallMap small(config_of_pages(8));
  REQUIRE(restore(small.map, kVoxel, labels(0.1F, 3.0F), 7) == Status::kOk);
  const VoxelEvidence evidence = small.map.evidence(kVoxel);
  CHECK(evidence.sigma[0] == 7.0F * 0.4F);
  CHECK(evidence.sigma[1] == 0.1F);
  CHECK(evidence.sigma[4] == 3.0F);
  CHECK(small.map.usage().label_voxels == 1);
}

TEST_CASE("restore: counts outside of floor and ceiling are invalid and change nothing") {
  MapConfig config = config_of_pages(8);
  config.max_evidence = 0.0F;
  SmallMap small(config);
  REQUIRE(small.map.open_block(block_of(kVoxel)).ok());
  const Content before = content_of(small.map);
  for (const float count :
       {1e-39F, std::nextafter(kLeastCount, 0.0F), std::nextafter(kLargestCount, 3e30F), -1.0F,
        std::numeric_limits<float>::quiet_NaN()}) {
    CAPTURE(count);
    CHECK(restore(small.map, kVoxel, labels(count, 1.0F), 0) == Status::kInvalidArgument);
    CHECK(content_of(small.map) == before);
  }
  CHECK(restore(small.map, kVoxel, labels(kLeastCount, kLargestCount), 0) == Status::kOk);
  CHECK(small.map.evidence(kVoxel).sigma[1] == kLeastCount);
}

TEST_CASE("restore: free passes alone make a free voxel, without a label page") {
  SmallMap small(config_of_pages(8));
  REQUIRE(restore(small.map, kVoxel, labels(0.0F, 0.0F), 250) == Status::kOk);
  CHECK(small.map.count_free_voxels() == 1);
  CHECK_FALSE(small.map.find(block_of(kVoxel))->has_labels());
}

TEST_CASE("restore: passes up to the cap are taken, one more is invalid and changes nothing") {
  SmallMap small(config_of_pages(8));
  REQUIRE(restore(small.map, {0, 0, 0}, labels(0.0F, 0.0F), 249) == Status::kOk);
  REQUIRE(restore(small.map, {1, 0, 0}, labels(0.0F, 0.0F), 250) == Status::kOk);
  REQUIRE(small.map.open_block(block_of(kVoxel)).ok());
  const Content before = content_of(small.map);
  CHECK(restore(small.map, kVoxel, labels(1.0F, 0.0F), 251) == Status::kInvalidArgument);
  CHECK(content_of(small.map) == before);
}

TEST_CASE("restore: where the labels do not fit, the free passes are not set either") {
  SmallMap small(config_of_pages(4));
  for (std::int32_t i = 0; i < 23; ++i) carve_layers(small.map, {8 * i, 80, 80});
  REQUIRE(small.map.open_block(block_of(kVoxel)).ok());
  const Content before = content_of(small.map);
  CHECK(restore(small.map, kVoxel, labels(1.0F, 0.0F), 5) == Status::kResourceExhausted);
  CHECK(content_of(small.map) == before);
  CHECK(small.map.usage().storage_refused == 1);
}

TEST_CASE("restore: where no free page fits nothing is set, and it is counted") {
  SmallMap small(config_of_pages(4));
  for (std::int32_t i = 0; i < 24; ++i) carve_layers(small.map, {8 * i, 80, 80});
  REQUIRE(small.map.open_block(block_of(kVoxel)).ok());
  const Content before = content_of(small.map);
  CHECK(restore(small.map, kVoxel, labels(1.0F, 0.0F), 5) == Status::kResourceExhausted);
  CHECK(content_of(small.map) == before);
  CHECK(small.map.usage().storage_refused == 1);
}

TEST_CASE("restore: a map restored voxel by voxel has the content of the first one") {
  SmallMap first(config_of_pages(16));
  for (std::int32_t i = 0; i < 60; ++i) {
    REQUIRE(hit(first.map, {i % 9 - 4, i / 9 - 3, -i % 5}, 1 + i % 4,
                0.3F * static_cast<float>(i)) == Status::kOk);
    REQUIRE(carve(first.map, {i % 7 - 4, i / 7 - 3, -i % 3}) == Status::kOk);
  }
  const Content content = content_of(first.map);
  SmallMap second(config_of_pages(16));
  for (const auto& [zyx, sigma] : content.evidence) {
    const auto [z, y, x] = zyx;
    VoxelEvidence evidence;
    for (const float count : sigma) {
      evidence.sigma[static_cast<std::size_t>(evidence.num_components++)] = count;
    }
    const int passes = static_cast<int>(sigma[0] / 0.4F + 0.5F);
    REQUIRE(restore(second.map, {x, y, z}, evidence, passes) == Status::kOk);
  }
  CHECK(content_of(second.map) == content);
}

TEST_CASE("restore_revision: sets the map's revision and a block's") {
  SmallMap small(config_of_pages(8));
  REQUIRE(hit(small.map, kVoxel, 1, 1.0F) == Status::kOk);
  small.map.restore_revision(41);
  small.map.restore_revision(*small.map.open_block(block_of(kVoxel)), 17);
  CHECK(small.map.revision() == 41);
  CHECK(small.map.find(block_of(kVoxel))->revision == 17);
}

}  // namespace
}  // namespace tessera
