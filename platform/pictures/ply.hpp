// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Voxels as binary PLY for other tools (CloudCompare, MeshLab, Blender): as points with all values,
// or as cubes.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <string>

#include "pictures/picture.hpp"

namespace tessera {

/// A voxel to export: centre in metres, map frame, with its label's estimate.
struct PlyVoxel {
  float x = 0.0F;
  float y = 0.0F;
  float z = 0.0F;
  Color color{};
  std::uint8_t label = 0;    ///< The component with the largest concentration.
  float probability = 0.0F;  ///< Of the label.
  float variance = 0.0F;     ///< Of the label.
  float evidence = 0.0F;     ///< The sum over all components.
  std::uint8_t robots = 0;   ///< Robots with a label there; 0: none, or not known.
  bool is_free = false;      ///< By now; not written.
};

/// False iff a coordinate of its centre is NaN or infinite: such a voxel is left out.
[[nodiscard]] inline bool is_finite(const PlyVoxel& voxel) {
  return std::isfinite(voxel.x) && std::isfinite(voxel.y) && std::isfinite(voxel.z);
}

enum class PlyForm {
  kPoints,  ///< One vertex per voxel, at its centre: x y z red green blue label probability
            ///< variance evidence, and robots if any voxel has some.
  kCubes,   ///< Quads: the cubes' faces that no other voxel covers, vertices x y z red green blue.
            ///< Cubes of one colour share their corners; colours are per vertex because few tools
            ///< read colours of faces.
};

/// Writes binary little-endian PLY, and replaces an earlier file only when the new one is complete.
/// Without voxels the file is valid and has no elements. resolution_m: edge of a voxel; centres lie
/// on one lattice of it. kCubes leaves out voxels more than 10^6 voxels away from the first, and
/// repeated ones. Fails with kUsage iff resolution_m is not positive, there are more corners than a
/// PLY index can number, or path cannot be written to; with kFailure iff writing fails. On
/// failure path is unchanged. O(voxels); kPoints needs no memory, kCubes about 30 bytes per voxel
/// and per corner. label_names: of label 0, 1, ..., for comments in the header; empty names are
/// skipped.
Outcome<WriteReport> write_ply(std::span<const PlyVoxel> voxels, float resolution_m,
                               const std::string& path, PlyForm form = PlyForm::kPoints,
                               std::span<const std::string> label_names = {});

}  // namespace tessera
