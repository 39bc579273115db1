// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// PNG files: pictures, label images, and depth images with two bytes per pixel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "base/outcome.hpp"

namespace tessera {

/// A picture by rows from the top, without padding.
struct PixelsView {
  int width_px = 0;
  int height_px = 0;
  int bytes_per_pixel = 1;  ///< 1: grey; 3: red, green, blue.
  const void* pixels = nullptr;
};

/// The bytes of the file; the same pixels give the same bytes. Fails with kFailure iff the encoder
/// does.
Outcome<std::vector<std::byte>> encode_png(const PixelsView& picture);

/// Reads an 8-bit grey PNG of exactly that size into out, which has a byte for each of its pixels.
/// Values are as stored: no gamma, no conversion of colours to grey. Fails with kUsage, naming the
/// file and the remedy, iff it is missing, unreadable, over 64 MiB, not an intact PNG, not of 8
/// bits grey, or of another size. Heap: the file, two rows, 8 bytes per row and 96 KiB; text and
/// other chunks apart from the pixels need none, compressed or not.
Outcome<void> read_grey_png(std::string_view path, int width_px, int height_px,
                            std::span<std::uint8_t> out);

/// Kinds of grey images.
enum class GreyBits : std::uint8_t {
  kSixteen,         ///< 16 bits: depths.
  kEightOrSixteen,  ///< Ids of classes.
};
/// The same for grey PNGs with more bits; those of 8 bits are not scaled. Heap: also as many bytes
/// as out has.
Outcome<void> read_grey_png(std::string_view path, int width_px, int height_px, GreyBits bits,
                            std::span<std::uint16_t> out);

}  // namespace tessera
