// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The scans of a recording in their order, each read when it is asked for.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/outcome.hpp"
#include "scans/recorded_scans.hpp"
#include "scans/scan_source.hpp"

namespace tessera {

enum class ScanOrder : std::uint8_t {
  kOnce,
  kLoop,          ///< From the first again, without end.
  kThereAndBack,  ///< From the first to the last, from the last to the first, and so on.
};

class RecordedSource final : public ScanSource {
 public:
  /// scans must outlive it, and registrar, which may be null: with it scans are registered, and
  /// depth images become clouds. Allocates memory for the largest scan.
  explicit RecordedSource(const RecordedScans& scans, ScanOrder order = ScanOrder::kOnce,
                          Registrar* registrar = nullptr);

  /// Reads the scan. Uses the heap only if RecordedScans::read does or depth images become clouds.
  [[nodiscard]] Scan* front() noexcept override;
  void pop() noexcept override;
  [[nodiscard]] bool ended() const noexcept override { return ended_; }
  [[nodiscard]] SourceCounters counters() const noexcept override { return counters_; }
  [[nodiscard]] const Outcome<void>& outcome() const noexcept override { return outcome_; }

 private:
  [[nodiscard]] std::size_t place() const noexcept;
  [[nodiscard]] Outcome<void> read_scan();

  const RecordedScans& scans_;
  const ScanOrder order_;
  Registrar* const registrar_;
  Scan scan_;
  bool is_read_ = false;
  bool ended_ = false;
  std::size_t next_ = 0;  ///< Of a pass there and back.
  SourceCounters counters_{};
  Outcome<void> outcome_;
};

}  // namespace tessera
