// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map's blocks in memory: the index that finds them, the pool that their pages come from, and the
// counts in their tuples. Only a BlockEditor changes what a block holds.
#pragma once

#include <span>

#include "tessera/base/internal/radix_sort.hpp"
#include "tessera/base/internal/shared_words.hpp"
#include "tessera/map/map_config.hpp"
#include "tessera/map/map_usage.hpp"
#include "tessera/semantics/class_table.hpp"

namespace tessera {

class BlockEditor;

class BlockTable {
 public:
  /// Holds nothing, and takes nothing.
  BlockTable() noexcept = default;
  /// Moves only: a copy would write to the same memory. What was moved from is of no further use.
  BlockTable(const BlockTable&) = delete;
  BlockTable& operator=(const BlockTable&) = delete;
  BlockTable(BlockTable&&) noexcept = default;
  BlockTable& operator=(BlockTable&&) noexcept = default;
  ~BlockTable() = default;

  [[nodiscard]] const MapConfig& config() const noexcept { return config_; }
  [[nodiscard]] const ClassTable& classes() const noexcept { return classes_; }
  /// How its counts are read.
  [[nodiscard]] const Reading& reading() const noexcept { return reading_; }
  [[nodiscard]] Lattice lattice() const noexcept { return Lattice(config_.resolution_m); }
  [[nodiscard]] int num_components() const noexcept { return classes_.num_components(); }

