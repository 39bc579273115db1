// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Reads a regular file into memory that the caller has prepared: never more than the caller's span,
// and without the heap unless something fails and a message has to be written.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "posix/file_descriptor.hpp"
#include "posix/outcome.hpp"

namespace tessera {

class InputFile {
 public:
  static constexpr std::size_t kMaxPathBytes = 4096;  ///< With the final zero, as Linux has it.

  /// Fails with kUsage iff path is too long, missing, unreadable, or not a regular file.
  static Outcome<InputFile> open(std::string_view path);

  /// Bytes in the file when it was opened.
  [[nodiscard]] std::uint64_t size_bytes() const noexcept { return size_bytes_; }
  [[nodiscard]] std::string_view path() const noexcept { return {path_.data(), path_bytes_}; }

  /// Continues where the last read ended and fills the span as far as the file goes. The value is
  /// the number of bytes read; fewer than asked for: the file ends there. Fails with kFailure iff
  /// the system does.
  Outcome<std::size_t> read(std::span<std::byte> into);
  /// As read(), and fails with kFailure too if the file ends before the span is full.
  Outcome<void> read_exactly(std::span<std::byte> into);

 private:
  InputFile() = default;

  FileDescriptor file_;
  std::uint64_t size_bytes_ = 0;
  std::uint64_t position_bytes_ = 0;
  std::array<char, kMaxPathBytes>
      path_{};  // Here rather than in a string: opening must not allocate.
  std::size_t path_bytes_ = 0;
};

/// The whole of a small text file, without a byte order mark before it. Fails as InputFile does,
/// and with kUsage if it has more than max_bytes. Uses the heap.
Outcome<std::string> read_text_file(std::string_view path, std::size_t max_bytes);

}  // namespace tessera
