// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The highest voxel over each square of ground, and shading that makes relief visible from above.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "pictures/framing.hpp"

namespace tessera {

/// Square cells over a rectangle of the map's x-y plane, rows along y.
struct HeightField {
  static constexpr float kNone =
      std::numeric_limits<float>::lowest();  ///< The height of an empty cell.

  /// Covers [x_m.low, x_m.high] x [y_m.low, y_m.high], all cells empty.
  HeightField(Interval x_m, Interval y_m, float cell_m);

  [[nodiscard]] bool contains(int column, int row) const {
    return column >= 0 && row >= 0 && column < columns && row < rows;
  }
  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
  /// kNone outside of the field.
  [[nodiscard]] float height_at(int column, int row) const {
    return contains(column, row) ? height_m[index(column, row)] : kNone;
  }
  /// The column of x and the row of y; may be outside of the field.
  [[nodiscard]] int column_of(float x) const;
  [[nodiscard]] int row_of(float y) const;
  /// Takes the voxel if it is the highest of its cell so far.
  void raise(const RenderVoxel& voxel);

  float x_low_m;
  float y_low_m;
  float cell_m;
  int columns;
  int rows;
  std::vector<float> height_m;  ///< Of the voxels' centres.
  std::vector<Color> color;
};

/// One of the eight ways to a neighbouring cell.
struct CellStep {
  int column;
  int row;
};

/// True if something towards the light, at most 6 m away, hides the sun from a point of height_m in
/// the cell. slack_m: smaller differences cast no shadow.
[[nodiscard]] bool in_shadow(const HeightField& field, CellStep cell, float height_m,
                             CellStep to_light, float slack_m);

/// The ground's height in cells of some metres: the lowest voxels, made robust by the median over
/// neighbouring cells.
[[nodiscard]] HeightField ground_heights(const Scene& scene, Interval x_m, Interval y_m);

/// Replaces each colour by its shaded one: darker where neighbours are higher or cast a shadow
/// (light from the upper left: towards smaller x and larger y), lighter on slopes that face the
/// light. Even ground keeps its colour exactly. step_m: differences up to this are the lattice's
/// steps and not relief. turned: the picture shows +y to the right.
void shade_relief(HeightField& field, float step_m, bool turned);

}  // namespace tessera
