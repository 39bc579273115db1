// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How contributions become one map (docs/design/theory.md has the formulas).
#pragma once

#include <cstdint>

namespace tessera {

/// How evidence goes from a voxel to its neighbours.
enum class DiffusionMode : std::uint8_t {
  kContractive = 0,  ///< Z <- B + alpha P Z: evidence stays what was observed.
  kPaper = 1,        ///< Paper eqs. 10-16: evidence grows with every iteration.
  kNone = 2,         ///< The plain sum B.
};
constexpr const char* to_string(DiffusionMode mode) noexcept {
  switch (mode) {
    case DiffusionMode::kContractive:
      return "contractive";
    case DiffusionMode::kPaper:
      return "paper";
    case DiffusionMode::kNone:
      return "none";
  }
  return "invalid";
}

/// g(j, j'): how much of k_0 an edge of the contractive diffusion keeps; a function of B alone.
enum class EdgeTerm : std::uint8_t {
  kNone = 0,        ///< 1: distance alone.
  kLabel = 1,       ///< 1 where both have the same label, else kOtherLabel.
  kSimilarity = 2,  ///< What the two distributions have in common.
  /// 1 less how surely the two are different, times less the more evidence the other has.
  kConfidence = 3,
};
constexpr const char* to_string(EdgeTerm term) noexcept {
  switch (term) {
    case EdgeTerm::kNone:
      return "none";
    case EdgeTerm::kLabel:
      return "label";
    case EdgeTerm::kSimilarity:
      return "similarity";
    case EdgeTerm::kConfidence:
      return "confidence";
  }
  return "invalid";
}

struct DiffusionConfig {
  /// Voxels that n iterations may reach together.
  static constexpr int kMostHalo = 16;
  static constexpr int kMostReach = 8;

  DiffusionMode mode = DiffusionMode::kContractive;
  EdgeTerm edge = EdgeTerm::kConfidence;
  int iterations = 4;      ///< n, 0 .. 16; paper mode: at least 1.
  float length_m = 0.2F;   ///< D of k_0 between voxels.
  float alpha = 0.98F;     ///< 0 < alpha < 1; contractive mode only.
  float omega = 1.0F;      ///< Weight of all evidence, 1e-6 .. 1000.
  float prior = 0.001F;    ///< Of the contributions, >= 0: eq. (10) counts it; paper mode only.
  bool whole_map = false;  ///< Nodes wherever there are labels, not only where robots overlap.
  /// A robot's labels count by how reliable they are (reliability.hpp); contractive mode only.
  bool weigh_robots = true;
  /// A robot and its classes that are less reliable are named, 0 .. 1.
  float reliability_alarm = 0.7F;
};

}  // namespace tessera
