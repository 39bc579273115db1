// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Reading the global map while another thread works on it. The writer never waits and does not know
// of its readers.
#pragma once

#include <span>

#include "tessera/fusion/global_map.hpp"
#include "tessera/map/map_reader.hpp"

namespace tessera {

/// A reader of a global map; one for each thread that reads. The map must be made before the
/// reader, and stay where it is while the reader is used.
///
/// What is read of a block is as MapReader says. All that one call reads is of one generation: as
/// before a move of contributions or as after it, but for blocks that GlobalMapReport::torn_blocks
/// counts. Generations never go back.
///
/// A call tries kMaxAttempts times, then fails with kBusy: a move was completed meanwhile each
/// time, or a block was in the middle of a change. A try costs up to two reads of MapReader a
/// voxel.
class GlobalReader {
 public:
  static constexpr int kMaxAttempts = MapReader::kMaxAttempts;

  explicit GlobalReader(const GlobalMap& global) noexcept
      : maps_(&global.maps()), map_(maps_->map()), staged_(maps_->staged()) {}

  /// For what never changes: configuration, classes, lattice, how counts are read.
  [[nodiscard]] const LocalMap& map() const noexcept { return maps_->map(); }

  /// A voxel's counts. Fails with kBusy iff kMaxAttempts tries did.
  [[nodiscard]] Result<VoxelEvidence> evidence(VoxelCoord voxel) noexcept;
  [[nodiscard]] Result<VoxelEvidence> evidence(const Point3f& p_global) noexcept;
  /// State, label, probability and variance. Fails as evidence.
  [[nodiscard]] Result<Estimate> query(VoxelCoord voxel) noexcept;
  [[nodiscard]] Result<Estimate> query(const Point3f& p_global) noexcept;
  /// Many voxels of one generation. Fails with kInvalidArgument iff into is shorter than voxels;
  /// kBusy as evidence, and into is undefined then. O(voxels) a try.
  [[nodiscard]] Status query(std::span<const VoxelCoord> voxels, std::span<Estimate> into) noexcept;
  /// Bytes of workspace that snapshot needs.
  [[nodiscard]] std::size_t snapshot_bytes() const noexcept { return map_.snapshot_bytes(); }
  /// A whole block of one generation; one that the map does not have gives an empty snapshot.
  /// workspace: aligned to eight bytes, of use until the snapshot is not. Fails as
  /// MapReader::snapshot. A try costs up to two of those.
  [[nodiscard]] Result<BlockSnapshot> snapshot(BlockCoord block,
                                               std::span<std::byte> workspace) noexcept;
  /// Moves that were complete in what was read last: tells before from after.
  [[nodiscard]] std::uint64_t generation() const noexcept { return generation_; }

  /// Tries that were in vain, since the reader was made.
  [[nodiscard]] std::uint64_t retries() const noexcept {
    return retries_ + map_.retries() + staged_.retries();
  }
  /// Calls that failed with kBusy.
  [[nodiscard]] std::uint64_t busy() const noexcept { return busy_; }

 private:
  [[nodiscard]] Estimate estimate_of(const VoxelEvidence& evidence) const noexcept;
  [[nodiscard]] bool read(VoxelCoord voxel, bool staged, VoxelEvidence& into) noexcept;
  template <class Read>
  [[nodiscard]] bool read_one_generation(Read&& read) noexcept;

  const TwoMaps* maps_;
  MapReader map_;
  MapReader staged_;
  std::uint64_t generation_ = 0;
  std::uint64_t retries_ = 0;
  std::uint64_t busy_ = 0;
};

}  // namespace tessera
