// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The letters of pictures: a 5 x 7 face with two rows for descenders, printable ASCII, drawn for
// this project.
#pragma once

#include <array>
#include <cstdint>

namespace tessera {

inline constexpr int kGlyphColumns = 5;
inline constexpr int kGlyphRows = 9;  ///< Seven above the base line, two below it.

/// One row a byte, from the top; bit 4 is the leftmost column.
using Glyph = std::array<std::uint8_t, kGlyphRows>;

/// The glyph of a printable ASCII character (32 .. 126), for anything else that of '?'.
[[nodiscard]] const Glyph& glyph_of(char character) noexcept;

}  // namespace tessera
