// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures/canvas.hpp"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

std::uint8_t to_channel(float value) {
  return static_cast<std::uint8_t>(std::clamp(value + 0.5F, 0.0F, 255.0F));
}

}  // namespace

Color mix(Color under, Color over, float share) noexcept {
  const auto channel = [share](std::uint8_t a, std::uint8_t b) {
    return to_channel(static_cast<float>(a) * (1.0F - share) + static_cast<float>(b) * share);
  };
  return {channel(under.r, over.r), channel(under.g, over.g), channel(under.b, over.b)};
}

Color scaled(Color color, float factor) noexcept {
  return {to_channel(static_cast<float>(color.r) * factor),
          to_channel(static_cast<float>(color.g) * factor),
          to_channel(static_cast<float>(color.b) * factor)};
}

Canvas::Canvas(int width, int height, Color background)
    : width_(width),
      height_(height),
      pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), background) {}

void Canvas::fill(PixelRect rect, Color color, float opacity) {
  const int x_end = std::min(rect.x + rect.width, width_);
  const int y_end = std::min(rect.y + rect.height, height_);
  for (int y = std::max(rect.y, 0); y < y_end; ++y) {
    for (int x = std::max(rect.x, 0); x < x_end; ++x) {
      at(x, y) = opacity >= 1.0F ? color : mix(at(x, y), color, opacity);
    }
  }
}

void Canvas::outline(PixelRect rect, int thickness, Color color) {
  fill({rect.x, rect.y, rect.width, thickness}, color);
  fill({rect.x, rect.y + rect.height - thickness, rect.width, thickness}, color);
  fill({rect.x, rect.y, thickness, rect.height}, color);
  fill({rect.x + rect.width - thickness, rect.y, thickness, rect.height}, color);
}

void Canvas::blit(const Canvas& source, int x, int y) {
  const int x_begin = std::max(0, -x);
  const int x_end = std::min(source.width_, width_ - x);
  const int y_begin = std::max(0, -y);
  const int y_end = std::min(source.height_, height_ - y);
  for (int row = y_begin; row < y_end; ++row) {
    for (int column = x_begin; column < x_end; ++column) {
      at(x + column, y + row) = source.at(column, row);
    }
  }
}

Canvas Canvas::halved() const {
  Canvas half(width_ / 2, height_ / 2, Color{});
  for (int y = 0; y < half.height_; ++y) {
    for (int x = 0; x < half.width_; ++x) {
      const Color a = at(2 * x, 2 * y);
      const Color b = at(2 * x + 1, 2 * y);
      const Color c = at(2 * x, 2 * y + 1);
      const Color d = at(2 * x + 1, 2 * y + 1);
      half.at(x, y) = {static_cast<std::uint8_t>((a.r + b.r + c.r + d.r + 2) / 4),
                       static_cast<std::uint8_t>((a.g + b.g + c.g + d.g + 2) / 4),
                       static_cast<std::uint8_t>((a.b + b.b + c.b + d.b + 2) / 4)};
    }
  }
  return half;
}

}  // namespace tessera
