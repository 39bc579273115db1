// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/robot_setup.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "maps/held_archive.hpp"
#include "maps/session_file.hpp"
#include "node/node_settings.hpp"
#include "scans/transform_file.hpp"
#include "settings/sharing_settings.hpp"
#include "settings/window_setup.hpp"

namespace tessera {

namespace {

Outcome<Matrix34d> frame_of(const NodeConfig& config) {
  if (config.frames == FrameMode::kFound) {
    if (config.T_global_map.empty()) return Matrix34d(Matrix34d::Identity());
    return Failure{Message(kNodeSettings["robot.T_global_map"]) + " is given, and " +
                   kSharingSettings["fusion.frames"] +
                   " is found; leave it out, or have it refined"};
  }
  std::string path = config.T_global_map;
  if (path.empty()) {
    if (config.sensors.enabled) return Matrix34d(Matrix34d::Identity());
    path = config.map.folder() + "/T_global_map.txt";
    std::error_code error;
    if (!std::filesystem::exists(path, error)) return Matrix34d(Matrix34d::Identity());
  }
  return read_transform(path);
}

/// Takes the memory of the archive and of the queue to it from the budget; how many blocks that is
/// for. Without an archive nothing would ever leave the window, as others have it.
Outcome<std::uint32_t> set_up_archive(const NodeConfig& config, int num_components,
                                      MapSetup& setup) {
  if (!setup.window) return 0U;
  if (config.map.archive.empty())
    return Failure{Message(kMapSettings["--window"]) + " needs " + kMapSettings["--archive"] +
                   ", as other robots have what leaves it; give both"};
  const std::size_t blocks = archive_blocks(setup, nullptr);
  setup.archive_bytes = ArchiveFile::required_bytes(setup.map, num_components, blocks) +
                        EvictionQueue::required_bytes(blocks);
  return static_cast<std::uint32_t>(blocks);
}

/// Submaps are themselves what is kept in memory of a map.
Outcome<void> set_up_submaps(const NodeConfig& config, MapSetup& setup) {
  setup.submap_length_m = config.map.submap_length_m.value_or(0.0);
  if (!config.map.in_submaps() || !setup.window) return {};
  return Failure{Message(kMapSettings["--submap-length"]) + " and " + kMapSettings["--window"] +
                 " do not go together; leave out one, and " + kMapSettings["--archive"] +
                 " if there is no window"};
}

}  // namespace

ObstacleSectorsConfig sectors_of(const VehicleConfig& vehicle) noexcept {
  ObstacleSectorsConfig sectors;
  sectors.count = static_cast<int>(vehicle.sectors);
  sectors.max_range_m = vehicle.sector_range_m;
  sectors.min_height_m = vehicle.sector_low_m;
  sectors.max_height_m = vehicle.sector_high_m;
  sectors.own_radius_m = vehicle.own_radius_m;
  sectors.ring_m = std::min(1.0, vehicle.sector_range_m);
  return sectors;
}

bool may_wait(const NodeConfig& config) {
  return !config.sensors.enabled && !(config.rate_hz > 0.0) && !(config.map.deadline_ms > 0.0);
}

Outcome<HeldRobot> make_robot(const RobotConfig& config, const ClassTable& classes,
                              const RobotKeys& keys, const Clock& clock) {
  TESSERA_TRY_ASSIGN(ArenaMemory memory, ArenaMemory::allocate(Robot::required_bytes(
                                             config, classes.num_components())));
  Arena arena(memory.span());
  const Result<Robot*> robot = Robot::make(arena, config, classes, keys, clock);
  if (!robot.ok())
    return Failure{std::string("the robot cannot be set up: ") + to_string(robot.status())};
  return HeldRobot(std::move(memory), **robot);
}

Outcome<RobotSetup> set_up_robot(const NodeConfig& config, const ScanContent& scans,
                                 std::uint32_t epoch) {
  TESSERA_TRY_ASSIGN(const MapSetup map, set_up(config.map));
  RobotSetup setup;
  setup.map = map;
  TESSERA_TRY_ASSIGN(setup.classes, with_kernels(scans.classes, map.kernels, map.kernels_path));
  TESSERA_TRY(set_up_submaps(config, setup.map));
  TESSERA_TRY_ASSIGN(const std::uint32_t archived,
                     set_up_archive(config, scans.classes.num_components(), setup.map));
  TESSERA_TRY_ASSIGN(const ScanCapacity capacity, split_budget(setup.map, scans.max_points));
  let_near_blocks_leave(setup.map, may_wait(config));
  TESSERA_TRY_ASSIGN(const Matrix34d T_global_map, frame_of(config));
  TESSERA_TRY_ASSIGN(const RobotConfig robot,
                     set_up_sharing(config, setup.map, scans.classes.num_components(), epoch));
  setup.robot = robot;
  setup.robot.window = setup.map.window;
  setup.robot.archived_blocks = archived;
  setup.robot.scan = capacity;
  setup.robot.T_global_map = T_global_map;
  setup.robot.keep_sessions = !config.sessions.empty();
  if (!config.sessions.empty())
    TESSERA_TRY(check_frame_of_sessions(setup.robot.frames, kSharingSettings["fusion.frames"]));
  return setup;
}

}  // namespace tessera
