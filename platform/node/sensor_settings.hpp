// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The settings of a node's sensors and of its vehicle.
#pragma once

#include "node/node_config.hpp"

namespace tessera {

template <>
inline constexpr std::array kChoicesOf<CloudKind>{CloudKind::kSemantic, CloudKind::kRaw,
                                                  CloudKind::kNone};
template <>
inline constexpr std::array kChoicesOf<PoseWay>{PoseWay::kLcm, PoseWay::kCan};
template <>
inline constexpr std::array kChoicesOf<MissingImages>{MissingImages::kUnlabelled,
                                                      MissingImages::kDrop};
template <>
inline constexpr std::array kChoicesOf<PoseMode>{PoseMode::kPose, PoseMode::kBridging,
                                                 PoseMode::kOdometry};

inline constexpr Setting kSensorRows[] = {
    row<&SensorsConfig::url>({.table = "sensors", .key = "url"},
                             "network of this machine's sensors; ttl 0"),
    row<&SensorsConfig::interface>({.table = "sensors", .key = "interface"},
                                   "network interface, by name or IPv4 address"),
    row<&SensorsConfig::clouds>(
        {.table = "sensors", .key = "clouds"},
        "clouds that arrive: with labels, raw (labelled by the cameras), or none"),
    row<&SensorsConfig::lidar>({.table = "sensors", .key = "lidar"},
                               "number of the clouds' sensor in messages",
                               {.allowed = from_to(0.0, 1e6)}),
    row<&SensorsConfig::points>({.table = "sensors", .key = "points"},
                                "most points of a scan; a larger scan is refused",
                                {.allowed = from_to(1.0, 4e6)}),
    path_row<&SensorsConfig::T_body_lidar>({.table = "sensors", .key = "T_body_lidar"},
                                           "file of the sensor's pose, 4 x 4, row by row, metres",
                                           {.otherwise = "the identity"}),
    path_row<&SensorsConfig::cameras>({.table = "sensors", .key = "cameras"},
                                      "file `cameras.toml` ([cli.md](cli.md#datasets)); cameras "
                                      "are numbered from 0, as in messages"),
    row<&SensorsConfig::depth_camera>({.table = "sensors", .key = "depth_camera"},
                                      "number of the camera that sends depth images",
                                      {.allowed = from_to(0.0, 5.0)}),
    path_row<&SensorsConfig::classes>({.table = "sensors", .key = "classes"}, "file `classes.toml`",
                                      {.otherwise = "SemanticKITTI's"}),
    row<&SensorsConfig::clock>({.table = "sensors", .key = "clock"},
                               "clock of the sensors' stamps"),
    row<&SensorsConfig::poses>({.table = "sensors", .key = "poses"}, "how poses arrive"),
    row<&SensorsConfig::missing_images>({.table = "sensors", .key = "missing_images"},
                                        "what happens to a scan without its images"),
    row<&SensorsConfig::max_wait_ms>({.table = "sensors", .key = "max_wait_ms"},
                                     "longest wait for poses and images",
                                     {.allowed = from_to(1.0, 10000.0, "milliseconds")}),
    row<&SensorsConfig::max_image_offset_ms>({.table = "sensors", .key = "max_image_offset_ms"},
                                             "longest time between a scan and its images",
                                             {.allowed = from_to(0.0, 10000.0, "milliseconds")}),
    row<&SensorsConfig::max_pose_gap_ms>(
        {.table = "sensors", .key = "max_pose_gap_ms"},
        "longest time between the two poses around a scan; with a larger gap the scan is dropped",
        {.allowed = from_to(1.0, 10000.0, "milliseconds")}),
};
inline constexpr SettingTable<SensorsConfig> kSensorSettings{kSensorRows};

inline constexpr Setting kVehicleRows[] = {
    row<&VehicleConfig::can>({.table = "vehicle", .key = "can"}, "CAN interface"),
    row<&VehicleConfig::base_id>({.table = "vehicle", .key = "base_id"},
                                 "the lowest identifier, a multiple of 32 ([can.md](can.md))",
                                 {.allowed = from_to(0.0, 2016.0)}),
    row<&VehicleConfig::mode>({.table = "vehicle", .key = "mode"}, "source of poses"),
    row<&VehicleConfig::can_fd>({.table = "vehicle", .key = "can_fd"}, "sectors in CAN FD frames"),
    row<&VehicleConfig::sectors>({.table = "vehicle", .key = "sectors"},
                                 "number of obstacle sectors, 16 or 32",
                                 {.allowed = from_to(16.0, 32.0)}),
    row<&VehicleConfig::sector_range_m>({.table = "vehicle", .key = "sector_range_m"},
                                        "reach of the obstacle sectors",
                                        {.allowed = from_to(0.5, 60.0, "metres")}),
    row<&VehicleConfig::sector_low_m>({.table = "vehicle", .key = "sector_low_m"},
                                      "lower bound of obstacles, above the body's origin",
                                      {.allowed = from_to(-20.0, 20.0, "metres")}),
    row<&VehicleConfig::sector_high_m>({.table = "vehicle", .key = "sector_high_m"},
                                       "upper bound of obstacles, from `sector_low_m`",
                                       {.allowed = from_to(-20.0, 20.0, "metres")}),
    row<&VehicleConfig::own_radius_m>({.table = "vehicle", .key = "own_radius_m"},
                                      "anything nearer is the vehicle itself",
                                      {.allowed = from_to(0.0, 20.0, "metres")}),
    row<&VehicleConfig::pose_timeout_ms>(
        {.table = "vehicle", .key = "pose_timeout_ms"},
        "longest time without a pose, and age of a pose; beyond it poses are stale",
        {.allowed = from_to(10.0, 10000.0, "milliseconds")}),
    row<&VehicleConfig::guard, &PoseGuardConfig::max_speed_mps>(
        {.table = "vehicle", .key = "max_speed_mps"},
        "a faster pose is a jump; faster odometry is ignored",
        {.allowed = from_to(0.01, 200.0, "metres a second")}),
    row<&VehicleConfig::guard, &PoseGuardConfig::max_acceleration_mps2>(
        {.table = "vehicle", .key = "max_acceleration_mps2"},
        "largest change of speed between poses, beyond which they jump "
        "([can.md](can.md#which-poses-are-used))",
        {.allowed = from_to(0.1, 1000.0, "metres a second squared")}),
    row<&VehicleConfig::guard, &PoseGuardConfig::slack_m>(
        {.table = "vehicle", .key = "jump_m"},
        "a smaller step is no jump, whatever the time and the deviations",
        {.allowed = from_to(0.001, 100.0, "metres")}),
    row<&VehicleConfig::guard, &PoseGuardConfig::slack_rad>(
        {.table = "vehicle", .key = "jump_rad"}, "a smaller turn is no jump",
        {.allowed = from_to(0.001, 3.2, "radians")}),
    row<&VehicleConfig::guard, &PoseGuardConfig::max_yaw_rate_radps>(
        {.table = "vehicle", .key = "max_yaw_rate_radps"}, "a faster turn is a jump",
        {.allowed = from_to(0.01, 50.0, "radians a second")}),
    row<&VehicleConfig::guard, &PoseGuardConfig::max_std_position_m>(
        {.table = "vehicle", .key = "max_std_position_m"},
        "a pose with a larger standard deviation is not used for mapping",
        {.allowed = from_to(0.001, 100.0, "metres")}),
    row<&VehicleConfig::guard, &PoseGuardConfig::max_std_heading_rad>(
        {.table = "vehicle", .key = "max_std_heading_rad"},
        "the same for the standard deviation of the heading",
        {.allowed = from_to(0.0001, 3.2, "radians")}),
};
inline constexpr SettingTable<VehicleConfig> kVehicleSettings{kVehicleRows};

}  // namespace tessera
