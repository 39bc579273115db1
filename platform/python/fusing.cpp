// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera.fuse: fuses local maps into one global map.
#include "fusing.hpp"

#include <fmt/core.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <variant>

#include "arrays.hpp"
#include "base/number_text.hpp"
#include "held_map.hpp"
#include "maps/fuse_sessions.hpp"
#include "maps/fusion_run.hpp"
#include "settings.hpp"
#include "sharer_sessions.hpp"

namespace tessera::python {

namespace {

using Given = std::variant<std::shared_ptr<HeldMap>, std::filesystem::path>;

class FusedMap final : public HeldMap {
 public:
  FusedMap(std::shared_ptr<FusionRun> run, const MapIdentity& identity, Json report)
      : HeldMap(run, run->map(), identity), report_(std::move(report)) {}
  [[nodiscard]] py::object report() const { return dict_of(report_); }

 private:
  Json report_;
};

/// The maps by their names, each once, and the locks against writers.
struct Inputs {
  std::vector<std::string> names;
  std::vector<std::shared_ptr<StoredMap>> stored;
  std::vector<Gate*> gates;
};

Inputs gather(const std::vector<Given>& maps) {
  Inputs inputs;
  for (std::size_t i = 0; i < maps.size(); ++i) {
    std::string name = fmt::format("maps[{}]", i);
    if (const auto* const held = std::get_if<std::shared_ptr<HeldMap>>(&maps[i])) {
      if (*held == nullptr) throw InputError(name + " is None; give a map or its file");
      if ((*held)->stored() == nullptr || (*held)->identity().kind == MapKind::kGlobal)
        throw InputError(name + " is a global map; give the local maps that it was made of");
      if (!(*held)->is_whole())
        throw InputError(name + " has a window; save it, and give the file");
      inputs.stored.push_back((*held)->stored());
      inputs.gates.push_back(&(*held)->gate());
    } else {
      name = std::get<std::filesystem::path>(maps[i]).string();
      const py::gil_scoped_release released;
      Outcome<std::unique_ptr<StoredMap>> loaded = load_map(name);
      inputs.stored.emplace_back(loaded.ok() ? std::move(*loaded) : nullptr);
      if (!loaded.ok()) raise(loaded.failure());
    }
    const auto before = inputs.stored.end() - 1;
    const bool is_new =
        std::find(inputs.stored.begin(), before, *before) == before &&
        std::find(inputs.names.begin(), inputs.names.end(), name) == inputs.names.end();
    if (!is_new) throw InputError(name + " is named twice; a map's evidence counts once");
    inputs.names.push_back(std::move(name));
  }
  // All calls lock them in the same order.
  std::sort(inputs.gates.begin(), inputs.gates.end());
  return inputs;
}

using GivenSessions = std::vector<std::variant<std::filesystem::path, GivenSession>>;

std::vector<GivenSession> sessions_in(const GivenSessions& given) {
  std::vector<GivenSession> sessions;
  for (const auto& one : given) {
    const auto* const path = std::get_if<std::filesystem::path>(&one);
    sessions.push_back(path != nullptr ? GivenSession{.path = *path} : std::get<GivenSession>(one));
  }
  return sessions;
}

/// Everything except warnings, which need the GIL.
Outcome<std::shared_ptr<FusedMap>> run(const Inputs& given,
                                       const std::vector<std::optional<Matrix34d>>& transforms,
                                       const std::vector<GivenSession>& sessions,
                                       const FuseOptions& options, std::vector<Message>& warnings) {
  std::vector<std::unique_lock<std::shared_mutex>> alone;
  for (Gate* const gate : given.gates) alone.emplace_back(gate->mutex);
  std::vector<FuseInput> gathered;
  for (std::size_t i = 0; i < given.stored.size(); ++i) {
    measure_content(*given.stored[i]);
    TESSERA_TRY_ASSIGN(FuseInput input, to_fuse(given.names[i], given.stored[i]));
    if (i < transforms.size() && transforms[i]) {
      input.T_global_map = *transforms[i];
      input.placed = true;
    }
    gathered.push_back(std::move(input));
  }
  TESSERA_TRY_ASSIGN(std::vector<FuseInput> inputs, arrange_inputs(std::move(gathered), warnings));
  TESSERA_TRY(check_number_of_robots(inputs));
  TESSERA_TRY_ASSIGN(const DiffusionConfig diffusion,
                     diffusion_of(options.diffusion, inputs.front().stored->map.config()));
  TESSERA_TRY_ASSIGN(std::vector<PairAlignment> pairs,
                     pairs_of(options, !sessions.empty(), inputs, warnings));
  for (const GivenSession& session : sessions) {
    TESSERA_TRY_ASSIGN(SessionFile file, load_given(session));
    TESSERA_TRY(add_session(std::move(file), inputs, warnings));
  }
  TESSERA_TRY_ASSIGN(std::unique_ptr<FusionRun> prepared,
                     FusionRun::prepare(inputs, options, diffusion));
  warn_of_no_frame(inputs, warnings);
  std::shared_ptr<FusionRun> fusion = std::move(prepared);
  TESSERA_TRY(fusion->fuse(inputs, {}));
  fusion->measure();
  fusion->run().pairs = std::move(pairs);
  for (Message& loss : losses_of(fusion->run())) warnings.push_back(std::move(loss));
  for (Message& doubt : doubts_of(fusion->run(), fusion->map().classes()))
    warnings.push_back(std::move(doubt));
  const Json config = to_json(options, fusion->run().config);
  MapIdentity identity{.kind = MapKind::kGlobal};
  TESSERA_TRY(record_settings(record_of(inputs, config), identity));
  Json report = to_json(fusion->run(), inputs, config);
  return std::make_shared<FusedMap>(std::move(fusion), identity, std::move(report));
}

std::shared_ptr<FusedMap> fuse(
    const std::vector<Given>& maps,
    const std::optional<std::vector<std::optional<PoseArray>>>& transforms,
    const std::vector<GivenSession>& sessions, py::dict settings) {
  check(check_number_of_maps(maps.size(), maps.empty() ? 0 : sessions.size()));
  check(check_number_of_sessions(sessions.size()));
  if (transforms && transforms->size() != maps.size())
    throw InputError(
        fmt::format("transforms has {} transforms for {} maps; give one for each, or None",
                    transforms->size(), maps.size()));
  FuseOptions options;
  take_settings(settings, kDiffusionSettings, options.diffusion);
  take_settings(settings, kFuseSettings, options);
  refuse_others(settings, "fuse");
  std::vector<std::optional<Matrix34d>> T_global_map;
  for (const auto& transform : transforms.value_or(std::vector<std::optional<PoseArray>>{})) {
    T_global_map.emplace_back();
    if (transform) T_global_map.back() = pose_of(transform, "transforms");
  }
  const Inputs inputs = gather(maps);
  options.maps = inputs.names;
  for (const GivenSession& session : sessions)
    options.sessions.push_back(session.path.string() + ":" + text_of(session.weight));
  std::vector<Message> warnings;
  Outcome<std::shared_ptr<FusedMap>> fused = [&] {
    const py::gil_scoped_release released;
    return run(inputs, T_global_map, sessions, options, warnings);
  }();
  warn_of(warnings);
  return value_of(std::move(fused));
}

constexpr const char* kFuse =
    R"(Fuses local maps, or files of them, into one global map by label diffusion, as `tessera fuse`.

transforms: for each map T_global_map (4, 4), or None for that in the map, else the identity. None for
iterations and diffusion_length_m: 4 and two voxels, in paper mode 2 and three. memory_bytes: None:
what the maps need. sessions: maps of earlier days that count less than the maps, each a Session or a
file; one map and a session are enough. Issues a UserWarning about doubtful inputs. Raises InputError iff a map is a global
one, named twice, or does not match the others, a file cannot be read, or a value is out of its range;
TypeError iff one is of another type; Error iff the system does not give the memory, or the global map
refuses a block. Other threads that read or write the maps wait meanwhile.)";

}  // namespace

