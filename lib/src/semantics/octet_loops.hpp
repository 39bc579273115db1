// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Loops over the eight voxels of an octet's compact tuples, in two widths of lanes with the same
// bits.
#pragma once

#include <cstdint>

#include "tessera/base/internal/lane_width.hpp"

namespace tessera {

/// Words are as CompactTuple has them: eight in a row for each slot, the rest in the last one.
struct OctetLoops {
  static constexpr int kVoxels = 8;
  static constexpr int kSlots = 3;

  /// What becomes of the counts of all slots (LabelShares).
  struct Shares {
    std::uint32_t labels[kSlots]{};  // NOLINT(cppcoreguidelines-avoid-c-arrays): for any width
    float shares[kSlots]{};          // NOLINT(cppcoreguidelines-avoid-c-arrays)
    unsigned voxels = 0;             ///< That are shared out, a bit each.
  };

  /// Adds a plane to the slots of its component, and sets counts to what no slot took. given: gets
  /// the bits of all counts.
  void (*add_to_slots)(std::uint32_t* words, std::uint32_t component, const float* plane,
                       float quanta, std::uint32_t* counts, std::uint32_t* given) noexcept;
  void (*add_to_rests)(std::uint32_t* words, const float* plane, float quanta,
                       std::uint32_t* given) noexcept;
  /// Adds a plane, if there is one, to what the slots have together, and shares that out. No slot
  /// is of unlabelled evidence.
  void (*share_out)(std::uint32_t* words, const float* plane, float quanta, const Shares& shares,
                    std::uint32_t* given) noexcept;
  /// Whether a slot of one of the voxels is of that component.
  bool (*any_of)(const std::uint32_t* words, std::uint32_t component) noexcept;
  /// Sums of slots and rest.
  void (*sum_up)(const std::uint32_t* words, float quantum, float* sums) noexcept;
};

[[nodiscard]] const OctetLoops& octet_loops(LaneWidth lanes) noexcept;

}  // namespace tessera
