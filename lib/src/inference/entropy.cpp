// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/entropy.hpp"

#include <bit>

#include "tessera/base/internal/bits.hpp"

namespace tessera {

float class_entropy(std::uint32_t n, std::uint32_t n_max, std::uint32_t m,
                    int num_classes) noexcept {
  if (n == 0) return 0.0F;
  const double outcomes = num_classes;  // N - 1 with N = C + 1: free is an outcome too
  const double share = static_cast<double>(n_max) / static_cast<double>(n);
  return static_cast<float>((1.0 - share) *
                            (1.0 + (static_cast<double>(m) - 1.0) / (outcomes * outcomes)));
}

void measure_units(ScanTiles& tiles, int num_classes) noexcept {
  std::array<std::uint32_t, kMaxComponents> count{};
  for (UnitSample& unit : tiles.units()) {
    std::uint64_t seen = 0;
    std::uint32_t labelled = 0;
    for (std::uint32_t i = unit.begin; i < unit.end; ++i) {
      const std::uint8_t component = tiles.points()[i].component;
      if (component > num_classes) continue;  // unlabelled
      seen |= std::uint64_t{1} << component;
      ++count[component];
      ++labelled;
    }
    std::uint32_t most = 0;
    for (std::uint64_t rest = seen; rest != 0; rest &= rest - 1) {
      std::uint32_t& here = count[static_cast<std::size_t>(std::countr_zero(rest))];
      if (here > most) most = here;
      here = 0;
    }
    const int classes = count_ones(seen);
    unit.class_entropy =
        class_entropy(labelled, most, static_cast<std::uint32_t>(classes), num_classes);
    unit.label = classes == 0   ? UnitSample::kNoLabel
                 : classes == 1 ? static_cast<std::uint8_t>(std::countr_zero(seen))
                                : UnitSample::kMixed;
  }
}

EntropyDecision decide(const EntropyConfig& config, const UnitSample* own,
                       const std::array<const UnitSample*, 6>& faces) noexcept {
  if (own != nullptr) {
    return {.length_voxels = config.base_length + config.entropy_length * own->class_entropy,
            .own = true,
            .neighbours = own->class_entropy > config.smooth_above};
  }
  int with_points = 0;
  bool agree = true;
  std::uint8_t label = UnitSample::kNoLabel;
  for (const UnitSample* const face : faces) {
    if (face == nullptr) continue;
    ++with_points;
    if (face->label == UnitSample::kNoLabel) continue;
    agree = agree && face->label != UnitSample::kMixed &&
            (label == UnitSample::kNoLabel || label == face->label);
    label = face->label;
  }
  if (with_points < config.fill_neighbours || (config.fill_one_label && !agree)) return {};
  return {.length_voxels = config.fill_length, .own = false, .neighbours = true};
}

}  // namespace tessera
