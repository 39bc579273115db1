// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Maps of earlier days that a tessera.Sharer shares beside its own map.
#include "sharer_sessions.hpp"

#include <pybind11/stl.h>

#include "settings/sharing_settings.hpp"

namespace tessera::python {

namespace {

/// Shares all of it, in slices, so that other threads can use the sharer meanwhile.
std::uint32_t share(HeldSharer& sharer, const SessionFile& file) {
  constexpr std::size_t kBlocks = 256;
  const LocalMap& map = file.stored->map;
  const Result<std::uint32_t> number = sharer.change(
      [&](Sharer& s) { return s.sessions().open(map, file.session, file.T_global_map); });
  if (number.status() == Status::kResourceExhausted)
    throw WorkError(file.path + " has no place: at most " + std::to_string(MapSessions::kMost) +
                    " sessions are shared at a time, " +
                    std::to_string(MapSession::kPlacesOfRobot) + " in an epoch");
  if (!number.ok())
    throw InputError(file.path + " is not allowed here; its content is shared already");
  for (std::size_t done = 0;;) {
    const Result<std::size_t> more = sharer.change(
        [&](Sharer& s) { return s.sessions().publish(*number, map, file.blocks, done, kBlocks); });
    if (!more.ok()) throw WorkError(file.path + " was removed while it was loaded");
    if (*more == 0) return *number - MapSession::kFirst;
    done += *more;
  }
}

std::uint32_t load(HeldSharer& sharer, const std::filesystem::path& path, double weight,
                   const std::optional<PoseArray>& T_global_map,
                   const std::optional<std::int64_t>& date_s) {
  const GivenSession given = given_session(path, weight, T_global_map, date_s);
  const RobotConfig& config = sharer.config();
  check(check_frame_of_sessions(config.frames, kSharingSettings["fusion.frames"]));
  const ClassTable classes =
      sharer.change([](const Sharer& s) { return s.global().map().classes(); });
  SessionFile file;
  {
    const py::gil_scoped_release released;
    file = value_of(load_given(given));
    check(check_session(file, config.map, classes));
  }
  return share(sharer, file);
}

void remove(HeldSharer& sharer, std::int64_t number) {
  const auto submap = in_range<std::uint32_t>(number, "session");
  const Status status = sharer.change([&](Sharer& s) {
    return submap > 0xffffU ? Status::kInvalidArgument
                            : s.sessions().remove(MapSession::kFirst + submap);
  });
  if (status != Status::kOk)
    throw InputError("session " + std::to_string(number) + " does not exist");
}

}  // namespace

GivenSession given_session(const std::filesystem::path& path, double weight,
                           const std::optional<PoseArray>& T_global_map,
                           const std::optional<std::int64_t>& date_s) {
  if (!(weight >= kSessionWeights.least && weight <= kSessionWeights.most))
    throw InputError("weight " + std::to_string(weight) +
                     " is not allowed; give a number from 0.0001 to 1");
  GivenSession given{.path = path, .weight = weight, .date_s = date_s};
  if (T_global_map) given.T_global_map = pose_of(T_global_map, "T_global_map");
  return given;
}

Outcome<SessionFile> load_given(const GivenSession& given) {
  TESSERA_TRY_ASSIGN(SessionFile file,
                     load_session({.file = given.path.string(), .weight = given.weight}));
  if (given.T_global_map) {
    file.T_global_map = *given.T_global_map;
    file.placed = true;
  }
  if (given.date_s) file.session.date_s = *given.date_s;
  return file;
}

py::list sessions_of(const std::vector<MapSessions::Session>& sessions) {
  py::list list;
  for (const MapSessions::Session& session : sessions) {
    if (session.state == MapSessions::State::kLeaving) continue;
    py::dict one = session_dict(session.session);
    one["session"] = session.submap - MapSession::kFirst;
    one["blocks"] = session.blocks;
    one["refused_blocks"] = session.refused_blocks;
    list.append(one);
  }
  return list;
}

py::dict session_dict(const MapSession& session) {
  py::dict one;
  one["digest"] = hex64(session.digest);
  one["date_s"] = session.date_s;
  one["weight"] = weight_of(session);
  return one;
}

void add_sharer_sessions(py::class_<HeldSharer, std::shared_ptr<HeldSharer>>& sharer_class) {
  sharer_class
      .def(
          "load_session", &load, py::arg("path"), py::arg("weight") = 0.5,
          py::arg("T_global_map") = py::none(), py::arg("date_s") = py::none(),
          R"(Shares a map of an earlier day beside the own one, from a map file of any kind, and returns its number.

Its evidence is multiplied by weight, above 0 and at most 1, and counts once however many robots load
the same file; of all sessions together no more than a quarter of max_evidence counts in a voxel.
T_global_map: (4, 4); None: the file's own, or the identity. date_s: of the map, seconds since 1970;
None: when the file was last written. At most 8 at a time. Those that an earlier epoch of this robot
had end when it starts.

Raises InputError iff the robot's own frame is not known exactly (frames), the file is missing,
damaged, of another resolution, other classes or another weight of free passes, or its content is
shared already; Error iff there is no place for it.)")
      .def(
          "remove_session", &remove, py::arg("session"),
          R"(Removes a session everywhere; ticks free its memory. Raises InputError iff there is none of that number.)")
      .def_property_readonly(
          "sessions",
          [](const HeldSharer& s) {
            const std::vector<MapSessions::Session> all = s.change([](const Sharer& sharer) {
              const auto open = sharer.sessions().all();
              return std::vector<MapSessions::Session>(open.begin(), open.end());
            });
            return sessions_of(all);
          },
          "The sessions of this sharer: number, digest of the file, date_s, weight, blocks.");
}

}  // namespace tessera::python
