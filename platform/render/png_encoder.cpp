// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "render/png_encoder.hpp"

#include <png.h>

#include <string>

namespace tessera {

// The encoder reads the pixels as packed RGB triples.
static_assert(sizeof(Color) == 3);

Outcome<void> encode_png(const Canvas& canvas, TargetFile& file) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(canvas.width());
  image.height = static_cast<png_uint_32>(canvas.height());
  image.format = PNG_FORMAT_RGB;
  const int written = png_image_write_to_stdio(&image, file.stream(), 0, canvas.data(), 0, nullptr);
  const std::string reason = static_cast<const char*>(image.message);
  png_image_free(&image);
  if (written == 0) {
    return Failure{"cannot encode the picture: " + reason + "; is the disk full?",
                   FailureKind::kFailure};
  }
  return {};
}

}  // namespace tessera
