// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The options of "map", and how they become the core's configurations.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "mapping/report.hpp"
#include "posix/outcome.hpp"
#include "tessera/inference/integrator.hpp"
#include "tessera/map/map_config.hpp"
#include "tessera/map/moving_window.hpp"

namespace tessera {

struct MapOptions {
  std::string dataset;  ///< One of this, pcd, ply and depth.
  std::string pcd;
  std::string ply;
  std::string depth;         ///< Or this: a folder of depth images,
  std::string label_images;  ///< of their labels, if there are any,
  std::string intrinsics;    ///< and the file of their camera.
  std::string poses;         ///< Of pcd, ply and depth.
  std::string prior_map;     ///< A .bt or .ot file; empty: none.
  double prior_map_weight = 1.0;
  std::string out;
  std::string report;
  std::string continue_from;
  std::optional<double> window_m;  ///< Without it: the map keeps everything.
  std::string archive;             ///< Folder; empty: none.
  std::string labels = "predictions";
  std::string deskew;  ///< "on" or "off"; empty: where the dataset has times.
  std::optional<int> first;
  std::optional<int> last;
  std::optional<double> resolution_m;  ///< Without it: the map to continue, or 0.1.
  std::string inference = "multi-entropy";
  double kernel_length_m = 0.5;
  std::optional<double> prior;  ///< Without it: the map to continue, or 0.001.
  double max_range_m = 40.0;
  std::string downsample;       ///< Metres or "off"; empty: the resolution.
  std::string thinning_weight;  ///< "mean" or "sum"; empty: what the mode does better with.
  std::string free_space = "on";
  std::string memory = "512M";
  std::string counts;  ///< "dense" or "compact"; empty: the map to continue, or as the mode does
                       ///< better.
  std::optional<std::uint32_t> robot;  ///< Without it: the map to continue, or 0.
  double min_weight = 1.0 / 4096.0;
  std::optional<double>
      max_evidence;  ///< Without it, this and the next follow the mode: its sums have other sizes.
  std::optional<double> free_weight;
  double min_range_m = 0.5;
  std::uint64_t work_budget = 0;
  double deadline_ms = 0.0;  ///< For each scan; 0: none.
  bool kernel_length_given = false;
  bool labels_given = false;
  bool prior_map_weight_given = false;

  /// The folder that the scans are in.
  [[nodiscard]] const std::string& folder() const noexcept {
    return !pcd.empty() ? pcd : !ply.empty() ? ply : !depth.empty() ? depth : dataset;
  }
};

/// What mapping is set up with.
struct MapSetup {
  MapConfig map;
  double max_evidence = 0.0;  ///< As typed: the map's own are floats.
  double free_weight = 0.0;
  InferenceConfig inference;
  std::int64_t deadline_us = 0;  ///< From the start of a scan's integration; 0: none.
  std::size_t budget_bytes = 0;
  WindowConfig window;            ///< Where --window is given.
  std::size_t archive_bytes = 0;  ///< Of the budget, for the archive's index.
};

/// Fails with kUsage, naming the option, iff a value is out of its range or options contradict each
/// other.
Outcome<MapSetup> set_up(const MapOptions& options);

/// The window of a map with that resolution; set_up does it for a new map. Fails as set_up.
Outcome<void> set_up_window(const MapOptions& options, double resolution_m, WindowConfig& window);

/// Every option's value, for reports and for the map's own record.
Json to_json(const MapOptions& options, const MapSetup& setup);

/// How a map was made, for its own record: without the paths and ranges of this run. config: as
/// to_json gave it.
Json settings_of(Json config);

/// Splits the budget: the archive's part, scratch for scans of max_points returns, the rest for the
/// map. With a budget
/// too small for both, capacities shrink until scratch takes half. Fails with kUsage iff the budget
/// holds no map at all.
Outcome<ScanCapacity> split_budget(MapSetup& setup, std::size_t max_points);

/// A --memory, in whole MiB, with which split_budget gives a map at least so much storage.
std::size_t budget_for_storage(const MapSetup& setup, std::size_t max_points,
                               std::size_t storage_bytes);

}  // namespace tessera
