// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How two sketches agree where a transform puts one: surfaces on surfaces, and surfaces in the
// free space of the other.
#pragma once

#include <cstdint>

#include "tessera/frames/map_sketch.hpp"

namespace tessera {

/// Parts of surfaces of both sketches, looked up in the other one.
struct Agreement {
  /// Of what stands.
  std::uint32_t agreed = 0;        ///< A surface is there, or in a part beside it.
  std::uint32_t contradicted = 0;  ///< None is, and the part was seen to be free.
  std::uint32_t unseen = 0;        ///< The other sketch does not know.
  /// Of what is flat.
  std::uint32_t flat_agreed = 0;
  std::uint32_t flat_contradicted = 0;
  /// Surfaces with a label in both, and with the same.
  std::uint32_t labelled = 0;
  std::uint32_t same_label = 0;

  /// Of what stands and was seen by both, the share that agrees.
  [[nodiscard]] double share() const noexcept {
    const std::uint32_t seen = agreed + contradicted;
    return seen == 0 ? 0.0 : static_cast<double>(agreed) / seen;
  }
  [[nodiscard]] double flat_share() const noexcept {
    const std::uint32_t seen = flat_agreed + flat_contradicted;
    return seen == 0 ? 0.0 : static_cast<double>(flat_agreed) / seen;
  }
};

/// most_surfaces: of each sketch, evenly taken. O(32 look-ups a surface).
[[nodiscard]] Agreement check_overlap(const MapSketch& a, const MapSketch& b,
                                      const Matrix34d& T_a_b, std::uint32_t most_surfaces) noexcept;

}  // namespace tessera
