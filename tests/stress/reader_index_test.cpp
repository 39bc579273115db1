// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Blocks that are there are found, whatever the index does with its entries meanwhile.
#include "race.hpp"
#include "tessera/base/internal/digest.hpp"

namespace tessera {

TEST_CASE("reader: a block that is there is found while the index moves others about") {
  MapConfig config = config_of(TuplePolicy::kCompact);
  config.storage_bytes = 1200 * SlabPool::kPageBytes;
  OwnedMap owned(config);
  LocalMap& map = owned.map;
  OctetEvidence added;
  added.plane(3).fill(2.0F);
  const auto stays = [](int i) { return BlockCoord{i, -i, i / 7}; };
  for (int i = 0; i < 300; ++i)
    REQUIRE(map.add_labels(*map.open_block(stays(i)), 63, added) == Status::kOk);
  Findings findings;
  const auto write = [&](int round) {
    // Grows from one page of the index to dozens, then all those blocks go again and others come.
    for (int i = 0; i < 300; ++i) REQUIRE(map.open_block({i, 1000, round}).ok());
    if (round % 40 == 39) map.close_empty_blocks();
  };
  const auto read = [&](MapReader& reader, oracle::Random& random) {
    const BlockCoord block = stays(random.below(300));
    const Result<VoxelEvidence> evidence = reader.evidence(voxel_at(block, 63, 5));
    if (!evidence.ok()) return;
    const bool found = evidence->sigma[3] == 2.0F && evidence->total() == 2.0;
    findings.full += found ? 1U : 0U;
    findings.torn += found ? 0U : 1U;
  };
  race(map, findings, kVoxelReads, write, read);
}

TEST_CASE("reader: a block that is there is found while others displace it in the index") {
  MapConfig config = config_of(TuplePolicy::kCompact);
  config.storage_bytes = 17 * SlabPool::kPageBytes;  // one page of the index
  OwnedMap owned(config);
  LocalMap& map = owned.map;
  // Blocks whose two buckets are among eight, so that these are full and every insert moves others.
  std::vector<BlockCoord> blocks;
  for (std::int32_t i = 0; blocks.size() < 150; ++i) {
    const BlockCoord block{i % 100, i / 100, 3};
    const auto hash =
        static_cast<std::uint32_t>(mix64(pack_in_grid(block).bits + 0x9e3779b97f4a7c15U) >> 32U);
    if (hash % 64 < 8 && hash / 64 % 64 < 8) blocks.push_back(block);
  }
  constexpr int kStay = 20;
  OctetEvidence added;
  added.plane(3).fill(2.0F);
  for (std::size_t i = 0; i < kStay; ++i)
    REQUIRE(map.add_labels(*map.open_block(blocks[i]), 63, added) == Status::kOk);
  Findings findings;
  oracle::Random random(10);
  const auto write = [&](int) {
    for (int i = 0; i < 200; ++i) {
      const BlockCoord block = blocks[static_cast<std::size_t>(kStay + random.below(130))];
      const Block* const there = map.find(block);
      const Result<SlabHandle> handle = map.open_block(block);
      if (there != nullptr) map.close_if_empty(*handle);
    }
  };
  const auto read = [&](MapReader& reader, oracle::Random& own) {
    const BlockCoord block = blocks[static_cast<std::size_t>(own.below(kStay))];
    const Result<VoxelEvidence> evidence = reader.evidence(voxel_at(block, 63, 5));
    if (!evidence.ok()) return;
    findings.full += evidence->sigma[3] == 2.0F ? 1U : 0U;
    findings.torn += evidence->sigma[3] == 2.0F ? 0U : 1U;
  };
  race(map, findings, kVoxelReads, write, read);
  CHECK(map.usage().blocks_refused > 0);
}

}  // namespace tessera
