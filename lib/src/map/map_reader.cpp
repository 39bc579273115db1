// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/map_reader.hpp"

namespace tessera {

namespace {

constexpr std::size_t kMaxOctetBytes = DenseTuple::octet_bytes(kMaxComponents);

std::uint32_t octet_bytes_of(const LocalMap& map) noexcept {
  return TupleStore::octet_bytes(map.config().tuple, map.num_components());
}

}  // namespace

VoxelEvidence BlockSnapshot::evidence(int octet, int voxel) const noexcept {
  VoxelEvidence result;
  result.num_components = num_components_;
  result.sigma[0] = static_cast<float>(free_passes(octet, voxel)) * free_weight_;
  const std::size_t place = place_[static_cast<std::size_t>(octet)];
  if (place > 0) tuples_.read(octets_.subspan((place - 1) * octet_bytes_).data(), voxel, result);
  return result;
}

template <class Item>
const Item* MapReader::item(SlabHandle handle, std::size_t bytes) const noexcept {
  return map_->pool().reaches(handle, bytes)
             ? reinterpret_cast<const Item*>(map_->pool().at(handle))
             : nullptr;
}

/// The order of loads is what makes this right: the stamps of map, index and block, then what they
/// guard, then the stamps again. Whoever sees a store of the writer sees the odd stamp before it.
template <class Copy>
MapReader::Outcome MapReader::try_read(BlockKey key, Copy& copy) noexcept {
  const LocalMap& map = *map_;
  const std::uint64_t cleared = load_shared(map.shared_clear_stamp(), std::memory_order_acquire);
  const std::uint64_t moved = map.index().move_stamp();
  const auto is_block = [&](SlabHandle handle) {
    const Block* const block = item<Block>(handle);
    return block != nullptr && load_shared(block->key) == key.bits;
  };
  const auto is_same_map = [&] { return load_shared(map.shared_clear_stamp()) == cleared; };
  if (cleared % 2 != 0) return Outcome::kTorn;
  const SlabHandle handle = map.index().find_shared(key, is_block);
  if (handle == 0) {
    std::atomic_thread_fence(std::memory_order_acquire);
    // An entry that moves may be missed in both of its places.
    const bool absent = moved % 2 == 0 && map.index().move_stamp() == moved && is_same_map();
    return absent ? Outcome::kAbsent : Outcome::kTorn;
  }
  const Block* const block = item<Block>(handle);
  if (block == nullptr) return Outcome::kTorn;
  const std::uint64_t stamp = load_shared(block->stamp, std::memory_order_acquire);
  if (stamp % 2 != 0 || stamp == 0 || load_shared(block->key) != key.bits) return Outcome::kTorn;
  const bool copied = copy(*block);
  std::atomic_thread_fence(std::memory_order_acquire);
  const bool same = load_shared(block->stamp) == stamp && is_same_map();
  return copied && same ? Outcome::kRead : Outcome::kTorn;
}

template <class Copy>
MapReader::Outcome MapReader::read(BlockKey key, Copy&& copy) noexcept {
  if (maps_ == nullptr) return read_one(key, copy);
  map_ = &maps_->map();
  const Outcome outcome = read_one(key, copy);
  const LocalMap* const before = maps_->before();
  if (outcome != Outcome::kAbsent || before == nullptr) return outcome;
  map_ = before;
  return read_one(key, copy);
}

template <class Copy>
MapReader::Outcome MapReader::read_one(BlockKey key, Copy& copy) noexcept {
  for (int attempt = 0; attempt < kMaxAttempts; ++attempt) {
    const Outcome outcome = try_read(key, copy);
    if (outcome != Outcome::kTorn) return outcome;
    ++retries_;
  }
  ++busy_;
  return Outcome::kTorn;
}

bool MapReader::copy_octet(const Block& block, int octet, std::byte* to,
                           bool& present) const noexcept {
  present = false;
  const SlabHandle labels = load_shared(block.labels[layer_of_octet(octet)]);
  if (labels == 0) return true;
  const auto* const page = item<LabelPage>(labels);
  if (page == nullptr) return false;
  const SlabHandle handle = load_shared(page->octets[octet_in_layer(octet)]);
  if (handle == 0) return true;
  const auto* const tuples = item<std::byte>(handle, octet_bytes_of(*map_));
  if (tuples == nullptr) return false;
  map_->tuples().copy_shared(tuples, to, map_->num_components());
  present = true;
  return true;
}

MapReader::Outcome MapReader::read_evidence(VoxelCoord voxel, VoxelEvidence& into) noexcept {
  into = {};
  into.num_components = map_->num_components();
  if (!in_grid(voxel)) return Outcome::kAbsent;
  const int octet = octet_in_block(voxel);
  // Two kilobytes, written before they are read.
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init)
  alignas(32) std::array<std::byte, kMaxOctetBytes> tuples;
  std::uint8_t passes = 0;
  bool labelled = false;
  const Outcome outcome = read(pack_in_grid(block_of(voxel)), [&](const Block& block) {
    const SlabHandle free = load_shared(block.free_passes[layer_of_octet(octet)]);
    passes = 0;
    if (free != 0) {
      const auto* const page = item<FreePage>(free);
      if (page == nullptr) return false;
      passes = load_shared(page->passes[row_in_layer(row_order(octet, voxel_in_octet(voxel)))]);
    }
    return copy_octet(block, octet, tuples.data(), labelled);
  });
  if (outcome != Outcome::kRead) return outcome;
  into.sigma[0] = static_cast<float>(passes) * map_->config().free_weight;
  if (labelled) map_->tuples().read(tuples.data(), voxel_in_octet(voxel), into);
  return outcome;
}

