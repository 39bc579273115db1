// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "render/png_encoder.hpp"

#include <png.h>

#include <string>

namespace tessera {

// The encoder reads the pixels as packed RGB triples.
static_assert(sizeof(Color) == 3);

Outcome<std::vector<std::byte>> encode_png(const Canvas& canvas) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(canvas.width());
  image.height = static_cast<png_uint_32>(canvas.height());
  image.format = PNG_FORMAT_RGB;
  std::vector<std::byte> bytes(PNG_IMAGE_PNG_SIZE_MAX(image));
  png_alloc_size_t count = bytes.size();
  const int encoded =
      png_image_write_to_memory(&image, bytes.data(), &count, 0, canvas.data(), 0, nullptr);
  const std::string reason = static_cast<const char*>(image.message);
  png_image_free(&image);
  if (encoded == 0) return Failure{"cannot encode the picture: " + reason, FailureKind::kFailure};
  bytes.resize(count);
  return bytes;
}

}  // namespace tessera
