// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which cells a sketch keeps, and where it finds them.
#include <bit>

#include "tessera/base/internal/digest.hpp"
#include "tessera/frames/map_sketch.hpp"

namespace tessera {

namespace {

/// Whether a key is among the one in 2^levels that are kept.
constexpr bool is_kept(std::uint64_t key, unsigned levels) noexcept {
  return (mix64(key + 1) & ((std::uint64_t{1} << levels) - 1)) == 0;
}

/// Of a key: it is kept up to so many levels.
std::size_t level_of_hash(std::uint64_t key) noexcept {
  const auto zeros = static_cast<std::size_t>(std::countr_zero(mix64(key + 1)));
  return zeros < 31 ? zeros : 31;
}

/// At which level so many cells are few enough.
template <class Levels>
unsigned least_level(const Levels& levels, std::uint32_t most) noexcept {
  std::uint32_t kept = 0;
  std::size_t level = levels.size();
  while (level != 0 && kept + levels[level - 1] <= most) kept += levels[--level];
  return static_cast<unsigned>(level);
}

/// Takes out what `is_gone` says. Returns how many are left.
template <class Cells, class IsGone>
std::uint32_t compact(const Cells& cells, std::uint32_t count, IsGone&& is_gone) noexcept {
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!is_gone(cells[i])) cells[kept++] = cells[i];
  }
  return kept;
}

}  // namespace

void MapSketch::keep_surface(const Surface& surface) noexcept {
  ++surface_hashes_[level_of_hash(surface.key)];
  if (!is_kept(surface.key, surface_levels_)) return;
  while (surface_count_ == kMostSurfaces) {
    ++surface_levels_;
    surface_count_ = compact(surfaces_, surface_count_, [this](const Surface& one) {
      return !is_kept(one.key, surface_levels_);
    });
    if (!is_kept(surface.key, surface_levels_)) return;
  }
  surfaces_[surface_count_++] = surface;
}

void MapSketch::keep_free(const FreeCell& cell) noexcept {
  ++free_hashes_[level_of_hash(cell.key)];
  if (!is_kept(cell.key, free_levels_)) return;
  while (free_count_ == kMostFreeCells) {
    ++free_levels_;
    free_count_ = compact(free_cells_, free_count_,
                          [this](const FreeCell& one) { return !is_kept(one.key, free_levels_); });
    if (!is_kept(cell.key, free_levels_)) return;
  }
  free_cells_[free_count_++] = cell;
}

void MapSketch::forget(BlockKey block, BlockCells cells) noexcept {
  TESSERA_ASSERT(is_finished_);
  const BlockCoord at = unpack(block);
  for (int n = 0; cells != 0; ++n, cells = static_cast<BlockCells>(cells >> 2)) {
    const auto kind = static_cast<CellKind>(cells & 3U);
    if (kind == CellKind::kNone) continue;
    const VoxelCoord cell = cell_of_block(at, n, cells_edge());
    const Result<BlockKey> key = pack({cell.x, cell.y, cell.z});
    if (!key.ok()) continue;
    --(kind == CellKind::kSurface ? surface_hashes_ : free_hashes_)[level_of_hash(key->bits)];
    const std::uint32_t entry = entry_of(cell);
    if (entry == 0) continue;  // left out, as others were
    has_forgotten_ = true;
    // No part is what no cell has that is there.
    if ((entry & kFreeBit) != 0) {
      free_cells_[(entry & ~kFreeBit) - 1].free = 0;
    } else {
      surfaces_[entry - 1].occupied = 0;
    }
  }
}

void MapSketch::drop_forgotten() noexcept {
  if (!has_forgotten_) return;
  has_forgotten_ = false;
  surface_count_ = compact(surfaces_, surface_count_,
                           [](const Surface& surface) { return surface.occupied == 0; });
  free_count_ =
      compact(free_cells_, free_count_, [](const FreeCell& cell) { return cell.free == 0; });
  is_finished_ = false;
}

bool MapSketch::is_too_thin() const noexcept {
  return least_level(surface_hashes_, kMostSurfaces) < surface_levels_ ||
         least_level(free_hashes_, kMostFreeCells) < free_levels_;
}

void MapSketch::finish(std::span<KeyedIndex> scratch) noexcept {
  TESSERA_ASSERT(scratch.size() >= kScratch);
  if (is_finished_) return;  // nothing has changed
  const std::span<KeyedIndex> items = scratch.first(surface_count_);
  for (std::uint32_t i = 0; i < surface_count_; ++i) items[i] = {surfaces_[i].key, i};
  radix_sort(items, scratch.subspan(kMostSurfaces));
  for (std::uint32_t& entry : table_) entry = 0;
  for (std::uint32_t i = 0; i < surface_count_; ++i) {
    order_[i] = items[i].index;
    enter(items[i].key, items[i].index + 1);
  }
  for (std::uint32_t i = 0; i < free_count_; ++i) enter(free_cells_[i].key, kFreeBit | (i + 1));
  is_finished_ = true;
}

void MapSketch::enter(std::uint64_t key, std::uint32_t entry) noexcept {
  auto place = static_cast<std::uint32_t>(mix64(key) >> 32U) % kBuckets;
  while (table_[place] != 0) place = (place + 1) % kBuckets;
  table_[place] = entry;
}

std::uint32_t MapSketch::entry_of(VoxelCoord cell) const noexcept {
  const Result<BlockKey> key = pack({cell.x, cell.y, cell.z});
  if (!key.ok()) return 0;
  auto place = static_cast<std::uint32_t>(mix64(key->bits) >> 32U) % kBuckets;
  for (std::uint32_t entry = table_[place]; entry != 0; entry = table_[place]) {
    const std::uint64_t found = (entry & kFreeBit) != 0 ? free_cells_[(entry & ~kFreeBit) - 1].key
                                                        : surfaces_[entry - 1].key;
    if (found == key->bits) return entry;
    place = (place + 1) % kBuckets;
  }
  return 0;
}

const MapSketch::Surface* MapSketch::find_surface(VoxelCoord cell) const noexcept {
  const std::uint32_t entry = entry_of(cell);
  return entry == 0 || (entry & kFreeBit) != 0 ? nullptr : &surfaces_[entry - 1];
}

MapSketch::Parts MapSketch::parts(VoxelCoord cell) const noexcept {
  const std::uint32_t entry = entry_of(cell);
  if (entry == 0) return {};
  if ((entry & kFreeBit) != 0) return {0, free_cells_[(entry & ~kFreeBit) - 1].free, nullptr};
  const Surface& surface = surfaces_[entry - 1];
  return {surface.occupied, surface.free, &surface};
}

}  // namespace tessera
