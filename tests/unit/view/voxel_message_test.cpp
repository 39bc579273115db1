// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <set>

#include "support/small_map.hpp"
#include "unit/view/view_messages.hpp"

using namespace tessera;

namespace {

ReadBlock encoded(const LocalMap& map, BlockCoord coord, const BlockMarks* marks = nullptr,
                  std::uint64_t moving = 0) {
  MapReader reader(map);
  std::vector<std::uint64_t> workspace(reader.snapshot_bytes() / 8 + 1);
  const Result<BlockSnapshot> block =
      reader.snapshot(coord, std::as_writable_bytes(std::span(workspace)));
  REQUIRE(block.ok());
  std::vector<std::byte> bytes(kMostViewBlockBytes);
  const EncodedBlock put = put_view_block(*block, map.reading(), moving, marks, bytes);
  std::size_t at = 0;
  const ReadBlock read = read_block(bytes, at);
  CHECK(at == put.bytes);
  CHECK(read.voxels.size() == put.voxels);
  return read;
}

bool is_occupied(const LocalMap& map, VoxelCoord voxel) {
  return map.query(voxel).state == VoxelState::kOccupied;
}

/// By the definition, a voxel at a time.
std::set<int> exposed(const LocalMap& map, BlockCoord block) {
  std::set<int> rows;
  for (int row = 0; row < kBlockVoxels; ++row) {
    const VoxelCoord v = voxel_of_row(block, row);
    if (!is_occupied(map, v)) continue;
    bool hidden = true;
    for (const BlockCoord& step : kFaceSteps) {
      const VoxelCoord beside{v.x + step.x, v.y + step.y, v.z + step.z};
      hidden = hidden && block_of(beside) == block && is_occupied(map, beside);
    }
    if (!hidden) rows.insert(row);
  }
  return rows;
}

}  // namespace

TEST_CASE("put_view_block: a voxel's estimate, each part within half of its step") {
  SmallMap small(config_of_pages(64));
  small.map.begin_revision();
  const VoxelCoord voxel{-3, 12, -20};
  REQUIRE(hit(small.map, voxel, 2, 3.0F) == Status::kOk);
  REQUIRE(hit(small.map, voxel, 1, 1.0F) == Status::kOk);
  const ReadBlock block = encoded(small.map, block_of(voxel));
  CHECK(block.coord == block_of(voxel));
  CHECK(block.revision == 1);
  REQUIRE(block.voxels.size() == 1);
  const ReadVoxel& read = block.voxels.front();
  const Estimate e = small.map.query(voxel);
  CHECK(read.row == row_order(voxel));
  CHECK(read.label == 2);
  CHECK(std::abs(read.probability / 255.0 - e.probability) <= 0.5 / 255.0);
  CHECK(std::abs(-read.variance / 40.0 - std::log10(e.variance)) <= 0.5 / 40.0 + 1e-9);
  CHECK(read.contributor == VoxelMark::kNobody);
  CHECK(read.flags == 0);
  CHECK(read.zero == 0);
}

TEST_CASE("put_view_block: free and unknown voxels are left out, those without a label are not") {
  SmallMap small(config_of_pages(64));
  REQUIRE(carve(small.map, {1, 1, 1}) == Status::kOk);
  REQUIRE(hit(small.map, {2, 2, 2}, small.map.classes().unlabelled(), 1.0F) == Status::kOk);
  for (int i = 0; i < 20; ++i) REQUIRE(carve(small.map, {3, 3, 3}) == Status::kOk);
  REQUIRE(hit(small.map, {3, 3, 3}, 1, 0.1F) == Status::kOk);
  REQUIRE_FALSE(is_occupied(small.map, {3, 3, 3}));
  const ReadBlock block = encoded(small.map, {0, 0, 0});
  REQUIRE(block.voxels.size() == 1);
  CHECK(block.voxels[0].row == row_order(VoxelCoord{2, 2, 2}));
  CHECK(block.voxels[0].label == 0);
  CHECK(block.voxels[0].probability == 0);
  CHECK(block.voxels[0].variance == 255);
}

