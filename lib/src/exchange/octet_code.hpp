// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// An octet of a block's content as the codec sees it: components and levels.
#pragma once

#include <array>
#include <cstdint>

#include "tessera/exchange/internal/evidence_levels.hpp"
#include "tessera/map/block_content.hpp"

namespace tessera::detail {

/// Classes that a coded voxel can have.
inline constexpr int kCodedClasses = 3;
/// Places for levels: the classes in their order, then the evidence of no known class.
inline constexpr int kSlots = kCodedClasses + 1;
inline constexpr int kRestSlot = kCodedClasses;

/// Which components a voxel has.
struct ComponentSet {
  std::array<std::uint8_t, kCodedClasses> components{};  ///< Ascending; zeros after the last.
  std::uint8_t classes = 0;
  bool rest = false;

  [[nodiscard]] bool has(int slot) const noexcept {
    return slot == kRestSlot ? rest : slot < classes;
  }
  [[nodiscard]] bool any() const noexcept { return rest || classes != 0; }
  /// A voxel with all of these has no centroid, so that no code is longer for it.
  [[nodiscard]] bool full() const noexcept { return rest && classes == kCodedClasses; }
  friend bool operator==(const ComponentSet&, const ComponentSet&) = default;
};

struct VoxelCode {
  ComponentSet set;
  std::array<std::uint8_t, kSlots> levels{};
  Centroid centroid{};
  std::uint8_t passes = 0;  ///< A level, as the next.
};

struct OctetCode {
  std::uint8_t labelled = 0;  ///< Voxels with label evidence, a bit each.
  std::uint8_t freed = 0;     ///< Of the others, those with passes.
  std::uint8_t passes = 0;    ///< What these share.
  std::array<VoxelCode, kOctetVoxels> voxels{};
};

/// Reads an octet of quantised content, its labels or passes only where it is said to have any;
/// what is not quantised is asserted against.
void read_octet(const BlockContent& content, int octet, bool labels, bool passes,
                OctetCode& code) noexcept;
/// Adds an octet to content that has nothing there.
void add_octet(const OctetCode& code, int octet, BlockContent& content) noexcept;

}  // namespace tessera::detail
