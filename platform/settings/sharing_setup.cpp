// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <numbers>

#include "base/monotonic_clock.hpp"
#include "settings/sharing_settings.hpp"

namespace tessera {

namespace {

PublisherBudget budget_of(const SharingOptions& config) {
  PublisherBudget budget;
  const double tick_s = 1e-3 * static_cast<double>(config.tick_ms);
  const auto of_tick = [tick_s](std::uint32_t per_s) {
    return static_cast<std::uint32_t>(std::max(1.0, tick_s * static_cast<double>(per_s)));
  };
  budget.label_bytes = of_tick(config.label_bytes_per_s);
  budget.free_bytes = of_tick(config.free_bytes_per_s);
  return budget;
}

ExchangeConfig exchange_of(const SharingOptions& config, const MapConfig& map,
                           std::uint32_t starts) {
  ExchangeConfig exchange;
  exchange.robot = config.robot;
  exchange.session = std::uint64_t{starts} << 32U;
  exchange.resolution_m = map.resolution_m;
  exchange.prior = map.prior;
  exchange.free_weight = map.free_weight;
  exchange.max_evidence = robot_max_evidence(map);
  exchange.conflicts = config.conflicts;
  exchange.peers = config.peers;
  exchange.bytes_per_s = config.bytes_per_s;
  exchange.burst_bytes = config.burst_bytes;
  return exchange;
}

Outcome<FramesConfig> frames_of(const SharingOptions& options) {
  FramesConfig config;
  config.mode = options.frames;
  config.sigma_m = options.frame_sigma_m;
  config.sigma_rad = options.frame_sigma_deg * std::numbers::pi / 180.0;
  config.most_robots = options.frame_robots;
  if (config.mode == FrameMode::kGiven) return config;
  if ((config.sigma_m > 0.0) != (config.sigma_rad > 0.0))
    return Failure{Message(kSharingSettings["fusion.frame_sigma_m"]) + " and " +
                   kSharingSettings["fusion.frame_sigma_deg"] +
                   " are both 0, for an exact frame, or both above it"};
  if (options.reach_m > 0.0)
    return Failure{Message(kSharingSettings["fusion.frames"]) + " other than given and " +
                   kSharingSettings["network.reach_m"] +
                   " do not go together, as nobody knows what is near before frames are found; "
                   "leave out one"};
  return config;
}

}  // namespace

Outcome<void> check_publishing(const SharingOptions& options) {
  if (options.free_staleness_s >= options.staleness_s) return {};
  return not_allowed(kSharingSettings["publish.free_staleness_s"],
                     text_of(options.free_staleness_s),
                     "seconds from " + Message(kSharingSettings["publish.staleness_s"]));
}

Outcome<GlobalMapConfig> fit_global_map(GlobalMapConfig config, std::size_t memory_bytes,
                                        double robot_share, int num_components) {
  constexpr std::size_t kLeastStorage = 4 * SlabPool::kPageBytes;
  constexpr std::uint32_t kLeastParts = 64;
  constexpr std::size_t kLeastBytes = std::size_t{4} << 20U;
  config.replicas.segments = config.replicas.robot_segments = kLeastParts;
  config.replicas.blocks = config.blocks = config.sum_segments = kLeastParts;
  config.staged_bytes = config.map.storage_bytes = kLeastStorage;
  // Mostly the brick of the diffusion.
  const std::size_t fixed_bytes = GlobalMap::required_bytes(config, num_components);
  if (memory_bytes < fixed_bytes + kLeastBytes) {
    constexpr std::size_t kMiB = std::size_t{1} << 20U;
    return Failure{Message(kSharingSettings["fusion.memory"]) + " " + bytes_text(memory_bytes) +
                   " is too little for a global map; give at least " +
                   bytes_text(((fixed_bytes + kLeastBytes) / kMiB + 1) * kMiB)};
  }
  const std::size_t rest_bytes = memory_bytes - fixed_bytes;
  const auto parts_of = [rest_bytes](double share, std::size_t bytes) {
    const double parts = share * static_cast<double>(rest_bytes) / static_cast<double>(bytes);
    return static_cast<std::uint32_t>(std::clamp(parts, double{kLeastParts}, 1e9));
  };
  // Shares as measured for two robots in a street with 0.1 m voxels.
  config.replicas.segments = parts_of(0.25, SegmentStore::kSegmentBytes);
  config.replicas.blocks = config.blocks = std::max(kLeastParts, config.replicas.segments / 3);
  config.replicas.robot_segments =
      std::max(1U, static_cast<std::uint32_t>(robot_share * config.replicas.segments));
  config.replicas.robot_blocks =
      std::max(1U, static_cast<std::uint32_t>(robot_share * config.replicas.blocks));
  config.sum_segments = parts_of(0.12, SegmentStore::kSegmentBytes);
  // Where frames are found, all of a robot moves at once.
  const std::size_t staged_share = config.place_robots ? 6 : 20;
  config.staged_bytes = std::max(
      kLeastStorage, rest_bytes / staged_share / SlabPool::kPageBytes * SlabPool::kPageBytes);
  const std::size_t without_map =
      GlobalMap::required_bytes(config, num_components) - required_bytes(config.map);
  config.map = fit_to_budget(config.map, memory_bytes - without_map);
  config.map.storage_bytes = std::min(config.map.storage_bytes, MapConfig::kMaxStorageBytes);
  return config;
}

Outcome<RobotConfig> set_up_sharing(const SharingOptions& options, const MapSetup& map,
                                    int num_components, std::uint32_t epoch) {
  TESSERA_TRY(check_publishing(options));
  TESSERA_TRY_ASSIGN(const DiffusionConfig diffusion, diffusion_of(options.diffusion, map.map));
  RobotConfig robot;
  robot.map = map.map;
  robot.inference = map.inference;
  robot.deadline_us = map.deadline_us;
  robot.publisher.blocks = options.blocks;
  robot.publisher.candidates = std::max<std::uint32_t>(64, options.blocks / 2);
  robot.publisher.staleness_us = microseconds(options.staleness_s);
  robot.publisher.free_staleness_us = microseconds(options.free_staleness_s);
  robot.publisher.evidence_factor = static_cast<float>(options.evidence_factor);
  robot.budget = budget_of(options);
  robot.exchange = exchange_of(options, robot.map, epoch);
  const bool in_submaps = map.submap_length_m > 0.0;
  robot.exchange.contributions = options.contributions;
  robot.reach_m = options.reach_m;
  robot.exchange.far_contributions = options.reach_m > 0.0 ? options.far_contributions : 0;
  robot.exchange.contributions_per_robot = options.contributions_per_robot;
  robot.teammate_margin_m = options.teammate_margin_m;
  robot.objections = options.objections;
  if (in_submaps) {
    // Others hold no more of one robot. A place is kept for each, and there are three for
    // others' beside it.
    robot.most_submaps =
        std::min({options.contributions / 4, options.contributions_per_robot, kMostSubmapsOfRobot});
    if (robot.most_submaps < 2)
      return Failure{Message(kMapSettings["--submap-length"]) + " needs " +
                     kSharingSettings["network.contributions_per_robot"] + " of at least 2 and " +
                     kSharingSettings["network.contributions"] + " of at least 8"};
    robot.exchange.own_contributions = robot.most_submaps;
    robot.submap_cuts.length_m = map.submap_length_m;
  }
  robot.work_per_tick = options.work_per_tick;
  robot.near_first = options.near_first;
  TESSERA_TRY_ASSIGN(const FramesConfig frames, frames_of(options));
  robot.frames = frames;
  robot.epoch = epoch;

  GlobalMapConfig global;
  global.diffusion = diffusion;
  global.map = robot.map;
  global.max_evidence = robot.map.max_evidence;
  global.map.max_evidence = 0.0F;
  if (diffusion.mode == DiffusionMode::kPaper) global.map.prior = 0.0;
  global.map.tuple = options.counts;
  global.place_robots = frames.mode != FrameMode::kGiven;
  global.replicas.contributions = options.contributions;
  TESSERA_TRY_ASSIGN(
      const GlobalMapConfig fitted,
      fit_global_map(global, options.fusion_memory_bytes, options.robot_share, num_components));
  robot.global = fitted;
  robot.exchange.records = robot.global.replicas.blocks;
  return robot;
}

}  // namespace tessera
