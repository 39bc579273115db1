// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Labels that are contradicted, and the list of blocks that may hold what moves.
#include <catch2/catch.hpp>

#include "support/small_map.hpp"

namespace tessera {
namespace {

constexpr int kStands = 1;
constexpr int kMoves = 2;

constexpr VoxelMask kAll = [] {
  VoxelMask mask{};
  for (std::uint64_t& word : mask) word = ~std::uint64_t{0};
  return mask;
}();

/// Class 2 moves.
struct Rig {
  explicit Rig(std::size_t pages = 64, TuplePolicy tuple = TuplePolicy::kDense)
      : config([&] {
          MapConfig made = config_of_pages(pages);
          made.tuple = tuple;
          return made;
        }()),
        memory(required_bytes(config)) {
    Arena arena(memory.span());
    ClassTable classes;
    static_cast<void>(classes.add("stands", Color{}, false));
    static_cast<void>(classes.add("moves", Color{}, true));
    static_cast<void>(classes.add("stands too", Color{}, false));
    map = std::move(*LocalMap::make(arena, config, classes));
  }
  Contradicted doubt(VoxelCoord voxel) {
    return map.contradict(*map.open_block(block_of(voxel)), mask_of(voxel), VoxelMask{});
  }
  Contradicted clear(VoxelCoord voxel) {
    return map.contradict(*map.open_block(block_of(voxel)), VoxelMask{}, mask_of(voxel));
  }
  [[nodiscard]] std::vector<BlockCoord> moving() const {
    std::vector<BlockCoord> found;
    map.visit_moving([&](SlabHandle handle) {
      found.push_back(unpack(BlockKey{map.block_at(handle).key}));
      return true;
    });
    return found;
  }
  MapConfig config;
  AlignedMemory memory;
  LocalMap map;
};

}  // namespace

TEST_CASE("occupied: faint is what at most eight points say, and only what is asked is looked at") {
  const TuplePolicy tuple = GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact);
  Rig rig(64, tuple);
  const VoxelCoord faint{1, 2, 3};
  const VoxelCoord strong{4, 5, 6};
  REQUIRE(hit(rig.map, faint, kStands, 8.0F) == Status::kOk);
  REQUIRE(hit(rig.map, strong, kStands, 8.5F) == Status::kOk);
  const SlabHandle block = *rig.map.open_block({0, 0, 0});
  const LocalMap::Occupied all = rig.map.occupied(block, kAll);
  CHECK(all.all[3] == mask_of(faint)[3]);
  CHECK(all.all[6] == mask_of(strong)[6]);
  CHECK(all.faint == mask_of(faint));
  CHECK_FALSE(all.any_moving);
  CHECK(rig.map.occupied(block, mask_of(strong)).all == mask_of(strong));
  CHECK(rig.map.occupied(block, VoxelMask{}).all == VoxelMask{});
  // What moves is found beside what is asked, too.
  REQUIRE(hit(rig.map, {7, 7, 7}, kMoves, 1.0F) == Status::kOk);
  CHECK(rig.map.occupied(block, VoxelMask{}).moving == mask_of({7, 7, 7}));
  // Where passes weigh more, nothing is occupied.
  for (int i = 0; i < 21; ++i) REQUIRE(carve(rig.map, faint) == Status::kOk);
  CHECK(rig.map.occupied(block, kAll).faint[3] == 0);
}

