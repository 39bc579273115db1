// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A sketch that is brought up to date is the one that is taken from nothing, and reads what has
// changed alone.
#include <algorithm>
#include <array>

#include "finder_rig.hpp"
#include "replica_rig.hpp"

namespace tessera {

namespace {

constexpr ContributionId kOfRobot{3, 1, 0};

/// One contribution, a source that goes on with its sketch, and one that never does.
struct KeptRig {
  explicit KeptRig(const ReplicasConfig& room)
      : own(room),
        packer(classes.num_components()),
        kept_source(map_config(), classes, room),
        new_source(map_config(), classes, room),
        slot(*own.replicas.open(kOfRobot)) {}

  static MapConfig map_config() {
    MapConfig config;
    config.resolution_m = 0.2;
    return config;
  }
  /// A part with these layers.
  void put_part(BlockKey key, std::uint32_t version, std::uint8_t layers,
                const BlockVoxels& voxels) {
    const PartVersion part{.number = version, .first = version, .layers = layers};
    REQUIRE(own.replicas.put(slot, key, part, packer.pack(voxels, layers)).ok());
  }
  /// A block in two parts, once it was read. Returns their records.
  std::array<std::uint32_t, 2> read_in_two_parts(BlockKey key, const BlockVoxels& voxels) {
    put_part(key, 1, 1, voxels);
    put_part(key, 2, 2, voxels);
    update();
    const std::uint32_t first = number(slot, key);
    return {first, own.replicas.record(first).next_part};
  }
  /// Of the block's first part.
  [[nodiscard]] std::uint32_t number(Replicas::Slot of, BlockKey key) const {
    return own.replicas.number_of(*own.replicas.find(of, key));
  }
  /// Of one voxel in each of the first so many cells of a block.
  std::vector<std::byte> cells(int count) {
    packer.content().clear();
    for (int n = 0; n < count; ++n)
      packer.content().add(1, 4 * (n % 2) + 32 * (n / 2 % 2) + 256 * (n / 4), 4.0F);
    return packer.pack();
  }
  void put(BlockKey key, std::uint32_t version, std::span<const std::byte> bytes) {
    REQUIRE(own.replicas.put(slot, key, version, bytes).ok());
  }
  void drop(BlockKey key) {
    const Replicas::Replica* const found = own.replicas.find(slot, key);
    REQUIRE(found != nullptr);
    own.replicas.drop(own.replicas.number_of(*found));
  }
  /// Blocks that were read to bring it up to date.
  std::uint32_t update() {
    REQUIRE(kept_source.source.begin(own.replicas, slot) == Status::kOk);
    kept.go_on(kept_source.source.source());
    const std::uint32_t read = kept_source.source.blocks_taken();
    REQUIRE(new_source.source.begin(own.replicas, slot) == Status::kOk);
    taken.take(new_source.source.source());
    CHECK(same_sketch(kept.sketch, taken.sketch));
    CHECK(kept.sketch.surface_levels() == taken.sketch.surface_levels());
    CHECK(kept_source.source.newest_version() == new_source.source.newest_version());
    return read;
  }

