// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "oracle/carve_image_oracle.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace tessera::oracle {

namespace {

constexpr double kHalfFace = 256.0;
constexpr int kPixels = 512;
constexpr int kPadding = 16;
constexpr int kSquare = 16;

double pixel_of(double tangent) {
  return kHalfFace * (1.0 + tangent * (1.25 - 0.25 * std::fabs(tangent)));
}

int square_of(int pixel) { return static_cast<int>(std::floor(double(pixel) / kSquare)); }

/// 2^shift pixels are one of the level.
int shift_of(int level) { return std::max(level - 1, 0); }

int texel_of(double pixel, int shift) {
  return static_cast<int>(std::floor(pixel / std::ldexp(1.0, shift)));
}

std::array<int, 2> across(int axis) {
  return axis == 0 ? std::array{1, 2} : axis == 1 ? std::array{0, 2} : std::array{0, 1};
}

Vector minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

/// What a value may be if it is off by rounding: of its whole part one or two.
std::set<int> texels_of(double pixel, int shift) {
  constexpr double kRounding = 2e-3;
  return {texel_of(pixel - kRounding, shift), texel_of(pixel + kRounding, shift)};
}

std::set<int> levels_of(double depth_voxels) {
  std::set<int> levels;
  for (const double depth : {depth_voxels * (1.0 - 1e-9), depth_voxels * (1.0 + 1e-9)}) {
    int level = 4;
    for (const double from : {16.0, 32.0, 64.0, 128.0}) level -= depth >= from ? 1 : 0;
    levels.insert(level);
  }
  return levels;
}

}  // namespace

CarveImageOracle::CarveImageOracle(const ImageRule& rule, const Vector& origin,
                                   std::span<const Vector> returns, std::span<const Vector> beyond)
    : rule_(rule), origin_(origin) {
  for (const Vector& end : returns) add(end, true);
  for (const Vector& end : beyond) add(end, false);
}

void CarveImageOracle::add(const Vector& end, bool is_hit) {
  const Vector d = minus(end, origin_);
  for (int axis = 0; axis < 3; ++axis) {
    const auto along = static_cast<std::size_t>(axis);
    const double depth_m = std::fabs(d[along]);
    if (depth_m == 0.0) continue;
    const double column = pixel_of(d[static_cast<std::size_t>(across(axis)[0])] / depth_m);
    const double row = pixel_of(d[static_cast<std::size_t>(across(axis)[1])] / depth_m);
    // Beyond the padding no return counts; far beyond it the formula turns back.
    const auto outside = [&](int k, double pixel) {
      const double tangent =
          d[static_cast<std::size_t>(across(axis)[static_cast<std::size_t>(k)])] / depth_m;
      return std::fabs(tangent) > 2.0 || pixel < -kPadding || pixel >= kPixels + kPadding;
    };
    if (outside(0, column) || outside(1, row)) continue;
    const int face = 2 * axis + (d[along] < 0.0 ? 1 : 0);
    seen_[{face, square_of(texel_of(column, 0)), square_of(texel_of(row, 0))}].push_back(
        {column, row, depth_m, is_hit});
  }
}

Freed CarveImageOracle::judge(const Vector& centre) const {
  const Vector d = minus(centre, origin_);
  const double range_m = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  if (range_m > rule_.range_m * (1.0 + 1e-9)) return Freed::kNo;
  const double longest = std::max({std::fabs(d[0]), std::fabs(d[1]), std::fabs(d[2])});
  bool all = true;
  bool any = false;
  int faces = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::fabs(d[static_cast<std::size_t>(axis)]) < longest * (1.0 - 1e-6)) continue;
    ++faces;
    const Freed freed = judge_on_face(axis, d);
    all = all && freed == Freed::kYes;
    any = any || freed != Freed::kNo;
  }
  if (!any) return Freed::kNo;
  // On an edge of the cube it is freed by either face.
  return all && faces >= 1 && range_m <= rule_.range_m * (1.0 - 1e-9) ? Freed::kYes
                                                                      : Freed::kEither;
}

Freed CarveImageOracle::judge_on_face(int axis, const Vector& d) const {
  const double along = d[static_cast<std::size_t>(axis)];
  const double depth_m = std::fabs(along);
  if (depth_m < 0.011 * rule_.resolution_m)
    return depth_m < 0.009 * rule_.resolution_m ? Freed::kNo : Freed::kEither;
  const int face = 2 * axis + (along < 0.0 ? 1 : 0);
  const double column = pixel_of(d[static_cast<std::size_t>(across(axis)[0])] / depth_m);
  const double row = pixel_of(d[static_cast<std::size_t>(across(axis)[1])] / depth_m);
  const double least_m = depth_m + rule_.margin_voxels * rule_.resolution_m;
  bool yes = false;
  bool no = false;
  for (const int level : levels_of(depth_m / rule_.resolution_m)) {
    for (const int c : texels_of(column, shift_of(level))) {
      for (const int r : texels_of(row, shift_of(level))) {
        const Freed freed = judge_texel(face, level, c, r, least_m);
        yes = yes || freed != Freed::kNo;
        no = no || freed != Freed::kYes;
      }
    }
  }
  return yes && no ? Freed::kEither : yes ? Freed::kYes : Freed::kNo;
}

