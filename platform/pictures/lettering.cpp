// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures/lettering.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "pictures/bitmap_font.hpp"

namespace tessera {
namespace {

constexpr int kMagnification = 8;
constexpr int kMaskColumns = kGlyphColumns * kMagnification;
constexpr int kMaskRows = kGlyphRows * kMagnification;
constexpr float kAdvanceCells = 6.0F;

/// A black-and-white picture of one letter while it is magnified.
struct Mask {
  int columns = 0;
  int rows = 0;
  std::array<bool, static_cast<std::size_t>(kMaskColumns) * kMaskRows> ink{};

  [[nodiscard]] bool at(int column, int row) const {
    if (column < 0 || row < 0 || column >= columns || row >= rows) return false;
    return ink[static_cast<std::size_t>(row * columns + column)];
  }
  void set(int column, int row, bool value) {
    ink[static_cast<std::size_t>(row * columns + column)] = value;
  }
};

Mask mask_of(const Glyph& glyph) {
  Mask mask;
  mask.columns = kGlyphColumns;
  mask.rows = kGlyphRows;
  for (int row = 0; row < kGlyphRows; ++row) {
    const int bits = glyph[static_cast<std::size_t>(row)];
    for (int column = 0; column < kGlyphColumns; ++column) {
      mask.set(column, row, ((bits >> (kGlyphColumns - 1 - column)) & 1) != 0);
    }
  }
  return mask;
}

/// Doubles the size. A quarter of a dot takes the value of its two outer neighbours if these are
/// equal and differ from the opposite ones: that turns stairs into slopes and keeps corners.
Mask doubled(const Mask& mask) {
  Mask result;
  result.columns = 2 * mask.columns;
  result.rows = 2 * mask.rows;
  for (int row = 0; row < mask.rows; ++row) {
    for (int column = 0; column < mask.columns; ++column) {
      const bool self = mask.at(column, row);
      const bool above = mask.at(column, row - 1);
      const bool below = mask.at(column, row + 1);
      const bool left = mask.at(column - 1, row);
      const bool right = mask.at(column + 1, row);
      const bool sloped = above != below && left != right;
      result.set(2 * column, 2 * row, sloped && left == above ? left : self);
      result.set(2 * column + 1, 2 * row, sloped && right == above ? right : self);
      result.set(2 * column, 2 * row + 1, sloped && left == below ? left : self);
      result.set(2 * column + 1, 2 * row + 1, sloped && right == below ? right : self);
    }
  }
  return result;
}

void draw_glyph(Canvas& canvas, PixelPoint top_left, char character, float cell_px, Color color) {
  const Mask mask = doubled(doubled(doubled(mask_of(glyph_of(character)))));
  const int x0 = static_cast<int>(std::lround(top_left.x));
  const int y0 = static_cast<int>(std::lround(top_left.y));
  const int columns = static_cast<int>(std::ceil(cell_px * static_cast<float>(kGlyphColumns)));
  const int rows = static_cast<int>(std::ceil(cell_px * static_cast<float>(kGlyphRows)));
  const float step = static_cast<float>(kMagnification) / cell_px;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const int mask_column = static_cast<int>((static_cast<float>(column) + 0.5F) * step);
      const int mask_row = static_cast<int>((static_cast<float>(row) + 0.5F) * step);
      const int x = x0 + column;
      const int y = y0 + row;
      if (x < 0 || y < 0 || x >= canvas.width() || y >= canvas.height()) continue;
      if (mask.at(mask_column, mask_row)) canvas.at(x, y) = color;
    }
  }
}

bool is_continuation_byte(char character) {
  return (static_cast<unsigned char>(character) & 0xC0U) == 0x80U;
}

std::size_t next_character(std::string_view text, std::size_t at) {
  do ++at;
  while (at < text.size() && is_continuation_byte(text[at]));
  return at;
}

std::size_t previous_character(std::string_view text, std::size_t at) {
  do --at;
  while (at > 0 && is_continuation_byte(text[at]));
  return at;
}

}  // namespace

int text_width(std::string_view text, float cell_px) {
  int characters = 0;
  for (const char character : text) characters += is_continuation_byte(character) ? 0 : 1;
  return static_cast<int>(std::ceil(static_cast<float>(characters) * kAdvanceCells * cell_px));
}

std::string shortened(std::string_view text, int width_px, float cell_px) {
  std::string whole(text);
  if (text_width(text, cell_px) <= width_px) return whole;
  constexpr std::string_view kGap = "...";
  const auto fits = static_cast<int>(static_cast<float>(width_px) / (kAdvanceCells * cell_px));
  const int kept = std::max(0, fits - static_cast<int>(kGap.size()));
  std::size_t head = 0;
  for (int left = kept - kept / 2; left > 0; --left) head = next_character(text, head);
  std::size_t tail = text.size();
  for (int left = kept / 2; left > 0; --left) tail = previous_character(text, tail);
  return whole.replace(head, tail - head, kGap);
}

void draw_text(Canvas& canvas, PixelPoint top_left, std::string_view text, float cell_px,
               Color color) {
  float x = top_left.x;
  for (const char character : text) {
    if (is_continuation_byte(character)) continue;
    draw_glyph(canvas, {x, top_left.y}, character, cell_px, color);
    x += kAdvanceCells * cell_px;
  }
}

}  // namespace tessera
