// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How a run of map ends that did not do all that it was asked for.
#pragma once

#include <cstddef>
#include <string>

#include "base/outcome.hpp"
#include "cli/map_report.hpp"
#include "settings/map_options.hpp"

namespace tessera {

/// Fails iff no scan is in the map.
Outcome<void> check_some_integrated(const MapRun& run, double resolution_m);

/// For a run whose map and report are written, but without some of the scans.
/// continued: the map file, or an archive that is beside it; of submaps, which cannot be continued,
/// empty.
Failure interruption(const MapOptions& options, const std::string& continued, const MapRun& run,
                     std::size_t num_scans);

/// For a run that ended as neither memory nor the archive had room for more. The map grows with the
/// way: what the whole takes is estimated from the scans so far.
Failure out_of_memory(const MapOptions& options, const MapSetup& setup, std::size_t max_points,
                      const MapRun& run, std::size_t num_scans);

/// Fails iff scans lack points or rays for want of memory, although blocks leave it as needed: a
/// scan takes more than the half of it that is free before each. Says which scans, of which part of
/// the memory, and how many points and rays.
Outcome<void> check_nothing_lost(const MapSetup& setup, const MapRun& run);

}  // namespace tessera
