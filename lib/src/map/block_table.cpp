// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/internal/block_table.hpp"

#include <bit>
#include <cstring>

#include "tessera/base/internal/lanes.hpp"
#include "tessera/map/internal/block_editor.hpp"

namespace tessera {

namespace {

bool valid(const MapConfig& config, const ClassTable& classes) noexcept {
  return in_range(config) && classes.num_classes() >= 1 &&
         config.storage_bytes >= 4 * SlabPool::kPageBytes &&
         config.storage_bytes <= MapConfig::kMaxStorageBytes;
}

/// Voxels of a layer with free evidence only.
std::uint64_t free_voxels_of(const BlockTable& table, const Block& block,
                             std::size_t layer) noexcept {
  if (block.free_passes[layer] == 0) return 0;
  const auto& page = *reinterpret_cast<const FreePage*>(table.pool().at(block.free_passes[layer]));
  std::uint64_t count = 0;
  for (const std::uint8_t passes : page.passes) count += passes != 0 ? 1U : 0U;
  if (block.labels[layer] == 0) return count;
  const int first = static_cast<int>(layer) * kLayerOctets;
  for (int octet = first; octet < first + kLayerOctets; ++octet) {
    for (unsigned labels = table.observed_labels(block, octet); labels != 0; labels &= labels - 1)
      count -= table.free_passes(block, octet, std::countr_zero(labels)) != 0 ? 1U : 0U;
  }
  return count;
}

}  // namespace

Status BlockTable::set_up(Arena& arena, const MapConfig& config,
                          const ClassTable& classes) noexcept {
  if (!valid(config, classes)) return Status::kInvalidArgument;
  if (!arena.aligned() || arena.remaining_bytes() < required_bytes(config)) {
    return Status::kResourceExhausted;
  }
  config_ = config;
  reading_ =
      Reading(config.probabilities, config.prior, config.resolution_m, classes, config.label_votes);
  classes_ = classes;
  const Result<BlockIndex> index = BlockIndex::make(arena, max_blocks(config), config.hash_seed);
  if (!index.ok()) return index.status();
  index_ = *index;
  const std::size_t pages = config.storage_bytes / SlabPool::kPageBytes;
  pool_ = SlabPool(arena.take_untouched(pages * SlabPool::kPageBytes),
                   {static_cast<std::uint32_t>(sizeof(Block)), label_page_bytes(config.label_votes),
                    static_cast<std::uint32_t>(sizeof(FreePage)),
                    TupleStore::octet_bytes(config.tuple, num_components())});
  tuples_ = TupleStore(config.tuple, config.max_evidence);
  if (config.max_evidence > 0.0F)
    max_passes_ = passes_at_cap(config.max_evidence, config.free_weight);
  note_usage();
  return Status::kOk;
}

std::uint64_t BlockTable::octets_of(const Block& block, unsigned layers) const noexcept {
  std::uint64_t octets = 0;
  for (std::size_t layer = 0; layer < kBlockLayers; ++layer) {
    if (block.labels[layer] == 0 || ((layers >> layer) & 1U) == 0) continue;
    const auto& page = *reinterpret_cast<const LabelPage*>(pool_.at(block.labels[layer]));
    std::uint64_t without = 0;
    for (std::size_t i = 0; i < kLayerOctets; i += 4) {
      Int4 handles;
      std::memcpy(&handles, &page.octets[i], sizeof(handles));
      without |= std::uint64_t{bits_of(handles == Int4{})} << i;
    }
    octets |= (without ^ 0xffffU) << (kLayerOctets * layer);
  }
  return octets;
}

std::array<std::uint8_t, kOctetVoxels> BlockTable::passes_of(const Block& block,
                                                             int octet) const noexcept {
  std::array<std::uint8_t, kOctetVoxels> passes{};
  const SlabHandle page = block.free_passes[layer_of_octet(octet)];
  if (page == 0) return passes;
  const std::uint8_t* const from =
      reinterpret_cast<const FreePage*>(pool_.at(page))->passes.data() +
      row_in_layer(row_order_corner(octet));
  for (int pair = 0; pair < kOctetVoxels; pair += 2)
    std::memcpy(&passes[static_cast<std::size_t>(pair)], from + row_order(0, pair), 2);
  return passes;
}

VoxelEvidence BlockTable::evidence(const Block& block, int octet, int voxel) const noexcept {
  VoxelEvidence result;
  result.num_components = num_components();
  result.sigma[0] = static_cast<float>(free_passes(block, octet, voxel)) * config_.free_weight;
  const SlabHandle tuples = octet_handle(block, octet);
  if (tuples != 0) tuples_.read(pool_.at(tuples), voxel, result);
  return result;
}

std::span<const KeyedIndex> BlockTable::blocks_in_order(
    std::span<KeyedIndex> workspace) const noexcept {
  const std::size_t n = index_.size();
  if (workspace.size() < 2 * n) return {};
  std::size_t i = 0;
  index_.for_each([&](SlabHandle handle) { workspace[i++] = {block_at(handle).key, handle}; });
  radix_sort(workspace.first(n), workspace.subspan(n, n));
  return workspace.first(n);
}

MapUsage BlockTable::usage() const noexcept {
  const bool made = index_.capacity() > 0;
  return {.capacity_bytes = made ? required_bytes(config_) : 0,
          .used_bytes = made ? index_.used_bytes() + pool_.used_bytes() : 0,
          .peak_bytes = peak_bytes_,
          .blocks = index_.size(),
          .label_voxels = label_voxels_,
          .blocks_refused = blocks_refused_,
          .storage_refused = pool_.refused()};
}

std::uint64_t BlockTable::count_free_voxels() const noexcept {
  std::uint64_t count = 0;
  index_.for_each([&](SlabHandle handle) {
    for (std::size_t layer = 0; layer < kBlockLayers; ++layer)
      count += free_voxels_of(*this, block_at(handle), layer);
  });
  return count;
}

void BlockTable::note_usage() noexcept {
  const std::size_t used = index_.used_bytes() + pool_.used_bytes();
  if (used > peak_bytes_) peak_bytes_ = used;
}

Result<SlabHandle> BlockTable::open_block(BlockCoord block) noexcept {
  const Result<BlockKey> key = pack(block);
  if (!key.ok()) return key.status();
  if (const SlabHandle handle = find_handle(*key); handle != 0) return handle;
  // The index first: a block taken from the pool and given back would keep its page from other
  // uses.
  const bool fits = pool_.fits_or_refuse({1, 0, 0, 0});
  const Result<BlockIndex::Place> place =
      fits ? index_.make_room(*key) : Result<BlockIndex::Place>(Status::kResourceExhausted);
  if (!place.ok()) {
    ++blocks_refused_;
    note_usage();
    return Status::kResourceExhausted;
  }
  const Result<SlabHandle> handle = pool_.allocate(kBlockSlab);
  TESSERA_ASSERT(handle.ok());
  Block& opened = mutable_block(*handle);
  store_shared(opened.key, key->bits);
  stamp_anew(opened);
  index_.insert(*place, *key, *handle);
  note_usage();
  return *handle;
}

void BlockTable::close_if_empty(SlabHandle handle) noexcept {
  const Block& block = block_at(handle);
  if (!block.has_labels() && !block.has_free_passes()) remove_block(handle);
}

void BlockTable::close_empty_blocks() noexcept {
  index_.for_each([this](SlabHandle handle) { close_if_empty(handle); });
}

void BlockTable::join_moving(SlabHandle handle) noexcept {
  if (may_move(handle)) return;
  store_shared(mutable_block(handle).moving_before, moving_last_);
  if (moving_last_ == 0) {
    moving_first_ = handle;
  } else {
    store_shared(mutable_block(moving_last_).moving_next, handle);
  }
  moving_last_ = handle;
}

void BlockTable::leave_moving(SlabHandle handle) noexcept {
  if (!may_move(handle)) return;
  Block& block = mutable_block(handle);
  const SlabHandle before = block.moving_before;
  const SlabHandle next = block.moving_next;
  if (before == 0) {
    moving_first_ = next;
  } else {
    store_shared(mutable_block(before).moving_next, next);
  }
  if (next == 0) {
    moving_last_ = before;
  } else {
    store_shared(mutable_block(next).moving_before, before);
  }
  store_shared(block.moving_before, SlabHandle{0});
  store_shared(block.moving_next, SlabHandle{0});
}

void BlockTable::remove_block(SlabHandle handle) noexcept { BlockEditor(*this, handle).close(); }

void BlockTable::clear() noexcept {
  store_shared(clear_stamp_, clear_stamp_ + 1);
  std::atomic_thread_fence(std::memory_order_release);
  index_.clear();
  pool_.clear();
  moving_first_ = 0;
  moving_last_ = 0;
  store_shared(clear_stamp_, clear_stamp_ + 1, std::memory_order_release);
  revision_ = 0;
  label_voxels_ = 0;
  blocks_refused_ = 0;
  peak_bytes_ = 0;
  note_usage();
}

bool copy_passes(const BlockTable& table, const Block& block, std::span<std::byte> into) noexcept {
  // Two voxels of an octet are neighbours in a row: from there to where the octet has them.
  constexpr std::size_t kRow = kBlockEdge;
  constexpr std::array<std::size_t, 4> kPairs{0, kRow, kRow * kRow, kRow * kRow + kRow};
  std::uint64_t any = 0;
  for (std::size_t layer = 0; layer < kBlockLayers; ++layer) {
    const std::span<std::byte> to = into.subspan(layer * kLayerVoxels, kLayerVoxels);
    if (block.free_passes[layer] == 0) {
      std::memset(to.data(), 0, to.size());
      continue;
    }
    const auto& page =
        *reinterpret_cast<const FreePage*>(table.pool().at(block.free_passes[layer]));
    for (std::size_t octet = 0; octet < kLayerOctets; ++octet) {
      const std::size_t corner = row_in_layer(row_order_corner(static_cast<int>(octet)));
      std::array<std::uint8_t, kOctetVoxels> passes{};
      for (std::size_t i = 0; i < kPairs.size(); ++i)
        std::memcpy(&passes[2 * i], &page.passes[corner + kPairs[i]], 2);
      std::memcpy(&to[octet * kOctetVoxels], passes.data(), kOctetVoxels);
      std::uint64_t word = 0;
      std::memcpy(&word, passes.data(), sizeof(word));
      any |= word;
    }
  }
  return any != 0;
}

}  // namespace tessera
