// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Reading a map while another thread writes to it. The writer never waits and does not know of its
// readers. A reader copies what it needs and looks whether the block was changed meanwhile; if so
// it tries again, a bounded number of times.
#pragma once

#include <array>
#include <cstring>
#include <span>

#include "tessera/map/local_maps.hpp"

namespace tessera {

/// A block as it was at one moment. Its content lies in the workspace that it was made in.
class BlockSnapshot {
 public:
  /// An empty one.
  BlockSnapshot() noexcept = default;
  /// True iff the map had no such block: nothing in it was observed.
  [[nodiscard]] bool empty() const noexcept { return free_passes_.empty(); }
  [[nodiscard]] BlockCoord coord() const noexcept { return coord_; }
  /// The map's revision when the block's content last changed.
  [[nodiscard]] std::uint32_t revision() const noexcept { return revision_; }
  /// Block::stamp of this content; 0 of an empty one.
  [[nodiscard]] std::uint64_t stamp() const noexcept { return stamp_; }
  /// Voxels with evidence in 1 .. C + 1.
  [[nodiscard]] std::uint32_t label_voxels() const noexcept { return label_voxels_; }
  /// As the functions of LocalMap of the same names.
  [[nodiscard]] std::uint8_t observed_labels(int octet) const noexcept {
    return observed_[static_cast<std::size_t>(octet)];
  }
  [[nodiscard]] std::uint8_t free_passes(int octet, int voxel) const noexcept {
    return empty() ? std::uint8_t{0}
                   : std::to_integer<std::uint8_t>(
                         free_passes_[static_cast<std::size_t>(row_order(octet, voxel))]);
  }
  [[nodiscard]] VoxelEvidence evidence(int octet, int voxel) const noexcept;
  template <class Label, class Rest>
  void visit_labels(int octet, int voxel, Label&& label, Rest&& rest) const noexcept {
    const std::size_t place = place_[static_cast<std::size_t>(octet)];
    if (place == 0) return;
    tuples_.visit(octets_.subspan((place - 1) * octet_bytes_).data(), voxel, label, rest);
  }
  [[nodiscard]] OctetCentroids centroids(int octet) const noexcept {
    const std::size_t place = place_[static_cast<std::size_t>(octet)];
    if (place == 0) return {};
    return tuples_.centroids(octets_.subspan((place - 1) * octet_bytes_).data());
  }
  /// Of a layer, if its map keeps them; else none that have begun.
  [[nodiscard]] LabelVotes votes(std::size_t layer) const noexcept {
    LabelVotes votes;
    if (!votes_.empty()) std::memcpy(&votes, &votes_[layer * sizeof(votes)], sizeof(votes));
    return votes;
  }
  /// The free passes of all 512 voxels in row order, a byte each; nothing of an empty one.
  [[nodiscard]] std::span<const std::byte> free_rows() const noexcept { return free_passes_; }

 private:
  friend class MapReader;
  BlockCoord coord_{};
  std::uint64_t stamp_ = 0;
  std::uint32_t revision_ = 0;
  std::uint32_t label_voxels_ = 0;
  int num_components_ = 0;
  float free_weight_ = 0.0F;
  TupleStore tuples_{};
  std::size_t octet_bytes_ = 0;
  std::span<const std::byte> free_passes_;  ///< A byte a voxel in row order.
  std::span<const std::byte> votes_;        ///< Of each layer.
  std::span<const std::byte> octets_;
  std::array<std::uint8_t, kBlockOctets> observed_{};
  std::array<std::uint8_t, kBlockOctets> place_{};  ///< Of the octet in octets_, plus one.
};

/// What the map's index says of a block, without its content.
struct BlockNote {
  BlockKey key{};
  /// As Block::stamp; odd while the block is changed, and then above that of its last state.
  std::uint64_t stamp = 0;
  std::uint32_t label_voxels = 0;
  std::uint32_t slot = 0;  ///< Its place in the index's page.
};

/// How many notes were read of a page.
struct PageNotes {
  std::size_t count = 0;
  std::uint64_t moves = 0;  ///< Another whenever entries of the index change their places.
};

/// A reader of a map; one for each thread that reads. The map must be made before the reader, and
/// stay where it is while the reader is used: it must not be moved or moved to. Everything else may
/// be done to it by its one writer meanwhile: scans integrated, blocks closed, content loaded, all
/// cleared.
///
/// What is read is as it was after some one write to its block (a scan's evidence for an octet, a
/// scan's free passes for a block, an octet's restored voxel), never a mixture, and never older
/// than what this thread has seen or was told of before. Voxels of different octets or blocks may
/// be of different scans; a snapshot's octets are of one moment, which may be in the middle of a
/// scan.
///
/// A read tries kMaxAttempts times, then fails with kBusy: the writer was in the middle of a change
/// each time, or was interrupted there. Try again later; retries() and busy() count. A try costs
/// what LocalMap's reading does, and a copy of the octet (at most 2 kB) or of the block.
class MapReader {
 public:
  static constexpr int kMaxAttempts = 64;

  explicit MapReader(const LocalMap& map) noexcept : map_(&map) {}
  /// Of a robot that may map in submaps: of the current submap, and where that has no block, of the
  /// one before it if that lies in the same frame. Not what is said of changes, which is of one
  /// map.
  explicit MapReader(const LocalMaps& maps) noexcept : map_(&maps.map()), maps_(&maps) {}

