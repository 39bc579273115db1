// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The options of "map", and their conversion to configurations of the library.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "base/json.hpp"
#include "base/outcome.hpp"
#include "settings/source_options.hpp"
#include "tessera/inference/integrator.hpp"
#include "tessera/map/map_config.hpp"
#include "tessera/map/moving_window.hpp"

namespace tessera {

struct MapOptions : SourceOptions {
  std::string prior_map;  ///< A .bt or .ot file; empty: none.
  double prior_map_weight = 1.0;
  std::string out;
  std::string report;
  std::string continue_from;
  std::optional<double> window_m;      ///< Default: the map keeps everything.
  std::string archive;                 ///< Folder; empty: none.
  std::optional<double> resolution_m;  ///< Default: as the continued map, or 0.1.
  std::string inference = "multi-entropy";
  double kernel_length_m = 0.5;
  std::optional<double> prior;  ///< Default: as the continued map, or 0.001.
  double max_range_m = 40.0;
  std::string downsample;       ///< Metres or "off"; empty: the resolution.
  std::string thinning_weight;  ///< "mean" or "sum"; empty: the better one for the mode.
  std::string free_space = "on";
  std::string memory = "512M";
  std::string counts;  ///< "dense" or "compact"; empty: as the continued map, or the better one for
                       ///< the mode.
  std::optional<std::uint32_t> robot;  ///< Default: as the continued map, or 0.
  double min_weight = 1.0 / 4096.0;
  std::optional<double> max_evidence;  ///< Defaults of this and the next depend on the mode, whose
                                       ///< sums have other sizes.
  std::optional<double> free_weight;
  double min_range_m = 0.5;
  std::uint64_t work_budget = 0;
  double deadline_ms = 0.0;  ///< For each scan; 0: none.
  bool kernel_length_given = false;
  bool prior_map_weight_given = false;
};

/// Configurations for mapping.
struct MapSetup {
  MapConfig map;
  double max_evidence = 0.0;  ///< As typed: those of the map are floats.
  double free_weight = 0.0;
  InferenceConfig inference;
  std::int64_t deadline_us = 0;  ///< Counted from the start of a scan's integration; 0: none.
  std::size_t budget_bytes = 0;
  std::optional<WindowConfig> window;
  std::size_t archive_bytes = 0;  ///< Part of the budget, for the archive's index.
};

/// Fails with kUsage, naming the option, iff a value is out of its range or options contradict each
/// other.
Outcome<MapSetup> set_up(const MapOptions& options);

/// Blocks that a window reaches at most.
inline constexpr double kMostWindowBlocks = 4000.0;

/// How far from the robot a scan changes the map: 0 without a limit of the range.
double reach_m(const MapOptions& options);

/// Sets up the window for the map's resolution; set_up does it for a new map. Fails as set_up.
Outcome<void> set_up_window(const MapOptions& options, MapSetup& setup);

/// The values of all options, for reports and for the record in the map.
Json to_json(const MapOptions& options, const MapSetup& setup);

/// How a map was made, for the record in it: without the paths and ranges of this run. config: as
/// returned by to_json.
Json settings_of(Json config);

/// Splits the budget: the archive's part, scratch for scans of max_points returns, the rest for the
/// map. If the budget is too small for both, capacities shrink until scratch takes half. Fails with
/// kUsage iff the budget is too small for any map.
Outcome<ScanCapacity> split_budget(MapSetup& setup, std::size_t max_points);

/// A --memory, in whole MiB, with which split_budget gives a map at least this much storage.
std::size_t budget_for_storage(const MapSetup& setup, std::size_t max_points,
                               std::size_t storage_bytes);

}  // namespace tessera
