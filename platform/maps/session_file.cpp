// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/session_file.hpp"

#include <sys/stat.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/input_file.hpp"
#include "base/number_text.hpp"
#include "maps/open_map.hpp"
#include "maps/submaps.hpp"
#include "scans/transform_file.hpp"
#include "tessera/map/queries.hpp"
#include "tessera/replica/grid_transform.hpp"

namespace tessera {

namespace {

/// When the file was last written: a map file has no date.
Outcome<std::int64_t> date_of(const std::string& path) {
  TESSERA_TRY_ASSIGN(const InputFile file, InputFile::open(path));
  struct stat status {};
  if (::fstat(file.descriptor(), &status) != 0)
    return Failure{path + ": the time of the file cannot be read", FailureKind::kFailure};
  return static_cast<std::int64_t>(status.st_mtim.tv_sec);
}

/// Of submaps the digest covers their frames too.
Outcome<std::uint64_t> digest_of(const std::string& path, SessionFile& file) {
  if (is_journal(path)) return digest(file.stored->map, file.workspace);
  TESSERA_TRY_ASSIGN(const MapFileHeader header, load_map_header(path));
  if (header.identity.kind != MapKind::kSubmaps) return digest(file.stored->map, file.workspace);
  TESSERA_TRY_ASSIGN(const StoredSubmaps submaps, load_submaps(path, header));
  return digest(std::span(submaps.rows));
}

}  // namespace

std::uint16_t session_weight(double weight) {
  const double units = std::round(weight * MapSession::kFullWeight);
  return static_cast<std::uint16_t>(std::clamp(units, 1.0, double{MapSession::kFullWeight}));
}

double weight_of(const MapSession& session) {
  constexpr double kDigits = 1e4;  // as fine as the least weight
  return std::round(session.weight / double{MapSession::kFullWeight} * kDigits) / kDigits;
}

Outcome<SessionFile> load_session(const SessionOptions& options) {
  SessionFile file;
  file.path = options.file;
  TESSERA_TRY_ASSIGN(file.session.date_s, date_of(options.file));
  TESSERA_TRY_ASSIGN(file.stored, open_map(options.file));
  file.workspace = workspace_for(file.stored->map);
  TESSERA_TRY_ASSIGN(file.session.digest, digest_of(options.file, file));
  file.session.weight = session_weight(options.weight);
  file.blocks = file.stored->map.blocks_in_order(file.workspace);
  const MapIdentity& identity = file.stored->header.identity;
  file.placed = !options.frame.empty() || identity.is_placed();
  file.T_global_map = identity.place();
  if (!options.frame.empty()) {
    TESSERA_TRY_ASSIGN(file.T_global_map, read_transform(options.frame));
  }
  return file;
}

Outcome<void> check_frame_of_sessions(const FramesConfig& frames, const SettingName& setting) {
  if (knows_own_frame(frames)) return {};
  return Failure{
      Message("sessions need a robot whose frame is known: ") + setting + " is " +
      to_string(frames.mode) +
      "; leave out the sessions, or have it given, or refined from an exact one (sigmas of 0)"};
}

Outcome<void> check_session(const SessionFile& file, const MapConfig& map,
                            const ClassTable& classes) {
  const MapConfig& own = file.stored->map.config();
  const auto differs = [&](const char* what, double there, double here) {
    return Failure{file.path + " has " + what + " " + text_of(there) + ", but the maps here have " +
                   text_of(here) + "; give a session with the same"};
  };
  if (own.resolution_m != map.resolution_m)
    return differs("resolution", own.resolution_m, map.resolution_m);
  if (own.free_weight != map.free_weight)
    return differs("free weight", decimal_of(own.free_weight), decimal_of(map.free_weight));
  if (!(file.stored->map.classes() == classes))
    return Failure{file.path +
                   " has other classes than the maps here; give a session with the "
                   "same classes"};
  if (GridTransform::make(file.T_global_map, map.resolution_m).ok()) return {};
  return Failure{file.path + ": its frame puts it outside of the grid; fix the frame"};
}

std::string date_text(std::int64_t date_s) {
  const auto seconds = static_cast<time_t>(date_s);
  tm utc{};
  std::array<char, 32> text{};
  if (::gmtime_r(&seconds, &utc) == nullptr) return {};
  return {text.data(), ::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

Json to_json(const MapSession& session) {
  return {{"digest", hex64(session.digest)},
          {"date", date_text(session.date_s)},
          {"weight", weight_of(session)}};
}

}  // namespace tessera
