// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/node_config.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "base/input_file.hpp"
#include "link/key_settings.hpp"
#include "node/node_settings.hpp"
#include "node/sensor_settings.hpp"
#include "settings/sharing_settings.hpp"
#include "tessera/exchange/exchange_config.hpp"
#include "view/listen_address.hpp"

namespace tessera {

namespace {

/// Defaults of a node that are not those of its parts.
void set_defaults(const ConfigPlaces& places, NodeConfig& c) {
  c.sensors.enabled = places.has_table("sensors");
  c.queries = c.lock_memory = c.sensors.enabled;
  c.priority = c.sensors.enabled ? 40 : 0;
}

void read_tables(ConfigFile& file, NodeConfig& c) {
  file.read(kSharingSettings, c);
  file.read(kNodeSettings, c);
  file.read(kSourceSettings, c.map);
  file.read(kSensorSettings, c.sensors);
  file.read(kVehicleSettings, c.vehicle);
  // A replay must be reproducible; sensor data must be mapped in time.
  constexpr double kShare = 0.55;
  if (c.sensors.enabled) c.map.deadline_ms = kShare * static_cast<double>(c.period_ms);
  // Its poses may be corrected, and it must not come to the end of its memory.
  const bool has_window = c.places.is_given({.table = "map", .key = "window_m"}) ||
                          c.places.is_given({.table = "map", .key = "archive"});
  if (c.sensors.enabled && !has_window) c.map.submap_length_m = kSubmapOfNode_m;
  file.read(kMapSettings, c.map);
  file.read(kDiffusionSettings, c.diffusion);
  file.read(kKeySettings, c.keys);
  file.read_all(kSessionSettings, c.sessions);
  c.map.robot = c.robot;
  PoseGuardConfig& guard = c.vehicle.guard;
  guard.timeout_us = guard.max_age_us = static_cast<std::int64_t>(1e3 * c.vehicle.pose_timeout_ms);
}

Outcome<void> check_excluded(const NodeConfig& c) {
  const Message exclude(kNodeSettings["security.exclude"]);
  if (c.exclude.size() > ExchangeConfig::kMostExcluded)
    return Failure{exclude +
                   fmt::format(" takes at most {} robots", ExchangeConfig::kMostExcluded)};
  if (std::find(c.exclude.begin(), c.exclude.end(), c.robot) == c.exclude.end()) return {};
  return Failure{exclude + " names this robot itself; leave it out"};
}

/// Each takes a place for a contribution of this robot with everybody.
Outcome<void> check_sessions(const NodeConfig& c) {
  if (c.sessions.size() <= MapSession::kMostOfRobot) return {};
  return Failure{fmt::format("{}: [[sessions]] is given {} times; give at most {}", c.places.path(),
                             c.sessions.size(), MapSession::kMostOfRobot)};
}

/// The mission of the fleet's key file is checked when that is read.
Outcome<void> check_mission(const NodeConfig& c) {
  const SettingName& mission = kKeySettings["security.mission"];
  if (!c.places.is_given(mission)) return {};
  if (c.keys.fleet_key.empty() && c.keys.robot_secret.empty())
    return Failure{Message(mission) +
                   " protects nothing without a key; name fleet_key, or leave it out"};
  const Outcome<Mission> made = Mission::make(c.keys.mission);
  if (made.ok()) return {};
  return Failure{Message(mission) + " is not allowed: " + made.failure().message};
}

/// A robot does not run without the keys that its configuration asks for.
Outcome<void> check_keys(const NodeConfig& c) {
  for (const Setting& row : kKeyRows) {
    const std::string path = text_of(row, row.member.get(&c.keys));
    if (row.kind == SettingKind::kPath && c.places.is_given(row.name) && path.empty())
      return Failure{Message(row.name) + " is empty; name a key file, or leave it out"};
  }
  if (c.keys.robot_secret.empty() == c.keys.robot_public_keys.empty()) return {};
  const SettingName& secret = kKeySettings["security.robot_secret"];
  const SettingName& keys = kKeySettings["security.robot_public_keys"];
  const bool has_secret = !c.keys.robot_secret.empty();
  return Failure{Message(has_secret ? secret : keys) + " signatures need both keys: name " +
                 (has_secret ? keys : secret) + " too"};
}

/// A recording begins with its first scan, which the map would then have twice.
Outcome<void> check_restart(const NodeConfig& c) {
  if (c.restart != Restart::kContinue) return {};
  const Message restart(kNodeSettings["robot.restart"]);
  if (!c.sensors.enabled)
    return Failure{restart +
                   " \"continue\" needs a table [sensors]: scans of a folder would be in "
                   "the map twice; leave it out"};
  if (c.map.window_m)
    return Failure{restart + " \"continue\" and " + kMapSettings["--window"] +
                   " do not go together yet; leave out one"};
  return {};
}

/// The address, and whether other machines may reach it.
Outcome<void> check_view(const NodeConfig& c) {
  if (c.view.empty()) return {};
  const Message view(kNodeSettings["service.view"]);
  const Outcome<ListenAddress> address = parse_listen_address(c.view);
  if (!address.ok()) return Failure{view + " " + address.failure().message};
  if (address->is_loopback() || c.view_everywhere) return {};
  return Failure{view + " " + c.view +
                 " is open to everybody who reaches this machine; write view_everywhere = true to "
                 "allow that, or give 127.0.0.1:8080"};
}

Outcome<void> check_source_of_scans(const NodeConfig& c) {
  const std::array<const SettingName*, 4> folders{
      &kSourceSettings["--dataset"], &kSourceSettings["--pcd"], &kSourceSettings["--ply"],
      &kSourceSettings["--depth"]};
  const auto* const replayed =
      std::find_if(folders.begin(), folders.end(),
                   [&](const SettingName* name) { return c.places.is_given(*name); });
  const bool has_folder = replayed != folders.end();
  if (c.sensors.enabled && has_folder)
    return Failure{Message(kSensorSettings["sensors.url"]) + " excludes [replay] " + **replayed +
                   "; give one of them"};
  if (c.sensors.enabled || has_folder) return {};
  return Failure{Message(*folders[0]) +
                 " is missing; give a folder in the KITTI layout, a folder as pcd, ply or depth, "
                 "or a table [sensors]"};
}

Outcome<void> check_vehicle(const VehicleConfig& v) {
  if (!is_base_id(v.base_id))
    return Failure{Message(kVehicleSettings["vehicle.base_id"]) +
                   " is not a multiple of 32 up to 2016 (0x7e0)"};
  if (v.sectors != 16 && v.sectors != 32)
    return Failure{Message(kVehicleSettings["vehicle.sectors"]) + " is neither 16 nor 32"};
  const SettingName& low = kVehicleSettings["vehicle.sector_low_m"];
  if (v.sector_high_m >= v.sector_low_m) return {};
  return not_allowed(kVehicleSettings["vehicle.sector_high_m"], text_of(v.sector_high_m),
                     "metres from " + Message(low));
}

Outcome<void> check_processors(const NodeConfig& c) {
  const auto is_none = [](std::uint32_t cpu) { return cpu >= 64; };
  for (const auto* const cpus : {&c.mapping_cpus, &c.other_cpus}) {
    if (std::none_of(cpus->begin(), cpus->end(), is_none)) continue;
    const bool mapping = cpus == &c.mapping_cpus;
    return Failure{Message(mapping ? kNodeSettings["realtime.mapping_cpus"]
                                   : kNodeSettings["realtime.other_cpus"]) +
                   " has a processor over 63; give 0 to 63"};
  }
  return {};
}

Outcome<void> check_sensors(const NodeConfig& c) {
  const SensorsConfig& s = c.sensors;
  if (!s.enabled) return {};
  const Message clouds(kSensorSettings["sensors.clouds"]);
  if (s.poses == PoseWay::kCan && c.vehicle.can.empty())
    return Failure{Message(kSensorSettings["sensors.poses"]) +
                   " \"can\" needs a bus; name [vehicle] can"};
  if (s.clouds == CloudKind::kNone && !s.depth_camera)
    return Failure{clouds + " \"none\" needs a depth_camera; name one"};
  if (s.clouds == CloudKind::kRaw && s.cameras.empty())
    return Failure{clouds + " \"raw\" needs cameras for labels; name their file"};
  if (s.depth_camera && s.cameras.empty())
    return Failure{Message(kSensorSettings["sensors.depth_camera"]) +
                   " needs the file of cameras; name cameras too"};
  return {};
}

/// What more than one key says together.
Outcome<void> check(const NodeConfig& c) {
  Outcome<void> done = check_publishing(c);
  if (done.ok()) done = check_keys(c);
  if (done.ok()) done = check_mission(c);
  if (done.ok()) done = check_excluded(c);
  if (done.ok()) done = check_sessions(c);
  if (done.ok()) done = check_restart(c);
  if (done.ok()) done = check_view(c);
  if (done.ok()) done = check_source_of_scans(c);
  if (done.ok()) done = check_vehicle(c.vehicle);
  if (done.ok()) done = check_processors(c);
  if (done.ok()) done = check_sensors(c);
  return done;
}

}  // namespace

Outcome<NodeConfig> parse_node_config(std::string_view text, const std::string& path) {
  TESSERA_TRY_ASSIGN(ConfigFile file, ConfigFile::parse(text, path));
  NodeConfig config;
  config.places = file.places();
  set_defaults(config.places, config);
  read_tables(file, config);
  TESSERA_TRY(file.finish());
  const Outcome<void> checked = check(config);
  if (!checked.ok()) return config.places.worded(checked.failure());
  config.values = file.values();
  return config;
}

Outcome<NodeConfig> read_node_config(const std::string& path) {
  constexpr std::size_t kMostBytes = 1U << 20U;
  TESSERA_TRY_ASSIGN(const std::string text, read_text_file(path, kMostBytes));
  return parse_node_config(text, path);
}

}  // namespace tessera
