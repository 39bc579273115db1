// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The settings of what a robot shares, and of fusing what it receives.
#pragma once

#include "settings/sharing_setup.hpp"
#include "tessera/replica/replicas.hpp"

namespace tessera {

constexpr const char* to_string(ConflictPolicy policy) noexcept {
  return policy == ConflictPolicy::kExclude ? "exclude" : "alarm";
}
template <>
inline constexpr std::array kChoicesOf<ConflictPolicy>{ConflictPolicy::kAlarm,
                                                       ConflictPolicy::kExclude};

template <>
inline constexpr std::array kChoicesOf<FrameMode>{FrameMode::kGiven, FrameMode::kRefined,
                                                  FrameMode::kFound};

inline constexpr Setting kSharingRows[] = {
    row<&SharingOptions::robot>(
        {.table = "robot", .key = "id"}, "number of the robot, unique in the fleet",
        {.required = "a number that no other robot of the fleet has", .fixed = true}),
    row<&SharingOptions::tick_ms>({.table = "run", .key = "tick_ms"},
                                  "time between two rounds of sharing",
                                  {.allowed = from_to(1.0, 1000.0, "milliseconds")}),
    row<&SharingOptions::staleness_s>({.table = "publish", .key = "staleness_s"},
                                      "time within which a change of labelled voxels is published",
                                      {.allowed = from_to(0.001, 3600.0, "seconds")}),
    row<&SharingOptions::free_staleness_s>(
        {.table = "publish", .key = "free_staleness_s"},
        "the same for voxels that are only free; from `staleness_s`",
        {.allowed = from_to(0.001, 3600.0, "seconds")}),
    row<&SharingOptions::evidence_factor>(
        {.table = "publish", .key = "evidence_factor"},
        "a block is published again when a voxel's evidence changed by more than this factor",
        {.allowed = from_to(1.01, 1e6)}),
    row<&SharingOptions::blocks>({.table = "publish", .key = "blocks"},
                                 "most blocks that are published and in the map",
                                 {.allowed = from_to(64.0, 268435456.0)}),
    row<&SharingOptions::label_bytes_per_s>(
        {.table = "publish", .key = "label_bytes_per_s"},
        "limit for publishing blocks with changed labels",
        {.allowed = {.least = 1000.0, .what = "bytes a second"}}),
    row<&SharingOptions::free_bytes_per_s>(
        {.table = "publish", .key = "free_bytes_per_s"}, "limit for publishing other blocks",
        {.allowed = {.least = 1000.0, .what = "bytes a second"}}),
    row<&SharingOptions::bytes_per_s>({.table = "network", .key = "bytes_per_s"},
                                      "limit for everything that is sent",
                                      {.allowed = from_to(1000.0, 125e6, "bytes a second")}),
    row<&SharingOptions::burst_bytes>({.table = "network", .key = "burst_bytes"},
                                      "most that is sent at once, after a pause",
                                      {.allowed = from_to(4096.0, 16777216.0, "bytes")}),
    row<&SharingOptions::peers>({.table = "network", .key = "peers"},
                                "most robots that are received", {.allowed = from_to(1.0, 1024.0)}),
    row<&SharingOptions::contributions>({.table = "network", .key = "contributions"},
                                        "most contributions that are known",
                                        {.allowed = from_to(1.0, Replicas::kMostContributions)}),
    row<&SharingOptions::contributions_per_robot>(
        {.table = "network", .key = "contributions_per_robot"},
        "most contributions of one other robot, those with the highest epochs and submaps; and of "
        "this one: it begins no more submaps than that",
        {.allowed = from_to(1.0, 65535.0)}),
    row<&SharingOptions::reach_m>(
        {.table = "network", .key = "reach_m"},
        "what others published within this distance of the robot is kept first; the rest as far as "
        "there is room; 0: all alike",
        {.allowed = from_to(0.0, 1e6, "metres")}),
    row<&SharingOptions::far_contributions>(
        {.table = "network", .key = "far_contributions"},
        "with `reach_m`: most contributions of which only a description is kept, of some 630 bytes",
        {.allowed = from_to(1.0, 65536.0)}),
    row<&SharingOptions::teammate_margin_m>(
        {.table = "network", .key = "teammate_margin_m"},
        "how much larger than they say other robots are taken to be, as frames and places are not "
        "exact",
        {.allowed = from_to(0.0, 2.0, "metres")}),
    row<&SharingOptions::objections>(
        {.table = "network", .key = "objections"},
        "most [objections](../design/theory.md) that are followed; older ones stay; 0: the robot "
        "makes and answers none",
        {.allowed = from_to(0.0, Objection::kPlaces)}),
    row<&SharingOptions::conflicts>(
        {.table = "security", .key = "conflicts"},
        "policy for [conflicts](../design/exchange.md#conflicts); the same on every robot"),
    bytes_row<&SharingOptions::fusion_memory_bytes>(
        {.table = "fusion", .key = "memory", .argument = "fusion_memory_bytes"},
        "memory for the global map: a quarter for copies of contributions, an eighth for sums, "
        "some 40 % "
        "for the map",
        {.allowed = {.most = 1e15}}),
    row<&SharingOptions::counts>({.table = "fusion", .key = "counts"},
                                 "how the global map stores counts"),
    row<&SharingOptions::robot_share>(
        {.table = "fusion", .key = "robot_share"},
        "share of one robot in the memory for copies of contributions",
        {.allowed = from_to(0.01, 1.0)}),
    row<&SharingOptions::work_per_tick>({.table = "fusion", .key = "work_per_tick"},
                                        "most work on the global map in a tick, in units of some "
                                        "20 to 60 ns ([timing.md](../measured/timing.md))",
                                        {.allowed = from_to(1000.0, 1099511627776.0)}),
    row<&SharingOptions::near_first>(
        {.table = "fusion", .key = "near_first"},
        "update the global map near the robot first, at a higher total cost"),
    row<&SharingOptions::frames>({.table = "fusion", .key = "frames"},
                                 "how frames are known: by `T_global_map`; roughly by it; or only "
                                 "by what robots see in common "
                                 "([frames](../frames.md))"),
    row<&SharingOptions::frame_sigma_m>(
        {.table = "fusion", .key = "frame_sigma_m"},
        "with `frames = \"refined\"`: standard deviation of `T_global_map` along each axis; 0, "
        "with `frame_sigma_deg` 0: it is exact",
        {.allowed = from_to(0.0, 100.0, "metres")}),
    row<&SharingOptions::frame_sigma_deg>({.table = "fusion", .key = "frame_sigma_deg"},
                                          "the same about each axis",
                                          {.allowed = from_to(0.0, 57.0, "degrees")}),
    row<&SharingOptions::frame_robots>(
        {.table = "fusion", .key = "frame_robots"},
        "most robots whose frames are found, those with the lowest numbers; this takes 17 to 19 MB "
        "beside `memory`, and 32 bytes for each block of copies",
        {.allowed = from_to(1.0, TeamFrames::kMostRobots)}),
};
inline constexpr SettingTable<SharingOptions> kSharingSettings{kSharingRows};

}  // namespace tessera
