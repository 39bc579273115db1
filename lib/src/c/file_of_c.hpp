// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A file through functions of the program.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

/// Outside of the library's namespace, as CallbacksOfC.
struct FileOfC {
  int32_t (*write)(void* context, const uint8_t* bytes, size_t count) = nullptr;
  size_t (*read)(void* context, uint8_t* into, size_t capacity) = nullptr;
  void* context = nullptr;

  static bool write_bytes(void* file, std::span<const std::byte> bytes) {
    const auto& to = *static_cast<const FileOfC*>(file);
    return to.write(to.context, reinterpret_cast<const std::uint8_t*>(bytes.data()),
                    bytes.size()) == 1;
  }
  static std::size_t read_bytes(void* file, std::span<std::byte> into) {
    const auto& from = *static_cast<const FileOfC*>(file);
    const std::size_t count =
        from.read(from.context, reinterpret_cast<std::uint8_t*>(into.data()), into.size());
    // What claims to have given more than there is room for has given nothing of use.
    return count <= into.size() ? count : 0;
  }
};
