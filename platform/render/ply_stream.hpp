// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Bytes of PLY files: a header line by line, numbers little-endian whatever the machine, gathered
// into large writes.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "render/target_file.hpp"

namespace tessera {

class PlyStream {
 public:
  explicit PlyStream(TargetFile& file) : file_(file) { buffer_.reserve(kFlushBytes + kSlackBytes); }
  PlyStream(const PlyStream&) = delete;
  PlyStream& operator=(const PlyStream&) = delete;
  ~PlyStream() { flush(); }

  void text(const std::string& line) { file_.write(line.data(), line.size()); }
  void put(std::uint8_t value) { buffer_.push_back(value); }
  void put(std::uint32_t value) {
    for (int shift = 0; shift < 32; shift += 8)
      put(static_cast<std::uint8_t>((value >> shift) & 0xFFU));
  }
  void put(float value) { put(std::bit_cast<std::uint32_t>(value)); }
  /// Call after each element.
  void end_element() {
    if (buffer_.size() >= kFlushBytes) flush();
  }
  void flush() {
    file_.write(buffer_.data(), buffer_.size());
    buffer_.clear();
  }

 private:
  static constexpr std::size_t kFlushBytes = 1U << 20U;
  static constexpr std::size_t kSlackBytes = 256;

  TargetFile& file_;
  std::vector<std::uint8_t> buffer_;
};

}  // namespace tessera