  /// The blocks sorted by key, that is by (z, y, x); each entry's index is for block_at. workspace:
  /// at least 2 * block_count() entries, else nothing is given. O(index + blocks).
  [[nodiscard]] std::span<const KeyedIndex> blocks_in_order(
      std::span<KeyedIndex> workspace) const noexcept;
  [[nodiscard]] std::size_t block_count() const noexcept { return index_.size(); }
  /// Calls visit(BlockKey, SlabHandle) for the blocks among the next entries of the index from the
  /// cursor on, around its end and once around at most, and moves the cursor on. visit may remove
  /// the block that it is given; false from it stops the cursor at the entries at hand, which the
  /// next call begins with. Returns the entries looked at, at most entries + 7. While blocks are
  /// opened, one may be met twice in a round, or not at all if a call ends within an index's page.
  template <class Visit>
  std::size_t visit_blocks(SweepCursor& cursor, std::size_t entries, Visit&& visit) const noexcept {
    return index_.for_some(cursor.place, entries, [&](SlabHandle handle) {
      return visit(BlockKey{block_at(handle).key}, handle);
    });
  }
  [[nodiscard]] const Block& block_at(std::uint32_t handle) const noexcept {
    return *reinterpret_cast<const Block*>(pool_.at(handle));
  }
  /// The block's handle, or 0 if it is not open.
  [[nodiscard]] SlabHandle find_handle(BlockCoord block) const noexcept {
    const Result<BlockKey> key = pack(block);
    return key.ok() ? find_handle(*key) : 0;
  }
  [[nodiscard]] const Block* find(BlockCoord block) const noexcept {
    const SlabHandle handle = find_handle(block);
    return handle != 0 ? &block_at(handle) : nullptr;
  }
  /// A voxel's counts. O(components present).
  [[nodiscard]] VoxelEvidence evidence(const Block& block, int octet, int voxel) const noexcept;
  /// Calls label(component, count) for each label count of a voxel that has label evidence, and
  /// rest(count) for its rest.
  template <class Label, class Rest>
  void visit_labels(const Block& block, int octet, int voxel, Label&& label,
                    Rest&& rest) const noexcept {
    tuples_.visit(pool_.at(octet_handle(block, octet)), voxel, label, rest);
  }
  /// Where the returns in an octet's voxels were; the octet has label evidence.
  [[nodiscard]] OctetCentroids centroids(const Block& block, int octet) const noexcept {
    return tuples_.centroids(pool_.at(octet_handle(block, octet)));
  }
  /// Voxels of an octet with label evidence, a bit each.
  [[nodiscard]] std::uint8_t observed_labels(const Block& block, int octet) const noexcept {
    const LabelPage* const page = label_page(block, octet);
    return page == nullptr ? std::uint8_t{0} : page->observed[octet_in_layer(octet)];
  }
  /// The page of an octet's layer, or null where none of the layer's voxels has label evidence.
  [[nodiscard]] const LabelPage* label_page(const Block& block, int octet) const noexcept {
    const SlabHandle page = block.labels[layer_of_octet(octet)];
    return page == 0 ? nullptr : reinterpret_cast<const LabelPage*>(pool_.at(page));
  }
  /// Whether it keeps votes (MapConfig::label_votes).
  [[nodiscard]] bool keeps_votes() const noexcept { return config_.label_votes; }
  /// Of a layer that has a label page, in a map that keeps them.
  [[nodiscard]] const LabelVotes& votes(const Block& block, std::size_t layer) const noexcept {
    return *reinterpret_cast<const LabelVotes*>(pool_.at(block.labels[layer]) + sizeof(LabelPage));
  }
  /// The octets for which a block has tuples, a bit each; of these layers, a bit each.
  [[nodiscard]] std::uint64_t octets_of(const Block& block,
                                        unsigned layers = (1U << kBlockLayers) - 1U) const noexcept;
  /// Passes of rays through a voxel of a block.
  [[nodiscard]] std::uint8_t free_passes(const Block& block, int octet, int voxel) const noexcept {
    return free_passes(block, row_order(octet, voxel));
  }
  /// Of an octet's voxels.
  [[nodiscard]] std::array<std::uint8_t, kOctetVoxels> passes_of(const Block& block,
                                                                 int octet) const noexcept;
  /// Grows by one with every scan; a block's revision tells which scan changed it last.
  [[nodiscard]] std::uint32_t revision() const noexcept { return revision_; }
  /// The newest stamp of any block: every change gives its block a larger one.
  [[nodiscard]] std::uint64_t stamp() const noexcept { return stamp_; }
  [[nodiscard]] MapUsage usage() const noexcept;
  /// Voxels with free evidence only. O(blocks).
  [[nodiscard]] std::uint64_t count_free_voxels() const noexcept;
  /// Free passes at which the free layer saturates: floor(max_evidence / free_weight), 255 without
  /// a cap.
  [[nodiscard]] std::uint8_t max_passes() const noexcept { return max_passes_; }
  /// Calls visit(SlabHandle) for each block that got label evidence of what may move since it was
  /// opened, in that order, unless it left the list; ends where visit returns false. visit changes
  /// nothing. O(such blocks).
  template <class Visit>
  void visit_moving(Visit&& visit) const noexcept {
    SlabHandle at = moving_first_;
    while (at != 0 && visit(at)) at = block_at(at).moving_next;
  }
  /// Whether visit_moving() visits a block. O(1).
  [[nodiscard]] bool may_move(SlabHandle handle) const noexcept {
    return block_at(handle).moving_before != 0 || moving_first_ == handle;
  }
  /// True iff these many more items of each size could be given now, together.
  [[nodiscard]] bool fits(const SlabPool::Counts& wanted) const noexcept {
    return pool_.fits(wanted);
  }
  /// The same of an empty map.
  [[nodiscard]] bool fits_empty(const SlabPool::Counts& wanted) const noexcept {
    return pool_.fits_empty(wanted);
  }
  /// The same, with a refusal counted in MapUsage::storage_refused where not.
  [[nodiscard]] bool fits_or_refuse(const SlabPool::Counts& wanted) noexcept {
    return pool_.fits_or_refuse(wanted);
  }
  /// Items of each size that are in use.
  [[nodiscard]] SlabPool::Counts items() const noexcept {
    return {pool_.items(kBlockSlab), pool_.items(kLabelSlab), pool_.items(kFreeSlab),
            pool_.items(kOctetSlab)};
  }

  // --- Opening and closing blocks ----------------------------------------------------------------

