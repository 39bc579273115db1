// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One robot's map: blocks of voxels with count tuples and a free layer, in memory given by the
// caller. One writer, whose thread alone may use what is here; other threads read through a
// MapReader. Reading never allocates and never changes anything.
#pragma once

#include <optional>
#include <span>

#include "tessera/base/internal/radix_sort.hpp"
#include "tessera/base/internal/shared_words.hpp"
#include "tessera/map/block_content.hpp"
#include "tessera/map/map_config.hpp"
#include "tessera/map/map_usage.hpp"
#include "tessera/semantics/class_table.hpp"
#include "tessera/semantics/estimate.hpp"

namespace tessera {

class LocalMap {
 public:
  /// A map in memory from the arena. Fails with kInvalidArgument iff a value of config is outside
  /// its documented range, the table has no class, or the storage is under four pages;
  /// kResourceExhausted iff the arena has under required_bytes(config) left or is not aligned to
  /// kArenaAlignment. O(index's table) time; storage is not touched.
  [[nodiscard]] static Result<LocalMap> make(Arena& arena, const MapConfig& config,
                                             const ClassTable& classes) noexcept;
  /// No map yet: every voxel is unknown, and nothing can be written.
  LocalMap() noexcept = default;
  /// Moves only: a copy would write to the same memory. What was moved from is of no further use.
  LocalMap(const LocalMap&) = delete;
  LocalMap& operator=(const LocalMap&) = delete;
  LocalMap(LocalMap&&) noexcept = default;
  LocalMap& operator=(LocalMap&&) noexcept = default;
  ~LocalMap() = default;

  [[nodiscard]] const MapConfig& config() const noexcept { return config_; }
  [[nodiscard]] const ClassTable& classes() const noexcept { return classes_; }
  [[nodiscard]] Lattice lattice() const noexcept { return Lattice(config_.resolution_m); }
  [[nodiscard]] int num_components() const noexcept { return classes_.num_components(); }

  // --- Reading -----------------------------------------------------------------------------------

  /// A voxel's counts; all zero if it was never observed. Two cache lines of index, then at most
  /// one a component.
  [[nodiscard]] VoxelEvidence evidence(VoxelCoord voxel) const noexcept;
  /// The same for the voxel that contains p_map (metres); all zero if it is not finite or out of
  /// the grid.
  [[nodiscard]] VoxelEvidence evidence(const Point3f& p_map) const noexcept;
  /// State, label, probability and variance at p_map; unknown if it is not finite or out of the
  /// grid.
  [[nodiscard]] Estimate query(const Point3f& p_map) const noexcept;
  [[nodiscard]] Estimate query(VoxelCoord voxel) const noexcept;
  /// The same for many at once: into[i] is the estimate of the i-th. Faster than one by one where
  /// the map is larger than the caches, as a group of kQueryGroup waits for memory together; voxels
  /// that follow each other in one block share a look-up. Fails with kInvalidArgument iff the sizes
  /// differ, and writes nothing then. At most two look-ups and a query each; 1 kB of stack.
  Status query(std::span<const Point3f> points_map, std::span<Estimate> into) const noexcept;
  Status query(std::span<const VoxelCoord> voxels, std::span<Estimate> into) const noexcept;
  static constexpr std::size_t kQueryGroup = 16;

  /// The same for a voxel of a block.
  [[nodiscard]] Estimate query(const Block& block, VoxelCoord voxel) const noexcept;
  /// The state alone of a voxel of a block, which is what rays ask. Reads the tuple only where
  /// there is label evidence.
  [[nodiscard]] VoxelState state(const Block& block, VoxelCoord voxel) const noexcept {
    const int octet = octet_in_block(voxel);
    const auto place = static_cast<unsigned>(voxel_in_octet(voxel));
    if (((unsigned{observed_labels(block, octet)} >> place) & 1U) != 0)
      return query(block, voxel).state;
    return states_of_passes_[free_passes(block, row_order(voxel))];
  }

