// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where scans come from, one after the other: a recording, its replay in time, or sensors.
#pragma once

#include <cstdint>

#include "base/outcome.hpp"
#include "scans/scan.hpp"

namespace tessera {

/// What became of scans before they were integrated; the counters of the source have more.
struct SourceCounters {
  std::uint64_t offered = 0;  ///< Added to the queue.
  std::uint64_t lost = 0;     ///< Not added, as the mapping thread was late.
  std::uint64_t unknown_ids = 0;
};

/// front() and pop() are for the thread that uses the scans; of a source with a thread of its own
/// they make no system call, and the others are for any thread.
class ScanSource {
 public:
  ScanSource(const ScanSource&) = delete;
  ScanSource& operator=(const ScanSource&) = delete;

  /// The oldest scan that waits, which the caller owns until pop() and may exchange for another one
  /// with the same limits; nullptr: none.
  [[nodiscard]] virtual Scan* front() noexcept = 0;
  virtual void pop() noexcept = 0;
  /// True if no more will come.
  [[nodiscard]] virtual bool ended() const noexcept = 0;
  [[nodiscard]] virtual SourceCounters counters() const noexcept = 0;
  /// Why it ended early: a scan could not be read. After ended().
  [[nodiscard]] virtual const Outcome<void>& outcome() const noexcept { return kNoFailure; }

 protected:
  ScanSource() = default;
  ~ScanSource() = default;

 private:
  static inline const Outcome<void> kNoFailure{};
};

}  // namespace tessera
