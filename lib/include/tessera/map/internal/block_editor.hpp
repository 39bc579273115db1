// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A change of a block, of its pages or of its tuples, for those who read meanwhile: the block's
// stamp is odd from before the first store until after the last, and all stores between are shared
// ones. Cap arithmetic: with n free passes of weight w, labels summing to s and the cap S,
// n w + s <= S holds after every call (to float rounding).
#pragma once

#include "tessera/map/block_content.hpp"
#include "tessera/map/internal/block_table.hpp"

namespace tessera {

class BlockEditor {
 public:
  using Slices = std::array<std::uint64_t, 2>;
  /// An octet's eight bits of two slices of its layer: two of a row, of two rows, of each slice.
  [[nodiscard]] static unsigned of_octet(const Slices& slices, std::size_t octet_in_layer) noexcept;

  BlockEditor(BlockTable& table, SlabHandle handle) noexcept
      : table_(table), block_(table.mutable_block(handle)), handle_(handle) {
    store_shared(block_.stamp, block_.stamp | 1U);
    std::atomic_thread_fence(std::memory_order_release);
  }
  ~BlockEditor() {
    if (open_) table_.stamp_anew(block_);
  }
  BlockEditor(const BlockEditor&) = delete;
  BlockEditor& operator=(const BlockEditor&) = delete;
  BlockEditor(BlockEditor&&) = delete;
  BlockEditor& operator=(BlockEditor&&) = delete;

  /// This change is of the map's current revision.
  void note_revision() noexcept { store_shared(block_.revision, table_.revision_); }
  void restore_revision(std::uint32_t revision) noexcept {
    store_shared(block_.revision, revision);
  }

  // --- Labels ------------------------------------------------------------------------------------

  /// Opens an octet's tuples, with the page of its layer. Fails with kResourceExhausted iff they do
  /// not fit: counted, unchanged.
  [[nodiscard]] Status ensure_octet(int octet) noexcept;
  [[nodiscard]] std::byte* tuples(int octet) noexcept {
    return table_.pool_.at(table_.octet_handle(block_, octet));
  }
  /// Adds to an octet that is there and holds the cap. added: an OctetEvidence or an OctetOfBlock.
  template <class Evidence>
  void add_labels(int octet, const Evidence& added) noexcept;
  /// The same with shares, as LocalMap::add_labels has them.
  void add_labels(int octet, const OctetEvidence& added, unsigned voxels,
                  const LabelShares& shares) noexcept;
  /// There must be storage for it.
  void ensure_label_page(std::size_t layer) noexcept;
  /// From now on label pages stay that have lost their last octet; to be taken back later
  /// (drop_label_page).
  void keep_label_pages() noexcept { keeps_label_pages_ = true; }
  /// Takes back a label page without octets.
  void drop_label_page(std::size_t layer) noexcept;
  /// Makes a voxel's counts these; there must be room. voxel: of the octet, 0 to 7.
  void set_labels(int octet, int voxel, const VoxelEvidence& evidence, bool with_cap) noexcept;
  /// Of a layer with a label page, in a map that keeps votes.
  void set_votes(std::size_t layer, const LabelVotes& votes) noexcept {
    store_shared_words(table_.pool_.at(block_.labels[layer]) + sizeof(LabelPage), &votes,
                       sizeof(votes));
  }
  /// Fills an octet without tuples; there must be room.
  void fill_octet(int octet, const BlockContent& content) noexcept;

  // --- Free passes -------------------------------------------------------------------------------

