// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Voxels coloured by their height: what a map without labels has to show.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "pictures/picture.hpp"
#include "pictures/ply.hpp"

namespace tessera {

/// From low to high, evenly lighter, for every kind of colour vision.
inline constexpr std::array<Color, 8> kColorScale{
    Color{68, 1, 84},    Color{70, 50, 127},  Color{54, 92, 141},  Color{39, 127, 142},
    Color{31, 161, 135}, Color{74, 194, 109}, Color{159, 218, 58}, Color{253, 231, 37}};

/// Eight equal steps of height. The same for all voxels of an export.
struct HeightScale {
  float low_m = 0.0F;
  float step_m = 1.0F;
};

/// Between the heights that 2 % are below and above. heights_m: of all voxels. O(voxels).
[[nodiscard]] HeightScale scale_of(std::vector<float> heights_m);

/// What colours show, the same for all voxels of an export, whatever parts it is written in.
struct Coloring {
  std::string show;
  HeightScale heights{};  ///< If height is shown.
};

/// Chooses it from all voxels, before the first is coloured.
class ColoringChoice {
 public:
  /// show: the layer; empty: class, or height if no voxel has a label.
  explicit ColoringChoice(std::optional<std::string> show) : show_(std::move(show)) {}
  void add(float z_m, int label);
  [[nodiscard]] Coloring take();

 private:
  std::optional<std::string> show_;
  std::vector<float> heights_m_;  ///< While height may be shown.
};

/// Returns the legend; without voxels there is none. O(voxels).
[[nodiscard]] std::vector<LegendEntry> color_by_height(const HeightScale& scale,
                                                       std::span<PlyVoxel> voxels);

}  // namespace tessera
