// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A sketch of replicas is that of a map with the same content, and stays one of versions that were
// there while they change.
#include <array>

#include "finder_rig.hpp"
#include "replica_rig.hpp"
#include "tessera/replica/objection.hpp"

namespace tessera {

namespace {

constexpr ReplicasConfig kRoom{
    .segments = 1U << 15U, .blocks = 1'024, .contributions = 4, .robot_segments = 1U << 15U};
constexpr ContributionId kId{7, 1, 0};

MapConfig map_config(TuplePolicy tuple, double resolution_m) {
  MapConfig config = config_of_pages(600);
  config.tuple = tuple;
  config.resolution_m = resolution_m;
  return config;
}

}  // namespace

TEST_CASE("each voxel of a block in parts is what it is in a map with the same counts") {
  const TuplePolicy tuple = GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact);
  const double resolution_m = GENERATE(0.2, 0.1);
  CAPTURE(to_string(tuple), resolution_m);
  const ClassTable classes = room_classes(true);
  const int num_components = classes.num_components();
  WorldMap oracle(map_config(tuple, resolution_m), classes);
  OwnReplicas own(kRoom);
  const Replicas::Slot slot = *own.replicas.open(kId);
  BlockPacker packer(num_components);
  oracle::Random random(5);
  for (int n = 0; n < 90; ++n) {
    const BlockCoord at{random.below(9) - 4, random.below(9) - 4, random.below(9) - 4};
    const BlockKey key = *pack(at);
    if (own.replicas.find(slot, key) != nullptr) continue;
    // The whole block, then other content of some layers, that of the last version of each.
    BlockVoxels voxels = random_voxels(random, num_components, tuple);
    REQUIRE(own.replicas.put(slot, key, 1, packer.pack(voxels)).ok());
    for (std::uint32_t version = 2; version < 2U + static_cast<std::uint32_t>(n % 4); ++version) {
      const auto layers = static_cast<std::uint8_t>(1 + random.below(15));
      const BlockVoxels later = random_voxels(random, num_components, tuple);
      const PartVersion part{.number = version, .first = version, .layers = layers};
      REQUIRE(own.replicas.put(slot, key, part, packer.pack(later, layers)).ok());
      const auto is_replaced = [&](int row) { return ((layers >> layer_of_row(row)) & 1) != 0; };
      std::erase_if(voxels, [&](const auto& voxel) { return is_replaced(voxel.first); });
      for (const auto& [row, voxel] : later)
        if (is_replaced(row)) voxels[row] = voxel;
    }
    const SlabHandle block = *oracle.map.open_block(at);
    for (const auto& [row, voxel] : voxels) {
      const VoxelCoord local{row % 8, row / 8 % 8, row / 64};
      REQUIRE(oracle.map.restore(block, octet_in_block(local), voxel_in_octet(local),
                                 voxel.evidence, voxel.passes) == Status::kOk);
    }
  }
  OwnSource from(oracle.map.config(), classes, kRoom);
  REQUIRE(from.source.begin(own.replicas, slot) == Status::kOk);
  TakenSketch taken;
  taken.take(from.source.source());
  TakenSketch of_map;
  of_map.take(sketch_source_of(oracle.map));
  CHECK(of_map.sketch.surface_count() > 70);
  CHECK(same_sketch(taken.sketch, of_map.sketch));
  CHECK_FALSE(from.source.lost());
  CHECK(from.source.blocks_taken() == oracle.map.block_count());
  CHECK(from.source.newest_version() == 4);
  // And again, of the same memory.
  REQUIRE(from.source.begin(own.replicas, slot) == Status::kOk);
  taken.take(from.source.source());
  CHECK(same_sketch(taken.sketch, of_map.sketch));
}

TEST_CASE("its memory suffices for blocks that hold all that they can, one after the other") {
  const TuplePolicy tuple = GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact);
  const bool votes = GENERATE(false, true);
  ClassTable classes;
  for (int c = 0; c < 30; ++c)
    REQUIRE(classes.add(("class" + std::to_string(c)).c_str(), {}, false) == Status::kOk);
  const int num_components = classes.num_components();
  BlockPacker packer(num_components);
  for (int row = 0; row < kBlockVoxels; ++row) {
    for (int c = 1; c < num_components; ++c) packer.content().add(c, row, 0.25F);
    packer.content().add_rest(row, 0.5F);
    packer.content().add_passes(row, static_cast<unsigned>(1 + row % 7));
    packer.content().set_centroid(row, Centroid::of_code(static_cast<std::uint8_t>(1 + row % 200)));
  }
  const std::vector<std::byte> packed = packer.pack();
  OwnReplicas own(kRoom);
  const Replicas::Slot slot = *own.replicas.open(kId);
  constexpr std::uint32_t kBlocks = 40;
  for (std::uint32_t n = 0; n < kBlocks; ++n)
    REQUIRE(own.replicas.put(slot, *pack({static_cast<int>(n), 0, 0}), 1, packed).ok());
  MapConfig config = map_config(tuple, 0.2);
  config.label_votes = votes;
  OwnSource from(config, classes, kRoom);
  REQUIRE(from.source.begin(own.replicas, slot) == Status::kOk);
  TakenSketch taken;
  // Fewer to a piece than of small ones.
  const std::size_t to_piece = (ReplicaSketchSource::kMostBytes - 1) / packed.size() + 1;
  REQUIRE(to_piece < ReplicaSketchSource::kBlocks);
  CHECK(taken.take(from.source.source()) == static_cast<int>((kBlocks - 1) / to_piece + 1));
  REQUIRE(taken.sketch.surface_count() == 8 * kBlocks);
  for (std::uint32_t i = 0; i < 8 * kBlocks; ++i)
    REQUIRE(taken.sketch.surface(i).occupied == ~std::uint64_t{0});
}

