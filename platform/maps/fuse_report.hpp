// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The report of "fuse".
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/json.hpp"
#include "maps/fuse_frames.hpp"
#include "maps/fuse_setup.hpp"
#include "maps/judged_robot.hpp"
#include "tessera/fusion/global_map.hpp"

namespace tessera {

struct FuseRun {
  GlobalMapConfig config;
  GlobalMapReport report;
  MapUsage usage;
  std::vector<PairAlignment> pairs;
  std::vector<JudgedRobot> robots;  ///< By ascending number.
  std::uint64_t free_voxels = 0;
  std::uint64_t digest = 0;
  std::uint64_t work = 0;
  std::size_t budget_bytes = 0;
  std::uint64_t replica_voxels = 0;
  double publish_ms = 0.0;  ///< Packing and putting the blocks of the maps.
  double fuse_ms = 0.0;
  std::optional<std::uint64_t> heap_allocations;
};

Json to_json(const FuseOptions& options, const GlobalMapConfig& config);
Json to_json(const FuseRun& run, const std::vector<FuseInput>& inputs, const Json& config);
/// Robots that are named, and what of them is.
std::vector<Message> doubts_of(const FuseRun& run, const ClassTable& classes);
/// Text of what did not fit.
std::vector<Message> losses_of(const FuseRun& run);
/// The record in the map for eval and others: how it was made, and the range that all maps were
/// made with, if it is the same. config: as returned by to_json.
Json record_of(const std::vector<FuseInput>& inputs, Json config);

}  // namespace tessera