  /// The map, or one of the maps, for what never changes: configuration, classes, lattice.
  [[nodiscard]] const LocalMap& map() const noexcept { return *map_; }

  /// A voxel's counts, as LocalMap::evidence. Fails with kBusy iff kMaxAttempts tries did.
  [[nodiscard]] Result<VoxelEvidence> evidence(VoxelCoord voxel) noexcept;
  [[nodiscard]] Result<VoxelEvidence> evidence(const Point3f& p_map) noexcept;
  /// State, label, probability and variance, as LocalMap::query. Fails as evidence.
  [[nodiscard]] Result<Estimate> query(VoxelCoord voxel) noexcept;
  [[nodiscard]] Result<Estimate> query(const Point3f& p_map) noexcept;

  /// Bytes of workspace that snapshot needs: 512, votes of the layers, and 64 octets.
  [[nodiscard]] static constexpr std::size_t snapshot_bytes(TuplePolicy tuple,
                                                            int num_components) noexcept {
    return kSnapshotOctets +
           std::size_t{kBlockOctets} * TupleStore::octet_bytes(tuple, num_components);
  }
  /// Whatever a map keeps of a voxel.
  [[nodiscard]] static constexpr std::size_t most_snapshot_bytes(int num_components) noexcept {
    const std::size_t dense = snapshot_bytes(TuplePolicy::kDense, num_components);
    const std::size_t compact = snapshot_bytes(TuplePolicy::kCompact, num_components);
    return dense < compact ? compact : dense;
  }
  [[nodiscard]] std::size_t snapshot_bytes() const noexcept {
    return snapshot_bytes(map_->config().tuple, map_->num_components());
  }
  /// A whole block; one that the map does not have gives an empty snapshot. workspace: aligned to
  /// eight bytes, of use until the snapshot is not. Fails with kOutOfRange iff the block is outside
  /// the grid; kInvalidArgument iff the workspace is shorter than snapshot_bytes() or not aligned;
  /// kBusy iff kMaxAttempts tries failed.
  [[nodiscard]] Result<BlockSnapshot> snapshot(BlockCoord block,
                                               std::span<std::byte> workspace) noexcept;

  /// Whether the map has no such block, for certain: false while it may just be changed. Two
  /// look-ups.
  [[nodiscard]] bool lacks(BlockCoord block) noexcept;

  // --- What has changed --------------------------------------------------------------------------

  /// The newest stamp of any block. Every change that this thread cannot see yet will be newer.
  [[nodiscard]] std::uint64_t stamp() const noexcept {
    return load_shared(map_->shared_stamp(), std::memory_order_acquire);
  }
  static constexpr std::size_t kPageBlocks =
      static_cast<std::size_t>(BlockIndex::kPageBuckets) * BlockIndex::kBucketSlots;
  /// Pages of the map's index, of up to kPageBlocks blocks each. A block stays in its page or goes
  /// to one behind all that there are: who reads all pages in order, until there are no more, meets
  /// every block that was there from before until after.
  [[nodiscard]] std::size_t pages() const noexcept { return map_->index().pages_shared(); }
  /// The blocks of a page from a slot on. Fails with kOutOfRange iff there is no
  /// such page; kBusy iff kMaxAttempts tries met entries that moved. O(kPageBlocks) a try.
  [[nodiscard]] Result<PageNotes> notes(std::size_t page, std::size_t first_slot,
                                        std::span<BlockNote, kPageBlocks> into) noexcept;

  /// Tries that were in vain, since the reader was made.
  [[nodiscard]] std::uint64_t retries() const noexcept { return retries_; }
  /// Reads that failed with kBusy.
  [[nodiscard]] std::uint64_t busy() const noexcept { return busy_; }

 private:
  friend class GlobalReader;
  /// Where the octets of a snapshot begin in its workspace.
  static constexpr std::size_t kSnapshotOctets = kBlockVoxels + kBlockLayers * sizeof(LabelVotes);
  enum class Outcome : std::uint8_t { kRead, kAbsent, kTorn };
  /// kAbsent: there is no such block, and into is without evidence.
  [[nodiscard]] Outcome read_evidence(VoxelCoord voxel, VoxelEvidence& into) noexcept;
  [[nodiscard]] bool read_note(SlabHandle handle, BlockNote& into) const noexcept;
  template <class Copy>
  Outcome try_read(BlockKey key, Copy& copy) noexcept;
  template <class Copy>
  Outcome read(BlockKey key, Copy&& copy) noexcept;
  template <class Copy>
  Outcome read_one(BlockKey key, Copy& copy) noexcept;
  /// An item of the storage, or null where a handle that is torn reaches out of it.
  template <class Item>
  [[nodiscard]] const Item* item(SlabHandle handle,
                                 std::size_t bytes = sizeof(Item)) const noexcept;
  bool copy_octet(const Block& block, int octet, std::byte* to, bool& present) const noexcept;
  bool copy_passes(const Block& block, std::size_t layer, std::byte* to) const noexcept;
  bool copy_votes(const Block& block, std::size_t layer, std::byte* to) const noexcept;
  bool copy_block(const Block& block, std::span<std::byte> workspace,
                  BlockSnapshot& into) const noexcept;

  const LocalMap* map_;
  const LocalMaps* maps_ = nullptr;  ///< Of which map_ is one.
  std::uint64_t retries_ = 0;
  std::uint64_t busy_ = 0;
};

}  // namespace tessera
