// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The settings of a node by itself: how it runs, and where its files are.
#pragma once

#include "node/node_config.hpp"

namespace tessera {

template <>
inline constexpr std::array kChoicesOf<Restart>{Restart::kContinue, Restart::kEmpty};
template <>
inline constexpr std::array kChoicesOf<EarlierEpochs>{EarlierEpochs::kKeep, EarlierEpochs::kDrop};

inline constexpr Setting kNodeRows[] = {
    path_row<&NodeConfig::state>({.table = "robot", .key = "state"},
                                 "folder of the node's state, created if missing; holds "
                                 "`robot_ID.state` and `robot_ID.lock`",
                                 {.required = "a folder in which the node keeps its state"}),
    row<&NodeConfig::earlier>({.table = "robot", .key = "earlier"},
                              "what happens to data that the robot published before this start"),
    row<&NodeConfig::restart>(
        {.table = "robot", .key = "restart"},
        "map of the start before, as a crash or an end has left it: map on in "
        "it, or begin with an empty one",
        {.otherwise = "`\"continue\"` with `[sensors]` and without `[map] "
                      "window_m`, else `\"empty\"`"}),
    row<&NodeConfig::state_loss_s>(
        {.table = "robot", .key = "state_loss_s"},
        "mapping that a crash may cost: the map is made durable twice in this time",
        {.allowed = from_to(0.2, 3600.0, "seconds")}),
    path_row<&NodeConfig::T_global_map>(
        {.table = "robot", .key = "T_global_map"},
        "file of the map's frame, 4 x 4, row by row, metres",
        {.otherwise = "`T_global_map.txt` beside the replayed scans, else the identity"}),
    row<&NodeConfig::rate_hz>(
        {.table = "replay", .key = "rate_hz"},
        "scans a second; 0: as fast as possible. No scan is dropped; a late one is integrated late",
        {.allowed = from_to(0.0, 1000.0)}),
    row<&NodeConfig::loop>({.table = "replay", .key = "loop"},
                           "restart after the last scan, until a signal or `duration_s`"),
    row<&NodeConfig::start_delay_s>({.table = "replay", .key = "start_delay_s"},
                                    "pause before the first scan",
                                    {.allowed = from_to(0.0, 86400.0, "seconds")}),
    row<&NodeConfig::period_ms>({.table = "mapping", .key = "period_ms"}, "period of scans",
                                {.allowed = from_to(1.0, 10000.0, "milliseconds")}),
    row<&NodeConfig::priority>({.table = "realtime", .key = "priority"},
                               "SCHED_FIFO priority of the mapping thread; 0: none",
                               {.allowed = from_to(0.0, 95.0)}),
    row<&NodeConfig::lock_memory>({.table = "realtime", .key = "lock_memory"},
                                  "lock all memory in RAM"),
    row<&NodeConfig::mapping_cpus>({.table = "realtime", .key = "mapping_cpus"},
                                   "processors of the mapping thread, 0 to 63; empty: any"),
    row<&NodeConfig::other_cpus>(
        {.table = "realtime", .key = "other_cpus"},
        "processors of the other threads, including the first one once all run"),
    row<&NodeConfig::link, &LinkConfig::url>(
        {.table = "network", .key = "url"},
        "network of the fleet ([network.md](network.md#what-is-on-the-wire))"),
    row<&NodeConfig::link, &LinkConfig::interface>({.table = "network", .key = "interface"},
                                                   "network interface, by name or IPv4 address",
                                                   {.otherwise = "what the routes choose"}),
    row<&NodeConfig::link, &LinkConfig::queue_slots>({.table = "network", .key = "receive_slots"},
                                                     "datagrams in the receive queue",
                                                     {.allowed = from_to(16.0, 1048576.0)}),
    row<&NodeConfig::send_slots>({.table = "network", .key = "send_slots"},
                                 "datagrams in the send queue",
                                 {.allowed = from_to(16.0, 1048576.0)}),
    row<&NodeConfig::status>({.table = "network", .key = "status"},
                             "send `TESSERA_STATUS` once a second"),
    row<&NodeConfig::exclude>({.table = "security", .key = "exclude"},
                              "numbers of robots, 16 at most: all their data is refused; [read "
                              "again](#reading-again-while-it-runs) on request"),
    row<&NodeConfig::queries>({.table = "service", .key = "queries"},
                              "answer planners ([queries.md](queries.md))",
                              {.otherwise = "false; with `[sensors]` true"}),
    row<&NodeConfig::query_url>({.table = "service", .key = "url"},
                                "network of this machine's planners; ttl 0"),
    row<&NodeConfig::query_interface>({.table = "service", .key = "interface"},
                                      "network interface, by name or IPv4 address; with an "
                                      "interface other than `lo` other machines may ask too"),
    row<&NodeConfig::queries_per_s>({.table = "service", .key = "queries_per_s"},
                                    "queries that are answered in a second; more are refused",
                                    {.allowed = from_to(1.0, 100000.0)}),
    row<&NodeConfig::view>({.table = "service", .key = "view"},
                           "IP address and port to show the maps at in browsers, "
                           "`\"127.0.0.1:8080\"` ([view.md](view.md)); port 0: any free port"),
    row<&NodeConfig::view_everywhere>({.table = "service", .key = "view_everywhere"},
                                      "allow an address in `view` that other machines can reach; "
                                      "every machine that reaches it can see the maps"),
    row<&NodeConfig::view_voxels_per_s>(
        {.table = "service", .key = "view_voxels_per_s"},
        "voxels sent in a second, to all pages together; the rest is sent later",
        {.allowed = from_to(1000.0, 1e7)}),
    path_row<&NodeConfig::global_map>(
        {.table = "output", .key = "global_map"},
        "file for the global map (.tsm), with the number and the epoch of this robot"),
    path_row<&NodeConfig::local_map>({.table = "output", .key = "local_map"},
                                     "file for the robot's own map"),
    row<&NodeConfig::keep_maps>({.table = "output", .key = "keep_maps"},
                                "keep maps of earlier starts, and save a map before it is cleared; "
                                "false: overwrite and clear"),
    path_row<&NodeConfig::contribution>({.table = "output", .key = "contribution"},
                                        "file for the robot's published data, as a local map"),
    path_row<&NodeConfig::report>({.table = "output", .key = "report"},
                                  "file for the report (JSON); a start overwrites it"),
    path_row<&NodeConfig::snapshots>({.table = "output", .key = "snapshots"},
                                     "folder for copies of the global map: `global_0000.tsm`, ...; "
                                     "a start overwrites its files"),
    row<&NodeConfig::snapshot_every_s>({.table = "output", .key = "snapshot_every_s"},
                                       "time between two copies",
                                       {.allowed = from_to(0.05, 86400.0, "seconds")}),
    row<&NodeConfig::wait_for_peers>(
        {.table = "run", .key = "wait_for_peers"},
        "robots that must have been received before the node ends by itself",
        {.allowed = from_to(0.0, 1024.0)}),
    row<&NodeConfig::silence_s>(
        {.table = "run", .key = "silence_s"},
        "time without a scan after which the sensors count as ended; 0: they never do",
        {.allowed = from_to(0.0, 86400.0, "seconds")}),
    row<&NodeConfig::quiet_s>({.table = "run", .key = "quiet_s"},
                              "time without a change and without new data, after the last scan, "
                              "after which the node ends",
                              {.allowed = from_to(0.0, 3600.0, "seconds")}),
    row<&NodeConfig::linger_s>({.table = "run", .key = "linger_s"},
                               "time after the last scan at which the node ends in any case",
                               {.allowed = from_to(0.0, 86400.0, "seconds")}),
    row<&NodeConfig::duration_s>(
        {.table = "run", .key = "duration_s"},
        "time after the start at which the node ends in any case; 0: never",
        {.allowed = from_to(0.0, 1e7, "seconds")}),
};
inline constexpr SettingTable<NodeConfig> kNodeSettings{kNodeRows};

}  // namespace tessera
