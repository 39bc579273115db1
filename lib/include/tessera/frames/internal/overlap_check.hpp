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
  /// The other sketch does not know, or has it as seen from the opposite side: as two rooms back to
  /// back have the wall between them, which tells nothing of one place.
  std::uint32_t unseen = 0;
  /// Of what is flat.
  std::uint32_t flat_agreed = 0;
  std::uint32_t flat_contradicted = 0;
  /// Surfaces with a label in both, and with the same.
  std::uint32_t labelled = 0;
  std::uint32_t same_label = 0;

  /// What a sample that contradicts weighs against one that agrees: the ratio of the logarithms of
  /// how much rarer (0.03 for 0.25) and how much more frequent (0.97 for 0.75) they are where a
  /// frame is right.
  static constexpr double kVeto = 8.0;
  /// Samples of what stands that agree, less those that contradict at their weight.
  [[nodiscard]] double support() const noexcept {
    return static_cast<double>(agreed) - kVeto * static_cast<double>(contradicted);
  }
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

/// Counts in pieces.
class OverlapCheck {
 public:
  /// most_surfaces: of each sketch, evenly taken.
  void begin(const MapSketch& a, const MapSketch& b, const Matrix34d& T_a_b,
             std::uint32_t most_surfaces) noexcept;
  /// Counts so many more surfaces. True iff all are counted. O(surfaces) times 113 look-ups.
  bool count(std::uint32_t surfaces) noexcept;
  [[nodiscard]] const Agreement& agreement() const noexcept { return sums_; }

 private:
  const MapSketch* a_ = nullptr;
  const MapSketch* b_ = nullptr;
  Matrix34d T_a_b_ = Matrix34d(Matrix34d::Identity());
  Matrix34d T_b_a_ = Matrix34d(Matrix34d::Identity());
  Agreement sums_;
  std::uint32_t most_surfaces_ = 1;
  std::uint32_t next_ = 0;
  bool is_second_ = false;  ///< Those of a, after those of b.
};

/// All at once.
[[nodiscard]] Agreement check_overlap(const MapSketch& a, const MapSketch& b,
                                      const Matrix34d& T_a_b, std::uint32_t most_surfaces) noexcept;

}  // namespace tessera
