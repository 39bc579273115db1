// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/height_layer.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace tessera {

namespace {

constexpr auto kColorSteps = static_cast<float>(kColorScale.size());

/// The height that this share of the voxels is below.
float height_at(std::vector<float>& heights_m, double share) {
  const auto at = heights_m.begin() +
                  static_cast<std::ptrdiff_t>(share * static_cast<double>(heights_m.size() - 1));
  std::nth_element(heights_m.begin(), at, heights_m.end());
  return *at;
}

}  // namespace

HeightScale scale_of(std::vector<float> heights_m) {
  if (heights_m.empty()) return {};
  const float low_m = height_at(heights_m, 0.02);
  const float high_m = height_at(heights_m, 0.98);
  return {low_m, high_m > low_m ? (high_m - low_m) / kColorSteps : 1.0F};
}

void ColoringChoice::add(float z_m, int label) {
  if (!show_ && label != 0) {
    show_ = "class";
    heights_m_ = {};
  }
  if (!show_ || *show_ == "height") heights_m_.push_back(z_m);
}

Coloring ColoringChoice::take() {
  // Of a map without labels class would show one grey, which tells nothing.
  return {show_.value_or("height"), scale_of(std::move(heights_m_))};
}

std::vector<LegendEntry> color_by_height(const HeightScale& scale, std::span<PlyVoxel> voxels) {
  if (voxels.empty()) return {};
  for (PlyVoxel& voxel : voxels) {
    const float step = std::floor((voxel.z - scale.low_m) / scale.step_m);
    voxel.color = kColorScale[static_cast<std::size_t>(std::clamp(step, 0.0F, kColorSteps - 1.0F))];
  }
  std::vector<LegendEntry> legend;
  for (std::size_t step = 0; step < kColorScale.size(); ++step) {
    const float from_m = scale.low_m + static_cast<float>(step) * scale.step_m;
    legend.push_back({step == 0 ? fmt::format("height under {:.1f} m", from_m + scale.step_m)
                      : step + 1 == kColorScale.size()
                          ? fmt::format("over {:.1f} m", from_m)
                          : fmt::format("{:.1f} to {:.1f} m", from_m, from_m + scale.step_m),
                      kColorScale[step]});
  }
  return legend;
}

}  // namespace tessera