TEST_CASE("put_view_block: sent are those with an exposed face, by the definition") {
  for (const int one_of : {1, 2, 3, 10}) {
    SmallMap small(config_of_pages(512));
    unsigned noise = 12345;
    for (int row = 0; row < kBlockVoxels; ++row) {
      noise = noise * 1664525U + 1013904223U;
      if (one_of > 1 && (noise >> 16U) % static_cast<unsigned>(one_of * one_of) == 0) continue;
      REQUIRE(hit(small.map, voxel_of_row({0, -1, 2}, row), 1, 1.0F) == Status::kOk);
    }
    // A neighbour's voxels hide nothing.
    REQUIRE(hit(small.map, voxel_of_row({1, -1, 2}, 0), 1, 1.0F) == Status::kOk);
    const ReadBlock block = encoded(small.map, {0, -1, 2});
    std::set<int> rows;
    for (const ReadVoxel& voxel : block.voxels) rows.insert(voxel.row);
    CHECK(rows == exposed(small.map, {0, -1, 2}));
    CHECK(rows.size() == block.voxels.size());
    if (one_of == 1) CHECK(rows.size() == 512 - 6 * 6 * 6);
  }
}

TEST_CASE("put_view_block: marks go with their voxels") {
  SmallMap small(config_of_pages(64));
  REQUIRE(hit(small.map, {1, 0, 0}, 1, 1.0F) == Status::kOk);
  REQUIRE(hit(small.map, {0, 0, 7}, 1, 1.0F) == Status::kOk);
  BlockMarks marks{};
  marks[1] = {.contributor = 3, .disagreement = false};
  marks[448] = {.contributor = VoxelMark::kTwo, .disagreement = true};
  const ReadBlock block = encoded(small.map, {0, 0, 0}, &marks);
  REQUIRE(block.voxels.size() == 2);
  CHECK(block.voxels[0].contributor == 3);
  CHECK(block.voxels[0].flags == 0);
  CHECK(block.voxels[1].contributor == VoxelMark::kTwo);
  CHECK(block.voxels[1].flags == 1);
}

TEST_CASE("put_view_block: a free voxel whose label may move is marked as one that moved") {
  SmallMap small(config_of_pages(64));
  for (const VoxelCoord voxel : {VoxelCoord{3, 3, 3}, VoxelCoord{5, 3, 3}}) {
    for (int i = 0; i < 20; ++i) REQUIRE(carve(small.map, voxel) == Status::kOk);
    REQUIRE(hit(small.map, voxel, voxel.x == 3 ? 1 : 2, 0.1F) == Status::kOk);
  }
  REQUIRE(hit(small.map, {6, 6, 6}, 2, 1.0F) == Status::kOk);
  BlockMarks marks{};
  marks[static_cast<std::size_t>(row_order(VoxelCoord{5, 3, 3}))].disagreement = true;
  const ReadBlock block = encoded(small.map, {0, 0, 0}, &marks, 1U << 2U);
  REQUIRE(block.voxels.size() == 2);
  CHECK(block.voxels[0].row == row_order(VoxelCoord{5, 3, 3}));
  CHECK(block.voxels[0].label == 2);
  CHECK(block.voxels[0].flags == (kViewMoved | kViewDisagreement));
  CHECK(block.voxels[1].row == row_order(VoxelCoord{6, 6, 6}));
  CHECK(block.voxels[1].flags == 0);
}

TEST_CASE("put_view_block: a block that is not there has no voxels") {
  SmallMap small(config_of_pages(64));
  CHECK(encoded(small.map, {0, 0, 0}).voxels.empty());
}

TEST_CASE("codes of probability and variance at their ends") {
  CHECK(probability_code(0.0) == 0);
  CHECK(probability_code(1.0) == 255);
  CHECK(probability_code(-1.0) == 0);
  CHECK(probability_code(2.0) == 255);
  CHECK(variance_code(1.0) == 0);
  CHECK(variance_code(0.25) == 24);
  CHECK(variance_code(1e-6) == 240);
  CHECK(variance_code(1e-300) == 255);
  CHECK(variance_code(0.0) == 255);
  CHECK(variance_code(-1.0) == 255);
  CHECK(variance_code(1e9) == 0);
}
