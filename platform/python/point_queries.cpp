// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>
#include <pybind11/stl.h>

#include <cmath>
#include <string>

#include "estimates.hpp"

namespace tessera::python {

namespace {

/// Columns that grow, until their memory becomes that of arrays.
struct VoxelColumns {
  std::vector<std::int32_t> index;
  std::vector<std::uint8_t> state;
  std::vector<std::uint8_t> label;
  std::vector<double> probability;
  std::vector<double> variance;
  std::vector<double> evidence;
  std::vector<double> occupancy;
  std::vector<float> sigma;
  std::vector<double> probabilities;

  void add(const VoxelCoord& voxel, const VoxelEvidence& counts, const Estimate& estimate,
           const Reading& reading, WithComponents with) {
    index.insert(index.end(), {voxel.x, voxel.y, voxel.z});
    state.push_back(static_cast<std::uint8_t>(estimate.state));
    label.push_back(static_cast<std::uint8_t>(estimate.label));
    probability.push_back(estimate.probability);
    variance.push_back(estimate.variance);
    evidence.push_back(estimate.evidence);
    occupancy.push_back(estimate.occupancy);
    if (with.sigma) {
      const auto first = counts.sigma.begin();
      sigma.insert(sigma.end(), first, first + counts.num_components);
    }
    if (with.probabilities) {
      const auto components = static_cast<std::size_t>(counts.num_components);
      probabilities.resize(probabilities.size() + components);
      summary_of(counts).distribution(reading, std::span(probabilities).last(components));
    }
  }
};

VoxelCoord corner(const LocalMap& map, const std::array<double, 3>& p_map) {
  const auto on_axis = [&](double metres) {
    const double voxel = std::floor(metres / map.config().resolution_m);
    return static_cast<std::int32_t>(std::clamp(voxel, -1e9, 1e9));
  };
  return {on_axis(p_map[0]), on_axis(p_map[1]), on_axis(p_map[2])};
}

void check_corner(const std::array<double, 3>& p_map, const char* name) {
  for (const double metres : p_map) {
    if (std::isnan(metres)) throw InputError(std::string(name) + " is not a number; give metres");
  }
}

py::array_t<double> centers(const Voxels& voxels) {
  auto result = new_array<double>(voxels.size(), 3);
  const auto from = voxels.index.unchecked<2>();
  auto to = result.mutable_unchecked<2>();
  for (py::ssize_t i = 0; i < from.shape(0); ++i) {
    for (py::ssize_t axis = 0; axis < 3; ++axis)
      to(i, axis) = (from(i, axis) + 0.5) * voxels.resolution_m;
  }
  return result;
}

py::dict as_dict(const Estimates& e) {
  py::dict d;
  d["state"] = e.state;
  d["label"] = e.label;
  d["probability"] = e.probability;
  d["variance"] = e.variance;
  d["evidence"] = e.evidence;
  d["occupancy"] = e.occupancy;
  if (!e.sigma.is_none()) d["sigma"] = e.sigma;
  if (!e.probabilities.is_none()) d["probabilities"] = e.probabilities;
  return d;
}

}  // namespace

EstimateWriter::EstimateWriter(std::size_t count, std::size_t components, WithComponents with)
    : arrays_{.state = new_array<std::uint8_t>(count),
              .label = new_array<std::uint8_t>(count),
              .probability = new_array<double>(count),
              .variance = new_array<double>(count),
              .evidence = new_array<double>(count),
              .occupancy = new_array<double>(count)},
      components_(components),
      state_(arrays_.state.mutable_data()),
      label_(arrays_.label.mutable_data()),
      probability_(arrays_.probability.mutable_data()),
      variance_(arrays_.variance.mutable_data()),
      evidence_(arrays_.evidence.mutable_data()),
      occupancy_(arrays_.occupancy.mutable_data()) {
  if (with.sigma) {
    auto sigma = new_array<float>(count, components);
    sigma_ = sigma.mutable_data();
    arrays_.sigma = std::move(sigma);
  }
  if (with.probabilities) {
    auto probabilities = new_array<double>(count, components);
    probabilities_ = probabilities.mutable_data();
    arrays_.probabilities = std::move(probabilities);
  }
}

Estimates query(const HeldMap& map, const py::array& points, WithComponents with) {
  const Coordinates p_map(points, "points");
  const auto components = static_cast<std::size_t>(map.classes().num_components());
  EstimateWriter writer(p_map.count(), components, with);
  map.read([&](const LocalMap& m) {
    const Lattice lattice = m.lattice();
    std::array<VoxelCoord, LocalMap::kQueryGroup> voxels;
    std::array<Estimate, LocalMap::kQueryGroup> estimates;
    for (std::size_t first = 0; first < p_map.count(); first += voxels.size()) {
      const std::size_t n = std::min(voxels.size(), p_map.count() - first);
      for (std::size_t k = 0; k < n; ++k) voxels[k] = voxel_at(lattice, p_map[first + k]);
      static_cast<void>(m.query(std::span(voxels).first(n), std::span(estimates).first(n)));
      for (std::size_t k = 0; k < n; ++k) {
        writer.write(first + k, estimates[k]);
        if (with.any()) writer.write(first + k, m.evidence(voxels[k]), m.reading());
      }
    }
  });
  return std::move(writer.arrays());
}

Voxels voxels(const HeldMap& map, const std::optional<std::array<double, 3>>& low,
              const std::optional<std::array<double, 3>>& high, bool occupied_only,
              WithComponents with) {
  constexpr double kAll = 1e300;
  const std::array<double, 3> from = low.value_or(std::array<double, 3>{-kAll, -kAll, -kAll});
  const std::array<double, 3> to = high.value_or(std::array<double, 3>{kAll, kAll, kAll});
  check_corner(from, "low");
  check_corner(to, "high");
  VoxelColumns columns;
  map.read([&](const LocalMap& m) {
    std::vector<KeyedIndex> workspace = workspace_for(m);
    for_each_in_box(m, corner(m, from), corner(m, to), workspace,
                    [&](const VoxelCoord& voxel, const VoxelEvidence& evidence) {
                      const Estimate e = estimate(evidence, m.reading());
                      if (occupied_only && e.state != VoxelState::kOccupied) return;
                      columns.add(voxel, evidence, e, m.reading(), with);
                    });
  });
  Voxels result;
  result.resolution_m = map.config().resolution_m;
  result.index = array_taking(std::move(columns.index), 3);
  result.state = array_taking(std::move(columns.state));
  result.label = array_taking(std::move(columns.label));
  result.probability = array_taking(std::move(columns.probability));
  result.variance = array_taking(std::move(columns.variance));
  result.evidence = array_taking(std::move(columns.evidence));
  result.occupancy = array_taking(std::move(columns.occupancy));
  const auto components = static_cast<std::size_t>(map.classes().num_components());
  if (with.sigma) result.sigma = array_taking(std::move(columns.sigma), components);
  if (with.probabilities)
    result.probabilities = array_taking(std::move(columns.probabilities), components);
  return result;
}

void add_estimates(py::module_& module) {
  py::class_<Estimates>(module, "Estimates", "Estimates at N places; row i is for place i.")
      .def_readonly("state", &Estimates::state,
                    "(N,) uint8: tessera.State; 0 unknown, 1 free, 2 occupied.")
      .def_readonly("label", &Estimates::label,
                    "(N,) uint8: class 1 .. C with the most evidence, 0 none.")
      .def_readonly("probability", &Estimates::probability,
                    "(N,) float64: probability of the label; 0 without one.")
      .def_readonly("variance", &Estimates::variance,
                    "(N,) float64: variance of the label's probability; 0 without one.")
      .def_readonly("evidence", &Estimates::evidence,
                    "(N,) float64: sum of all counts, without the prior.")
      .def_readonly("occupancy", &Estimates::occupancy,
                    "(N,) float64: probability that the place is not free.")
      .def_readonly("sigma", &Estimates::sigma,
                    "(N, C + 2) float32 counts without the prior: free, classes, unlabelled; None "
                    "unless requested.")
      .def_readonly("probabilities", &Estimates::probabilities,
                    "(N, C + 2) float64 probabilities: free, classes, unlabelled; all equal where "
                    "nothing was seen; what is missing to 1 elsewhere is evidence whose class is "
                    "not known any more; None unless requested.")
      .def("as_dict", &as_dict, "The arrays by name.")
      .def("__len__", &Estimates::size)
      .def("__repr__", [](const Estimates& e) {
        return fmt::format("<tessera.Estimates of {} places>", e.size());
      });
  py::class_<Voxels, Estimates>(
      module, "Voxels", "Observed voxels, by blocks of 8 x 8 x 8 in the order of (z, y, x).")
      .def_readonly("index", &Voxels::index,
                    "(N, 3) int32: voxel v covers [v, v + 1) * resolution_m on each axis.")
      .def_property_readonly("center", &centers, "(N, 3) float64, metres, map frame; a new array.")
      .def_readonly("resolution_m", &Voxels::resolution_m, "Edge of a voxel, metres.")
      .def("__repr__",
           [](const Voxels& v) { return fmt::format("<tessera.Voxels: {} of them>", v.size()); });
}

}  // namespace tessera::python
