// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where the columns of one sketch fit those of another, over all turns about the vertical and all
// shifts within reach: the sum of how well columns go together, for each shift exactly.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "tessera/frames/internal/columns.hpp"

namespace tessera {

/// A turn and shift that fit well, between levelled frames: p_a = R_z(yaw) p_b + (x, y).
struct Candidate {
  double cosine = 1.0;
  double sine = 0.0;
  double x_m = 0.0;
  double y_m = 0.0;
  int yaw_step = 0;
  std::int32_t score = 0;
};

class YawSearch {
 public:
  static constexpr int kYaws = 180;  ///< Two degrees apart.
  static constexpr int kMostShifts = 192;
  static constexpr std::size_t kMostFeatures = 1'024;
  static constexpr std::size_t kMostCandidates = 48;

  [[nodiscard]] static constexpr std::size_t required_bytes() noexcept {
    return 2 * arena_bytes<std::int16_t>(kImage) + arena_bytes<std::int16_t>(kSums) +
           arena_bytes<Feature>(kMostFeatures);
  }
  [[nodiscard]] static Result<YawSearch> make(Arena& arena) noexcept;
  /// The same in place, with little stack. The place may hold anything if it fails.
  [[nodiscard]] static Status make_at(YawSearch& place, Arena& arena) noexcept;
  YawSearch() noexcept = default;

  /// Takes the columns of the sketch that is moved. O(columns).
  void take_moved(const Columns& columns) noexcept;
  /// Takes those of the one that stays. reach_m: shifts that are tried, on each axis both ways.
  void take_fixed(const Columns& columns, double reach_m) noexcept;
  /// Tries all shifts about a candidate's at its turn, and keeps the best. O(features shifts).
  void try_heading(const Candidate& around) noexcept;
  /// The cosine and sine of a step.
  [[nodiscard]] static std::array<double, 2> direction(int step) noexcept;
  /// The best so far, best first. No two are within two steps and two columns of each other.
  [[nodiscard]] std::span<const Candidate> candidates() const noexcept {
    return std::span(candidates_).first(candidate_count_);
  }
  [[nodiscard]] std::size_t feature_count() const noexcept { return feature_count_; }

 private:
  struct Feature {
    float x_m = 0.0F;
    float y_m = 0.0F;
    bool is_tall = false;
  };
  static constexpr int kPadded = Columns::kEdge;
  static constexpr std::size_t kImage = std::size_t{kPadded} * kPadded;
  static constexpr std::size_t kSums = std::size_t{kMostShifts} * kMostShifts;

  /// Takes one of 2^levels columns that stand. False iff they are too many.
  [[nodiscard]] bool gather(const Columns& columns, unsigned levels) noexcept;
  /// first: of all shifts at its turn the first one.
  void add_feature(const Feature& feature, const Candidate& first) noexcept;
  void keep_peaks(const Candidate& first) noexcept;
  void keep(const Candidate& candidate) noexcept;

  std::span<std::int16_t> tall_;
  std::span<std::int16_t> low_;
  std::span<std::int16_t> sums_;
  std::span<Feature> features_;
  std::size_t feature_count_ = 0;
  int shifts_ = 0;
  double width_m_ = 0.8;
  std::array<Candidate, kMostCandidates> candidates_{};
  std::size_t candidate_count_ = 0;
};

}  // namespace tessera
