// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Maps of earlier days among the maps to fuse.
#pragma once

#include <string>
#include <vector>

#include "maps/fuse_inputs.hpp"
#include "maps/session_file.hpp"
#include "settings/session_options.hpp"

namespace tessera {

/// The option of maps of earlier days.
inline constexpr SettingName kSessionSetting{.option = "--session", .argument = "sessions"};

/// Sessions as typed, FILE.tsm or FILE.tsm:WEIGHT. transforms: as typed, FILE.tsm=T.txt; those of
/// sessions are taken out. Fails with kUsage iff there are over MapSession::kMostOfRobot, one is
/// named twice, or a weight is out of its range.
Outcome<std::vector<SessionOptions>> parse_sessions(const std::vector<std::string>& texts,
                                                    std::vector<std::string>& transforms);

/// Fails with kUsage iff there are over MapSession::kMostOfRobot.
Outcome<void> check_number_of_sessions(std::size_t sessions);

/// Adds a session to the inputs, which are arranged, and not none. Adds warnings about it. Fails as
/// check_session, and with kUsage iff one has its content already.
Outcome<void> add_session(SessionFile file, std::vector<FuseInput>& inputs,
                          std::vector<Message>& warnings);
/// Loads sessions and adds them. Fails as load_session and add_session.
Outcome<void> add_sessions(const std::vector<SessionOptions>& sessions,
                           std::vector<FuseInput>& inputs, std::vector<Message>& warnings);

}  // namespace tessera
