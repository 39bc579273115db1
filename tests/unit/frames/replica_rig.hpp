// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Replicas and what a sketch is taken from them with, in memory of exactly the size that they ask
// for; sketches that can be compared; and voxels that a block's parts are made of.
#pragma once

#include <catch2/catch.hpp>
#include <map>
#include <tuple>
#include <vector>

#include "support/random.hpp"
#include "support/small_map.hpp"
#include "tessera/frames/replica_sketch_source.hpp"

namespace tessera {

struct OwnReplicas {
  explicit OwnReplicas(const ReplicasConfig& given) : memory(Replicas::required_bytes(given)) {
    Arena arena = memory.arena();
    replicas = *Replicas::make(arena, given);
  }
  AlignedMemory memory;
  Replicas replicas;
};

struct OwnSource {
  OwnSource(const MapConfig& map, const ClassTable& classes, const ReplicasConfig& replicas)
      : memory(ReplicaSketchSource::required_bytes(map, classes.num_components(), replicas)) {
    memory.fill(std::byte{0xa5});
    Arena arena = memory.arena();
    Result<ReplicaSketchSource> made = ReplicaSketchSource::make(arena, map, classes, replicas);
    REQUIRE(made.ok());
    REQUIRE(arena.remaining_bytes() == 0);
    source = *made;
  }
  AlignedMemory memory;
  ReplicaSketchSource source;
};

struct TakenSketch {
  AlignedMemory memory{MapSketch::required_bytes()};
  std::vector<KeyedIndex> scratch{MapSketch::kScratch};
  MapSketch sketch;

  TakenSketch() {
    Arena arena = memory.arena();
    sketch = *MapSketch::make(arena);
  }
  /// All of a source; between(piece) is called after each piece but the last. Returns the pieces.
  template <class Between>
  int take(const SketchSource& source, Between&& between) {
    sketch.begin(source.resolution_m);
    SketchSource::Cursor cursor;
    int pieces = 1;
    for (; !source.take(source.context, cursor, sketch); ++pieces) {
      REQUIRE(pieces < 10'000);
      between(pieces);
    }
    sketch.finish(scratch);
    return pieces;
  }
  int take(const SketchSource& source) {
    return take(source, [](int) {});
  }
  /// Goes on with what it has of the source; between(piece) as above.
  template <class Between>
  void go_on(const SketchSource& source, Between&& between) {
    SketchSource::Cursor cursor;
    for (int pieces = 1; !source.take(source.context, cursor, sketch); ++pieces) {
      REQUIRE(pieces < 10'000);
      between(pieces);
    }
    sketch.finish(scratch);
  }
  void go_on(const SketchSource& source) {
    go_on(source, [](int) {});
  }
};

/// All that a finder reads of a surface.
inline auto values_of(const MapSketch::Surface& surface) {
  return std::tuple(surface.key, surface.occupied, surface.free, surface.offset_m,
                    surface.looseness_m2, surface.normal, surface.label, surface.open,
                    surface.kind);
}

/// False where they differ in any bit, the order of free cells aside.
inline bool same_sketch(const MapSketch& a, const MapSketch& b) {
  if (a.cell_m() != b.cell_m() || a.surface_count() != b.surface_count() ||
      a.free_cell_count() != b.free_cell_count())
    return false;
  for (std::uint32_t i = 0; i < a.surface_count(); ++i)
    if (values_of(a.surface(i)) != values_of(b.surface(i))) return false;
  std::multimap<std::uint64_t, std::uint64_t> free_a;
  std::multimap<std::uint64_t, std::uint64_t> free_b;
  for (std::uint32_t i = 0; i < a.free_cell_count(); ++i) {
    free_a.emplace(a.free_cell(i).key, a.free_cell(i).free);
    free_b.emplace(b.free_cell(i).key, b.free_cell(i).free);
  }
  return free_a == free_b;
}

/// What a block's voxels hold, by row order.
struct VoxelContent {
  VoxelEvidence evidence;
  std::uint8_t passes = 0;
};
using BlockVoxels = std::map<int, VoxelContent>;

/// Content of these layers, packed.
class BlockPacker {
 public:
  explicit BlockPacker(int num_components)
      : memory_(BlockContent::required_bytes(num_components)),
        num_components_(num_components),
        into_(most_packed_bytes(num_components)) {
    Arena arena = memory_.arena();
    content_ = *BlockContent::make(arena, num_components);
  }
  [[nodiscard]] BlockContent& content() { return content_; }
  /// Of what is in content().
  std::vector<std::byte> pack() {
    const std::size_t bytes = pack_block(content_, into_);
    return {into_.begin(), into_.begin() + static_cast<std::ptrdiff_t>(bytes)};
  }
  std::vector<std::byte> pack(const BlockVoxels& voxels, unsigned layers = kAllLayers) {
    content_.clear();
    for (const auto& [row, voxel] : voxels) {
      if (((layers >> layer_of_row(row)) & 1U) == 0) continue;
      for (int c = 1; c < num_components_; ++c) {
        const float count = voxel.evidence.sigma[static_cast<std::size_t>(c)];
        if (count > 0.0F) content_.add(c, row, count);
      }
      if (voxel.evidence.rest > 0.0F) content_.add_rest(row, voxel.evidence.rest);
      if (voxel.passes > 0) content_.add_passes(row, voxel.passes);
      content_.add_centroid(row, voxel.evidence.centroid);
    }
    return pack();
  }

 private:
  AlignedMemory memory_;
  int num_components_;
  BlockContent content_;
  std::vector<std::byte> into_;
};

/// A third of the voxels, with up to three classes each, and rests where the map keeps them; counts
/// are multiples of 1 / 4, which packing and tuples keep.
inline BlockVoxels random_voxels(oracle::Random& random, int num_components, TuplePolicy tuple) {
  BlockVoxels voxels;
  for (int row = 0; row < kBlockVoxels; ++row) {
    if (random.below(3) != 0) continue;
    VoxelContent& voxel = voxels[row];
    voxel.evidence.num_components = num_components;
    voxel.passes = static_cast<std::uint8_t>(random.below(2) * random.below(30));
    const int classes = random.below(4);
    for (int n = 0; n < classes; ++n) {
      const int component = 1 + random.below(num_components - 1);
      voxel.evidence.sigma[static_cast<std::size_t>(component)] =
          0.25F * static_cast<float>(1 + random.below(24));
    }
    const bool has_rest = tuple == TuplePolicy::kCompact && random.below(8) == 0;
    if (has_rest) voxel.evidence.rest = 0.25F * static_cast<float>(1 + random.below(24));
    if ((classes > 0 || has_rest) && random.below(2) == 0)
      voxel.evidence.centroid = Centroid::of_code(static_cast<std::uint8_t>(1 + random.below(216)));
  }
  return voxels;
}

}  // namespace tessera