TEST_CASE("contradict: doubted labels are reduced to a pass and a quarter, in proportion") {
  const TuplePolicy tuple = GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact);
  Rig rig(64, tuple);
  const VoxelCoord voxel{3, 5, 6};
  REQUIRE(hit(rig.map, voxel, 1, 6.0F) == Status::kOk);
  REQUIRE(hit(rig.map, voxel, 3, 2.0F) == Status::kOk);
  REQUIRE(carve(rig.map, {0, 0, 6}) == Status::kOk);  // The layer has a page.
  const Contradicted once = rig.doubt(voxel);
  CHECK(once.doubted == 1);
  CHECK(once.cleared == 0);
  const VoxelEvidence evidence = rig.map.evidence(voxel);
  CHECK(evidence.sigma[1] == Approx(0.375).margin(1e-4));
  CHECK(evidence.sigma[3] == Approx(0.125).margin(1e-4));
  CHECK(evidence.sigma[0] == 0.0F);
  const Contradicted twice = rig.doubt(voxel);
  CHECK(twice.cleared == 1);
  CHECK(twice.doubted == 0);
  CHECK(rig.map.evidence(voxel).sigma[0] == 2.0F * rig.config.free_weight);
  // What was there is known still.
  CHECK(label_evidence(rig.map, voxel) == Approx(0.1).margin(1e-4));
  const Estimate left = rig.map.query(voxel);
  CHECK(left.state == VoxelState::kFree);
  CHECK(left.label == 1);
}

TEST_CASE(
    "contradict: one hit makes of a doubted voxel one that is not; what spreads to it does not") {
  Rig rig;
  const VoxelCoord hit_again{1, 1, 1};
  const VoxelCoord spread_to{4, 4, 4};
  for (const VoxelCoord& voxel : {hit_again, spread_to}) {
    REQUIRE(hit(rig.map, voxel, kStands, 9.0F) == Status::kOk);
    REQUIRE(carve(rig.map, {0, 0, voxel.z}) == Status::kOk);
    rig.doubt(voxel);
  }
  REQUIRE(hit(rig.map, hit_again, kStands, 1.0F) == Status::kOk);
  REQUIRE(hit(rig.map, spread_to, kStands, 0.2F) == Status::kOk);
  CHECK(rig.doubt(hit_again).doubted == 1);
  CHECK(rig.doubt(spread_to).cleared == 1);
  // One hit is more than the passes of what was cleared.
  REQUIRE(hit(rig.map, spread_to, kStands, 1.0F) == Status::kOk);
  CHECK(rig.map.query(spread_to).state == VoxelState::kOccupied);
}

TEST_CASE("contradict: voxels that are not named stay as they are, and ones without labels too") {
  Rig rig;
  REQUIRE(hit(rig.map, {0, 0, 0}, kStands, 3.0F) == Status::kOk);
  REQUIRE(hit(rig.map, {1, 0, 0}, kStands, 3.0F) == Status::kOk);
  REQUIRE(carve(rig.map, {7, 0, 0}) == Status::kOk);
  const Content before = content_of(rig.map);
  CHECK(rig.clear({7, 7, 7}).cleared == 0);
  CHECK(rig.doubt({2, 0, 0}).cleared == 0);
  CHECK(content_of(rig.map).evidence == before.evidence);
  CHECK(rig.clear({1, 0, 0}).cleared == 1);
  CHECK(rig.map.query(VoxelCoord{0, 0, 0}).state == VoxelState::kOccupied);
  CHECK(rig.map.query(VoxelCoord{1, 0, 0}).state == VoxelState::kFree);
}

TEST_CASE("contradict: it takes no page for passes; where there is none all labels go") {
  Rig rig;
  REQUIRE(hit(rig.map, {0, 0, 0}, kStands, 3.0F) == Status::kOk);
  const std::uint32_t pages = rig.map.items()[kFreeSlab];
  CHECK(rig.clear({0, 0, 0}).cleared == 1);
  CHECK(rig.map.query(VoxelCoord{0, 0, 0}).state == VoxelState::kUnknown);
  CHECK(rig.map.usage().label_voxels == 0);
  CHECK(rig.map.items()[kFreeSlab] == pages);
}

