// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One robot's map: blocks of voxels with count tuples and a free layer, in memory given by the
// caller. One writer, whose thread alone may use what is here; other threads read through a
// MapReader. Reading never allocates and never changes anything.
#pragma once

#include <span>

#include "tessera/map/block_content.hpp"
#include "tessera/map/internal/block_table.hpp"
#include "tessera/semantics/estimate.hpp"

namespace tessera {

/// Blocks (BlockTable), what their voxels say, and how evidence is added to them.
class LocalMap : public BlockTable {
 public:
  /// A map in memory from the arena. Fails with kInvalidArgument iff a value of config is outside
  /// its documented range, the table has no class, or the storage is under four pages;
  /// kResourceExhausted iff the arena has under required_bytes(config) left or is not aligned to
  /// kArenaAlignment. O(index's table) time; storage is not touched.
  [[nodiscard]] static Result<LocalMap> make(Arena& arena, const MapConfig& config,
                                             const ClassTable& classes) noexcept;
  /// The same where there is no map yet, without a map on the stack.
  [[nodiscard]] static Status make_at(LocalMap& place, Arena& arena, const MapConfig& config,
                                      const ClassTable& classes) noexcept;
  /// No map yet: every voxel is unknown, and nothing can be written.
  LocalMap() noexcept = default;

  // --- Reading -----------------------------------------------------------------------------------

  using BlockTable::evidence;
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
  /// The estimate of a voxel that was never observed.
  [[nodiscard]] const Estimate& unobserved() const noexcept { return unobserved_; }

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

  /// True iff a voxel without label evidence is never occupied, however few passes it has: always
  /// but for a large prior. Rays then need not read the free layer.
  [[nodiscard]] bool only_labels_occupy() const noexcept { return only_labels_occupy_; }

  // --- Writing (inference, map file) -------------------------------------------------------------

  /// Adds a scan's evidence to an octet, then holds the cap: free passes and labels give way in
  /// proportion, in whole passes rounded in favour of occupancy. Voxels without added evidence stay
  /// as they are. Fails with kResourceExhausted iff a label page or octet is needed and does not
  /// fit: counted, unchanged. O(components present).
  Status add_labels(SlabHandle handle, int octet, const OctetEvidence& added) noexcept;
  /// The same for these octets of a block, with room for all at once. Returns for how many there
  /// was anything. Fails as above, with those before added. O(64 components present).
  Result<int> add_labels(SlabHandle handle, std::uint64_t octets,
                         const BlockEvidence& added) noexcept;
  /// The same for evidence of the first of these classes alone and of none; and then all label
  /// evidence of voxels that got some, but what is of no class, is of these classes in these
  /// shares: the total stays. shares: of one class at least.
  Status add_labels(SlabHandle handle, int octet, const OctetEvidence& added,
                    const LabelShares& shares) noexcept;
  /// Opens the label pages of layers of a block, a bit each, so that they can hold votes before
  /// there are labels. Fails with kResourceExhausted iff they do not fit: counted, unchanged.
  Status open_label_layers(SlabHandle handle, unsigned layers) noexcept;
  /// Takes back label pages without labels. O(layers).
  void close_empty_label_layers(SlabHandle handle) noexcept;
  /// Votes of a layer with a label page. If they were not begun, they begin as what its labels say:
  /// a quarter of LabelVotes::kPerPoint for each count. O(1), or O(128 components present).
  [[nodiscard]] const LabelVotes& begun_votes(SlabHandle handle, std::size_t layer) noexcept {
    const LabelVotes& found = votes(block_at(handle), layer);
    if (!found.begun) begin_votes(handle, layer);
    return found;
  }
  /// Sets them. The block's revision stays: no voxel says anything else.
  void set_votes(SlabHandle handle, std::size_t layer, const LabelVotes& votes) noexcept;
  /// Adds one pass to every voxel in mask; label evidence gives way where the cap is reached, and a
  /// tuple that has none left is taken back. Fails with kResourceExhausted iff a free page is
  /// needed and does not fit: counted, unchanged.
  Status add_free_pass(SlabHandle handle, const VoxelMask& mask) noexcept;
  /// One scan saw through voxels that labels occupy (occupied()). Of those in gone label evidence
  /// is reduced to a quarter of free_weight, classes in proportion, so that it is known what was
  /// there; of those in doubted to 1.25 free_weight, or as in gone where it is up to half more than
  /// that: so by the second of two scans between which there was no hit. What is in gone, or went
  /// as if, counts two passes more, as what spreads from voxels beside it is no hit; where its
  /// layer has no page for them all labels go. Takes no storage. O(64 + voxels in the masks).
  Contradicted contradict(SlabHandle handle, const VoxelMask& doubted,
                          const VoxelMask& gone) noexcept;
  /// Voxels of a block whose label evidence is more than their passes weigh; those of them where it
  /// is at most kFaint; and those whose label is of a class that may move. If no voxel has evidence
  /// of such a class, visit_moving() visits the block no more. asked: of a block that
  /// visit_moving() does not visit, only octets with some of these voxels are looked at. O(512
  /// components present).
  struct Occupied {
    static constexpr float kFaint = 8.0F;  ///< So many points.
    VoxelMask all{};
    VoxelMask faint{};
    VoxelMask moving{};
    bool any_moving = false;
  };
  [[nodiscard]] Occupied occupied(SlabHandle handle, const VoxelMask& asked) noexcept;
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
  using BlockTable::restore_revision;
  void restore_revision(SlabHandle block, std::uint32_t revision) noexcept;

 private:
  void fill_states_of_passes() noexcept;
  void begin_votes(SlabHandle handle, std::size_t layer) noexcept;
  /// Label evidence came to an octet that is no scan's: where its layer's votes were begun, it
  /// votes.
  void vote_as(BlockEditor& editor, SlabHandle handle, int octet,
               const VoxelEvidence& evidence) noexcept;

  std::array<VoxelState, 256> states_of_passes_{};  ///< Of a voxel with free evidence alone.
  bool only_labels_occupy_ = false;
  /// Of a voxel that was never observed.
  Estimate unobserved_ = CountSummary(num_components(), 0.0F).estimate(config().prior);
};

}  // namespace tessera
