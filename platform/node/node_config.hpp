// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The configuration of a node: one file, described key by key in docs/reference/node.md.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/json.hpp"
#include "base/outcome.hpp"
#include "link/datagram_link.hpp"
#include "link/fleet_keys.hpp"
#include "link/sensor_link.hpp"
#include "node/query_port.hpp"
#include "node/robot_state.hpp"
#include "scans/sensor_port.hpp"
#include "settings/config_file.hpp"
#include "settings/map_options.hpp"
#include "settings/session_options.hpp"
#include "settings/sharing_setup.hpp"
#include "vehicle/bus_table.hpp"
#include "vehicle/pose_guard.hpp"
#include "vehicle/vehicle_inputs.hpp"

namespace tessera {

/// Clouds that a node's sensor sends.
enum class CloudKind : std::uint8_t {
  kSemantic,  ///< With labels.
  kRaw,       ///< Without: the cameras label them.
  kNone,
};
constexpr const char* to_string(CloudKind kind) noexcept {
  switch (kind) {
    case CloudKind::kSemantic:
      return "semantic";
    case CloudKind::kRaw:
      return "raw";
    case CloudKind::kNone:
      return "none";
  }
  return "";
}

/// How poses arrive.
enum class PoseWay : std::uint8_t { kLcm, kCan };
constexpr const char* to_string(PoseWay way) noexcept {
  return way == PoseWay::kCan ? "can" : "lcm";
}

/// [sensors]: sources of scans and poses, unless they are replayed.
struct SensorsConfig {
  bool enabled = false;  ///< The table exists, and there is no dataset to replay.
  std::string url = kDefaultSensorUrl;
  std::string interface = "lo";
  CloudKind clouds = CloudKind::kSemantic;
  std::int32_t lidar = 0;                     ///< Sensor number of clouds in messages.
  std::uint32_t points = 131'072;             ///< Most points of a scan.
  std::string T_body_lidar;                   ///< File; empty: the identity.
  std::string cameras;                        ///< cameras.toml; empty: none.
  std::optional<std::uint32_t> depth_camera;  ///< The one of them that gives depth images.
  std::string classes;                        ///< classes.toml; empty: SemanticKITTI's.
  SensorClock clock = SensorClock::kMonotonic;
  PoseWay poses = PoseWay::kLcm;
  MissingImages missing_images = MissingImages::kUnlabelled;
  double max_wait_ms = 100.0;
  double max_image_offset_ms = 50.0;
  double max_pose_gap_ms = 150.0;  ///< Between the two poses around a scan's stamp.
};

/// What a node does with the map of the start before.
enum class Restart : std::uint8_t {
  kContinue,  ///< Maps on in it.
  kEmpty,     ///< Begins with an empty map.
};
constexpr const char* to_string(Restart restart) noexcept {
  return restart == Restart::kEmpty ? "empty" : "continue";
}

/// [vehicle]: its CAN bus, and the limits of usable poses.
struct VehicleConfig {
  std::string can;  ///< Interface; empty: none.
  std::uint32_t base_id = kDefaultBaseId;
  PoseMode mode = PoseMode::kBridging;
  bool can_fd = false;
  std::uint32_t sectors = 16;
  double sector_range_m = 20.0;
  double sector_low_m = -1.0;
  double sector_high_m = 1.0;
  double own_radius_m = 0.0;
  double pose_timeout_ms = 200.0;
  PoseGuardConfig guard{};
};

/// Including what is shared and how it is fused: [robot] robot, [publish], [fusion], and the rates
/// of [network].
struct NodeConfig : SharingOptions {
  NodeConfig() { map.memory_bytes = std::size_t{192} << 20U; }

  // [robot]
  std::string state;  ///< Folder of the robot's state, kept over restarts.
  EarlierEpochs earlier = EarlierEpochs::kKeep;
  std::optional<Restart> restart;        ///< Nothing: kContinue with sensors, else kEmpty.
  double state_loss_s = 2.0;             ///< What a crash may cost.
  std::string T_global_map;              ///< File; empty: as in the dataset, else the identity.
  std::vector<SessionOptions> sessions;  ///< [[sessions]]
  // [replay], [map]; not all of MapOptions is for a node.
  MapOptions map;
  double rate_hz = 10.0;  ///< 0: as fast as possible.
  bool loop = false;
  double start_delay_s = 0.0;
  SensorsConfig sensors;
  VehicleConfig vehicle;
  // [service]
  bool queries = false;
  std::string query_url = kDefaultQueryUrl;
  std::string query_interface = "lo";
  std::uint32_t queries_per_s = 200;
  std::string view;              ///< Address and port for showing the maps; empty: none.
  bool view_everywhere = false;  ///< Allows an address that other machines reach.
  std::uint32_t view_voxels_per_s = 50'000;
  // [mapping], [realtime]
  std::int64_t period_ms = 100;
  std::int64_t priority = 0;  ///< Of the mapping thread, SCHED_FIFO; 0: none.
  bool lock_memory = false;
  std::vector<std::uint32_t> mapping_cpus;  ///< Empty: any.
  std::vector<std::uint32_t> other_cpus;
  // [network]
  LinkConfig link;
  std::uint32_t send_slots = 512;
  bool status = true;
  // [security]
  KeyFiles keys;
  std::vector<std::uint32_t> exclude;
  // [output]
  std::string global_map;
  std::string local_map;
  bool keep_maps = true;  ///< Of earlier starts, and from before the map was cleared.
  std::string contribution;
  std::string report;
  std::string snapshots;
  double snapshot_every_s = 1.0;
  // [run]
  std::uint32_t wait_for_peers = 0;
  double silence_s =
      0.0;  ///< After this time without another scan none will come; 0: one always may.
  double quiet_s = 3.0;
  double linger_s = 60.0;
  double duration_s = 0.0;  ///< 0: no limit.

  [[nodiscard]] bool continues() const {
    const bool can = sensors.enabled && !map.window_m;
    return restart.value_or(can ? Restart::kContinue : Restart::kEmpty) == Restart::kContinue;
  }

  Json values;  ///< All values, by table and key.
  ConfigPlaces places;
};

/// Fails with kUsage, naming the line and what to write instead, iff the file is missing or differs
/// from docs/reference/node.md in any way. set_up_robot() checks what settings of the map and of
/// the diffusion say together.
Outcome<NodeConfig> read_node_config(const std::string& path);
Outcome<NodeConfig> parse_node_config(std::string_view text, const std::string& path);

}  // namespace tessera
