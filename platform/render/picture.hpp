// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Pictures of maps for people: what to draw, how, and the one call that writes a PNG. Knows plain
// coloured voxels, not maps, so that anything that has voxels can be looked at. The same input
// gives the same bytes.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "posix/outcome.hpp"
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
  static constexpr int kMinWidthPx = 600;  ///< Less has no room for the lettering.
  static constexpr int kMaxWidthPx = 6000;

  int width_px = 1600;  ///< Of the whole picture; its height follows from the content.
  View view = View::kBoth;
  std::string title;                     ///< One line above the views; empty for none.
  std::string empty_note = "empty map";  ///< What a picture without voxels says.
  std::vector<LegendEntry> legend;       ///< Entries whose colour no voxel has are left out.
  /// Top view: what is higher above the ground than this (crowns, roofs) is drawn translucently
  /// over what is below it; metres, +infinity to draw everything solid.
  float translucent_above_m = 3.0F;
};

struct WriteReport {
  std::uint64_t voxels = 0;  ///< Written, or within each view of the picture.
  /// Not written: a coordinate that is not finite, or too far away to be meant. Not in each view of
  /// a picture: also stray voxels, so far from the rest that showing them would shrink it.
  std::uint64_t left_out = 0;
};

/// Draws the voxels and writes a PNG to path, replacing what was there only when the picture is
/// complete. The views show all voxels but stray ones, and their captions count those.
/// resolution_m: edge of a voxel. No drawable voxel at all gives a picture that says "empty map".
/// Fails with kUsage iff resolution_m or width_px is outside its range or path
/// cannot be written to; with kFailure iff writing breaks off (disk full). On failure path is as it
/// was. O(voxels + pixels); memory some 40 bytes for each pixel of the picture beside the voxels.
Outcome<WriteReport> write_png(std::span<const RenderVoxel> voxels, float resolution_m,
                               const ImageOptions& options, const std::string& path);

}  // namespace tessera
