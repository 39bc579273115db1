// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The report of "map": a record a scan, then totals.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "cli/registration_report.hpp"
#include "dataset/dataset.hpp"
#include "mapping/prior_map.hpp"
#include "mapping/report.hpp"
#include "tessera/inference/scan_report.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

struct ScanRecord {
  int index = 0;
  double milliseconds = 0.0;
  UnknownRawIds unknown;
  ScanReport report;
  RegistrationRecord registration{};
};

/// What the moving window did in all.
struct WindowTotals {
  double radius_m = 0.0;
  std::uint64_t evicted = 0;
  std::uint64_t evictions_refused = 0;
  std::uint64_t reloaded = 0;
  std::uint64_t merged = 0;  ///< On reloading, or with what was archived already.
  std::uint64_t reloads_failed = 0;
  std::uint64_t steps_without_room = 0;
  std::uint64_t backlog = 0;  ///< After the last step.
  std::uint64_t most_backlog = 0;
  std::uint64_t most_evicted = 0;  ///< In a step.
  std::uint64_t most_reloaded = 0;
  std::uint64_t lost_blocks = 0;
  std::uint64_t archived_blocks = 0;
  std::uint64_t archive_bytes = 0;  ///< Of the file.
  std::uint64_t index_bytes = 0;    ///< Of the budget.
};

/// What mapping was done with, and what came of it.
struct MapRun {
  std::vector<ScanRecord> scans;
  bool interrupted = false;  ///< By a signal, before the last scan.
  std::size_t budget_bytes = 0;
  std::size_t scratch_bytes = 0;
  std::int64_t deadline_us = 0;  ///< 0: none.
  std::optional<std::uint64_t> heap_allocations;
  std::uint64_t digest = 0;
  MapUsage usage;  ///< After the last scan, as the next: with a window, what is in it.
  std::uint64_t free_voxels = 0;
  std::optional<WindowTotals> window;
  std::optional<PriorMapReport> prior_map;
};

/// median, p99, max of the scans' milliseconds; zeros without scans.
struct Timing {
  double median_ms = 0.0;
  double p99_ms = 0.0;
  double max_ms = 0.0;
};
Timing timing_of(const std::vector<ScanRecord>& scans);

Json to_json(const MapRun& run, const Json& config);

/// A few lines for people on stdout, and warnings for what was refused or left out on stderr.
void print_summary(const MapRun& run, const std::string& out);

}  // namespace tessera
