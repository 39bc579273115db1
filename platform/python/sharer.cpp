// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera.Sharer.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "arrays.hpp"
#include "base/monotonic_clock.hpp"
#include "fusing.hpp"
#include "held_sharer.hpp"
#include "link/key_settings.hpp"
#include "maps/frames_state.hpp"
#include "maps/judged_robot.hpp"
#include "report.hpp"
#include "settings.hpp"
#include "settings/sharing_settings.hpp"
#include "sharer_sessions.hpp"
#include "teammates.hpp"

namespace tessera::python {

namespace {

using Now = std::optional<std::int64_t>;

std::int64_t time_of(const Now& now_us) { return now_us ? *now_us : MonotonicClock::now_us(); }

py::list tick(HeldSharer& sharer, const Now& now_us) {
  const std::vector<std::string> datagrams = sharer.tick(time_of(now_us));
  py::list list;
  for (const std::string& datagram : datagrams) list.append(py::bytes(datagram));
  return list;
}

void receive(HeldSharer& sharer, const py::buffer& datagram, const Now& now_us) {
  const py::buffer_info bytes = datagram.request();
  const bool is_plain =
      bytes.ndim == 1 && bytes.itemsize == 1 && (bytes.size == 0 || bytes.strides[0] == 1);
  if (!is_plain)
    raise_type("a datagram is bytes without gaps; give bytes, bytearray or memoryview");
  const std::span view(static_cast<const std::byte*>(bytes.ptr),
                       static_cast<std::size_t>(bytes.size));
  const std::int64_t at_us = time_of(now_us);
  sharer.change([&](Sharer& s) { s.receive(view, at_us); });
}

/// Raises for the status of a sharer.
void check_status(Status status, const char* argument) {
  if (status == Status::kOk) return;
  if (status == Status::kBusy)
    throw WorkError("a new submap is pending; it begins with the next scan");
  if (status == Status::kUnsupported)
    throw InputError("the map is not in submaps; make it with submap_m");
  if (status == Status::kResourceExhausted)
    throw WorkError("there is no free place for another one");
  throw InputError(std::string(argument) + " is not allowed here");
}

std::vector<Point3d> places_of(const PoseArray& p_global) {
  if (p_global.ndim() != 2 || p_global.shape(1) != 3)
    throw InputError("p_global has another shape than (n, 3)");
  std::vector<Point3d> places;
  for (py::ssize_t i = 0; i < p_global.shape(0); ++i) {
    places.emplace_back(p_global.at(i, 0), p_global.at(i, 1), p_global.at(i, 2));
    if (!places.back().allFinite()) throw InputError("p_global has a number that is not finite");
  }
  return places;
}

py::dict report(const HeldSharer& sharer) {
  struct All {
    ExchangeReport exchange;
    GlobalMapReport global;
    SubmapReport submap;
    std::vector<ContributionState> contributions;
    std::size_t waiting;
    ObjectionsReport objections;
    std::vector<JudgedRobot> robots;
    FramesState frames;
  };
  const All all = sharer.change([](const Sharer& s) {
    All a{s.exchange().report(), s.global().report(),      s.submap(), {}, s.publisher().waiting(),
          s.objections(),        judge_robots(s.global()), {}};
    if (s.shared_frames() != nullptr) a.frames.take(*s.shared_frames());
    a.contributions.resize(a.exchange.contributions);
    static_cast<void>(s.exchange().contributions(a.contributions));
    return a;
  });
  py::dict d = counters_of(all.exchange);
  d["waiting_blocks"] = all.waiting;
  d["submap"] = all.submap.submap;
  d["revision"] = all.submap.revision;
  d["lost_blocks"] = all.submap.lost_blocks;
  py::list contributions;
  for (const ContributionState& c : all.contributions) {
    py::dict one;
    one["robot"] = c.id.robot;
    one["epoch"] = c.id.epoch;
    one["submap"] = c.id.submap;
    one["own"] = c.own;
    one["complete"] = c.complete;
    one["far"] = c.far;
    if (MapSession::is(c.id.submap)) one["session"] = session_dict(c.session);
    if (Objection::is(c.id.submap)) one["objections"] = true;
    if (FrameStatements::is(c.id.submap)) one["frame_statements"] = true;
    contributions.append(one);
  }
  d["contributions_by_id"] = contributions;
  d["reliability"] = dict_of(to_json(all.robots, sharer.global()->classes()));
  d["objections"] = counters_of(all.objections);
  if (all.frames.mode != FrameMode::kGiven) d["frames"] = dict_of(to_json(all.frames));
  const GlobalMapReport& g = all.global;
  py::dict global = counters_of(g);
  global["overlap_voxels"] = g.nodes;
  add_counters(global, g.replicas);
  // By their names of before, too.
  global["refused_storage"] = g.replicas.replicas_refused_storage;
  global["refused_quota"] = g.replicas.replicas_refused_quota;
  d["global"] = global;
  return d;
}

bool is_complete(const HeldSharer& sharer) {
  return sharer.change([](const Sharer& s) { return s.exchange().report().holds_all(); });
}

std::shared_ptr<HeldSharer> make(std::shared_ptr<HeldLocalMap> map,
                                 const std::optional<PoseArray>& T_global_map, std::int64_t epoch,
                                 py::dict settings) {
  if (map == nullptr) raise_type("map is None; give a LocalMap");
  SharingOptions options;
  KeyFiles keys;
  take_settings(settings, kDiffusionSettings, options.diffusion);
  take_settings(settings, kSharingSettings, options, false);
  take_settings(settings, kKeySettings, keys);
  refuse_others(settings, "Sharer");
  options.robot = map->identity().robot;
  Matrix34d T = map->identity().T_global_map;
  if (T_global_map) T = pose_of(T_global_map, "T_global_map");
  if (options.frames == FrameMode::kFound) {
    if (T_global_map) throw InputError("T_global_map is given, and frames is found; leave out one");
    T = Matrix34d::Identity();
  }
  return HeldSharer::make(std::move(map), options, T, in_range<std::uint32_t>(epoch, "epoch"),
                          keys);
}

constexpr const char* kMake =
    R"(map: a LocalMap, whose robot number no other robot has. T_global_map: (4, 4); None: the map's, or the identity.

epoch: higher with every start of the robot, from a persistent counter. tick_ms: between calls of tick.
All robots of a team need the same resolution, classes, prior, free weight, max_evidence and conflicts,
and for the same global map the same diffusion.

fleet_key, robot_secret, robot_public_keys: files of tessera key, as in [security] of a node. With the
first, only datagrams with the same key are accepted; with the other two, which are needed together,
only data that its robot has signed. Without any of them datagrams have only a checksum. mission: its
name, which is part of all keys; None: the one in fleet_key. conflicts: what to do with a robot that
signed two contents of one version, "alarm" or "exclude". The other settings are those of a node's
[publish], [network] and [fusion].

Raises InputError iff a value is out of its range, the memory is too small for a global map or a file
does not have the key; Error iff the system does not give the memory.)";

}  // namespace

