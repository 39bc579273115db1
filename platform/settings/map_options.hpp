// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The options of "map", and their conversion to configurations of the library.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/json.hpp"
#include "base/outcome.hpp"
#include "settings/class_kernels.hpp"
#include "settings/source_options.hpp"
#include "tessera/inference/integrator.hpp"
#include "tessera/map/map_config.hpp"
#include "tessera/map/moving_window.hpp"

namespace tessera {

struct MapOptions : SourceOptions {
  std::string out;
  std::string report;
  std::string continue_from;
  std::string prior_map;  ///< A .bt or .ot file; empty: none.
  std::optional<double> prior_map_weight;
  std::optional<double> submap_length_m;  ///< 0, the default: one map.
  std::vector<std::string> corrections;   ///< Files of corrected poses.
  std::optional<double> resolution_m;
  InferenceMode inference = InferenceMode::kLattice;
  std::optional<double> kernel_length_m;
  std::string kernels;  ///< File; empty: by the names of classes.
  std::optional<double> prior;
  double max_range_m = 40.0;
  double min_range_m = 0.5;
  double no_return_range_m = 0.0;      ///< 0: off.
  std::vector<double> body;            ///< Six numbers a box; empty: none.
  std::optional<double> downsample_m;  ///< 0: off.
  std::optional<ThinningWeight> thinning_weight;
  bool free_space = true;
  Carving carving = Carving::kImage;
  std::size_t memory_bytes = std::size_t{512} << 20U;
  std::optional<TuplePolicy> counts;
  std::optional<std::uint32_t> robot;
  double min_weight = 1.0 / 4096.0;
  std::optional<double> max_evidence;
  std::optional<double> free_weight;
  std::uint64_t work_budget = 0;
  double deadline_ms = 0.0;        ///< For each scan; 0: none.
  std::optional<double> window_m;  ///< Default: the map keeps everything.
  std::string archive;             ///< Folder; empty: none.

