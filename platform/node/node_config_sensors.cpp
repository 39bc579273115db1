// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The tables of a configuration for the sources of scans and poses, and for queries.
#include <algorithm>
#include <array>

#include "node/node_config.hpp"
#include "settings/config_file.hpp"
#include "view/listen_address.hpp"

namespace tessera {

void take_replay(ConfigFile& file, NodeConfig& c) {
  constexpr std::int64_t kMostScan = std::numeric_limits<int>::max();
  file.take_path({"replay", "dataset"}, c.map.dataset);
  file.take({"replay", "first"}, c.map.first, {0, kMostScan});
  file.take({"replay", "last"}, c.map.last, {0, kMostScan});
  file.take_path({"replay", "pcd"}, c.map.pcd);
  file.take_path({"replay", "ply"}, c.map.ply);
  file.take_path({"replay", "depth"}, c.map.depth);
  file.take_path({"replay", "label_images"}, c.map.label_images);
  file.take_path({"replay", "intrinsics"}, c.map.intrinsics);
  file.take_path({"replay", "poses"}, c.map.poses);
  file.take({"replay", "labels"}, c.map.labels);
  c.map.labels_given = file.is_given({"replay", "labels"});
  file.take({"replay", "deskew"}, c.map.deskew);
  file.take({"replay", "rate_hz"}, c.rate_hz, ConfigFile::Real{0.0, 1000.0});
  file.take({"replay", "loop"}, c.loop);
  file.take({"replay", "start_delay_s"}, c.start_delay_s, ConfigFile::Real{0.0, 86400.0});
}

void take_sensors(ConfigFile& file, NodeConfig& c) {
  SensorsConfig& s = c.sensors;
  s.enabled = file.has_table("sensors");
  file.take({"sensors", "url"}, s.url);
  file.take({"sensors", "interface"}, s.interface);
  file.take({"sensors", "clouds"}, s.clouds, {"semantic", "raw", "none"});
  file.take({"sensors", "lidar"}, s.lidar, {0, 1'000'000});
  file.take({"sensors", "points"}, s.points, {1, 4'000'000});
  file.take_path({"sensors", "T_body_lidar"}, s.T_body_lidar);
  file.take_path({"sensors", "cameras"}, s.cameras);
  file.take({"sensors", "depth_camera"}, s.depth_camera, {0, 5});
  file.take_path({"sensors", "classes"}, s.classes);
  file.take({"sensors", "clock"}, s.clock, {"monotonic", "wall"});
  file.take({"sensors", "poses"}, s.poses, {"lcm", "can"});
  file.take({"sensors", "missing_images"}, s.missing_images, {"unlabelled", "drop"});
  file.take({"sensors", "max_wait_ms"}, s.max_wait_ms, ConfigFile::Real{1.0, 10'000.0});
  file.take({"sensors", "max_image_offset_ms"}, s.max_image_offset_ms,
            ConfigFile::Real{0.0, 10'000.0});
  file.take({"sensors", "max_pose_gap_ms"}, s.max_pose_gap_ms, ConfigFile::Real{1.0, 10'000.0});
}

void take_vehicle(ConfigFile& file, NodeConfig& c) {
  VehicleConfig& v = c.vehicle;
  PoseGuardConfig& guard = v.guard;
  file.take({"vehicle", "can"}, v.can);
  file.take({"vehicle", "base_id"}, v.base_id, {0, 0x7e0});
  file.take({"vehicle", "mode"}, v.mode, {"pose", "bridging", "odometry"});
  file.take({"vehicle", "can_fd"}, v.can_fd);
  file.take({"vehicle", "sectors"}, v.sectors, {16, 32});
  file.take({"vehicle", "sector_range_m"}, v.sector_range_m, ConfigFile::Real{0.5, 60.0});
  file.take({"vehicle", "sector_low_m"}, v.sector_low_m, ConfigFile::Real{-20.0, 20.0});
  file.take({"vehicle", "sector_high_m"}, v.sector_high_m, ConfigFile::Real{v.sector_low_m, 20.0});
  file.take({"vehicle", "own_radius_m"}, v.own_radius_m, ConfigFile::Real{0.0, 20.0});
  double timeout_ms = 1e-3 * static_cast<double>(guard.timeout_us);
  file.take({"vehicle", "pose_timeout_ms"}, timeout_ms, ConfigFile::Real{10.0, 10'000.0});
  guard.timeout_us = static_cast<std::int64_t>(1e3 * timeout_ms);
  guard.max_age_us = guard.timeout_us;
  file.take({"vehicle", "max_speed_mps"}, guard.max_speed_mps, ConfigFile::Real{0.01, 200.0});
  file.take({"vehicle", "max_acceleration_mps2"}, guard.max_acceleration_mps2,
            ConfigFile::Real{0.1, 1000.0});
  file.take({"vehicle", "jump_m"}, guard.slack_m, ConfigFile::Real{0.001, 100.0});
  file.take({"vehicle", "jump_rad"}, guard.slack_rad, ConfigFile::Real{0.001, 3.2});
  file.take({"vehicle", "max_yaw_rate_radps"}, guard.max_yaw_rate_radps,
            ConfigFile::Real{0.01, 50.0});
  file.take({"vehicle", "max_std_position_m"}, guard.max_std_position_m,
            ConfigFile::Real{1e-3, 100.0});
  file.take({"vehicle", "max_std_heading_rad"}, guard.max_std_heading_rad,
            ConfigFile::Real{1e-4, 3.2});
}

void take_service(ConfigFile& file, NodeConfig& c) {
  c.queries = c.sensors.enabled;
  file.take({"service", "queries"}, c.queries);
  file.take({"service", "url"}, c.query_url);
  file.take({"service", "interface"}, c.query_interface);
  file.take({"service", "queries_per_s"}, c.queries_per_s, {1, 100'000});
  file.take({"service", "view"}, c.view);
  file.take({"service", "view_everywhere"}, c.view_everywhere);
  file.take({"service", "view_voxels_per_s"}, c.view_voxels_per_s, {1'000, 10'000'000});
}

Outcome<void> check_view(const ConfigFile& file, const NodeConfig& c) {
  if (c.view.empty()) return {};
  const ConfigKey key{"service", "view"};
  const Outcome<ListenAddress> address = parse_listen_address(c.view);
  if (!address.ok()) return file.refusal(key, address.failure().message);
  if (address->is_loopback() || c.view_everywhere) return {};
  return file.refusal(key,
                      c.view +
                          " is open to everybody who reaches this machine; write view_everywhere "
                          "= true to allow that, or give 127.0.0.1:8080");
}

Outcome<void> check_sensors(const ConfigFile& file, const NodeConfig& c) {
  const SensorsConfig& s = c.sensors;
  const auto is_given = [&file](const char* key) { return file.is_given({"replay", key}); };
  const std::array<const char*, 4> folders{"dataset", "pcd", "ply", "depth"};
  const auto* const replayed = std::find_if(folders.begin(), folders.end(), is_given);
  if (s.enabled && replayed != folders.end()) {
    return file.refusal({"sensors", "url"},
                        std::string("excludes [replay] ") + *replayed + "; give one of them");
  }
  if (!s.enabled && replayed == folders.end()) {
    return file.refusal({"replay", "dataset"},
                        "is missing; give a folder in the KITTI layout, a folder as pcd, ply or "
                        "depth, or a table [sensors]");
  }
  if (!is_base_id(c.vehicle.base_id))
    return file.refusal({"vehicle", "base_id"}, "is not a multiple of 32 up to 2016 (0x7e0)");
  if (c.vehicle.sectors != 16 && c.vehicle.sectors != 32)
    return file.refusal({"vehicle", "sectors"}, "is neither 16 nor 32");
  const auto is_none = [](std::uint32_t cpu) { return cpu >= 64; };
  for (const auto* const cpus : {&c.mapping_cpus, &c.other_cpus}) {
    if (std::any_of(cpus->begin(), cpus->end(), is_none)) {
      return file.refusal({"realtime", cpus == &c.mapping_cpus ? "mapping_cpus" : "other_cpus"},
                          "has a processor over 63; give 0 to 63");
    }
  }
  if (!s.enabled) return {};
  if (s.poses == "can" && c.vehicle.can.empty())
    return file.refusal({"sensors", "poses"}, "\"can\" needs a bus; name [vehicle] can");
  if (s.clouds == "none" && !s.depth_camera)
    return file.refusal({"sensors", "clouds"}, "\"none\" needs a depth_camera; name one");
  if (s.clouds == "raw" && s.cameras.empty())
    return file.refusal({"sensors", "clouds"}, "\"raw\" needs cameras for labels; name their file");
  if (s.depth_camera && s.cameras.empty())
    return file.refusal({"sensors", "depth_camera"}, "needs the file of cameras; name cameras too");
  return {};
}

}  // namespace tessera