  /// The blocks sorted by key, that is by (z, y, x); each entry's index is for block_at. workspace:
  /// at least 2 * block_count() entries, else nothing is given. O(index + blocks).
  [[nodiscard]] std::span<const KeyedIndex> blocks_in_order(
      std::span<KeyedIndex> workspace) const noexcept;
  [[nodiscard]] std::size_t block_count() const noexcept { return index_.size(); }
  [[nodiscard]] std::size_t index_entries() const noexcept { return index_.slots(); }
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
  [[nodiscard]] SlabHandle find_handle(BlockCoord block) const noexcept;
  [[nodiscard]] const Block* find(BlockCoord block) const noexcept;
  [[nodiscard]] VoxelEvidence evidence(const Block& block, int octet, int voxel) const noexcept;
  /// Calls label(component, count) for each label count of a voxel that has label evidence, and
  /// rest(count) for its rest.
  template <class Label, class Rest>
  void visit_labels(const Block& block, int octet, int voxel, Label&& label,
                    Rest&& rest) const noexcept {
    tuples_.visit(pool_.at(octet_handle(block, octet)), voxel, label, rest);
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
  /// True iff a voxel without label evidence is never occupied, however few passes it has: always
  /// but for a large prior. Rays then need not read the free layer.
  [[nodiscard]] bool only_labels_occupy() const noexcept { return only_labels_occupy_; }
  /// True iff the block has a tuple octet there.
  [[nodiscard]] bool has_octet(const Block& block, int octet) const noexcept;
  /// The octets for which a block has tuples, a bit each.
  [[nodiscard]] std::uint64_t octets_of(const Block& block) const noexcept;
  /// Passes of rays through a voxel of a block.
  [[nodiscard]] std::uint8_t free_passes(const Block& block, int octet, int voxel) const noexcept {
    return free_passes(block, row_order(octet, voxel));
  }

  /// Copies the passes of a block's 512 voxels, octet by octet; into: at least 512 bytes. True iff
  /// any is not zero.
  bool copy_passes(const Block& block, std::span<std::byte> into) const noexcept;

  /// Grows by one with every scan; a block's revision tells which scan changed it last.
  [[nodiscard]] std::uint32_t revision() const noexcept { return revision_; }
  /// The newest stamp of any block: every change gives its block a larger one.
  [[nodiscard]] std::uint64_t stamp() const noexcept { return stamp_; }
  [[nodiscard]] MapUsage usage() const noexcept;
  /// Voxels with free evidence only. O(blocks).
  [[nodiscard]] std::uint64_t count_free_voxels() const noexcept;

  // --- Writing (inference, map file) -------------------------------------------------------------

  /// Starts the next revision.
  void begin_revision() noexcept { ++revision_; }
  /// The block's handle, opening an empty one if needed. Fails with kOutOfRange iff the block is
  /// outside the grid; kResourceExhausted iff storage or index has no place for it: counted, map
  /// unchanged.
  [[nodiscard]] Result<SlabHandle> open_block(BlockCoord block) noexcept;
  /// Takes back a block that holds no evidence; does nothing to others.
  void close_if_empty(SlabHandle handle) noexcept;
  /// Takes back every block that holds no evidence. O(index).
  void close_empty_blocks() noexcept;
  /// True iff these many more items of each size could be given now, together.
  [[nodiscard]] bool fits(const SlabPool::Counts& wanted) const noexcept {
    return pool_.fits(wanted);
  }
  /// The same, with a refusal counted in MapUsage::storage_refused where not.
  [[nodiscard]] bool fits_or_refuse(const SlabPool::Counts& wanted) noexcept {
    return pool_.fits_or_refuse(wanted);
  }

  /// Adds a scan's evidence to an octet, then holds the cap: free passes and labels give way in
  /// proportion, in whole passes rounded in favour of occupancy. Voxels without added evidence stay
  /// as they are. Fails with kResourceExhausted iff a label page or octet is needed and does not
  /// fit: counted, unchanged. O(components present).
  Status add_labels(SlabHandle handle, int octet, const OctetEvidence& added) noexcept;
  /// The same for these octets of a block, with room for all at once. Returns for how many there
  /// was anything. Fails as above, with those before added. O(64 components present).
  Result<int> add_labels(SlabHandle handle, std::uint64_t octets,
                         const BlockEvidence& added) noexcept;
  /// Prefetches the memory that this reads: the pages of a block, if any, then these octets.
  void prefetch_pages(SlabHandle handle) const noexcept;
  void prefetch_octets(SlabHandle handle, std::uint64_t octets) const noexcept;
  /// Adds one pass to every voxel in mask; label evidence gives way where the cap is reached, and a
  /// tuple that has none left is taken back. Fails with kResourceExhausted iff a free page is
  /// needed and does not fit: counted, unchanged.
  Status add_free_pass(SlabHandle handle, const VoxelMask& mask) noexcept;
  /// Sets a voxel that was never observed: what the map file restores. Fails with
  /// kResourceExhausted as the two above, kInvalidArgument iff passes exceed the cap or no tuple
  /// can hold the counts.
  Status restore(SlabHandle handle, int octet, int voxel, const VoxelEvidence& evidence,
                 std::uint8_t passes) noexcept;
  /// Adds counts and passes to a voxel that may have some: sums, then the cap as in add_labels;
  /// passes stop at max_passes(), and of a compact tuple the three largest counts keep their class
  /// (among equals the lower one), the others go to the rest. The same as restore for a voxel that
  /// was never observed. Fails as restore, and nothing was changed. O(components present).
  Status merge(SlabHandle handle, int octet, int voxel, const VoxelEvidence& added,
               std::uint8_t passes) noexcept;
  /// The same for passes alone, of an octet's voxels without label evidence; passes: eight, of
  /// which those of the voxels in mask count. Fails as merge, and nothing was changed. O(8).
  Status merge_passes(SlabHandle handle, int octet, std::span<const std::byte> passes,
                      unsigned mask) noexcept;
  /// Makes a block hold this and nothing else, as one change; passes stop at max_passes(), and the
  /// cap is not held. Fails with kResourceExhausted iff storage has no room: counted, and the block
  /// holds nothing then. O(512 + voxels * components).
  Status replace(SlabHandle handle, const BlockContent& content) noexcept;
  /// Closes a block with all its content. Work: its octets, 64 at most, and an entry of the index.
  void remove_block(SlabHandle handle) noexcept;
  void restore_revision(std::uint32_t revision) noexcept { revision_ = revision; }
  void restore_revision(SlabHandle block, std::uint32_t revision) noexcept;
  /// Forgets all content. O(index).
  void clear() noexcept;

  /// Free passes at which the free layer saturates: floor(max_evidence / free_weight), 255 without
  /// a cap.
  [[nodiscard]] std::uint8_t max_passes() const noexcept { return max_passes_; }

 private:
  friend class MapReader;
  /// A change of a block, of its pages or of its tuples, for those who read meanwhile: made before
  /// the first store and gone after the last. All stores between are shared ones.
  class Change {
   public:
    Change(LocalMap& map, SlabHandle handle) noexcept
        : map_(map), block_(map.mutable_block(handle)) {
      store_shared(block_.stamp, block_.stamp | 1U);
      std::atomic_thread_fence(std::memory_order_release);
    }
    ~Change() { map_.stamp_anew(block_); }
    Change(const Change&) = delete;
    Change& operator=(const Change&) = delete;
    Change(Change&&) = delete;
    Change& operator=(Change&&) = delete;

   private:
    LocalMap& map_;
    Block& block_;
  };
  /// The block first: who sees the map's stamp then sees the changes up to it.
  void stamp_anew(Block& block) noexcept {
    store_shared(block.stamp, stamp_ + 2, std::memory_order_release);
    store_shared(stamp_, stamp_ + 2, std::memory_order_release);
  }
  [[nodiscard]] std::uint32_t octet_bytes() const noexcept {
    return TupleStore::octet_bytes(config_.tuple, num_components());
  }
  [[nodiscard]] Block& mutable_block(SlabHandle at) noexcept {
    return *reinterpret_cast<Block*>(pool_.at(at));
  }
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
  [[nodiscard]] LabelPage& mutable_label_page(const Block& block, std::size_t layer) noexcept {
    return *reinterpret_cast<LabelPage*>(pool_.at(block.labels[layer]));
  }
  [[nodiscard]] FreePage& mutable_free_page(const Block& block, std::size_t layer) noexcept {
    return *reinterpret_cast<FreePage*>(pool_.at(block.free_passes[layer]));
  }
  [[nodiscard]] SlabHandle find_handle(BlockKey key) const noexcept {
    return index_.find(key, [&](SlabHandle item) { return block_at(item).key == key.bits; });
  }
  [[nodiscard]] std::uint64_t count_free_voxels(const Block& block,
                                                std::size_t layer) const noexcept;
  /// Whether there is room for what a voxel of an octet gets; a refusal is counted.
  [[nodiscard]] bool has_room(const Block& block, int octet, bool labels, bool passes) noexcept;
  Status ensure_octet(Block& block, int octet) noexcept;
  template <class Evidence>
  void add_to_octet(Block& block, int octet, const Evidence& added) noexcept;
  void ensure_free_page(Block& block, std::size_t layer) noexcept;
  void empty_block(Block& block) noexcept;
  void fill_octet(Block& block, int octet, const BlockContent& content) noexcept;
  void hold_cap_on_labels(Block& block, int octet, unsigned voxels,
                          TupleStore::Plane& sums) noexcept;
  bool give_way_in_layer(Block& block, std::size_t layer,
                         const std::array<std::uint64_t, 2>& slices) noexcept;
  bool give_way_to_free(Block& block, int octet, int voxel, std::uint8_t passes) noexcept;
  void update_observed(Block& block, int octet, const TupleStore::Plane& sums) noexcept;
  void note_usage() noexcept;
  void fill_states_of_passes() noexcept;
  template <class Item, class VoxelOf>
  void query_in_groups(std::span<const Item> items, std::span<Estimate> into,
                       VoxelOf&& voxel_of) const noexcept;
  struct Ask;
  void query_group(std::span<Ask> asks, Estimate* into) const noexcept;

  std::uint64_t clear_stamp_ = 0;  ///< Odd while clear() is at work. Beside what never changes.
  MapConfig config_{};
  ClassTable classes_{};
  BlockIndex index_{};
  SlabPool pool_{};
  TupleStore tuples_{};
  std::uint32_t revision_ = 0;
  std::uint8_t max_passes_ = 255;
  std::array<VoxelState, 256> states_of_passes_{};  ///< Of a voxel with free evidence alone.
  bool only_labels_occupy_ = false;
  /// Of a voxel that was never observed.
  Estimate unobserved_ = CountSummary(classes_.num_components(), 0.0F).estimate(config_.prior);
  std::uint64_t label_voxels_ = 0;
  std::uint64_t blocks_refused_ = 0;
  std::size_t peak_bytes_ = 0;
  std::uint64_t stamp_ = 0;  ///< The last that a block got; even.
};

}  // namespace tessera
