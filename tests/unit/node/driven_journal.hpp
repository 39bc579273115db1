// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map in which something changes from step to step, its journal, and what is read of that.
#pragma once

#include <catch2/catch.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "maps/map_journal.hpp"
#include "support/random.hpp"
#include "support/small_map.hpp"

namespace tessera {

using oracle::Random;

inline constexpr std::size_t kPages = 256;

/// Blocks as bytes, by their keys.
using Blocks = std::map<std::uint64_t, std::vector<std::byte>>;

inline Blocks blocks_of(const LocalMap& map) {
  Blocks blocks;
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
    std::vector<std::byte> bytes(most_block_bytes(map.num_components()));
    bytes.resize(save_block(map, map.block_at(item.index), bytes));
    if (!bytes.empty()) blocks[item.key] = bytes;
  }
  return blocks;
}

/// A map in which something changes from step to step.
struct Driven : SmallMap {
  explicit Driven(std::uint64_t seed) : SmallMap(config_of_pages(kPages)), random(seed) {}
  /// Up to 12 of 40 blocks.
  void drive() {
    ++scans;
    map.begin_revision();
    const int changes = 1 + random.below(12);
    for (int i = 0; i < changes; ++i) {
      const std::int32_t at = 8 * random.below(40);
      const std::int32_t within = random.below(8);
      const VoxelCoord voxel{at + within, within, 0};
      if (random.below(3) == 0) {
        REQUIRE(carve(map, voxel) == Status::kOk);
      } else {
        REQUIRE(hit(map, voxel, 1 + random.below(3), 1.5F) == Status::kOk);
      }
    }
  }
  [[nodiscard]] JournalNote note() const {
    JournalNote note{.has_scan = true,
                     .submap = {.first_scan = 2, .last_scan = scans, .length_m = 0.5 * scans},
                     .map_revision = map.revision(),
                     .stamp_us = static_cast<std::int64_t>(100'000 * scans),
                     .T_map_body = {},
                     .continues = scans % 2 == 0};
    note.T_map_body[9] = static_cast<double>(scans);
    return note;
  }
  Random random;
  std::uint32_t scans = 0;
};

inline std::unique_ptr<MapJournal> journal_of(
    const Driven& driven, const std::string& path, const JournalContent* found = nullptr,
    std::uint64_t growth = MapJournal::kLeastGrowth_bytes) {
  auto made =
      MapJournal::make(path, driven.map, MapIdentity{.robot = 1, .epoch = 2}, found, growth);
  INFO(made.failure().text());
  REQUIRE(made.ok());
  return std::move(*made);
}

/// What is read from a file into an empty map.
struct Read {
  explicit Read(const std::string& path) : map(config_of_pages(kPages)) {
    auto read = read_journal(path, &map.map);
    INFO(read.failure().text());
    REQUIRE(read.ok());
    content = *read;
    blocks = blocks_of(map.map);
  }
  SmallMap map;
  JournalContent content;
  Blocks blocks;
};

}  // namespace tessera