void add_sharer(py::module_& module) {
  const SharingOptions by_default;
  const KeyFiles no_keys;
  const std::string text =
      "__init__(self, map: LocalMap, *, "
      "T_global_map: numpy.ndarray | None = None, epoch: int = 1, " +
      arguments_text(kDiffusionRows, &by_default.diffusion) + ", " +
      arguments_text(kSharingRows, &by_default, false) + ", " + arguments_text(kKeyRows, &no_keys) +
      ") -> None\n\n" + kMake;
  py::class_<HeldSharer, std::shared_ptr<HeldSharer>> sharer_class(
      module, "Sharer",
      R"(Shares the map of a robot, as bytes for any transport, and fuses what other robots send.

Robots with the same replicas have the same global map, bit for bit. Every call of a sharer may have
a time, now_us, microseconds on one monotonic clock; None: that of the machine.)");
  {
    py::options docstrings;
    docstrings.disable_function_signatures();
    sharer_class.def(
        py::init([](std::shared_ptr<HeldLocalMap> map, const std::optional<PoseArray>& T_global_map,
                    std::int64_t epoch, const py::kwargs& settings) {
          return make(std::move(map), T_global_map, epoch, settings);
        }),
        py::arg("map"), py::kw_only(), py::arg("T_global_map") = py::none(), py::arg("epoch") = 1,
        text.c_str());
  }
  sharer_class
      .def(
          "tick", &tick, py::arg("now_us") = py::none(),
          R"(Publishes what has changed in the map, updates the global map, and returns the datagrams to send now.

A list of bytes, each at most 1392 long, for all other robots. Call it periodically; the map may be
integrated into meanwhile.)")
      .def("receive", &receive, py::arg("datagram"), py::arg("now_us") = py::none(),
           R"(Takes one datagram of another robot: bytes, bytearray or memoryview, not copied.

Any content is safe: damaged, foreign and repeated datagrams are counted in report(). Datagrams may be
lost, repeated and arrive in any order.)")
      .def(
          "finish", [](HeldSharer& s) { s.change([](Sharer& sharer) { sharer.finish(); }); },
          "Brings the global map up to date with everything received, however long it takes.")
      .def_property_readonly("global_map", &HeldSharer::global,
                             "The global map, a Map for reading that changes with the sharer.")
      .def_property_readonly(
          "idle",
          [](const HeldSharer& s) {
            return s.change([](const Sharer& sharer) { return sharer.idle(); });
          },
          "Nothing waits to be published or fused, as far as ticks since the last scan have found.")
      .def_property_readonly(
          "complete", &is_complete,
          "Whether everything that other robots are known to have published has arrived.")
      .def(
          "digest",
          [](const HeldSharer& s) {
            return hex64(s.change([](const Sharer& sharer) { return sharer.exchange().digest(); }));
          },
          "Digest of the replicas, in hex: equal on robots that have the same replicas.")
      .def("report", &report,
           "Counters of the exchange and the global map; all except levels never decrease.")
      .def(
          "set_frame",
          [](HeldSharer& s, const PoseArray& T_global_map,
             const std::optional<std::int64_t>& submap) {
            const Matrix34d T = pose_of(T_global_map, "T_global_map");
            std::optional<std::uint32_t> number;
            if (submap) number = in_range<std::uint32_t>(*submap, "submap");
            check_status(s.change([&](Sharer& sharer) {
              return sharer.set_frame(number.value_or(sharer.submap().submap), T);
            }),
                         "T_global_map or submap");
          },
          py::arg("T_global_map"), py::arg("submap") = py::none(),
          R"(Moves what was published, or one submap of it, to another frame (4, 4); nothing else is sent again.

Raises InputError iff the submap does not exist or the frame is not a rigid transform within the grid.)")
      .def(
          "new_submap",
          [](HeldSharer& s, const std::optional<PoseArray>& T_global_map) {
            const std::optional<Matrix34d> T =
                T_global_map ? std::optional(pose_of(T_global_map, "T_global_map")) : std::nullopt;
            check_status(s.new_submap(T), "T_global_map");
          },
          py::arg("T_global_map") = py::none(),
          R"(Begins another submap with the next scan; the current map is empty then.

T_global_map: (4, 4) of the new one; None: as before. Raises InputError iff the map is not in submaps
(submap_m) or it is not a frame, Error iff one that was asked for has not begun.)")
      .def(
          "correct",
          [](HeldSharer& s, const StampArray& stamps_us, const PoseArray& T_world_sensor,
             std::int64_t revision) {
            const StampedPoses poses = stamped_poses_of(stamps_us, T_world_sensor);
            return correction_of(s.correct({poses.stamps_us, poses.transforms},
                                           in_range<std::uint32_t>(revision, "revision")));
          },
          py::arg("stamps_us"), py::arg("T_world_sensor"), py::arg("revision"),
          R"(As LocalMap.correct, for the map and what was published of it; frames alone are sent again.)")
      .def(
          "set_route",
          [](HeldSharer& s, const PoseArray& p_global) {
            const std::vector<Point3d> places = places_of(p_global);
            s.change([&](Sharer& sharer) { sharer.set_route(places); });
          },
          py::arg("p_global"),
          R"(Places, (n, 3) in metres of the global frame, to which the robot is going: within reach_m of the first 15
of them, what others have published is kept as what is near the robot is. Replaces those of before; (0, 3): none.

Raises InputError iff the shape is another one or a number is not finite.)")
      .def(
          "leave",
          [](HeldSharer& s) { s.change([](Sharer& sharer) { sharer.exchange().leave(); }); },
          "Announces with the next tick that this robot leaves.")
      .def(
          "exclude",
          [](HeldSharer& s, std::int64_t robot) {
            const auto number = in_range<std::uint32_t>(robot, "robot");
            check_status(
                s.change([&](Sharer& sharer) { return sharer.exchange().exclude(number); }),
                "robot");
          },
          py::arg("robot"),
          R"(Removes all data of a robot from the global map, and refuses its datagrams.

Raises InputError iff it is this robot, Error iff 16 are excluded.)");
  add_sharer_sessions(sharer_class);
  add_sharer_teammates(sharer_class);
}

}  // namespace tessera::python