TEST_CASE("blocks that change, come and go while it is taken: each once, as it is at its turn") {
  // Version v of a block has one voxel in each of its eight cells: number v of 64.
  const ClassTable classes = room_classes();
  BlockPacker packer(classes.num_components());
  const auto packed_of = [&](std::uint32_t version) {
    packer.content().clear();
    const auto part = static_cast<int>(version);
    for (int cell = 0; cell < 8; ++cell) {
      const VoxelCoord voxel{4 * (cell % 2) + part % 4, 4 * (cell / 2 % 2) + part / 4 % 4,
                             4 * (cell / 4) + part / 16};
      packer.content().add(1, row_order(voxel), 4.0F);
    }
    return packer.pack();
  };
  constexpr int kBlocks = 100;
  constexpr std::size_t kGone = 3;
  const auto key_of = [](int n) { return *pack({n % 12 - 6, n / 12 - 4, n % 3}); };
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    oracle::Random random(seed);
    OwnReplicas own(kRoom);
    const Replicas::Slot slot = *own.replicas.open(kId);
    // Of each block the version that is there, 0: none; and what was taken of it, as its bit.
    std::array<std::uint32_t, 2 * kBlocks> now{};
    std::array<std::uint64_t, 2 * kBlocks> parts{};
    std::array<bool, 2 * kBlocks> stayed{};
    const auto put = [&](std::size_t n, std::uint32_t version) {
      REQUIRE(
          own.replicas.put(slot, key_of(static_cast<int>(n)), version, packed_of(version)).ok());
      now[n] = version;
    };
    const auto drop = [&](std::size_t n) {
      const auto* const part = own.replicas.find(slot, key_of(static_cast<int>(n)));
      own.replicas.drop(own.replicas.number_of(*part));
      now[n] = 0;
      stayed[n] = false;
    };
    for (std::size_t n = 0; n < kBlocks; ++n) {
      put(n, 1);
      stayed[n] = true;
    }
    OwnSource from(map_config(TuplePolicy::kCompact, 0.2), classes, kRoom);
    REQUIRE(from.source.begin(own.replicas, slot) == Status::kOk);
    TakenSketch taken;
    // What a piece has added is what is there now, and what was added before stays.
    const auto compare = [&] {
      taken.sketch.finish(taken.scratch);
      for (std::uint32_t i = 1; i < taken.sketch.surface_count(); ++i)
        REQUIRE(taken.sketch.surface(i - 1).key < taken.sketch.surface(i).key);  // none twice
      for (std::size_t n = 0; n < 2 * kBlocks; ++n) {
        const BlockCoord at = unpack(key_of(static_cast<int>(n)));
        const std::uint64_t found = taken.sketch.parts({2 * at.x, 2 * at.y, 2 * at.z}).occupied;
        if (parts[n] == 0 && found != 0) REQUIRE(found == std::uint64_t{1} << now[n]);
        if (parts[n] != 0) REQUIRE(found == parts[n]);
        parts[n] = found;
      }
    };
    const auto change = [&](int piece) {
      compare();
      for (int i = 0; i < 60; ++i) {
        const auto n = static_cast<std::size_t>(random.below(2 * kBlocks));
        if (n == kGone || n == kGone + 1) continue;
        if (now[n] != 0 && random.below(4) == 0)
          drop(n);
        else
          put(n, now[n] == 0 ? static_cast<std::uint32_t>(8 * piece) : now[n] + 1);
      }
    };
    // One goes before the first piece, and one goes and comes back.
    drop(kGone);
    drop(kGone + 1);
    put(kGone + 1, 2);
    CHECK(taken.take(from.source.source(), change) == 7);
    compare();
    CHECK_FALSE(from.source.lost());
    CHECK(from.source.blocks_taken() + from.source.blocks_gone() == kBlocks);
    CHECK(from.source.blocks_gone() > 0);
    CHECK(taken.sketch.surface_count() == 8 * from.source.blocks_taken());
    CHECK(parts[kGone] == 0);
    CHECK(parts[kGone + 1] != 0);
    for (std::size_t n = 0; n < 2 * kBlocks; ++n) {
      if (stayed[n]) REQUIRE(parts[n] != 0);
      if (n >= kBlocks) REQUIRE(parts[n] == 0);
    }
  }
}

