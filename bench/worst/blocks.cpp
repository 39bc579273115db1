// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Blocks that leave the map and come back: bytes of a full block, map files, and a window that
// jumps.
#include <cstring>

#include "meter.hpp"
#include "tessera/map/map_file.hpp"
#include "tessera/map/moving_window.hpp"
#include "tessera/map/stored_block.hpp"

namespace tessera::bench {

namespace {

constexpr double kCounts = 512.0 * (kMostClasses + 1);  // of a block

void measure_bytes(Meter& meter) {
  OwnedMap owned(config_of(TuplePolicy::kDense, 4), kMostClasses);
  OwnedMap other(config_of(TuplePolicy::kDense, 4), kMostClasses);
  const BlockCoord at{1, 2, 3};
  const SlabHandle handle = fill_block(owned.map, at, 100);
  std::vector<std::byte> bytes(most_block_bytes(kMostClasses + 2));
  std::size_t size = 0;
  meter.measure(
      {"save_block", "save_block", "dense: 512 voxels of every class", "512 (C + 1) counts"}, 1,
      [] {},
      [&] {
        size = save_block(owned.map, owned.map.block_at(handle), bytes);
        return fixed(size > 0, kCounts);
      });
  meter.measure(
      {"restore_block", "restore_block", "the same, into the same block at the cap",
       "512 (C + 1) counts"},
      1,
      [&] {
        other.map.clear();
        static_cast<void>(fill_block(other.map, at, 100));
      },
      [&] {
        const MapFileStatus status = restore_block(std::span(bytes).first(size), other.map);
        return fixed(status.ok(), kCounts);
      });
}

/// A file in memory of fixed size.
struct Bytes {
  std::vector<std::byte> bytes;
  std::size_t written = 0;
  std::size_t read = 0;

  ByteSink sink() {
    return {this, [](void* context, std::span<const std::byte> more) {
              auto& self = *static_cast<Bytes*>(context);
              if (self.bytes.size() - self.written < more.size()) return false;
              std::memcpy(self.bytes.data() + self.written, more.data(), more.size());
              self.written += more.size();
              return true;
            }};
  }
  ByteSource source() {
    return {this, [](void* context, std::span<std::byte> into) {
              auto& self = *static_cast<Bytes*>(context);
              const std::size_t n = std::min(into.size(), self.written - self.read);
              std::memcpy(into.data(), self.bytes.data() + self.read, n);
              self.read += n;
              return n;
            }};
  }
};

void measure_file(Meter& meter) {
  constexpr int kBlocks = 16;
  OwnedMap owned(config_of(TuplePolicy::kDense, 8), kMostClasses);
  OwnedMap other(config_of(TuplePolicy::kDense, 8), kMostClasses);
  for (std::int32_t i = 0; i < kBlocks; ++i)
    static_cast<void>(fill_block(owned.map, {i, 0, 0}, 100));
  Bytes file{.bytes = std::vector<std::byte>(std::size_t{16} << 20U)};
  MapFileBuffer buffer{};
  std::vector<KeyedIndex> workspace(2 * owned.map.block_count());
  MapFileStatus status;
  const double counts = kBlocks * kCounts;
  const auto operations = [&] { return fixed(status.ok(), counts); };
  meter.measure(
      {"save", "save", "16 blocks, dense, every voxel of every class", "blocks 512 (C + 1) counts"},
      1, [&] { file.written = 0; },
      [&] {
        status = save(owned.map, {}, workspace, buffer, file.sink());
        return operations();
      });
  meter.measure(
      {"load", "load_header, load_blocks", "the same", "blocks 512 (C + 1) counts"}, 1,
      [&] {
        file.read = 0;
        other.map.clear();
      },
      [&] {
        MapFileHeader header;
        status = load_header(file.source(), buffer, header);
        if (status.ok()) status = load_blocks(file.source(), header, buffer, other.map);
        return operations();
      });
}

/// Takes what it is given, and remembers nothing: the archive's own cost is not the window's.
BlockArchive forgetful(std::vector<std::byte>& bytes) {
  return {.context = &bytes, .evict = [](void* context, const LocalMap& map, const Block& block) {
            return save_block(map, block, *static_cast<std::vector<std::byte>*>(context)) > 0;
          }};
}

/// Full blocks as bytes, 64 of one region: what the robot comes back to.
struct Shelf {
  std::vector<std::vector<std::byte>> blocks;
  RegionMask mask{};

  static const RegionMask* archived(void* context, BlockCoord region) {
    return region == BlockCoord{0, 0, 0} ? &static_cast<Shelf*>(context)->mask : nullptr;
  }
  static Status reload(void* context, LocalMap& map, BlockKey key) {
    auto& self = *static_cast<Shelf*>(context);
    const BlockCoord at = unpack(key);
    self.mask[0] &= ~(std::uint64_t{1} << static_cast<unsigned>(at.x + 8 * at.y));
    return restore_block(self.blocks[static_cast<std::size_t>(at.x + 8 * at.y)], map).status;
  }
};

void measure_window(Meter& meter) {
  // Storage full of the fullest blocks, and the robot is elsewhere all at once.
  constexpr std::uint32_t kPressed = 128;
  OwnedMap owned(config_of(TuplePolicy::kDense, 24), kMostClasses);
  LocalMap& map = owned.map;
  const WindowConfig config{
      .evictions_per_step = 64, .pressed_evictions_per_step = kPressed, .reloads_per_step = 64};
  const Result<MovingWindow> window = MovingWindow::make(config, map.lattice().resolution_m());
  std::vector<std::byte> bytes(most_block_bytes(kMostClasses + 2));
  MovingWindow fresh = *window;
  const auto fill = [&] {
    map.clear();
    fresh = *window;
    for (std::int32_t i = 0; fill_block(map, {i % 8, i / 8, 0}, 1) != 0 && map.fits({1, 4, 4, 64});)
      ++i;
  };
  const double counts = 512.0 * (kMostClasses + 1.0);
  meter.measure(
      {"window_jump", "MovingWindow::step",
       "storage full, dense, every class, and all of it far away at once; 128 evictions a step",
       "pressed_evictions_per_step 512 (C + 1) counts"},
      1, fill, [&] {
        const WindowStep step = fresh.step(map, Point3d(1000.0, 1000.0, 0.0), forgetful(bytes));
        return Operations{counts * step.evicted, counts * kPressed};
      });
  Shelf shelf;
  fill();
  for (std::int32_t i = 0; i < 64; ++i) {
    shelf.blocks.emplace_back(save_block(map, *map.find({i % 8, i / 8, 0}), bytes));
    std::memcpy(shelf.blocks.back().data(), bytes.data(), shelf.blocks.back().size());
  }
  BlockArchive archive = forgetful(bytes);
  archive.context = &shelf;
  archive.archived = Shelf::archived;
  archive.reload = Shelf::reload;
  meter.measure(
      {"window_return", "MovingWindow::step", "64 blocks come back, dense, every class",
       "reloads_per_step 512 (C + 1) counts"},
      1,
      [&] {
        map.clear();
        fresh = *window;
        shelf.mask[0] = ~std::uint64_t{0};
      },
      [&] {
        const WindowStep step = fresh.step(map, Point3d(3.0, 3.0, 0.4), archive);
        return Operations{step.reloaded == 64 ? counts * step.reloaded : 1e12,
                          counts * config.reloads_per_step};
      });
}

}  // namespace

void measure_blocks(Meter& meter) {
  measure_bytes(meter);
  measure_file(meter);
  measure_window(meter);
}

}  // namespace tessera::bench
