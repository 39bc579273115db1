// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>
#include <pybind11/stl.h>

#include <cmath>
#include <string>

#include "estimates.hpp"
#include "tessera/map/nearest_occupied.hpp"

namespace tessera::python {

namespace {

/// Results of N rays, or of N searches near points.
struct Found : Estimates {
  py::array_t<std::uint8_t> end;  ///< For rays.
  py::array_t<bool> found;        ///< For searches, as the next two.
  py::array_t<bool> complete;
  py::array_t<double> searched_m;
  py::array_t<double> distance_m;
  py::array_t<std::int32_t> voxel;
};
struct Rays : Found {};
struct Nearest : Found {};

void put_voxel(std::int32_t* into, std::size_t i, const VoxelCoord& voxel) noexcept {
  into[3 * i] = voxel.x;
  into[3 * i + 1] = voxel.y;
  into[3 * i + 2] = voxel.z;
}

/// Normalises a direction of any length, even one that a float cannot hold. Unchanged if its length
/// is 0 or not finite.
Point3d unit(const Point3d& direction) {
  const double scale = direction.cwiseAbs().maxCoeff();
  if (!(scale > 0.0) || !direction.allFinite()) return direction;
  const Point3d scaled = direction / scale;
  return scaled / norm(scaled);
}

void check_metres(double metres, const char* name, const HeldMap& map) {
  if (!(metres > 0.0) || !std::isfinite(metres))
    throw InputError(std::string(name) + " is not a length; give metres above 0");
  if (metres > static_cast<double>(1 << 20) * map.config().resolution_m)
    throw InputError(std::string(name) + " is too large; give at most 2^20 voxels");
}

Rays cast_rays(const HeldMap& map, const py::array& origins, const py::array& directions,
               double max_range_m, bool stop_at_unknown) {
  check_metres(max_range_m, "max_range_m", map);
  const Coordinates from(origins, "origins");
  const Coordinates along(directions, "directions");
  const std::size_t n = along.count();
  if (from.count() != n && from.count() != 1) {
    throw InputError(fmt::format("origins has {} rows for {} directions; give as many, or one",
                                 from.count(), n));
  }
  EstimateWriter writer(n);
  Rays rays;
  rays.end = new_array<std::uint8_t>(n);
  rays.distance_m = new_array<double>(n);
  rays.voxel = new_array<std::int32_t>(n, 3);
  std::uint8_t* const end = rays.end.mutable_data();
  double* const distance_m = rays.distance_m.mutable_data();
  std::int32_t* const voxel = rays.voxel.mutable_data();
  map.read([&](const LocalMap& m) {
    for (std::size_t i = 0; i < n; ++i) {
      const Point3d origin_map = from[from.count() == 1 ? 0 : i];
      const RayHit hit = cast_ray(m, round_to_float(origin_map), round_to_float(unit(along[i])),
                                  max_range_m, stop_at_unknown);
      end[i] = static_cast<std::uint8_t>(hit.end);
      distance_m[i] = hit.distance_m;
      put_voxel(voxel, i, hit.voxel);
      writer.write(i, hit.estimate);
    }
  });
  static_cast<Estimates&>(rays) = std::move(writer.arrays());
  return rays;
}

std::uint64_t bits_of(const std::optional<std::vector<std::int64_t>>& labels,
                      const ClassTable& classes) {
  std::uint64_t bits = 0;
  if (!labels) return bits;
  for (const std::int64_t label : *labels) {
    if (label < 1 || label > classes.num_classes())
      throw InputError(
          fmt::format("labels has {}; give classes from 1 to {}", label, classes.num_classes()));
    bits |= std::uint64_t{1} << static_cast<unsigned>(label);
  }
  if (bits == 0) throw InputError("labels is empty; leave it out for all occupied voxels");
  return bits;
}

Nearest nearest(const HeldMap& map, const py::array& points, double radius_m,
                const std::optional<std::vector<std::int64_t>>& labels, std::int64_t max_work) {
  check_metres(radius_m, "radius_m", map);
  const auto work = in_range<int>(max_work, "max_work", 1, NearestQuery::kMostWork);
  const Coordinates p_map(points, "points");
  const std::uint64_t classes = bits_of(labels, map.classes());
  const std::size_t n = p_map.count();
  EstimateWriter writer(n);
  Nearest result;
  result.found = new_array<bool>(n);
  result.complete = new_array<bool>(n);
  result.distance_m = new_array<double>(n);
  result.searched_m = new_array<double>(n);
  result.voxel = new_array<std::int32_t>(n, 3);
  bool* const found = result.found.mutable_data();
  bool* const complete = result.complete.mutable_data();
  double* const distance_m = result.distance_m.mutable_data();
  double* const searched_m = result.searched_m.mutable_data();
  std::int32_t* const voxel = result.voxel.mutable_data();
  map.read([&](const LocalMap& m) {
    MapReader reader(m);
    std::vector<std::uint64_t> workspace(reader.snapshot_bytes() / sizeof(std::uint64_t) + 1);
    for (std::size_t i = 0; i < n; ++i) {
      const NearestQuery query{.p_map = round_to_float(p_map[i]),
                               .radius_m = radius_m,
                               .classes = classes,
                               .max_work = work};
      // Nothing is known near a point outside of the grid.
      const Result<NearestOccupied> one = nearest_occupied(
          reader, m.lattice(), m.reading(), query, std::as_writable_bytes(std::span(workspace)));
      const NearestOccupied answer = one.ok() ? *one : NearestOccupied{};
      found[i] = answer.found;
      complete[i] = answer.complete;
      distance_m[i] = answer.found ? answer.distance_m : std::nan("");
      searched_m[i] = answer.searched_m;
      put_voxel(voxel, i, answer.voxel);
      writer.write(i, answer.estimate);
    }
  });
  static_cast<Estimates&>(result) = std::move(writer.arrays());
  return result;
}

}  // namespace

void add_ray_queries(py::module_& module, py::class_<HeldMap, std::shared_ptr<HeldMap>>& map) {
  py::class_<Rays, Estimates>(module, "Rays",
                              "What each of N rays hit; the estimates are of that voxel.")
      .def_readonly("end", &Rays::end,
                    "(N,) uint8: tessera.RayEnd; 0 range, 1 occupied, 2 unknown, 3 invalid: the "
                    "origin is outside of the grid, "
                    "the direction is 0 or not finite, or the ray leaves the grid.")
      .def_readonly("distance_m", &Rays::distance_m,
                    "(N,) float64: from the origin to where the ray enters the voxel.")
      .def_readonly("voxel", &Rays::voxel, "(N, 3) int32: index of that voxel.");
  py::class_<Nearest, Estimates>(
      module, "Nearest",
      "The obstacle nearest to each of N points; the estimates are of its voxel.")
      .def_readonly("found", &Nearest::found, "(N,) bool.")
      .def_readonly(
          "complete", &Nearest::complete,
          "(N,) bool: the search was not stopped early, so what was found is the nearest.")
      .def_readonly("distance_m", &Nearest::distance_m,
                    "(N,) float64: to the nearest point of the voxel, 0 within it; NaN if "
                    "nothing was found.")
      .def_readonly("searched_m", &Nearest::searched_m,
                    "(N,) float64: radius within which everything was searched.")
      .def_readonly("voxel", &Nearest::voxel, "(N, 3) int32: index of the voxel.");
  map.def(
         "cast_rays", &cast_rays, py::arg("origins"), py::arg("directions"), py::arg("max_range_m"),
         py::arg("stop_at_unknown") = false,
         R"(The first occupied voxel along each ray, or with stop_at_unknown the first that is not free.

origins: (N, 3) or (3,) for all, directions: (N, 3) of any length above 0, float32 or float64, metres,
map frame. Raises TypeError or InputError iff an array or max_range_m is invalid.)")
      .def("nearest_occupied", &nearest, py::arg("points"), py::arg("radius_m"),
           py::arg("labels") = py::none(), py::arg("max_work") = NearestQuery{}.max_work,
           R"(The occupied voxel nearest to each point, within radius_m.

points: (N, 3) float32 or float64, metres, map frame; labels: of these classes only. max_work bounds
the search of a point. Raises TypeError or InputError iff one of these is invalid.)");
}

}  // namespace tessera::python
