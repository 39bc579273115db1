// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot says against another contribution: that it has seen through voxels of one of its
// blocks after it had heard a version of that block. Whatever the block says later is not objected
// to, so no clocks are compared. A robot's objections are a contribution of their own, in which
// each has a place by what it is against.
#pragma once

#include <cstddef>
#include <span>

#include "tessera/replica/replicas.hpp"

namespace tessera {

struct Objection {
  /// The submap's number of a robot's objections, which are no map.
  static constexpr std::uint32_t kNumber = MapSession::kFirst - 1;
  [[nodiscard]] static constexpr bool is(std::uint32_t submap) noexcept {
    return submap == kNumber;
  }
  /// Contributions of objections that others hold of one robot: of its newest epochs.
  static constexpr std::uint32_t kPlacesOfRobot = 2;
  /// Places of one robot: of two objections of one place the later one counts.
  static constexpr std::uint32_t kPlaces = 1U << 14U;
  static constexpr std::size_t kMostBytes = 3 * 4 + 8 + 4 + 8 + kBlockVoxels / 8;

  ContributionId against;
  BlockKey key{};             ///< Of a block of it.
  std::uint32_t version = 0;  ///< PartVersion::first of what was heard of it.
  VoxelMask voxels{};         ///< Of the block.

  /// Where one against this block stands among a robot's objections.
  [[nodiscard]] static BlockKey place_of(const ContributionId& against, BlockKey key) noexcept;
  /// The bytes of it, in into, of at least kMostBytes.
  [[nodiscard]] std::size_t write(std::span<std::byte> into) const noexcept;
  /// False iff the bytes are not what write() gives for one against some voxel.
  [[nodiscard]] bool read(std::span<const std::byte> from) noexcept;
};

/// Reads a record of a robot's objections; false: there is none. O(1).
[[nodiscard]] bool read_objection(const Replicas& replicas, const Replicas::Replica* record,
                                  Objection& into) noexcept;

/// The one that a robot's objections have against a block; false: none. O(1).
[[nodiscard]] bool find_objection(const Replicas& replicas, Replicas::Slot objections,
                                  const ContributionId& against, BlockKey key,
                                  Objection& into) noexcept;

}  // namespace tessera