TEST_CASE("what is no map, or has no room, is not begun") {
  const MapConfig config = map_config(TuplePolicy::kCompact, 0.2);
  const ClassTable classes = room_classes();
  OwnReplicas own(kRoom);
  BlockPacker packer(classes.num_components());
  packer.content().add(1, 0, 4.0F);
  ReplicaSketchSource none;
  const Replicas::Slot slot = *own.replicas.open(kId);
  CHECK(none.begin(own.replicas, slot) == Status::kResourceExhausted);
  for (int n = 0; n < 3; ++n)
    REQUIRE(own.replicas.put(slot, *pack({n, 0, 0}), 1, packer.pack()).ok());
  ReplicasConfig small = kRoom;
  small.blocks = 2;
  OwnSource small_source(config, classes, small);
  CHECK(small_source.source.begin(own.replicas, slot) == Status::kResourceExhausted);
  OwnSource from(config, classes, kRoom);
  CHECK(from.source.begin(own.replicas, slot + 1) == Status::kInvalidArgument);
  CHECK(from.source.begin(own.replicas, kRoom.contributions) == Status::kInvalidArgument);
  const Replicas::Slot objections = *own.replicas.open({7, 1, Objection::kNumber});
  CHECK(from.source.begin(own.replicas, objections) == Status::kInvalidArgument);
  own.replicas.set_leaving(slot);
  CHECK(from.source.begin(own.replicas, slot) == Status::kInvalidArgument);
  // Nothing is left of what was begun before.
  TakenSketch taken;
  CHECK(taken.take(from.source.source()) == 1);
  CHECK(taken.sketch.surface_count() == 0);
  AlignedMemory memory(
      ReplicaSketchSource::required_bytes(config, classes.num_components(), kRoom) - 64);
  Arena arena = memory.arena();
  CHECK(ReplicaSketchSource::make(arena, config, classes, kRoom).status() ==
        Status::kResourceExhausted);
}

}  // namespace tessera
