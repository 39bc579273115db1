// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Clouds that tests feed to the library and to the oracle alike, and the seeds that they come from.
#pragma once

#include <cstdint>
#include <vector>

#include "support/random.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera::oracle {

/// A labelled cloud in the sensor frame; weights empty: all 1.
struct Cloud {
  std::vector<float> xyz;
  std::vector<std::uint8_t> components;
  std::vector<float> weights;

  [[nodiscard]] std::size_t size() const { return components.size(); }
  void add(double x, double y, double z, int component) {
    for (const double c : {x, y, z}) xyz.push_back(static_cast<float>(c));
    components.push_back(static_cast<std::uint8_t>(component));
  }
  void add(double x, double y, double z, int component, double weight) {
    add(x, y, z, component);
    weights.push_back(static_cast<float>(weight));
  }
  /// A view for the library; this cloud must outlive it.
  [[nodiscard]] ScanView view(const Matrix34d& T_map_sensor = Matrix34d::Identity()) const {
    return {.T_map_sensor = T_map_sensor,
            .points = xyz.data(),
            .stride_floats = 3,
            .count = size(),
            .components = components.data(),
            .weights = weights.empty() ? nullptr : weights.data()};
  }
};

struct CloudOptions {
  int points = 800;
  int classes = 5;  ///< C; clusters mix two of them.
  double reach_m =
      3.0;  ///< Clusters lie within this of the origin on each axis, on both sides of it.
  double cluster_m = 0.35;   ///< Half the size of a cluster.
  double unlabelled = 0.15;  ///< Share of unlabelled points.
  bool weighted = false;     ///< Weights from 0 (a twentieth of the points) to 2, else all 1.
  bool on_borders = false;   ///< Coordinates at whole multiples of a decimetre.
};

/// Clusters and sheets of points, so that classes meet, blocks stay empty between others, and
/// densities differ.
[[nodiscard]] Cloud random_cloud(Random& random, const CloudOptions& options);

/// Prints the seed of a test and returns it.
std::uint64_t announce_seed(std::uint64_t seed);

}  // namespace tessera::oracle
