// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a node is set up with: one file, described key by key in docs/node.md.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lcm/datagram_link.hpp"
#include "lcm/sensor_link.hpp"
#include "mapping/map_options.hpp"
#include "mapping/report.hpp"
#include "mapping/sharing_setup.hpp"
#include "node/robot_state.hpp"
#include "posix/outcome.hpp"
#include "security/fleet_keys.hpp"
#include "service/query_port.hpp"
#include "vehicle/bus_table.hpp"
#include "vehicle/pose_guard.hpp"

namespace tessera {

class ConfigFile;

/// [sensors]: where scans and poses come from that are not replayed.
struct SensorsConfig {
  bool enabled = false;  ///< There is the table, and no dataset to replay.
  std::string url = kDefaultSensorUrl;
  std::string interface = "lo";
  std::string clouds = "semantic";            ///< "semantic", "raw", "none".
  std::int32_t lidar = 0;                     ///< Number of clouds' sensor in messages.
  std::uint32_t points = 131'072;             ///< Of a scan, at most.
  std::string T_body_lidar;                   ///< File; empty: the identity.
  std::string cameras;                        ///< cameras.toml; empty: none.
  std::optional<std::uint32_t> depth_camera;  ///< Of these, that gives depth images.
  std::string classes;                        ///< classes.toml; empty: SemanticKITTI's.
  std::string clock = "monotonic";            ///< "monotonic", "wall".
  std::string poses = "lcm";                  ///< "lcm", "can".
  std::string missing_images = "unlabelled";
  double max_wait_ms = 100.0;
  double max_image_offset_ms = 50.0;
  double max_pose_gap_ms = 150.0;  ///< Between the two poses around a scan's stamp.
};

/// [vehicle]: its CAN bus, and what makes a pose unfit to map with.
struct VehicleConfig {
  std::string can;  ///< Interface; empty: none.
  std::uint32_t base_id = kDefaultBaseId;
  std::string mode = "bridging";  ///< "pose", "bridging", "odometry".
  bool can_fd = false;
  std::uint32_t sectors = 16;
  double sector_range_m = 20.0;
  double sector_low_m = -1.0;
  double sector_high_m = 1.0;
  double own_radius_m = 0.0;
  PoseGuardConfig guard{};
};

/// With what is shared, and how it becomes one map: [robot] robot, [publish], [fusion], and the
/// rates of [network].
struct NodeConfig : SharingOptions {
  // [robot]
  std::string state;  ///< Folder of what the robot knows of its earlier starts.
  EarlierEpochs earlier = EarlierEpochs::kKeep;
  std::string T_global_map;  ///< File; empty: as the dataset says, else the identity.
  // [replay], [map]; not all of MapOptions is for a node.
  MapOptions map;
  double rate_hz = 10.0;  ///< 0: as fast as it goes.
  bool loop = false;
  double start_delay_s = 0.0;
  SensorsConfig sensors;
  VehicleConfig vehicle;
  // [service]
  bool queries = false;
  std::string query_url = kDefaultQueryUrl;
  std::string query_interface = "lo";
  std::uint32_t queries_per_s = 200;
  std::string view;              ///< Address and port to show the maps at; empty: none.
  bool view_everywhere = false;  ///< It may be one that other machines reach.
  std::uint32_t view_voxels_per_s = 50'000;
  // [mapping], [realtime]
  std::int64_t period_ms = 100;
  std::int64_t priority = 0;  ///< Of the mapping thread, SCHED_FIFO; 0: as any program.
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
  bool keep_maps = true;  ///< Of earlier epochs, and from before the map was cleared.
  std::string contribution;
  std::string report;
  std::string snapshots;
  double snapshot_every_s = 1.0;
  // [run]
  std::uint32_t wait_for_peers = 0;
  double silence_s = 0.0;  ///< Without a scan, when there was one: none will come; 0: one may.
  double quiet_s = 3.0;
  double linger_s = 60.0;
  double duration_s = 0.0;  ///< 0: no limit.

  Json values;  ///< All of it, by table and key.
};

/// The tables of sensors, vehicle and service.
void take_sensors(ConfigFile& file, NodeConfig& config);
void take_vehicle(ConfigFile& file, NodeConfig& config);
void take_service(ConfigFile& file, NodeConfig& config);
/// Whether the address is one, and for whom it is meant.
Outcome<void> check_view(const ConfigFile& file, const NodeConfig& config);
/// Whether they fit together.
Outcome<void> check_sensors(const ConfigFile& file, const NodeConfig& config);

/// Fails with kUsage, naming the line and what to write instead, iff the file is missing or has
/// anything that is not as docs/node.md says. Ranges of the map's and the diffusion's settings are
/// checked where they are set up (set_up_robot).
Outcome<NodeConfig> read_node_config(const std::string& path);
Outcome<NodeConfig> parse_node_config(std::string_view text, const std::string& path);

/// "path, line n: [map] max_range_m -1 is not allowed; ..." of a failure that names an option of
/// "map" or "fuse" (--max-range).
Failure in_words_of_config(const Failure& failure, const std::string& path);

}  // namespace tessera
