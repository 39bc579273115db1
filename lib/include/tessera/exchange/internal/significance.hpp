// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What makes a block worth saying again: voxels whose meaning, state and label as estimate() tells
// them, is another one than was published, or whose evidence has become several times as much.
#pragma once

#include <array>
#include <cstdint>

#include "tessera/map/block_content.hpp"
#include "tessera/semantics/estimate.hpp"

namespace tessera {

/// How two contents of a block differ, in voxels; a voxel counts once.
struct Difference {
  /// Of another state or label, or with label evidence in one of the two only.
  int labels = 0;
  /// Others whose label evidence has grown or shrunk by more than the factor.
  int evidence = 0;
  /// Without label evidence in either, of another state.
  int free = 0;

  /// Of voxels with label evidence.
  [[nodiscard]] constexpr int labelled() const noexcept { return labels + evidence; }
  [[nodiscard]] constexpr bool any() const noexcept { return (labels | evidence | free) != 0; }
  friend constexpr bool operator==(const Difference&, const Difference&) = default;
};

class Significance {
 public:
  /// config, num_components: those of the map. evidence_factor: above 1.
  Significance(const MapConfig& config, int num_components, float evidence_factor) noexcept;
  /// Finds nothing different.
  Significance() noexcept = default;

  /// How current differs from published; both with the map's components. Passes over 255 count as
  /// 255. O(512 + voxels with label evidence * components present).
  [[nodiscard]] Difference compare(const BlockContent& published,
                                   const BlockContent& current) const noexcept;

 private:
  struct Meaning;
  [[nodiscard]] Meaning meaning_of(const BlockContent& content, std::uint64_t components,
                                   int row) const noexcept;
  [[nodiscard]] VoxelState state_of(unsigned passes) const noexcept {
    return states_of_passes_[passes < 255U ? passes : 255U];
  }
  void compare_octet(const BlockContent& published, const BlockContent& current, int octet,
                     Difference& difference) const noexcept;

  std::array<VoxelState, 256> states_of_passes_{};  ///< Of a voxel with free evidence alone.
  int num_components_ = 0;
  float free_weight_ = 0.0F;
  double prior_ = 0.0;
  double evidence_factor_ = 1.0;
};

}  // namespace tessera
