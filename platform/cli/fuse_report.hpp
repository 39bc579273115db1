// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What "fuse" is asked for, what came of it, and how it is told.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/fuse_inputs.hpp"
#include "cli/report.hpp"
#include "tessera/fusion/global_map.hpp"

namespace tessera {

struct FuseOptions {
  std::vector<std::string> maps;
  std::string out;
  std::string report;
  std::vector<std::string> transforms;
  std::string diffusion = "contractive";
  std::string edge = to_string(DiffusionConfig{}.edge);
  std::string counts;              ///< "dense" or "compact"; empty: as the maps.
  std::optional<int> iterations;   ///< Without it: 8, in paper mode 2.
  std::optional<double> length_m;  ///< Without it: two voxels, in paper mode three.
  double alpha = 0.0;              ///< As typed; filled with the default.
  double omega = 1.0;
  bool whole_map = false;
};

struct FuseRun {
  GlobalMapConfig config;
  GlobalMapReport report;
  MapUsage usage;
  std::vector<PairAlignment> pairs;
  std::uint64_t free_voxels = 0;
  std::uint64_t digest = 0;
  std::uint64_t work = 0;
  std::size_t arena_bytes = 0;
  std::uint32_t replica_voxels = 0;
  double publish_ms = 0.0;  ///< The maps' blocks packed and put.
  double fuse_ms = 0.0;
  std::optional<std::uint64_t> heap_allocations;
};

Json to_json(const FuseOptions& options, const GlobalMapConfig& config);
Json to_json(const FuseRun& run, const std::vector<FuseInput>& inputs, const Json& config);
void print_summary(const FuseRun& run, const std::vector<FuseInput>& inputs,
                   const std::string& out);

}  // namespace tessera
