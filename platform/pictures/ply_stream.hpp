// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Bytes of PLY files and of tables: a header as text, then elements of numbers, little-endian on
// every machine.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "base/atomic_file.hpp"

namespace tessera {

/// The file keeps failures to write, and its commit() reports them.
class PlyStream {
 public:
  explicit PlyStream(AtomicFile& file) : file_(file) {}

  void text(const std::string& lines) { file_.write(std::as_bytes(std::span(lines))); }
  void put(std::uint8_t value) { element_.at(bytes_++) = std::byte{value}; }
  void put(std::uint32_t value) {
    for (unsigned shift = 0; shift < 32; shift += 8)
      put(static_cast<std::uint8_t>((value >> shift) & 0xFFU));
  }
  void put(float value) { put(std::bit_cast<std::uint32_t>(value)); }
  /// Call after each element, which is at most kElementBytes long.
  void end_element() {
    file_.write(std::span(element_).first(bytes_));
    bytes_ = 0;
  }

 private:
  static constexpr std::size_t kElementBytes = 320;  ///< A row with the counts of 64 components.

  AtomicFile& file_;
  std::array<std::byte, kElementBytes> element_{};
  std::size_t bytes_ = 0;
};

}  // namespace tessera
