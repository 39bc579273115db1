// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The source of scans for the mapping thread.
#pragma once

#include <cstdint>

#include "scans/scan_slot.hpp"

namespace tessera {

/// What became of scans before they were integrated; the counters of the source have more.
struct SourceCounters {
  std::uint64_t offered = 0;  ///< Added to the queue.
  std::uint64_t lost = 0;     ///< Not added, as the mapping thread was late.
  std::uint64_t unknown_ids = 0;
};

/// front() and pop() are for the mapping thread and make no system call; the others are for any.
class ScanSource {
 public:
  ScanSource(const ScanSource&) = delete;
  ScanSource& operator=(const ScanSource&) = delete;

  /// The oldest scan that waits, which the thread owns until pop(); nullptr: none.
  [[nodiscard]] virtual ScanSlot* front() noexcept = 0;
  virtual void pop() noexcept = 0;
  /// True if no more will come.
  [[nodiscard]] virtual bool ended() const noexcept = 0;
  [[nodiscard]] virtual SourceCounters counters() const noexcept = 0;

 protected:
  ScanSource() = default;
  ~ScanSource() = default;
};

}  // namespace tessera