Freed CarveImageOracle::judge_texel(int face, int level, int column, int row,
                                    double least_m) const {
  const int shift = shift_of(level);
  const int seen_reach = level == 0 ? 0 : 1;
  const int reach =
      std::max(seen_reach, static_cast<int>(std::ceil(std::ldexp(rule_.neighbour_pixels, -shift))));
  const double quantum_m = 1.001 * rule_.range_m / 65000.0;
  const int wide = (reach + 1) << shift;
  bool is_seen = false;
  bool is_surely_near = false;
  bool is_maybe_near = false;
  const int first_column = square_of((column << shift) - wide);
  const int last_column = square_of((column << shift) + wide + (1 << shift));
  const int first_row = square_of((row << shift) - wide);
  const int last_row = square_of((row << shift) + wide + (1 << shift));
  for (int y = first_row; y <= last_row; ++y) {
    for (int x = first_column; x <= last_column; ++x) {
      const auto square = seen_.find({face, x, y});
      if (square == seen_.end()) continue;
      for (const Seen& one : square->second) {
        const int off = std::max(std::abs(texel_of(one.column, shift) - column),
                                 std::abs(texel_of(one.row, shift) - row));
        is_seen = is_seen || off <= seen_reach;
        if (off > reach || !one.is_hit) continue;
        is_surely_near = is_surely_near || one.depth_m < least_m - quantum_m;
        is_maybe_near = is_maybe_near || one.depth_m < least_m + quantum_m;
      }
    }
  }
  if (!is_seen || is_surely_near) return Freed::kNo;
  return is_maybe_near ? Freed::kEither : Freed::kYes;
}

Freed CarveImageOracle::judge_seen(const Vector& centre, bool in_all, double margin_voxels) const {
  const Vector d = minus(centre, origin_);
  const double range_m = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  if (range_m > rule_.range_m * (1.0 + 1e-9)) return Freed::kNo;
  const double longest = std::max({std::fabs(d[0]), std::fabs(d[1]), std::fabs(d[2])});
  bool yes = false;
  bool no = range_m > rule_.range_m * (1.0 - 1e-9);
  for (int axis = 0; axis < 3; ++axis) {
    const double along = d[static_cast<std::size_t>(axis)];
    const double depth_m = std::fabs(along);
    if (depth_m < longest * (1.0 - 1e-6)) continue;
    if (depth_m < 0.011 * rule_.resolution_m) return Freed::kEither;
    const int face = 2 * axis + (along < 0.0 ? 1 : 0);
    const double column = pixel_of(d[static_cast<std::size_t>(across(axis)[0])] / depth_m);
    const double row = pixel_of(d[static_cast<std::size_t>(across(axis)[1])] / depth_m);
    for (const int c : texels_of(column, 0)) {
      for (const int r : texels_of(row, 0)) {
        const Freed seen =
            judge_pixel(face, c, r, depth_m + margin_voxels * rule_.resolution_m, in_all);
        yes = yes || seen != Freed::kNo;
        no = no || seen != Freed::kYes;
      }
    }
  }
  return yes && no ? Freed::kEither : yes ? Freed::kYes : Freed::kNo;
}

Freed CarveImageOracle::judge_pixel(int face, int column, int row, double least_m,
                                    bool in_all) const {
  const double quantum_m = 1.001 * rule_.range_m / 65000.0;
  const int below = in_all && face < 4 ? 4 : 1;
  // By pixel from the centre's, the nearest of what was met there.
  std::map<std::array<int, 2>, double> nearest_m;
  for (int y = square_of(row - below); y <= square_of(row + 1); ++y) {
    for (int x = square_of(column - 1); x <= square_of(column + 1); ++x) {
      const auto square = seen_.find({face, x, y});
      if (square == seen_.end()) continue;
      for (const Seen& one : square->second) {
        const std::array<int, 2> off{texel_of(one.column, 0) - column, texel_of(one.row, 0) - row};
        if (std::abs(off[0]) > 1 || off[1] > 1 || off[1] < -below) continue;
        const double depth_m = one.is_hit ? one.depth_m : 1e9;
        const auto [at, is_new] = nearest_m.try_emplace(off, depth_m);
        if (!is_new) at->second = std::min(at->second, depth_m);
      }
    }
  }
  double judged_m = 1e9;
  if (in_all) {
    bool is_seen = false;
    for (const auto& [off, depth_m] : nearest_m) {
      is_seen = is_seen || off[1] >= -1;
      judged_m = std::min(judged_m, depth_m);
    }
    if (!is_seen) return Freed::kNo;
  } else {
    if (nearest_m.empty()) return Freed::kNo;
    judged_m = 0.0;
    for (const auto& [off, depth_m] : nearest_m) judged_m = std::max(judged_m, depth_m);
  }
  if (judged_m < least_m - quantum_m) return Freed::kNo;
  return judged_m < least_m + quantum_m ? Freed::kEither : Freed::kYes;
}

}  // namespace tessera::oracle
