// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The settings of a robot's keys.
#pragma once

#include "link/fleet_keys.hpp"
#include "settings/setting.hpp"

namespace tessera {

inline constexpr Setting kKeyRows[] = {
    path_row<&KeyFiles::fleet_key>(
        {.table = "security", .key = "fleet_key"},
        "key file ([network.md](network.md#keys-and-what-they-protect-against)); without it tags "
        "are checksums and protect from nobody"),
    path_row<&KeyFiles::robot_secret>(
        {.table = "security", .key = "robot_secret"},
        "key file of this robot: it signs its messages, and accepts only signed ones"),
    path_row<&KeyFiles::robot_public_keys>(
        {.table = "security", .key = "robot_public_keys"},
        "file of the fleet's public keys; needs `robot_secret`, and the reverse"),
    row<&KeyFiles::mission>({.table = "security", .key = "mission"},
                            "name of 1 to 64 bytes, the same on every robot",
                            {.otherwise = "the one that `fleet_key` names"}),
};
inline constexpr SettingTable<KeyFiles> kKeySettings{kKeyRows};

}  // namespace tessera
