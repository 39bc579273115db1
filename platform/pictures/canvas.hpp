// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// An RGB picture in memory with a few drawing functions. Everything is drawn at twice the final
// size and halved at the end, which is the only anti-aliasing. Drawing outside of the picture is
// clipped.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tessera/semantics/class_table.hpp"

namespace tessera {

/// Pixels, origin top left, y downwards.
struct PixelRect {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

struct PixelPoint {
  float x = 0.0F;
  float y = 0.0F;
};

/// share of `over`, the rest of `under`; share in [0, 1].
[[nodiscard]] Color mix(Color under, Color over, float share) noexcept;
/// Each channel times factor (>= 0), saturating; exactly 1 returns the colour itself.
[[nodiscard]] Color scaled(Color color, float factor) noexcept;

class Canvas {
 public:
  /// width, height: pixels, positive.
  Canvas(int width, int height, Color background);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  /// x in [0, width), y in [0, height).
  [[nodiscard]] Color& at(int x, int y) { return pixels_[index(x, y)]; }
  [[nodiscard]] const Color& at(int x, int y) const { return pixels_[index(x, y)]; }
  [[nodiscard]] const Color* data() const { return pixels_.data(); }

  void fill(PixelRect rect, Color color, float opacity = 1.0F);
  /// A frame of the given thickness inside rect.
  void outline(PixelRect rect, int thickness, Color color);
  void blit(const Canvas& source, int x, int y);
  /// Half the size by averaging 2 x 2 pixels; odd last rows and columns are dropped.
  [[nodiscard]] Canvas halved() const;

 private:
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }

  int width_;
  int height_;
  std::vector<Color> pixels_;
};

}  // namespace tessera
