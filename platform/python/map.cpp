// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera.Map: reading any map.
#include <fmt/core.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "arrays.hpp"
#include "base/number_text.hpp"
#include "estimates.hpp"
#include "held_map.hpp"
#include "maps/open_map.hpp"

namespace tessera::python {

namespace {

py::object settings_of(const HeldMap& map) {
  const MapIdentity& identity = map.identity();
  if (identity.settings_bytes == 0) return py::dict();
  return py::module_::import("json").attr("loads")(
      py::str(identity.settings.data(), identity.settings_bytes));
}

constexpr const char* kQuery = R"(Estimates of the map at points.

points: (N, 3) or wider, or (3,) for one, float32 or float64, metres, map frame; any layout. A point
that is not finite or outside of the grid is unknown. sigma: also the counts; probabilities: also
those of each component. Raises TypeError or InputError iff the array has another type or shape.)";

}  // namespace

std::shared_ptr<HeldMap> load_held(const std::filesystem::path& path) {
  Outcome<std::unique_ptr<StoredMap>> stored = [&] {
    const py::gil_scoped_release released;
    return open_map(path.string());
  }();
  if (!stored.ok()) raise(stored.failure());
  return std::make_shared<HeldMap>(std::shared_ptr<StoredMap>(std::move(*stored)));
}

void add_map(py::module_& module) {
  add_estimates(module);
  py::class_<HeldMap, std::shared_ptr<HeldMap>> type(
      module, "Map", "A map for reading: a loaded one, a LocalMap, a global one.");
  type.def_property_readonly(
          "kind",
          [](const HeldMap& m) {
            return m.identity().kind == MapKind::kGlobal ? "global" : "local";
          },
          "\"local\" or \"global\".")
      .def_property_readonly(
          "robot", [](const HeldMap& m) { return m.identity().robot; }, "Id of the robot.")
      .def_property_readonly(
          "resolution_m", [](const HeldMap& m) { return m.config().resolution_m; },
          "Edge of a voxel, metres.")
      .def_property_readonly(
          "prior", [](const HeldMap& m) { return m.config().prior; },
          "Prior sigma_0 of every component.")
      .def_property_readonly("classes", &HeldMap::class_table, "The ClassTable.")
      .def_property_readonly(
          "T_global_map",
          [](const HeldMap& m) -> py::object {
            if (!m.identity().has_T_global_map) return py::none();
            return array_of(m.identity().T_global_map);
          },
          "(4, 4) float64, map to global frame, metres; None if it is not known.")
      .def_property_readonly(
          "settings", &settings_of,
          "How it was made: the options of `tessera map` or `tessera fuse` by name.")
      .def(
          "query",
          [](const HeldMap& m, const py::array& points, bool sigma, bool probabilities) {
            return query(m, points, {sigma, probabilities});
          },
          py::arg("points"), py::kw_only(), py::arg("sigma") = false,
          py::arg("probabilities") = false, kQuery)
      .def(
          "voxels",
          [](const HeldMap& m, bool occupied_only, bool sigma, bool probabilities) {
            return voxels(m, std::nullopt, std::nullopt, occupied_only, {sigma, probabilities});
          },
          py::kw_only(), py::arg("occupied_only") = false, py::arg("sigma") = false,
          py::arg("probabilities") = false,
          "All observed voxels, or the occupied ones; sigma, probabilities: as of query.")
      .def(
          "box",
          [](const HeldMap& m, const std::array<double, 3>& low, const std::array<double, 3>& high,
             bool occupied_only, bool sigma, bool probabilities) {
            return voxels(m, low, high, occupied_only, {sigma, probabilities});
          },
          py::arg("low"), py::arg("high"), py::kw_only(), py::arg("occupied_only") = false,
          py::arg("sigma") = false, py::arg("probabilities") = false,
          R"(The observed voxels from the one that contains low to the one that contains high, both included.

low, high: x y z, metres, map frame; they may be infinite. Raises InputError iff one is NaN.)")
      .def(
          "digest", [](const HeldMap& m) { return hex64(m.content_digest()); },
          "Digest of the content, 64 bits in hex, as of `tessera info`; equal for equal maps. "
          "O(map).")
      .def(
          "save",
          [](const HeldMap& m, const std::filesystem::path& path) { m.save(path.string()); },
          py::arg("path"),
          R"(Writes a .tsm file atomically. Raises Error or InputError iff it cannot be written.)")
      .def("__repr__", [](const HeldMap& m) {
        const auto label_voxels =
            m.read([](const LocalMap& map) { return map.usage().label_voxels; });
        return fmt::format("<tessera map, {}, {} labelled or occupied>",
                           (m.identity().kind == MapKind::kGlobal ? "global" : "local"),
                           counted(label_voxels, "voxel"));
      });
  add_ray_queries(module, type);
  module.def("load", &load_held, py::arg("path"),
             R"(The map of a .tsm file, local or global, for reading; LocalMap.load continues one.

Raises InputError iff the file is missing, damaged or of another kind; Error iff the system does not
give the memory.)");
}

}  // namespace tessera::python
