// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Reads a regular file into the caller's memory: never more than the caller's span, and without the
// heap unless it fails and makes a message.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "base/file_descriptor.hpp"
#include "base/outcome.hpp"

namespace tessera {

class InputFile {
 public:
  static constexpr std::size_t kMaxPathBytes = 4096;  ///< With the final zero, as in Linux.

  /// Fails with kUsage iff path is too long, missing, unreadable, or not a regular file.
  static Outcome<InputFile> open(std::string_view path);

  /// For who reads at places of its own.
  [[nodiscard]] int descriptor() const noexcept { return file_.get(); }
  /// Bytes in the file when it was opened.
  [[nodiscard]] std::uint64_t size_bytes() const noexcept { return size_bytes_; }
  [[nodiscard]] std::string_view path() const noexcept { return {path_.data(), path_bytes_}; }

  /// Continues where the last read ended and fills the span as far as the file goes. The value is
  /// the number of bytes read; fewer than requested: the file ends there. Fails with kFailure iff
  /// the system does.
  Outcome<std::size_t> read(std::span<std::byte> into);
  /// Reads on from there; beyond the end nothing is read.
  void skip_to(std::uint64_t position_bytes) noexcept;
  /// As read(), but also fails with kFailure if the file ends before the span is full.
  Outcome<void> read_exactly(std::span<std::byte> into);

 private:
  InputFile() = default;

  FileDescriptor file_;
  std::uint64_t size_bytes_ = 0;
  std::uint64_t position_bytes_ = 0;
  std::array<char, kMaxPathBytes> path_{};  // Not in a string, as opening must not allocate.
  std::size_t path_bytes_ = 0;
};

/// Reads a whole small text file, without its byte order mark. Fails as InputFile does,
/// and with kUsage if it has more than max_bytes. Uses the heap.
Outcome<std::string> read_text_file(std::string_view path, std::size_t max_bytes);

}  // namespace tessera