py::object dict_of(const Json& json) {
  return py::module_::import("json").attr("loads")(json.dump());
}

void warn_of(const std::vector<Message>& warnings, int frames) {
  for (const Message& warning : warnings) {
    if (PyErr_WarnEx(PyExc_UserWarning, warning.text(Speaker::kPython).c_str(), frames) != 0)
      throw py::error_already_set();
  }
}

void add_fusing(py::module_& module) {
  const FuseOptions by_default;
  const std::string text =
      "fuse(maps: List[Union[Map, os.PathLike]], transforms: list | None = None, *, sessions: "
      "list | None = None, " +
      arguments_text(kDiffusionRows, &by_default.diffusion) + ", " +
      arguments_text(kFuseRows, &by_default) + ") -> FusedMap\n\n" + kFuse;
  py::class_<FusedMap, HeldMap, std::shared_ptr<FusedMap>>(module, "FusedMap",
                                                           "A global map that fuse() made.")
      .def_property_readonly("report", &FusedMap::report,
                             "The report of `tessera fuse`, as a dictionary.");
  py::class_<GivenSession>(module, "Session",
                           R"(A map of an earlier day, of any kind of map file, for fuse().

Its evidence is multiplied by weight, above 0 and at most 1; of all sessions together no more than a
quarter of max_evidence counts in a voxel. T_global_map: (4, 4); None: the file's own, or the identity.
date_s: of the map, seconds since 1970; None: when the file was last written. Raises InputError iff the
weight is out of its range, or T_global_map is no rigid transform.)")
      .def(py::init(&given_session), py::arg("path"), py::arg("weight") = SessionOptions{}.weight,
           py::arg("T_global_map") = py::none(), py::arg("date_s") = py::none())
      .def_readonly("path", &GivenSession::path, "The file.")
      .def_readonly("weight", &GivenSession::weight, "What its evidence is multiplied by.")
      .def_readonly("date_s", &GivenSession::date_s, "As it was given.");
  py::options docstrings;
  docstrings.disable_function_signatures();
  module.def(
      "fuse",
      [](const std::vector<Given>& maps,
         const std::optional<std::vector<std::optional<PoseArray>>>& transforms,
         const std::optional<GivenSessions>& sessions, const py::kwargs& settings) {
        return fuse(maps, transforms, sessions_in(sessions.value_or(GivenSessions{})), settings);
      },
      py::arg("maps"), py::arg("transforms") = py::none(), py::kw_only(),
      py::arg("sessions") = py::none(), text.c_str());
}

}  // namespace tessera::python
