// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/internal/archive_index.hpp"

namespace tessera {

namespace {

struct Bit {
  std::size_t word;
  std::uint64_t mask;
};

Bit bit_of(BlockCoord block) noexcept {
  const auto low = [](std::int32_t v) { return static_cast<unsigned>(v) & 7U; };
  return {low(block.z), std::uint64_t{1} << (low(block.y) * 8 + low(block.x))};
}

}  // namespace

Result<ArchiveIndex> ArchiveIndex::make(Arena& arena, std::size_t blocks) noexcept {
  const Result<KeyIndex> keys = KeyIndex::make(arena, blocks);
  if (!keys.ok()) return keys.status();
  const Result<KeyIndex> known = KeyIndex::make(arena, regions(blocks));
  if (!known.ok()) return known.status();
  ArchiveIndex index;
  index.keys_ = *keys;
  index.regions_ = *known;
  index.masks_ = arena.take<RegionMask>(regions(blocks));
  if (index.masks_.empty()) return Status::kResourceExhausted;
  return index;
}

RegionMask* ArchiveIndex::mask_of(BlockCoord block) noexcept {
  const std::optional<std::uint32_t> number = regions_.find(pack_in_grid(region_of(block)));
  return number ? &masks_[*number] : nullptr;
}

bool ArchiveIndex::open(BlockKey key) noexcept {
  if (keys_.find(key)) return true;
  const BlockCoord block = unpack(key);
  RegionMask* mask = mask_of(block);
  if (mask == nullptr) {
    const auto number = static_cast<std::uint32_t>(regions_.size());
    if (number == masks_.size()) return false;
    if (regions_.insert(pack_in_grid(region_of(block)), number) != Status::kOk) return false;
    mask = &masks_[number];
  }
  if (keys_.insert(key, 0) != Status::kOk) return false;
  const Bit bit = bit_of(block);
  (*mask)[bit.word] |= bit.mask;
  return true;
}

void ArchiveIndex::erase(BlockKey key) noexcept {
  if (!keys_.erase(key)) return;
  const BlockCoord block = unpack(key);
  const Bit bit = bit_of(block);
  (*mask_of(block))[bit.word] &= ~bit.mask;
}

const RegionMask* ArchiveIndex::archived(BlockCoord region) const noexcept {
  const Result<BlockKey> key = pack(region);
  if (!key.ok()) return nullptr;
  const std::optional<std::uint32_t> number = regions_.find(*key);
  return number ? &masks_[*number] : nullptr;
}

std::span<const KeyedIndex> ArchiveIndex::blocks_in_order(
    std::span<KeyedIndex> workspace) const noexcept {
  const std::size_t n = keys_.size();
  TESSERA_ASSERT(workspace.size() >= 2 * n);
  std::size_t i = 0;
  keys_.for_each([&](BlockKey key, std::uint32_t place) { workspace[i++] = {key.bits, place}; });
  radix_sort(workspace.first(n), workspace.subspan(n, n));
  return workspace.first(n);
}

void ArchiveIndex::clear() noexcept {
  keys_.clear();
  regions_.clear();
  for (RegionMask& mask : masks_) mask = {};
}

}  // namespace tessera
