// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How much heap the process holds at most while something runs: what a reader's stated sum is
// compared with.
#pragma once

#include <cstddef>

namespace tessera::test {

/// Counts every block of the heap by the bytes asked for or a few more, whoever takes it: our
/// code, the standard library, other libraries. One at a time. Where the heap cannot be counted (C
/// libraries other than glibc, without sanitizers) bytes() is 0.
class HeapPeak {
 public:
  HeapPeak() noexcept;
  /// The most that was held at once since the start, beyond what was held then.
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  long long start_bytes_ = 0;
};

}  // namespace tessera::test