  /// The block's handle, opening an empty one if needed. Fails with kOutOfRange iff the block is
  /// outside the grid; kResourceExhausted iff storage or index has no place for it: counted, map
  /// unchanged.
  [[nodiscard]] Result<SlabHandle> open_block(BlockCoord block) noexcept;
  /// Takes back a block that holds no evidence; does nothing to others.
  void close_if_empty(SlabHandle handle) noexcept;
  /// Takes back every block that holds no evidence. O(index).
  void close_empty_blocks() noexcept;
  /// Closes a block with all its content. Work: its octets, 64 at most, and an entry of the index.
  void remove_block(SlabHandle handle) noexcept;
  /// Forgets all content. O(index).
  void clear() noexcept;
  /// Starts the next revision.
  void begin_revision() noexcept { ++revision_; }
  void restore_revision(std::uint32_t revision) noexcept { revision_ = revision; }

  // --- For readers of other threads, and for those that wait for memory together -----------------

  [[nodiscard]] const BlockIndex& index() const noexcept { return index_; }
  [[nodiscard]] const SlabPool& pool() const noexcept { return pool_; }
  [[nodiscard]] const TupleStore& tuples() const noexcept { return tuples_; }
  /// The newest stamp, in its place: to be read as what another thread writes.
  [[nodiscard]] const std::uint64_t& shared_stamp() const noexcept { return stamp_; }
  /// Odd while clear() is at work; to be read likewise.
  [[nodiscard]] const std::uint64_t& shared_clear_stamp() const noexcept { return clear_stamp_; }
  /// The octet's tuples, or 0 if it has none.
  [[nodiscard]] SlabHandle octet_handle(const Block& block, int octet) const noexcept {
    const LabelPage* const page = label_page(block, octet);
    return page == nullptr ? 0 : page->octets[octet_in_layer(octet)];
  }
  /// row: the voxel's row order in the block.
  [[nodiscard]] std::uint8_t free_passes(const Block& block, int row) const noexcept {
    const SlabHandle page = block.free_passes[layer_of_row(row)];
    if (page == 0) return 0;
    return reinterpret_cast<const FreePage*>(pool_.at(page))->passes[row_in_layer(row)];
  }
  [[nodiscard]] SlabHandle find_handle(BlockKey key) const noexcept {
    return index_.find(key, [&](SlabHandle item) { return block_at(item).key == key.bits; });
  }

 protected:
  /// Takes memory, once. Fails as LocalMap::make.
  [[nodiscard]] Status set_up(Arena& arena, const MapConfig& config,
                              const ClassTable& classes) noexcept;
  /// Takes a block out of the list of those that may hold what moves; it need not be there. O(1).
  void leave_moving(SlabHandle handle) noexcept;

 private:
  friend class BlockEditor;
  /// The block first: who sees the map's stamp then sees the changes up to it.
  void stamp_anew(Block& block) noexcept {
    store_shared(block.stamp, stamp_ + 2, std::memory_order_release);
    store_shared(stamp_, stamp_ + 2, std::memory_order_release);
  }
  [[nodiscard]] Block& mutable_block(SlabHandle at) noexcept {
    return *reinterpret_cast<Block*>(pool_.at(at));
  }
  void note_usage() noexcept;
  /// Puts a block at the end of the list of those that may hold what moves; it may be there. O(1).
  void join_moving(SlabHandle handle) noexcept;

  std::uint64_t clear_stamp_ = 0;  ///< Beside what never changes.
  MapConfig config_{};
  Reading reading_;
  ClassTable classes_{};
  BlockIndex index_{};
  SlabPool pool_{};
  TupleStore tuples_{};
  std::uint32_t revision_ = 0;
  SlabHandle moving_first_ = 0;
  SlabHandle moving_last_ = 0;
  std::uint8_t max_passes_ = 255;
  std::uint64_t label_voxels_ = 0;
  std::uint64_t blocks_refused_ = 0;
  std::size_t peak_bytes_ = 0;
  std::uint64_t stamp_ = 0;  ///< The last that a block got; even.
};

/// Copies the passes of a block's 512 voxels, octet by octet; into: at least 512 bytes. True iff
/// any is not zero.
bool copy_passes(const BlockTable& table, const Block& block, std::span<std::byte> into) noexcept;

}  // namespace tessera
