// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Estimates of voxels, as arrays by name.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "arrays.hpp"
#include "held_map.hpp"
#include "tessera/map/queries.hpp"

namespace tessera::python {

/// What an answer has beside the estimates, of each component.
struct WithComponents {
  bool sigma = false;
  bool probabilities = false;

  [[nodiscard]] bool any() const noexcept { return sigma || probabilities; }
};

/// A row for each requested place.
struct Estimates {
  py::array_t<std::uint8_t> state;
  py::array_t<std::uint8_t> label;
  py::array_t<double> probability;
  py::array_t<double> variance;
  py::array_t<double> evidence;
  py::array_t<double> occupancy;
  py::object sigma = py::none();          ///< (N, L) float32, or none.
  py::object probabilities = py::none();  ///< (N, L) float64, or none.

  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(state.size()); }
};

/// The observed voxels of a map or a box, in its order.
struct Voxels : Estimates {
  py::array_t<std::int32_t> index;
  double resolution_m = 0.0;
};

/// New arrays of Estimates, and pointers for writing into them without the GIL.
class EstimateWriter {
 public:
  /// components: L, of what is of each component.
  explicit EstimateWriter(std::size_t count, std::size_t components = 0, WithComponents with = {});
  void write(std::size_t i, const Estimate& estimate) noexcept {
    state_[i] = static_cast<std::uint8_t>(estimate.state);
    label_[i] = static_cast<std::uint8_t>(estimate.label);
    probability_[i] = estimate.probability;
    variance_[i] = estimate.variance;
    evidence_[i] = estimate.evidence;
    occupancy_[i] = estimate.occupancy;
  }
  /// What is of each component.
  void write(std::size_t i, const VoxelEvidence& evidence, const Reading& reading) noexcept {
    if (sigma_ != nullptr)
      std::copy_n(evidence.sigma.begin(), components_, sigma_ + i * components_);
    if (probabilities_ != nullptr)
      summary_of(evidence).distribution(reading,
                                        std::span(probabilities_ + i * components_, components_));
  }
  [[nodiscard]] Estimates& arrays() noexcept { return arrays_; }

 private:
  Estimates arrays_;
  std::size_t components_;
  std::uint8_t* state_;
  std::uint8_t* label_;
  double* probability_;
  double* variance_;
  double* evidence_;
  double* occupancy_;
  float* sigma_ = nullptr;
  double* probabilities_ = nullptr;
};

/// The voxel that contains p_map; one outside of the grid if p_map is outside or not finite.
[[nodiscard]] inline VoxelCoord voxel_at(const Lattice& lattice, const Point3d& p_map) noexcept {
  const Result<VoxelCoord> voxel = lattice.voxel_of(p_map);
  return voxel.ok() ? *voxel : VoxelCoord{kVoxelLimit, 0, 0};
}

[[nodiscard]] Estimates query(const HeldMap& map, const py::array& points, WithComponents with);
/// low, high: corners, both included; none: the whole map.
[[nodiscard]] Voxels voxels(const HeldMap& map, const std::optional<std::array<double, 3>>& low,
                            const std::optional<std::array<double, 3>>& high, bool occupied_only,
                            WithComponents with);

void add_estimates(py::module_& module);
void add_ray_queries(py::module_& module, py::class_<HeldMap, std::shared_ptr<HeldMap>>& map);

}  // namespace tessera::python
