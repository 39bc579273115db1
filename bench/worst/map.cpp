// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// States and writes that cost a map most: every class at once, all at the cap, keys that collide,
// storage full.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <vector>

#include "meter.hpp"
#include "tessera/map/queries.hpp"

namespace tessera::bench {

namespace {

constexpr std::size_t kMebibytes = 16;

const char* name_of(TuplePolicy tuple) {
  return tuple == TuplePolicy::kDense ? "dense" : "compact";
}

/// Keys of the first two of so many leaves: all in one page until the last split.
std::vector<BlockCoord> two_leaves(std::size_t count, std::uint64_t leaves) {
  return blocks_with_hash(
      count, [leaves](std::uint32_t hash, std::uint64_t) { return (hash * leaves) >> 32U < 2; });
}

double leaves_of(const MapConfig& config) {
  return static_cast<double>(max_blocks(config) / BlockIndex::kLeafEntries + 1);
}

void measure_index(Meter& meter) {
  const MapConfig config = config_of(TuplePolicy::kCompact, kMebibytes);
  OwnedMap owned(config, kMostClasses);
  LocalMap& map = owned.map;
  // The insert that splits most is that into a full page.
  const std::vector<BlockCoord> keys =
      two_leaves(600, static_cast<std::uint64_t>(leaves_of(config)));
  const auto used = [&map] { return map.usage().used_bytes; };
  std::size_t splitting = 0;
  std::size_t most = 0;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const std::size_t before = used();
    if (!map.open_block(keys[i]).ok()) break;
    if (used() - before > most) splitting = i;
    most = std::max(most, used() - before);
  }
  double splits = 0.0;
  meter.measure(
      {"open_block_colliding", "LocalMap::open_block",
       "a full page of keys of two leaves: all splits but the last leave them together",
       "log2(leaves) splits of 512 entries"},
      1,
      [&] {
        map.clear();
        for (std::size_t i = 0; i < splitting; ++i) static_cast<void>(map.open_block(keys[i]));
      },
      [&] {
        const std::size_t before = used();
        static_cast<void>(map.open_block(keys[splitting]));
        // A page of the pool comes with a block now and then; others are the index's.
        splits = static_cast<double>((used() - before) / BlockIndex::kPageBytes);
        return Operations{splits, std::ceil(std::log2(leaves_of(config))) + 1.0};
      });
  const std::vector<BlockCoord> crowd = same_buckets(17);
  meter.measure(
      {"find_colliding", "LocalMap::find", "both buckets full of others", "16 slots"}, 1000,
      [&] {
        map.clear();
        for (std::size_t i = 0; i < 16; ++i) static_cast<void>(map.open_block(crowd[i]));
      },
      [&] {
        std::uint64_t found = 0;
        for (int i = 0; i < 1000; ++i) found += map.find(crowd[16]) == nullptr ? 0U : 1U;
        return fixed(found == 0 && map.block_count() == 16, 16.0);
      });
  meter.measure(
      {"make", "LocalMap::make", "16 MiB", "leaves"}, 1, [] {},
      [&] {
        Arena arena(std::as_writable_bytes(std::span(owned.lines)));
        Result<LocalMap> made = LocalMap::make(arena, config, table_of(kMostClasses));
        if (made.ok()) map = std::move(*made);
        return fixed(map.block_count() == 0 && map.open_block({}).ok(), leaves_of(config));
      });
}

/// Sums of a block whose octets all are this one.
class BlockSums {
 public:
  explicit BlockSums(const OctetEvidence& octet)
      : components_(octet.components()), sums_(std::size_t{kMaxComponents} * kBlockVoxels) {
    touched_.fill(~std::uint64_t{0});
    for (std::uint64_t rest = components_; rest != 0; rest &= rest - 1) {
      const int component = std::countr_zero(rest);
      const OctetEvidence::Plane& plane = octet.read(component);
      for (std::size_t i = 0; i < kBlockVoxels; ++i) {
        const std::size_t voxel = (i & 1U) + 2 * (i / 8 & 1U) + 4 * (i / 64 & 1U);
        sums_[static_cast<std::size_t>(component) * kBlockVoxels + i] = plane[voxel];
      }
    }
  }
  [[nodiscard]] BlockEvidence evidence() const {
    return {.sums = sums_.data(),
            .row = kBlockEdge,
            .component = kBlockVoxels,
            .components = components_,
            .touched = touched_.data()};
  }

