// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Settings for what a robot shares and how fast, and for fusing what it receives; and their
// conversion to the configuration of the library.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "base/outcome.hpp"
#include "settings/diffusion_options.hpp"
#include "settings/map_options.hpp"
#include "tessera/exchange/publication.hpp"
#include "tessera/exchange/wire.hpp"
#include "tessera/robot/robot_config.hpp"

namespace tessera {

struct SharingOptions {
  std::uint32_t robot = 0;
  std::int64_t tick_ms = 50;
  // Publishing.
  double staleness_s = 1.0;
  double free_staleness_s = 4.0;
  double evidence_factor = 4.0;
  std::uint32_t blocks = PublisherConfig{}.blocks;
  std::uint32_t label_bytes_per_s = 1'500'000;
  std::uint32_t free_bytes_per_s = 375'000;
  // Exchange.
  std::uint32_t bytes_per_s = 1'500'000;
  std::uint32_t burst_bytes = 128U << 10U;
  std::uint32_t peers = 64;
  std::uint32_t contributions = 4096;
  std::uint32_t contributions_per_robot = kMostSubmapsOfRobot;
  ConflictPolicy conflicts = ConflictPolicy::kAlarm;
  double reach_m = 0.0;
  std::uint32_t far_contributions = 4096;
  double teammate_margin_m = RobotSettings{}.teammate_margin_m;
  std::uint32_t objections = RobotSettings{}.objections;
  // Global map.
  std::size_t fusion_memory_bytes = std::size_t{256} << 20U;
  DiffusionOptions diffusion;
  TuplePolicy counts = TuplePolicy::kCompact;
  double robot_share = 0.5;
  std::uint64_t work_per_tick = 300'000;
  bool near_first = false;
  // Frames.
  FrameMode frames = FrameMode::kGiven;
  double frame_sigma_m = FramesConfig{}.sigma_m;
  double frame_sigma_deg = 5.0;
  std::uint32_t frame_robots = FramesConfig{}.most_robots;
};

/// Fails with kUsage iff options of what is published contradict each other.
Outcome<void> check_publishing(const SharingOptions& options);

/// The configuration of a robot except the sizes of its scans and its frame. map: of its local map.
/// num_components: of the class table. epoch: of this start. Fails as check_publishing() and
/// diffusion_of() do, and with kUsage iff the memory budget is too small for a map.
Outcome<RobotConfig> set_up_sharing(const SharingOptions& options, const MapSetup& map,
                                    int num_components, std::uint32_t epoch);

/// Capacities of a global map that fit into memory_bytes. robot_share: of the replicas, for one
/// robot. Fails with kUsage iff they are too few for a map.
Outcome<GlobalMapConfig> fit_global_map(GlobalMapConfig config, std::size_t memory_bytes,
                                        double robot_share, int num_components);

}  // namespace tessera