  /// There must be storage for it.
  void ensure_free_page(std::size_t layer) noexcept;
  /// One more for the voxels of two slices, where the page is. Returns whether anything changed.
  [[nodiscard]] bool count_passes(std::size_t layer, const Slices& slices) noexcept;
  /// Labels of these voxels give way where the cap is reached. Returns whether anything changed.
  [[nodiscard]] bool give_way(std::size_t layer, const Slices& slices) noexcept;
  /// LocalMap::contradict() of a layer's voxels, whose free page must be there if with_passes is
  /// true; else all labels of what goes are taken.
  void contradict(std::size_t layer, const Slices& doubted, const Slices& gone, bool with_passes,
                  Contradicted& counts) noexcept;
  /// The page must be there; what is over max_passes() is not counted.
  void set_passes(int octet, int voxel, unsigned passes) noexcept {
    const std::uint8_t most = table_.max_passes_;
    store_shared(free_page(layer_of_octet(octet)).passes[row_in_layer(row_order(octet, voxel))],
                 passes < most ? static_cast<std::uint8_t>(passes) : most);
  }
  /// Adds to the passes of the octet's voxels in mask; passes: of all eight. Else as set_passes.
  void add_passes(int octet, std::span<const std::byte> passes, unsigned mask) noexcept;

  // --- All of it ---------------------------------------------------------------------------------

  /// Octets, with the last of a layer its page, and passes are taken back.
  void clear() noexcept;
  /// Closes the block: readers find it whole or not at all, never emptied. Nothing else after it.
  void close() noexcept;

 private:
  [[nodiscard]] LabelPage& label_page(std::size_t layer) noexcept {
    return *reinterpret_cast<LabelPage*>(table_.pool_.at(block_.labels[layer]));
  }
  [[nodiscard]] FreePage& free_page(std::size_t layer) noexcept {
    return *reinterpret_cast<FreePage*>(table_.pool_.at(block_.free_passes[layer]));
  }
  /// Label evidence of these components came.
  void note_components(std::uint64_t components) noexcept {
    if ((components & table_.classes_.moving()) != 0) table_.join_moving(handle_);
  }
  /// Holds the cap of the octet's voxels() that evidence was added to. Mostly there are no passes
  /// and no full voxel.
  template <class Voxels>
  void end_adding(int octet, Voxels&& voxels, TupleStore::Plane& sums) noexcept {
    const float cap = table_.config_.max_evidence;
    if (cap > 0.0F &&
        (block_.free_passes[layer_of_octet(octet)] != 0 || bits_above(sums.data(), cap) != 0))
      hold_cap(octet, voxels(), sums);
    update_observed(octet, sums);
  }
  void hold_cap(int octet, unsigned voxels, TupleStore::Plane& sums) noexcept;
  /// Returns those that went.
  unsigned contradict(int octet, unsigned voxels, unsigned going, float left) noexcept;
  [[nodiscard]] bool give_way_to_free(BlockTable& table, int octet, int voxel) noexcept;
  void update_observed(int octet, const TupleStore::Plane& sums) noexcept;

  BlockTable& table_;
  Block& block_;
  SlabHandle handle_;
  bool open_ = true;
  bool keeps_label_pages_ = false;
};

template <class Evidence>
void BlockEditor::add_labels(int octet, const Evidence& added) noexcept {
  note_components(added.components() & ~std::uint64_t{1});
  TupleStore::Plane sums = table_.tuples_.add(tuples(octet), added);
  end_adding(
      octet, [&added] { return labelled_voxels(added); }, sums);
}

/// A scan's label evidence for octets of one block.
class OctetWriter {
 public:
  OctetWriter(BlockTable& table, SlabHandle handle) noexcept : table_(table), handle_(handle) {}
  /// LocalMap::add_labels() of an octet; with shares iff they are of a class.
  Status add(int octet, const OctetEvidence& added, const LabelShares& shares = {}) noexcept;
  /// Fetches what add() reads first of an octet, if that is there. O(1).
  [[gnu::always_inline]] void prefetch(int octet) const noexcept {
    const SlabHandle tuples = table_.octet_handle(table_.block_at(handle_), octet);
    if (tuples != 0) table_.tuples().prefetch_to_add(table_.pool().at(tuples));
  }

 private:
  BlockTable& table_;
  SlabHandle handle_;
};

}  // namespace tessera
