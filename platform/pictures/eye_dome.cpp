// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures/eye_dome.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace tessera {
namespace {

struct Ring {
  int reach_px;
  float strength;
};

// A fine ring for outlines, a wide one for the darkness around objects; canvas pixels.
constexpr std::array<Ring, 2> kRings = {{{2, 26.0F}, {7, 14.0F}}};
constexpr std::array<std::array<int, 2>, 4> kAxes = {{{1, 0}, {1, 1}, {0, 1}, {-1, 1}}};
/// Larger relative depth steps are one object in front of another; their size does not matter.
constexpr float kLargestStep = 0.04F;
/// The perspective bends even planes by less than this.
constexpr float kFlat = 1.0e-4F;
constexpr float kDarkest = 0.35F;

/// Depth of a pixel behind its surroundings. Neighbours are taken in opposite pairs: on a
/// plane, however tilted, one is nearer by as much as the other is farther, so planes keep their
/// colour.
class DepthPicture {
 public:
  DepthPicture(const std::vector<float>& depth_m, int width, int height)
      : depth_m_(depth_m), width_(width), height_(height) {}

  /// kNoDepth outside of the picture.
  [[nodiscard]] float at(int x, int y) const {
    if (x < 0 || y < 0 || x >= width_ || y >= height_) return kNoDepth;
    return depth_m_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                    static_cast<std::size_t>(x)];
  }
  [[nodiscard]] float recess(int x, int y, int reach_px) const {
    const float here = at(x, y);
    float sum = 0.0F;
    for (const auto& axis : kAxes) {
      const float before = at(x + reach_px * axis[0], y + reach_px * axis[1]);
      const float behind = at(x - reach_px * axis[0], y - reach_px * axis[1]);
      if (before == kNoDepth || behind == kNoDepth) continue;
      sum += std::clamp((2.0F * here - before - behind) / here - kFlat, 0.0F, kLargestStep);
    }
    return sum / 8.0F;
  }

 private:
  const std::vector<float>& depth_m_;
  int width_;
  int height_;
};

}  // namespace

void apply_eye_dome(Canvas& canvas, const std::vector<float>& depth_m) {
  const DepthPicture depths(depth_m, canvas.width(), canvas.height());
  for (int y = 0; y < canvas.height(); ++y) {
    for (int x = 0; x < canvas.width(); ++x) {
      if (depths.at(x, y) == kNoDepth) continue;
      float darkening = 0.0F;
      for (const Ring& ring : kRings) {
        darkening += ring.strength * depths.recess(x, y, ring.reach_px);
      }
      canvas.at(x, y) = scaled(canvas.at(x, y), std::max(std::exp(-darkening), kDarkest));
    }
  }
}

}  // namespace tessera