TEST_CASE("blocks that may hold what moves: listed from the first such label on, once, in order") {
  Rig rig;
  CHECK(rig.moving().empty());
  REQUIRE(hit(rig.map, {0, 0, 0}, kStands, 1.0F) == Status::kOk);
  CHECK(rig.moving().empty());
  for (const std::int32_t block : {3, 1, 2, 1, 3}) {
    REQUIRE(hit(rig.map, {8 * block, 0, 0}, kMoves, 1.0F) == Status::kOk);
    REQUIRE(hit(rig.map, {8 * block + 1, 0, 0}, kStands, 1.0F) == Status::kOk);
  }
  CHECK(rig.moving() == std::vector<BlockCoord>{{3, 0, 0}, {1, 0, 0}, {2, 0, 0}});
  SECTION("a block that is closed leaves it") {
    rig.map.remove_block(rig.map.find_handle(BlockCoord{1, 0, 0}));
    CHECK(rig.moving() == std::vector<BlockCoord>{{3, 0, 0}, {2, 0, 0}});
    rig.map.remove_block(rig.map.find_handle(BlockCoord{3, 0, 0}));
    rig.map.remove_block(rig.map.find_handle(BlockCoord{2, 0, 0}));
    CHECK(rig.moving().empty());
    REQUIRE(hit(rig.map, {8, 0, 0}, kMoves, 1.0F) == Status::kOk);
    CHECK(rig.moving().size() == 1);
  }
  SECTION("so does one in which nothing that moves is left, once it is looked at") {
    const SlabHandle handle = rig.map.find_handle(BlockCoord{1, 0, 0});
    CHECK(rig.map.occupied(handle, kAll).any_moving);
    rig.clear({8, 0, 0});
    CHECK(rig.moving().size() == 3);
    const LocalMap::Occupied left = rig.map.occupied(handle, kAll);
    CHECK_FALSE(left.any_moving);
    CHECK(left.all == mask_of({9, 0, 0}));
    CHECK(rig.moving() == std::vector<BlockCoord>{{3, 0, 0}, {2, 0, 0}});
  }
  SECTION(
      "one with some evidence of what moves stays, whatever its label: so a loaded map has it") {
    const VoxelCoord voxel{8, 0, 0};
    REQUIRE(hit(rig.map, voxel, kStands, 5.0F) == Status::kOk);
    CHECK_FALSE(rig.map.occupied(rig.map.find_handle(BlockCoord{1, 0, 0}), kAll).any_moving);
    CHECK(rig.moving().size() == 3);
  }
  SECTION("a map that is emptied has none") {
    rig.map.clear();
    CHECK(rig.moving().empty());
  }
  SECTION("what a file or an archive restores is listed too") {
    VoxelEvidence evidence;
    evidence.num_components = 5;
    evidence.sigma[kMoves] = 2.0F;
    const SlabHandle handle = *rig.map.open_block({9, 0, 0});
    REQUIRE(rig.map.restore(handle, 0, 0, evidence, 0) == Status::kOk);
    CHECK(rig.moving().size() == 4);
  }
}

TEST_CASE(
    "occupied: every voxel that labels occupy, and those whose largest count is of what moves") {
  Rig rig;
  VoxelMask all{};
  VoxelMask moving{};
  int n = 0;
  for (std::int32_t z = 0; z < 8; ++z) {
    for (std::int32_t y = 0; y < 8; ++y) {
      for (std::int32_t x = (y + z) % 3; x < 8; x += 3) {
        const VoxelCoord voxel{x, y, z};
        const bool moves = ++n % 2 == 0;
        REQUIRE(hit(rig.map, voxel, kMoves, moves ? 2.0F : 0.5F) == Status::kOk);
        REQUIRE(hit(rig.map, voxel, kStands, 1.0F) == Status::kOk);
        // Of every fifth, the passes weigh more.
        for (int i = 0; n % 5 == 0 && i < 8; ++i) REQUIRE(carve(rig.map, voxel) == Status::kOk);
        if (n % 5 == 0) continue;
        add_row(all, row_order(voxel));
        if (moves) add_row(moving, row_order(voxel));
      }
    }
  }
  const LocalMap::Occupied found = rig.map.occupied(rig.map.find_handle(BlockCoord{0, 0, 0}), kAll);
  CHECK(found.all == all);
  CHECK(found.moving == moving);
}

}  // namespace tessera
