// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Voxels that are set, merged and asked for, many at once.
#include "meter.hpp"

namespace tessera::bench {

namespace {

void measure_voxel_writes(Meter& meter) {
  OwnedMap owned(config_of(TuplePolicy::kDense, 16), kMostClasses);
  OwnedMap from(config_of(TuplePolicy::kDense, 4), kMostClasses);
  LocalMap& map = owned.map;
  const SlabHandle source = fill_block(from.map, {1, 2, 3}, 100);
  const Block& full = from.map.block_at(source);
  const double counts = kMostClasses + 1.0;
  SlabHandle block = 0;
  const auto each = [&](auto&& write) {
    int done = 0;
    for (int i = 0; i < kBlockVoxels; ++i)
      done += write(i / 8, i % 8, from.map.evidence(full, i / 8, i % 8),
                    from.map.free_passes(full, i / 8, i % 8)) == Status::kOk
                  ? 1
                  : 0;
    return fixed(done == kBlockVoxels && map.usage().label_voxels == kBlockVoxels, counts);
  };
  const auto empty = [&] {
    map.clear();
    block = *map.open_block({1, 2, 3});
  };
  meter.measure({"restore", "LocalMap::restore", "dense: voxels of every class", "C + 1 counts"},
                kBlockVoxels, empty, [&] {
                  return each([&](int o, int v, const VoxelEvidence& e, std::uint8_t passes) {
                    return map.restore(block, o, v, e, passes);
                  });
                });
  meter.measure(
      {"merge", "LocalMap::merge", "dense: voxels of every class, at the cap, into the same",
       "C + 1 counts"},
      kBlockVoxels,
      [&] {
        map.clear();
        block = fill_block(map, {1, 2, 3}, 100);
      },
      [&] {
        return each([&](int o, int v, const VoxelEvidence& e, std::uint8_t passes) {
          return map.merge(block, o, v, e, passes);
        });
      });
  meter.measure(
      {"remove_block", "LocalMap::remove_block", "dense: a block with all its octets and pages",
       "64 octets"},
      1,
      [&] {
        map.clear();
        block = fill_block(map, {1, 2, 3}, 100);
      },
      [&] {
        map.remove_block(block);
        return fixed(map.block_count() == 0 && map.usage().label_voxels == 0, 64.0);
      });
}

/// Voxels of every block, in an order in which no two of a block follow each other.
void measure_batch(Meter& meter) {
  OwnedMap owned(config_of(TuplePolicy::kDense, 16), kMostClasses);
  LocalMap& map = owned.map;
  std::vector<BlockCoord> blocks;
  for (const BlockCoord& block : same_buckets(16)) {
    if (fill_block(map, block, 10) != 0) blocks.push_back(block);
  }
  std::vector<VoxelCoord> voxels;
  for (int i = 0; i < kBlockVoxels; ++i) {
    for (const BlockCoord& block : blocks) voxels.push_back(voxel_at(block, i % 64, i / 64));
  }
  std::vector<Estimate> estimates(voxels.size());
  const auto count = static_cast<int>(voxels.size());
  meter.measure(
      {"query_batch", "LocalMap::query",
       "at once: dense, every class, blocks that collide in the index by turns", "C + 2 counts"},
      count, [] {},
      [&] {
        const Status status = map.query(std::span<const VoxelCoord>(voxels), estimates);
        return fixed(status == Status::kOk && estimates.back().label > 0, kMostClasses + 2.0);
      });
}

void measure_passes(Meter& meter) {
  OwnedMap owned(config_of(TuplePolicy::kCompact, 16), kMostClasses);
  LocalMap& map = owned.map;
  const std::vector<std::byte> passes(kOctetVoxels, std::byte{100});
  SlabHandle block = 0;
  meter.measure(
      {"merge_passes", "LocalMap::merge_passes", "octets of a new block, then the same again",
       "8 voxels"},
      2 * kBlockOctets,
      [&] {
        map.clear();
        block = *map.open_block({1, 2, 3});
      },
      [&] {
        int done = 0;
        for (int i = 0; i < 2 * kBlockOctets; ++i)
          done += map.merge_passes(block, i % kBlockOctets, passes, 0xffU) == Status::kOk ? 1 : 0;
        return fixed(done == 2 * kBlockOctets, 8.0);
      });
}

}  // namespace

void measure_voxels(Meter& meter) {
  measure_voxel_writes(meter);
  measure_batch(meter);
  measure_passes(meter);
}

}  // namespace tessera::bench
