// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures/png_encoder.hpp"

#include "pictures/png_image.hpp"

namespace tessera {

// The encoder reads the pixels as packed RGB triples.
static_assert(sizeof(Color) == 3);

Outcome<std::vector<std::byte>> encode_png(const Canvas& canvas) {
  return encode_png(PixelsView{canvas.width(), canvas.height(), 3, canvas.data()});
}

}  // namespace tessera
