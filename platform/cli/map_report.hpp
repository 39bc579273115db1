// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The report of "map": a record per scan, then totals.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/json.hpp"
#include "cli/registration_report.hpp"
#include "maps/prior_map.hpp"
#include "maps/window_totals.hpp"
#include "scans/dataset.hpp"
#include "scans/scan.hpp"
#include "tessera/inference/scan_report.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

struct ScanRecord {
  int index = 0;
  double milliseconds = 0.0;
  UnknownRawIds unknown;
  ScanReport report;
  RegistrationRecord registration{};
  std::uint64_t no_returns = 0;  ///< Points at 0, 0, 0, as drivers write them for "no return".
  bool rigid = true;  ///< The pose; if it is refused all the same, it is out of the grid.
};

/// Of a scan as it was read. O(points).
[[nodiscard]] std::uint64_t count_no_returns(const Scan& scan);

/// Settings and results of a run.
struct MapRun {
  std::string labels;  ///< Where they come from, as the report says it.
  std::vector<ScanRecord> scans;
  bool interrupted = false;             ///< By a signal, before the last scan.
  std::size_t blocks_before = 0;        ///< Of the map that is continued.
  std::size_t blocks = 0;               ///< In the end, with those that are archived.
  std::optional<std::string> obstacle;  ///< Why the archive takes no more, if that ended the run.
  std::size_t budget_bytes = 0;
  std::size_t scratch_bytes = 0;
  std::int64_t deadline_us = 0;  ///< 0: none.
  std::optional<std::uint64_t> heap_allocations;
  MapSummary file;  ///< What was written.
  MapUsage usage;   ///< After the last scan, as the next member: with a window, of its content.
  std::uint64_t free_voxels = 0;
  bool in_submaps = false;  ///< The last two members are of the submap that took most memory.
  std::optional<WindowTotals> window;
  std::optional<PriorMapReport> prior_map;
  Json calibration;  ///< How the map's probabilities are computed: calibration_of.
};

/// How far its counts are taken to be worth something: the constants, and the worth of each class.
Json calibration_of(const LocalMap& map);

/// median, p99, max of the scans' milliseconds; zeros without scans.
struct Timing {
  double median_ms = 0.0;
  double p99_ms = 0.0;
  double max_ms = 0.0;
};
Timing timing_of(const std::vector<ScanRecord>& scans);

Json to_json(const MapRun& run, const Json& config);

/// Prints a few lines on stdout, and on stderr warnings about what was refused or left out.
void print_summary(const MapRun& run, const std::string& out);

}  // namespace tessera
