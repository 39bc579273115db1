// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Pictures of maps: options, and the call that writes a PNG. Takes coloured voxels, not maps, so
// that any voxels can be drawn. The same input gives the same bytes.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "tessera/semantics/class_table.hpp"

namespace tessera {

/// A voxel to draw: its centre in metres, map frame, and its colour. Centres lie on one lattice of
/// the resolution.
struct RenderVoxel {
  float x = 0.0F;
  float y = 0.0F;
  float z = 0.0F;
  Color color{};
};

struct LegendEntry {
  std::string name;  ///< ASCII; other characters are drawn as '?'.
  Color color{};
};

enum class View { kTop, kOblique, kBoth };

struct ImageOptions {
  static constexpr int kMinWidthPx = 600;  ///< Smaller pictures have no room for text.
  static constexpr int kMaxWidthPx = 6000;

  int width_px = 1600;  ///< Of the whole picture; its height follows from the content.
  View view = View::kBoth;
  std::string title;                     ///< One line above the views; empty for none.
  std::string empty_note = "empty map";  ///< Text of a picture without voxels.
  std::vector<LegendEntry> legend;       ///< Entries without a voxel of their colour are left out.
  /// Top view: voxels higher above the ground than this (crowns, roofs) are drawn translucently
  /// over those below; metres, +infinity to draw everything solid.
  float translucent_above_m = 3.0F;
};

struct WriteReport {
  std::uint64_t voxels = 0;  ///< Written, or within each view of the picture.
  /// Not written: coordinates that are not finite or implausibly far away. Not in each view of a
  /// picture: also stray voxels, so far from the rest that showing them would shrink it.
  std::uint64_t left_out = 0;
};

/// Draws the voxels and writes a PNG to path, and replaces an earlier file only when the picture is
/// complete. The views show all voxels except stray ones, whose number is in the captions.
/// resolution_m: edge of a voxel. Without a drawable voxel the picture has the text "empty map".
/// Fails with kUsage iff resolution_m or width_px is outside its range or path
/// cannot be written to; with kFailure iff writing fails (disk full). On failure path is unchanged.
/// O(voxels + pixels); memory about 40 bytes for each pixel of the picture, apart from the voxels.
Outcome<WriteReport> write_png(std::span<const RenderVoxel> voxels, float resolution_m,
                               const ImageOptions& options, const std::string& path);

}  // namespace tessera