  ClassTable classes = room_classes();
  OwnReplicas own;
  BlockPacker packer;
  OwnSource kept_source;
  OwnSource new_source;
  Replicas::Slot slot;
  TakenSketch kept;
  TakenSketch taken;
};

}  // namespace

TEST_CASE("a sketch that goes on is that from nothing, whatever has come, changed and gone") {
  oracle::Random random(11);
  KeptRig rig(
      {.segments = 1U << 14U, .blocks = 1'024, .contributions = 4, .robot_segments = 1U << 14U});
  const int num_components = rig.classes.num_components();
  // Another contribution takes and leaves records of the same replicas.
  const Replicas::Slot other = *rig.own.replicas.open({4, 1, 0});
  std::uint32_t version = 0;
  for (int round = 0; round < 40; ++round) {
    std::vector<std::uint64_t> changed;
    const int changes = random.below(12);
    for (int n = 0; n < changes; ++n) {
      const BlockKey key = *pack({random.below(4), random.below(4), random.below(3)});
      changed.push_back(key.bits);
      ++version;
      const bool is_part = random.below(3) == 0 && rig.own.replicas.find(rig.slot, key) != nullptr;
      const auto layers = static_cast<std::uint8_t>(
          is_part ? 1U + static_cast<unsigned>(random.below(15)) : kAllLayers);
      const BlockVoxels voxels = random_voxels(random, num_components, TuplePolicy::kDense);
      rig.put_part(key, version, layers, voxels);
      if (random.below(6) == 0) rig.drop(key);
      const BlockKey of_other = *pack({random.below(3), 0, 0});
      if (random.below(2) == 0)
        REQUIRE(rig.own.replicas.put(other, of_other, version, rig.cells(2)).ok());
      const Replicas::Replica* const found = rig.own.replicas.find(other, of_other);
      if (random.below(3) == 0 && found != nullptr)
        rig.own.replicas.drop(rig.own.replicas.number_of(*found));
    }
    std::sort(changed.begin(), changed.end());
    changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
    CHECK(rig.update() <= changed.size());
  }
  CHECK(rig.kept.sketch.surface_count() > 100);
  CHECK(rig.update() == 0);
}

TEST_CASE("a block that comes back without one of its parts is read again") {
  oracle::Random random(12);
  KeptRig rig({.segments = 1'024, .blocks = 256, .contributions = 4, .robot_segments = 1'024});
  const BlockVoxels voxels =
      random_voxels(random, rig.classes.num_components(), TuplePolicy::kDense);
  const BlockKey key = *pack({1, 2, 0});
  const auto [first, second] = rig.read_in_two_parts(key, voxels);
  rig.drop(key);
  // Another robot's block takes the record of the part that does not come back.
  const Replicas::Slot other = *rig.own.replicas.open({4, 1, 0});
  REQUIRE(rig.own.replicas.put(other, *pack({0, 0, 0}), 1, rig.cells(1)).ok());
  REQUIRE(rig.number(other, *pack({0, 0, 0})) == second);
  rig.put_part(key, 1, 1, voxels);
  REQUIRE(rig.number(rig.slot, key) == first);
  // Begun twice before it is taken.
  REQUIRE(rig.kept_source.source.begin(rig.own.replicas, rig.slot) == Status::kOk);
  CHECK(rig.update() == 1);
  rig.put_part(key, 2, 2, voxels);
  CHECK(rig.update() == 1);
  CHECK(rig.update() == 0);
}

TEST_CASE("a block that comes back without a part while the sketch is taken is read again") {
  oracle::Random random(13);
  KeptRig rig({.segments = 1'024, .blocks = 256, .contributions = 4, .robot_segments = 1'024});
  const BlockVoxels voxels =
      random_voxels(random, rig.classes.num_components(), TuplePolicy::kDense);
  const BlockKey back = *pack({1, 2, 0});
  const BlockKey grown = *pack({5, 2, 0});
  rig.put_part(grown, 3, 1, voxels);
  const std::array<std::uint32_t, 2> records = rig.read_in_two_parts(back, voxels);
  rig.put_part(grown, 4, 1, voxels);
  REQUIRE(rig.kept_source.source.begin(rig.own.replicas, rig.slot) == Status::kOk);
  rig.kept.go_on(rig.kept_source.source.source(), [&](int piece) {
    if (piece != 1) return;
    rig.drop(back);
    rig.put_part(grown, 5, 2, voxels);
    const Replicas::Replica* const block = rig.own.replicas.find(rig.slot, grown);
    REQUIRE(block->next_part == records[1]);
    rig.put_part(back, 1, 1, voxels);
    REQUIRE(rig.number(rig.slot, back) == records[0]);
  });
  rig.update();
  CHECK(rig.update() == 0);
}

TEST_CASE("a sketch that goes on is thinned as one from nothing, and read anew where it had less") {
  KeptRig rig(
      {.segments = 1U << 14U, .blocks = 8'192, .contributions = 4, .robot_segments = 1U << 14U});
  const std::vector<std::byte> full = rig.cells(8);
  const auto key = [](int n) { return *pack({n % 32, n / 32 % 32, n / 1'024}); };
  for (int n = 0; n < 5'000; ++n) rig.put(key(n), 1, full);
  CHECK(rig.update() == 5'000);
  CHECK(rig.kept.sketch.surface_count() == 40'000);
  for (int n = 5'000; n < 6'000; ++n) rig.put(key(n), 1, full);
  CHECK(rig.update() == 1'000);
  CHECK(rig.kept.sketch.surface_levels() == 1);
  for (int n = 5'500; n < 6'000; ++n) rig.drop(key(n));
  CHECK(rig.update() == 0);
  CHECK(rig.kept.sketch.surface_levels() == 1);
  // Fewer cells of some blocks, and then all of them fit again.
  for (int n = 0; n < 100; ++n) rig.put(key(n), 2, rig.cells(4));
  CHECK(rig.update() == 100);
  for (int n = 5'000; n < 5'500; ++n) rig.drop(key(n));
  CHECK(rig.update() == 5'000);
  CHECK(rig.kept.sketch.surface_levels() == 0);
}

TEST_CASE("a sketch that another source has taken since is read from nothing") {
  KeptRig rig({.segments = 1'024, .blocks = 256, .contributions = 4, .robot_segments = 1'024});
  for (int n = 0; n < 100; ++n) rig.put(*pack({n, 0, 0}), 1, rig.cells(1 + n % 8));
  CHECK(rig.update() == 100);
  rig.put(*pack({7, 0, 0}), 2, rig.cells(1));
  CHECK(rig.update() == 1);
  REQUIRE(rig.new_source.source.begin(rig.own.replicas, rig.slot) == Status::kOk);
  rig.kept.go_on(rig.new_source.source.source());
  CHECK(rig.update() == 100);
  // Of two contents of one version the lower one counts, whenever it comes.
  const PartVersion lower{.number = 1, .first = 1, .hash = {0, 1}};
  const PartVersion higher{.number = 1, .first = 1, .hash = {0, 2}};
  const BlockKey key = *pack({0, 1, 0});
  REQUIRE(rig.own.replicas.put(rig.slot, key, higher, rig.cells(2)).ok());
  CHECK(rig.update() == 1);
  REQUIRE(rig.own.replicas.put(rig.slot, key, lower, rig.cells(6)).ok());
  CHECK(rig.update() == 1);
}

}  // namespace tessera
