// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Text in pictures at any size: the bitmap letters are magnified with their diagonals smoothed, so
// that halving the canvas gives soft edges instead of stairs.
#pragma once

#include <string>
#include <string_view>

#include "pictures/canvas.hpp"

namespace tessera {

/// Width in pixels of the text's line, including the gap after the last letter. UTF-8 characters
/// count once. cell_px: the size of one dot of the 5 x 9 face, positive.
[[nodiscard]] int text_width(std::string_view text, float cell_px);

/// The text, with its middle replaced by "..." if its line would be wider than width_px, as the
/// ends of names are more important.
[[nodiscard]] std::string shortened(std::string_view text, int width_px, float cell_px);

/// Draws text with the top left corner of its first letter at (x, y); capitals are 7 * cell_px
/// high.
void draw_text(Canvas& canvas, PixelPoint top_left, std::string_view text, float cell_px,
               Color color);

}  // namespace tessera
