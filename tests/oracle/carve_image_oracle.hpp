// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Carving by the image of a scan, by its definition (docs/design/theory.md): each voxel against all
// returns in its windows, in double precision and without any image.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "oracle/carving_oracle.hpp"

namespace tessera::oracle {

struct ImageRule {
  double resolution_m = 0.1;
  double range_m = 40.0;
  double margin_voxels = 2.0;
  int neighbour_pixels = 3;
};

enum class Freed { kNo, kYes, kEither };  ///< kEither: within rounding of a border.

class CarveImageOracle {
 public:
  /// returns: hits within the range; beyond: directions in which nothing was met up to it.
  CarveImageOracle(const ImageRule& rule, const Vector& origin, std::span<const Vector> returns,
                   std::span<const Vector> beyond);
  /// Of the voxel whose centre is there; hits of the scan in it are not looked at.
  [[nodiscard]] Freed judge(const Vector& centre) const;
  /// Whether the scan saw through a voxel: in some pixel around its centre, or in all of the
  /// window.
  [[nodiscard]] Freed judge_seen(const Vector& centre, bool in_all, double margin_voxels) const;

 private:
  struct Seen {
    double column = 0.0;
    double row = 0.0;
    double depth_m = 0.0;
    bool is_hit = false;
  };
  void add(const Vector& end, bool is_hit);
  [[nodiscard]] Freed judge_on_face(int axis, const Vector& d) const;
  [[nodiscard]] Freed judge_pixel(int face, int column, int row, double least_m, bool in_all) const;
  [[nodiscard]] Freed judge_texel(int face, int level, int column, int row, double least_m) const;

  ImageRule rule_;
  Vector origin_;
  /// By face and squares of 16 pixels.
  std::map<std::array<int, 3>, std::vector<Seen>> seen_;
};

}  // namespace tessera::oracle