 private:
  std::uint64_t components_;
  std::vector<float> sums_;
  std::array<std::uint64_t, kMaxComponents> touched_{};
};

void measure_octets(Meter& meter, TuplePolicy tuple) {
  OwnedMap owned(config_of(tuple, kMebibytes), kMostClasses);
  LocalMap& map = owned.map;
  const std::string suffix = std::string("_") + name_of(tuple);
  const OctetEvidence added = everything(map, 3.0F);
  const double counts = 8.0 * (kMostClasses + 1);
  SlabHandle block = 0;
  const auto full = [&] {
    map.clear();
    block = fill_block(map, {1, 2, 3}, map.max_passes());
  };
  const std::string labels = "add_labels" + suffix;
  const std::string labels_input =
      std::string(name_of(tuple)) +
      ": all 63 label components to 8 voxels at the cap, free passes too";
  meter.measure({labels.c_str(), "LocalMap::add_labels", labels_input.c_str(), "8 (C + 1) counts"},
                kBlockOctets, full, [&] {
                  int done = 0;
                  for (int octet = 0; octet < kBlockOctets; ++octet)
                    done += map.add_labels(block, octet, added) == Status::kOk ? 1 : 0;
                  return fixed(done == kBlockOctets && map.usage().label_voxels == kBlockVoxels,
                               counts);
                });
  const BlockSums sums(added);
  const std::string block_labels = "add_labels_block" + suffix;
  const std::string block_labels_input =
      std::string(name_of(tuple)) +
      ": a block's 64 octets, all 63 label components at the cap, free passes too";
  meter.measure({block_labels.c_str(), "LocalMap::add_labels", block_labels_input.c_str(),
                 "512 (C + 1) counts"},
                1, full, [&] {
                  const Result<int> written =
                      map.add_labels(block, ~std::uint64_t{0}, sums.evidence());
                  return fixed(written.ok() && *written == kBlockOctets, kBlockOctets * counts);
                });
  VoxelMask all;
  all.fill(~std::uint64_t{0});
  const std::string pass = "add_free_pass" + suffix;
  const std::string pass_input =
      std::string(name_of(tuple)) + ": 512 voxels, all of which labels give way in";
  const bool dense = tuple == TuplePolicy::kDense;
  const double of_voxel = dense ? kMostClasses + 1.0 : 1.0;
  meter.measure({pass.c_str(), "LocalMap::add_free_pass", pass_input.c_str(),
                 dense ? "512 (C + 1) counts" : "512 tuples"},
                1, full, [&] {
                  return fixed(map.add_free_pass(block, all) == Status::kOk, 512.0 * of_voxel);
                });
  const std::string query = "query" + suffix;
  const std::string query_input =
      std::string(name_of(tuple)) + ": voxels with evidence of every class";
  meter.measure({query.c_str(), "LocalMap::query", query_input.c_str(), "C + 2 counts"},
                kBlockVoxels, full, [&] {
                  int labelled = 0;
                  for (int i = 0; i < kBlockVoxels; ++i)
                    labelled += map.query(voxel_at({1, 2, 3}, i / 8, i % 8)).label > 0 ? 1 : 0;
                  return fixed(labelled == kBlockVoxels, kMostClasses + 2.0);
                });
}

void measure_whole_map(Meter& meter) {
  OwnedMap owned(config_of(TuplePolicy::kCompact, kMebibytes), kMostClasses);
  LocalMap& map = owned.map;
  // Storage exactly full of blocks with as little as a block can have; the last ones have nothing.
  VoxelMask one{};
  one[0] = 1;
  VoxelMask layer{};
  std::fill_n(layer.begin(), kBlockEdge / 2, ~std::uint64_t{0});
  double blocks = 0.0;
  double voxels = 0.0;
  const auto fill = [&](const VoxelMask& mask) {
    map.clear();
    blocks = 0.0;
    voxels = 0.0;
    for (std::int32_t i = 0;; ++i) {
      const Result<SlabHandle> block = map.open_block({i % 256, i / 256 % 256, i / 65536});
      if (!block.ok()) break;
      voxels += map.add_free_pass(*block, mask) == Status::kOk ? 1.0 : 0.0;
      ++blocks;
    }
  };
  fill(one);
  const double most = static_cast<double>(max_blocks(map.config()));
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  const auto nothing = [] {};
  meter.measure({"count_free_voxels", "LocalMap::count_free_voxels",
                 "16 MiB full of blocks with one free page each", "blocks"},
                1, nothing, [&] {
                  return Operations{
                      static_cast<double>(map.count_free_voxels()) == voxels ? blocks : 1e12, most};
                });
  meter.measure(
      {"blocks_in_order", "LocalMap::blocks_in_order",
       "16 MiB full of blocks with one free page each", "blocks"},
      1, nothing, [&] {
        return Operations{static_cast<double>(map.blocks_in_order(workspace).size()), most};
      });
  fill(layer);
  meter.measure(
      {"digest", "digest", "16 MiB full of blocks with one full free page each", "256 blocks"}, 1,
      nothing, [&] {
        const bool any = digest(map, workspace) != 0;
        return Operations{any ? kLayerVoxels * blocks : 1e12, kLayerVoxels * most};
      });
  fill(one);
  meter.measure(
      {"visit_blocks", "LocalMap::visit_blocks", "4,096 entries of a full map", "entries + 7"}, 1,
      nothing, [&] {
        SweepCursor cursor;
        return Operations{static_cast<double>(map.visit_blocks(
                              cursor, 4096, [](BlockKey, SlabHandle) { return true; })),
                          4096.0 + 7.0};
      });
  meter.measure(
      {"open_block_full", "LocalMap::open_block", "storage is exactly full: refused", "1 look-up"},
      1000, nothing, [&] {
        double opened = 0.0;
        for (std::int32_t i = 0; i < 1000; ++i)
          opened += map.open_block({-i - 1, 0, 0}).ok() ? 1.0 : 0.0;
        return Operations{1.0 + opened, 1.0};
      });
  meter.measure(
      {"clear", "LocalMap::clear", "16 MiB full of blocks", "leaves"}, 1, [&] { fill(one); },
      [&] {
        map.clear();
        return fixed(map.block_count() == 0, leaves_of(map.config()));
      });
}

}  // namespace

void measure_map(Meter& meter) {
  measure_index(meter);
  measure_octets(meter, TuplePolicy::kDense);
  measure_octets(meter, TuplePolicy::kCompact);
  measure_whole_map(meter);
}

}  // namespace tessera::bench
