// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a move makes of blocks: staged, shown at once, copied into the map.
#include "tessera/fusion/internal/two_maps.hpp"

#include <catch2/catch.hpp>

#include "support/sample_content.hpp"
#include "support/small_map.hpp"

namespace tessera {
namespace {

constexpr VoxelCoord kVoxel{1, 2, 3};  // of block (0, 0, 0)

struct OwnMaps {
  OwnMaps() : memory(TwoMaps::required_bytes(config())) {
    Arena arena = memory.arena();
    maps = *TwoMaps::make(arena, config(), table_of(3));
  }
  static GlobalMapConfig config() {
    GlobalMapConfig config;
    config.map = config_of_pages(16);
    config.staged_bytes = 16 * SlabPool::kPageBytes;
    return config;
  }
  /// A block whose voxel has that class alone.
  const BlockContent& of_class(int component) {
    content->clear();
    if (component != 0) content->add(component, row_order(kVoxel), 3.0F);
    return *content;
  }
  int label(bool staged_first) { return maps.query(kVoxel, staged_first).label; }

  AlignedMemory memory;
  TwoMaps maps;
  OwnContent content{5};
};

}  // namespace

TEST_CASE("TwoMaps: what is staged hides the map, nothing hides it too, and merging ends that") {
  OwnMaps own;
  REQUIRE(own.maps.replace({0, 0, 0}, own.of_class(1)));
  const int staged = GENERATE(2, 0);
  REQUIRE(own.maps.stage({0, 0, 0}, own.of_class(staged)));
  CHECK(own.maps.is_staged({0, 0, 0}));
  CHECK(own.label(false) == 1);
  CHECK(own.label(true) == staged);
  CHECK(own.maps.generation() == 0);

  own.maps.show_staged();
  CHECK(own.maps.generation() == 1);
  CHECK(own.maps.view() % 2 == 1);
  TwoMaps::Merged merged;
  for (int i = 0; i < 100 && !merged.complete; ++i)
    merged = own.maps.merge(*own.content, GlobalRecords(), 1);
  CHECK(merged.complete);
  CHECK(merged.refused == 0);
  CHECK(own.maps.view() % 2 == 0);
  CHECK(own.maps.generation() == 1);
  CHECK_FALSE(own.maps.is_staged({0, 0, 0}));
  CHECK(own.label(false) == staged);
  CHECK(own.maps.map().block_count() == (staged != 0 ? 1U : 0U));
}

TEST_CASE("TwoMaps: a block that finds no room is not staged, and not half") {
  OwnMaps own;
  OwnContent full(5);
  for (int row = 0; row < kBlockVoxels; ++row) {
    for (int component = 1; component < 4; ++component) full->add(component, row, 1.0F);
    full->add_passes(row, 1);
  }
  std::int32_t x = 0;
  while (own.maps.stage({x, 0, 0}, *full)) REQUIRE(++x < 1000);
  CHECK_FALSE(own.maps.is_staged({x, 0, 0}));
  CHECK(own.maps.staged().block_count() == static_cast<std::size_t>(x));
  own.maps.unstage({0, 0, 0});
  CHECK(own.maps.stage({x, 0, 0}, *full));
}

}  // namespace tessera
