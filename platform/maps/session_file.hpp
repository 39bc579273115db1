// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map file as a session: its content in one piece, its name, date and frame.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/json.hpp"
#include "maps/stored_map.hpp"
#include "settings/session_options.hpp"
#include "tessera/replica/map_session.hpp"
#include "tessera/robot/frames_config.hpp"

namespace tessera {

struct SessionFile {
  std::string path;
  std::unique_ptr<StoredMap> stored;
  std::vector<KeyedIndex> workspace{};
  std::span<const KeyedIndex> blocks{};  ///< Of all of the map, in workspace.
  MapSession session{};                  ///< Its date is the file's time of modification.
  bool placed = false;                   ///< T_global_map was given, or is in the file.
  Matrix34d T_global_map = Matrix34d::Identity();
};

/// Reads a map file of any kind; one in submaps as the one map that their frames give. Its digest
/// is that of tessera info. Fails with kUsage iff the file, or that of its frame, is missing or
/// damaged.
Outcome<SessionFile> load_session(const SessionOptions& options);
/// Fails with kUsage iff it cannot be part of a global map of such maps: another resolution, other
/// classes or another weight of free passes, or its frame lies out of the grid.
Outcome<void> check_session(const SessionFile& file, const MapConfig& map,
                            const ClassTable& classes);

/// Fails with kUsage iff a robot with these frames shares no sessions (knows_own_frame). setting:
/// the name of frames.
Outcome<void> check_frame_of_sessions(const FramesConfig& frames, const SettingName& setting);

/// Units of a weight above 0 and at most 1.
[[nodiscard]] std::uint16_t session_weight(double weight);
/// The weight that this was given as, to four digits.
[[nodiscard]] double weight_of(const MapSession& session);
/// "2026-11-26T18:04:05Z", in UTC; empty where that is no date.
[[nodiscard]] std::string date_text(std::int64_t date_s);
/// Digest, date and weight.
[[nodiscard]] Json to_json(const MapSession& session);

}  // namespace tessera
