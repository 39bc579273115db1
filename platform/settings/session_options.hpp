// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map of an earlier day that a robot loads: [[sessions]] of a node, --session of fuse.
#pragma once

#include <string>

#include "settings/setting.hpp"

namespace tessera {

struct SessionOptions {
  std::string file{};
  double weight = 0.5;  ///< Of its evidence, above 0 and at most 1.
  std::string frame{};  ///< File of T_global_map; empty: the map's own, else the identity.
  friend bool operator==(const SessionOptions&, const SessionOptions&) = default;
};

/// What its evidence is multiplied by.
inline constexpr Allowed kSessionWeights = from_to(0.0001, 1.0);

inline constexpr Setting kSessionRows[] = {
    path_row<&SessionOptions::file>(
        {.table = "sessions", .key = "file"},
        "map of an earlier day, as a map file of any kind ([operations.md]"
        "(operations.md#maps-of-earlier-days))",
        {.required = "a map file"}),
    row<&SessionOptions::weight>({.table = "sessions", .key = "weight"},
                                 "what its evidence is multiplied by",
                                 {.allowed = kSessionWeights}),
    path_row<&SessionOptions::frame>(
        {.table = "sessions", .key = "frame"},
        "file of its frame in the global map, 4 x 4, row by row, metres",
        {.otherwise = "the file's own `T_global_map`, else the identity"}),
};
inline constexpr SettingTable<SessionOptions> kSessionSettings{kSessionRows};

}  // namespace tessera
