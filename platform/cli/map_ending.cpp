// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/map_ending.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "base/number_text.hpp"
#include "cli/losses.hpp"
#include "scans/scan_losses.hpp"

namespace tessera {

Outcome<void> check_some_integrated(const MapRun& run, double resolution_m) {
  const auto is_placed = [](const ScanRecord& scan) { return scan.report.pose == Status::kOk; };
  if (std::any_of(run.scans.begin(), run.scans.end(), is_placed)) return {};
  const auto is_rigid = [](const ScanRecord& scan) { return scan.rigid; };
  const std::string all = counted(run.scans.size(), "pose");
  if (std::all_of(run.scans.begin(), run.scans.end(), is_rigid))
    return Failure{
        fmt::format("no scan is in the map: not one of {} is within the grid, which "
                    "reaches {:.3g} km from 0, 0, 0; subtract an origin from the "
                    "coordinates, nothing was written",
                    all, 1e-3 * resolution_m * kVoxelLimit)};
  const bool some = std::any_of(run.scans.begin(), run.scans.end(), is_rigid);
  return Failure{"no scan is in the map: not one of " + all + " is a rigid transform" +
                 (some ? " within the grid" : "") + "; check the poses, nothing was written"};
}

Failure interruption(const MapOptions& options, const std::string& continued, const MapRun& run,
                     std::size_t num_scans) {
  std::string written = options.out + (options.report.empty() ? "" : " and " + options.report);
  std::string text =
      fmt::format("interrupted after scan {} of {}: {} written with the scans so far",
                  run.scans.size(), num_scans, written);
  if (!continued.empty())
    text += fmt::format("; continue with --continue {} --first {}", continued,
                        run.scans.back().index + 1);
  return {text, FailureKind::kFailure};
}

Failure out_of_memory(const MapOptions& options, const MapSetup& setup, std::size_t max_points,
                      const MapRun& run, std::size_t num_scans) {
  const double share = static_cast<double>(run.scans.size()) / static_cast<double>(num_scans);
  const double in_memory = static_cast<double>(std::max<std::size_t>(run.usage.blocks, 1));
  const double before = static_cast<double>(run.blocks_before);
  const double now = static_cast<double>(run.blocks);
  const double whole_blocks = before + std::max(now - before, 0.0) / share;
  const auto storage = static_cast<std::size_t>(static_cast<double>(run.usage.used_bytes) *
                                                whole_blocks / in_memory);
  const std::size_t whole = budget_for_storage(setup, max_points, storage);
  return {fmt::format("memory is full after scan {} of {}, and {}. {} has the scans so far; "
                      "without an archive the whole takes about --memory {}M",
                      run.scans.size(), num_scans, *run.obstacle, options.out, whole >> 20U),
          FailureKind::kFailure};
}

Outcome<void> check_nothing_lost(const MapSetup& setup, const MapRun& run) {
  NumberList scans;
  std::uint64_t lost = 0;
  bool map_is_short = false;
  for (const ScanRecord& scan : run.scans) {
    ScanTotals of_scan;
    of_scan.add(scan.report);
    const std::uint64_t here = left_out_for_memory(of_scan);
    if (here == 0) continue;
    scans.add(scan.index);
    lost += here;
    map_is_short = map_is_short || scan.report.refused_storage > 0;
  }
  if (lost == 0) return {};
  const std::size_t bytes = map_is_short ? setup.map.storage_bytes : run.scratch_bytes;
  return Failure{
      fmt::format("{} points and rays of {}, number {}, are not in the map: a scan takes more "
                  "than there is room for in the {} MB of {}; give a larger --memory or a coarser "
                  "--resolution",
                  lost, counted(scans.count(), "scan"), scans.text(), (bytes + 999'999) / 1'000'000,
                  map_is_short ? "the map" : "scratch"),
      FailureKind::kFailure};
}

}  // namespace tessera