  [[nodiscard]] bool in_submaps() const noexcept { return submap_length_m.value_or(0.0) > 0.0; }
  [[nodiscard]] bool is_kernel() const noexcept { return inference == InferenceMode::kKernel; }
  /// With the default of each option that has none of its own: those that depend on others.
  [[nodiscard]] MapOptions complete() const;
};

template <>
inline constexpr std::array kChoicesOf<InferenceMode>{
    InferenceMode::kLattice, InferenceMode::kMultiEntropy, InferenceMode::kKernel,
    InferenceMode::kCounting};
template <>
inline constexpr std::array kChoicesOf<Carving>{Carving::kImage, Carving::kRays};
template <>
inline constexpr std::array kChoicesOf<ThinningWeight>{ThinningWeight::kMean, ThinningWeight::kSum};
template <>
inline constexpr std::array kChoicesOf<TuplePolicy>{TuplePolicy::kDense, TuplePolicy::kCompact};

/// Those that a node and Python have too; set_up() checks what depends on more than one.
inline constexpr Setting kMapRows[] = {
    row<&MapOptions::resolution_m>({"--resolution", "map", "resolution_m"}, "Edge of a voxel",
                                   {.value = "M",
                                    .otherwise = "0.1",
                                    .allowed = from_to(0.001, 100.0, "metres"),
                                    .fixed = true}),
    row<&MapOptions::inference>(
        {"--inference", "map", "inference"},
        "How a point gives evidence to the voxels around it; lattice: from voxels of 0.25 m on "
        "as multi-entropy"),
    row<&MapOptions::kernel_length_m>(
        {"--kernel-length", "map", "kernel_length_m"},
        "Length D of the mode kernel, or of lattice, under voxels of 0.25 m, how far labels reach",
        {.value = "M",
         .otherwise = "0.5; lattice: each class has its own",
         .allowed = {.least = 0.0,
                     .above = true,
                     .words = "metres from 0.5 to 32 voxels; lattice: from 0.001 to 1000"}}),
    path_row<&MapOptions::kernels>(
        {"--kernels", "map", "kernels"},
        "File of kernels by class, for lattice under voxels of 0.25 m, as fit-kernels writes it",
        {.value = "FILE", .otherwise = "by the names of classes"}),
    row<&MapOptions::prior>(
        {"--prior", "map", "prior"}, "Prior sigma_0 of every component",
        {.value = "P", .otherwise = "0.001", .allowed = from_to(0.0, 1e6), .fixed = true}),
    row<&MapOptions::max_range_m>(
        {"--max-range", "map", "max_range_m"},
        "Farther returns add no hit, and their rays free space up to here; 0: no limit",
        {.value = "M", .allowed = from_to(0.0, 1e6, "metres")}),
    row<&MapOptions::min_range_m>({"--min-range", "map", "min_range_m"},
                                  "Nearer returns are refused",
                                  {.value = "M", .allowed = from_to(0.0, 1e6, "metres")}),
    row<&MapOptions::no_return_range_m>(
        {"--no-return-range", "map", "no_return_range_m"},
        "Directions from which nothing came back free space up to here, for sensors that are "
        "reliable in that; 0: they free nothing",
        {.value = "M", .allowed = from_to(0.0, 1e6, "metres")}),
    row<&MapOptions::body>({"--body", "robot", "body"},
                           "Boxes of the robot's own body, whose returns are left out: x, y, z of "
                           "the low corner, then "
                           "of the high one, metres, body's frame; at most 8",
                           {.value = "X,Y,Z,X,Y,Z", .otherwise = "none"}),
    row<&MapOptions::downsample_m>(
        {"--downsample", "map", "downsample_m"}, "Cell of which one point is taken",
        {.value = "M|off",
         .otherwise = "the resolution",
         .allowed = {.least = 0.001, .most = 1000.0, .what = "metres", .zero = "off"}}),
    row<&MapOptions::thinning_weight>({"--thinning-weight", "map", "thinning_weight"},
                                      "Weight of a thinned point, from the points with its label",
                                      {.otherwise = "kernel: sum, else mean"}),
    row<&MapOptions::free_space>({"--free-space", "map", "free_space"},
                                 "Map the space that the sensor saw to be free"),
    row<&MapOptions::carving>(
        {"--carving", "map", "carving"},
        "How free space is found: by the image of the scan, or along each ray"),
    bytes_row<&MapOptions::memory_bytes>({"--memory", "map", "memory", "memory_bytes"},
                                         "Memory for the map and for the work on a scan",
                                         {.value = "BYTES", .allowed = {.most = 1e15}}),
    row<&MapOptions::counts>(
        {"--counts", "map", "counts"},
        "Counts of a voxel. compact: 16 bytes, for three classes; dense: a float for each",
        {.otherwise = "kernel: dense, else compact", .fixed = true}),
    row<&MapOptions::robot>({"--robot"}, "Robot id, kept in the map file",
                            {.value = "ID", .otherwise = "0", .fixed = true}),
    row<&MapOptions::min_weight>(
        {"--min-weight", "map", "min_weight"}, "Smaller contributions are not added",
        {.value = "W", .otherwise = "2^-12", .allowed = from_to(0.0, 1.0)}),
    row<&MapOptions::max_evidence>(
        {"--max-evidence", "map", "max_evidence"}, "Cap of a voxel's evidence; 0: none",
        {.value = "S",
         .otherwise = "100; kernel: 250",
         .allowed = {.least = 0.0,
                     .most = 1e6,
                     .words = "0, or 1 to 255 times the weight of a pass"},
         .fixed = true}),
    row<&MapOptions::free_weight>(
        {"--free-weight", "map", "free_weight"}, "Evidence of one pass of a ray",
        {.value = "W", .otherwise = "0.4; kernel: 1", .allowed = above(0.0, 1e6), .fixed = true}),
    row<&MapOptions::work_budget>({"--work-budget", "map", "work_budget"},
                                  "Most kernel evaluations and ray steps of a scan; 0: no limit",
                                  {.value = "N"}),
    row<&MapOptions::deadline_ms>(
        {"--deadline", "map", "deadline_ms"},
        "Time for a scan from the end of reading; what does not fit is left out; 0: no limit",
        {.value = "MS",
         .allowed = {.least = 0.001, .most = 1e9, .what = "milliseconds", .zero = "0"}}),
    row<&MapOptions::window_m>(
        {"--window", "map", "window_m"},
        "Keep only the map within this distance of the robot in memory",
        {.value = "M",
         .otherwise = "all; with an archive: as far as scans reach",
         .allowed = {.least = 0.0, .above = true, .words = "metres above 0, to 32000 voxels"}}),
    path_row<&MapOptions::archive>(
        {"--archive", "map", "archive"},
        "Folder for blocks that leave the window; they are reloaded when the robot returns",
        {.value = "DIR"}),
    row<&MapOptions::submap_length_m>(
        {"--submap-length", "map", "submap_m"},
        "Map in submaps, each of this way; they can be moved on their own, as by --corrections; 0: "
        "one "
        "map",
        {.value = "M",
         .otherwise = "one map; a node with sensors and no window: 20",
         .allowed = {.least = 0.1, .most = 1e6, .what = "metres", .zero = "0"}}),
};
inline constexpr SettingTable<MapOptions> kMapSettings{kMapRows};

/// Those of the command alone.
inline constexpr Setting kMapFileRows[] = {
    path_row<&MapOptions::out>({"--out"}, "Map file to write, required", {.value = "MAP.tsm"}),
    path_row<&MapOptions::report>({"--report"}, "JSON report to write", {.value = "FILE"}),
    path_row<&MapOptions::continue_from>(
        {"--continue"},
        "Map file to continue; it sets resolution, prior, cap, weight of a pass and robot",
        {.value = "FILE"}),
    path_row<&MapOptions::prior_map>(
        {"--prior-map"}, "OctoMap file (.bt, .ot) to initialise a new map with", {.value = "FILE"}),
    row<&MapOptions::prior_map_weight>(
        {"--prior-map-weight"}, "Evidence of each voxel of the prior map",
        {.value = "W",
         .otherwise = "1",
         .allowed = {.least = 0.001, .words = "evidence from 0.001 to the cap of a voxel"}}),
};
inline constexpr SettingTable<MapOptions> kMapFileSettings{kMapFileRows};

/// Of a node with sensors and without a window, by default.
inline constexpr double kSubmapOfNode_m = 20.0;
/// Submaps of a running robot, at most.
inline constexpr std::uint32_t kMostSubmapsOfRobot = 1024;

/// Configurations for mapping.
struct MapSetup {
  MapConfig map;
  InferenceConfig inference;
  std::vector<NamedKernel> kernels;
  std::string kernels_path;      ///< Where they are from, for messages.
  std::int64_t deadline_us = 0;  ///< Counted from the start of a scan's integration; 0: none.
  std::size_t budget_bytes = 0;
  std::optional<WindowConfig> window;
  /// Of a running robot in submaps, which has two maps; 0: one map.
  double submap_length_m = 0.0;
  std::size_t archive_bytes = 0;  ///< Part of the budget, for the archive's index.
};

/// Fails with kUsage iff options contradict each other, each by itself in its range, or the file of
/// kernels is not valid.
Outcome<MapSetup> set_up(const MapOptions& options);

/// Fails with kUsage iff a box of the body holds the sensor, which would map nothing near it.
/// sensor: in words, for the message.
Outcome<void> check_body(const RobotBody& body, const Matrix34d& T_body_sensor,
                         const std::string& sensor);

/// Blocks that a window reaches at most.
inline constexpr double kMostWindowBlocks = 4000.0;

/// How far from the robot a scan changes the map: 0 without a limit of the range.
double reach_m(const MapOptions& options);

/// The values of all options, for reports and for the record in the map; setup: of these options.
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
