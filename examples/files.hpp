// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Map files through the C library. Tessera itself opens no files: copy this header into your
// program, or write its two functions for what your system has.
#pragma once

#include <cstdio>

#include "tessera/map/map_file.hpp"

/// Writes to an open file. A full disk may show only when the file is closed: std::fclose is part
/// of saving.
inline tessera::ByteSink to_file(std::FILE* file) {
  return {file, [](void* context, std::span<const std::byte> bytes) {
            auto* const to = static_cast<std::FILE*>(context);
            return std::fwrite(bytes.data(), 1, bytes.size(), to) == bytes.size();
          }};
}

/// Reads from an open file. A read that fails looks like the file's end: std::ferror tells.
inline tessera::ByteSource from_file(std::FILE* file) {
  return {file, [](void* context, std::span<std::byte> into) {
            return std::fread(into.data(), 1, into.size(), static_cast<std::FILE*>(context));
          }};
}