Result<VoxelEvidence> MapReader::evidence(VoxelCoord voxel) noexcept {
  VoxelEvidence result;
  if (read_evidence(voxel, result) == Outcome::kTorn) return Status::kBusy;
  return result;
}

Result<VoxelEvidence> MapReader::evidence(const Point3f& p_map) noexcept {
  const Result<VoxelCoord> voxel = map_->lattice().voxel_of(p_map);
  if (voxel.ok()) return evidence(*voxel);
  VoxelEvidence nothing;
  nothing.num_components = map_->num_components();
  return nothing;
}

Result<Estimate> MapReader::query(VoxelCoord voxel) noexcept {
  const Result<VoxelEvidence> found = evidence(voxel);
  if (!found.ok()) return found.status();
  return estimate(*found, map_->reading());
}

Result<Estimate> MapReader::query(const Point3f& p_map) noexcept {
  const Result<VoxelEvidence> found = evidence(p_map);
  if (!found.ok()) return found.status();
  return estimate(*found, map_->reading());
}

bool MapReader::copy_passes(const Block& block, std::size_t layer, std::byte* to) const noexcept {
  const SlabHandle free = load_shared(block.free_passes[layer]);
  if (free == 0) {
    std::memset(to, 0, sizeof(FreePage));
    return true;
  }
  const auto* const page = item<FreePage>(free);
  if (page == nullptr) return false;
  load_shared_words(to, page, sizeof(FreePage));
  return true;
}

bool MapReader::copy_votes(const Block& block, std::size_t layer, std::byte* to) const noexcept {
  const SlabHandle labels = load_shared(block.labels[layer]);
  if (labels == 0) {
    const LabelVotes none;
    std::memcpy(to, &none, sizeof(none));
    return true;
  }
  const auto* const page = item<std::byte>(labels, label_page_bytes(true));
  if (page == nullptr) return false;
  load_shared_words(to, page + sizeof(LabelPage), sizeof(LabelVotes));
  return true;
}

