// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The code of a block: what was quantised comes out, from any layers, within the bytes that are
// promised, the same bytes for the same content.
#include "tessera/exchange/internal/block_codec.hpp"

#include <catch2/catch.hpp>

#include "support/sample_content.hpp"
#include "support/small_map.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace tessera {
namespace {

using oracle::Random;

/// Decodes, and holds what was decoded against what was coded.
void check_round_trip(OwnContent& own, int components, unsigned layers) {
  const CodedBytes bytes = coded(*own, layers);
  CHECK(bytes.size() <= most_coded_bytes(count_ones(layers)));
  OwnContent found(components);
  REQUIRE(decode_block(bytes, layers, components, *found) == Status::kOk);
  CHECK(picture_of(*found, components, layers) == picture_of(*own, components, layers));
  CHECK(coded(*found, layers) == bytes);
  const std::vector<float> others = picture_of(*found, components, kAllLayers & ~layers);
  CHECK(others == std::vector<float>(others.size(), 0.0F));
}

TEST_CASE("block codec: smooth blocks come out as they were, from any layers") {
  Random random(static_cast<std::uint64_t>(GENERATE(range(1, 40))));
  const int components = 3 + random.below(kMaxComponents - 2);
  OwnContent own(components);
  fill_smoothly(*own, random, components);
  quantise(*own);
  for (unsigned layers = 1; layers <= kAllLayers; ++layers)
    check_round_trip(own, components, layers);
}

TEST_CASE("block codec: so do random ones of all components and levels, within the bytes") {
  Random random(static_cast<std::uint64_t>(GENERATE(range(1, 60))));
  const int components = random.below(2) == 0 ? kMaxComponents : 3 + random.below(20);
  OwnContent own(components);
  fill_at_random(*own, random, components, random.below(9),
                 random.below(2) == 0 ? 1.0 : random.uniform());
  quantise(*own);
  for (const unsigned layers : {1U, 2U, 8U, 5U, kAllLayers})
    check_round_trip(own, components, layers);
}

TEST_CASE("block codec: one layer is 1,200 bytes at most, whatever the levels are made to be") {
  static_assert(most_coded_bytes(1) <= 1200);
  CHECK(most_coded_bytes(1) == 1113);
  // Every decision against what is likely: levels that jump, components that change, full of them.
  Random random(17);
  std::size_t most = 0;
  for (int round = 0; round < 200; ++round) {
    OwnContent own;
    for (int row = 0; row < kLayerVoxels; ++row) {
      const int step = round % 4 == 0 ? 20 : 16 + random.below(4);
      const int largest = 1 + step + random.below(kMostLevel - step);
      const int first = 1 + random.below(20);
      own->set(first, row, count_of_level(largest));
      own->set(first + 1 + random.below(20), row, count_of_level(largest - step));
      own->set(first + 22 + random.below(20), row, count_of_level(largest - random.below(step)));
      own->add_rest(row, count_of_level(1 + random.below(kMostLevel)));
      own->add_passes(row, passes_of_level(1 + random.below(kMostPassesLevel)));
    }
    quantise(*own);
    check_round_trip(own, kMaxComponents, 1);
    most = std::max(most, coded(*own, 1).size());
  }
  CHECK(most > 850);
  CHECK(most <= 1113);
}

TEST_CASE("block codec: no evidence is no bytes, and no bytes are no evidence") {
  OwnContent own(8);
  CHECK(coded(*own).empty());
  CHECK(decode_block({}, kAllLayers, 8, *own) == Status::kOk);
  CHECK_FALSE(own->any());
  own->add(3, 200, 1.0F);  // layer 1
  quantise(*own);
  CHECK(coded(*own, 0b1101).empty());
  CHECK_FALSE(coded(*own, 0b0010).empty());
}

TEST_CASE("block codec: with too little room nothing is written") {
  Random random(3);
  OwnContent own(8);
  fill_smoothly(*own, random, 8);
  quantise(*own);
  const CodedBytes bytes = coded(*own);
  for (std::size_t room = 0; room < bytes.size(); ++room) {
    CodedBytes less(room);
    REQUIRE(encode_block(*own, kAllLayers, less) == 0);
  }
  CodedBytes enough(bytes.size() + 8);
  CHECK(encode_block(*own, kAllLayers, enough) == bytes.size());
}

TEST_CASE("block codec: only labels, only passes, only a rest, one voxel") {
  for (const int row : {0, 1, 77, 300, 511}) {
    for (int kind = 0; kind < 4; ++kind) {
      OwnContent own(8);
      if (kind == 0 || kind == 3) own->add(7, row, 0.5F);
      if (kind == 1 || kind == 3) own->add_passes(row, 3);
      if (kind == 2) own->add_rest(row, 4.0F);
      quantise(*own);
      check_round_trip(own, 8, kAllLayers);
      CHECK(coded(*own).size() <= 12);
    }
  }
}

TEST_CASE("block codec: content of maps of either kind of counts comes through") {
  const TuplePolicy tuple = GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact);
  MapConfig config = config_of_pages(64);
  config.tuple = tuple;
  constexpr int kClasses = 6;
  SmallMap small(config, kClasses);
  Random random(23);
  for (int i = 0; i < 800; ++i) {
    const VoxelCoord voxel{random.below(8), random.below(8), random.below(8)};
    REQUIRE(hit(small.map, voxel, 1 + random.below(kClasses + 1),
                static_cast<float>(random.uniform(0.1, 2.0))) == Status::kOk);
    const VoxelCoord free{random.below(8), random.below(8), random.below(8)};
    REQUIRE(carve(small.map, free) == Status::kOk);
  }
  OwnContent own(kClasses + 2);
  add_block(small.map, *small.map.find({0, 0, 0}), *own);
  quantise(*own);
  check_round_trip(own, kClasses + 2, kAllLayers);
  // Replicas keep what was decoded, to the last bit.
  MapConfig exact = config;
  exact.tuple = TuplePolicy::kDense;
  exact.max_evidence = 0.0F;
  SmallMap copy(exact, kClasses);
  const SlabHandle block = *copy.map.open_block({0, 0, 0});
  REQUIRE(copy.map.replace(block, *own) == Status::kOk);
  int same = 0;
  for (int row = 0; row < kBlockVoxels; ++row)
    same += copy.map.query(voxel_of_row({0, 0, 0}, row)).label ==
                    small.map.query(voxel_of_row({0, 0, 0}, row)).label
                ? 1
                : 0;
  CHECK(same == kBlockVoxels);
}

}  // namespace
}  // namespace tessera
