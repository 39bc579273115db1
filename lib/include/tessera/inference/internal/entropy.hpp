// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The multi-entropy policy: from which points a unit's voxels learn, and with which kernel length.
// A pure function of one unit's sample and of which face neighbours hold points. Formulas: spec
// section 2, from the reference implementation of the paper's eq. 6, for which the paper gives
// none.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "tessera/inference/inference_config.hpp"
#include "tessera/inference/internal/scan_tiles.hpp"

namespace tessera {

/// E_c = (1 - n_max / n) (1 + (m - 1) / (N - 1)^2) of n labelled points in m classes, n_max in the
/// commonest; N = C + 1. 0 without labelled points. From 0 (one class) to 1 (uniform over N).
[[nodiscard]] float class_entropy(std::uint32_t n, std::uint32_t n_max, std::uint32_t m,
                                  int num_classes) noexcept;

/// Fills class_entropy and label of every unit. O(points + classes seen).
void measure_units(ScanTiles& tiles, int num_classes) noexcept;

/// What a unit's voxels learn from.
struct EntropyDecision {
  float length_voxels = 0.0F;  ///< D_m; 0: nothing is learnt.
  bool own = false;
  bool neighbours = false;  ///< The points of all six face neighbours.
};

/// own: the unit's sample, or null if it holds no point. faces: the face neighbours' samples, null
/// where there are none.
[[nodiscard]] EntropyDecision decide(const EntropyConfig& config, const UnitSample* own,
                                     const std::array<const UnitSample*, 6>& faces) noexcept;

}  // namespace tessera