bool MapReader::copy_block(const Block& block, std::span<std::byte> workspace,
                           BlockSnapshot& into) const noexcept {
  into.stamp_ = load_shared(block.stamp);
  into.revision_ = load_shared(block.revision);
  into.label_voxels_ = load_shared(block.label_voxels);
  for (std::size_t layer = 0; layer < kBlockLayers; ++layer) {
    if (!copy_passes(block, layer, workspace.subspan(layer * kLayerVoxels).data())) return false;
    if (map_->keeps_votes() &&
        !copy_votes(block, layer, &workspace[kBlockVoxels + layer * sizeof(LabelVotes)]))
      return false;
  }
  std::size_t octets = 0;
  for (int octet = 0; octet < kBlockOctets; ++octet) {
    const auto at = static_cast<std::size_t>(octet);
    into.observed_[at] = into.place_[at] = 0;
    const SlabHandle labels = load_shared(block.labels[layer_of_octet(octet)]);
    if (labels == 0) continue;
    const auto* const page = item<LabelPage>(labels);
    if (page == nullptr) return false;
    into.observed_[at] = load_shared(page->observed[octet_in_layer(octet)]);
    std::byte* const to =
        workspace.subspan(kSnapshotOctets + octets * octet_bytes_of(*map_)).data();
    bool present = false;
    if (!copy_octet(block, octet, to, present)) return false;
    if (present) into.place_[at] = static_cast<std::uint8_t>(++octets);
  }
  return true;
}

Result<BlockSnapshot> MapReader::snapshot(BlockCoord block,
                                          std::span<std::byte> workspace) noexcept {
  const Result<BlockKey> key = pack(block);
  if (!key.ok()) return key.status();
  if (workspace.size() < snapshot_bytes() ||
      reinterpret_cast<std::uintptr_t>(workspace.data()) % alignof(std::uint64_t) != 0) {
    return Status::kInvalidArgument;
  }
  BlockSnapshot result;
  const Outcome outcome =
      read(*key, [&](const Block& from) { return copy_block(from, workspace, result); });
  if (outcome == Outcome::kTorn) return Status::kBusy;
  if (outcome == Outcome::kAbsent) result = BlockSnapshot{};
  result.coord_ = block;
  result.num_components_ = map_->num_components();
  result.free_weight_ = map_->config().free_weight;
  result.tuples_ = map_->tuples();
  result.octet_bytes_ = octet_bytes_of(*map_);
  if (outcome == Outcome::kRead) {
    result.free_passes_ = workspace.first(kBlockVoxels);
    if (map_->keeps_votes())
      result.votes_ = workspace.subspan(kBlockVoxels, kBlockLayers * sizeof(LabelVotes));
    result.octets_ = workspace.subspan(kSnapshotOctets);
  }
  return result;
}

bool MapReader::lacks(BlockCoord block) noexcept {
  const Result<BlockKey> key = pack(block);
  if (!key.ok()) return true;
  const auto nothing = [](const Block&) { return true; };
  if (maps_ == nullptr) return try_read(*key, nothing) == Outcome::kAbsent;
  map_ = &maps_->map();
  if (try_read(*key, nothing) != Outcome::kAbsent) return false;
  const LocalMap* const before = maps_->before();
  if (before == nullptr) return true;
  map_ = before;
  return try_read(*key, nothing) == Outcome::kAbsent;
}

bool MapReader::read_note(SlabHandle handle, BlockNote& into) const noexcept {
  const Block* const block = item<Block>(handle);
  if (block == nullptr) return false;
  into.stamp = load_shared(block->stamp, std::memory_order_acquire);
  into.key = BlockKey{load_shared(block->key)};
  into.label_voxels = load_shared(block->label_voxels);
  return true;
}

Result<PageNotes> MapReader::notes(std::size_t page, std::size_t first_slot,
                                   std::span<BlockNote, kPageBlocks> into) noexcept {
  const BlockIndex& index = map_->index();
  if (page >= pages()) return Status::kOutOfRange;
  for (int attempt = 0; attempt < kMaxAttempts; ++attempt) {
    const std::uint64_t moved = index.move_stamp();
    std::size_t count = 0;
    for (std::size_t slot = first_slot; slot < kPageBlocks; ++slot) {
      const SlabHandle handle = index.handle_shared(page, slot);
      if (handle == 0 || !read_note(handle, into[count])) continue;
      std::atomic_thread_fence(std::memory_order_acquire);
      // Else the block was closed meanwhile, and what was read may be another's.
      if (index.handle_shared(page, slot) != handle) continue;
      into[count++].slot = static_cast<std::uint32_t>(slot);
    }
    std::atomic_thread_fence(std::memory_order_acquire);
    if (moved % 2 == 0 && index.move_stamp() == moved) return PageNotes{count, moved};
    ++retries_;
  }
  ++busy_;
  return Status::kBusy;
}

}  // namespace tessera
