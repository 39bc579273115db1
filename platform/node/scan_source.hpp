// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where the mapping thread gets its scans from.
#pragma once

#include <cstdint>

#include "sensing/scan_slot.hpp"

namespace tessera {

/// What became of scans before they were integrated; the source's own counters say more.
struct SourceCounters {
  std::uint64_t offered = 0;  ///< Put into the queue.
  std::uint64_t lost = 0;     ///< Not put there: the mapping thread was behind.
  std::uint64_t unknown_ids = 0;
};

/// front() and pop() are for the mapping thread and cost no system call; the others are for any.
class ScanSource {
 public:
  ScanSource(const ScanSource&) = delete;
  ScanSource& operator=(const ScanSource&) = delete;

  /// The oldest scan that waits, the thread's own until pop(); nullptr: none.
  [[nodiscard]] virtual ScanSlot* front() noexcept = 0;
  virtual void pop() noexcept = 0;
  /// Whether no more will come.
  [[nodiscard]] virtual bool ended() const noexcept = 0;
  [[nodiscard]] virtual SourceCounters counters() const noexcept = 0;

 protected:
  ScanSource() = default;
  ~ScanSource() = default;
};

}  // namespace tessera
