// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Clouds that tests feed to the library and to the oracle alike, and the seeds that they come from.
#pragma once

#include <cstdint>
#include <vector>

#include "support/random.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera::oracle {

/// A labelled cloud in the sensor frame; weights empty: all 1; label_weights empty: one label each.
struct Cloud {
  std::vector<float> xyz;
  std::vector<std::uint8_t> components;
  std::vector<float> weights;
  std::vector<std::uint8_t> label_weights;
  std::size_t labels_per_point = 1;

  [[nodiscard]] std::size_t size() const { return components.size() / labels_per_point; }
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
            .weights = weights.empty() ? nullptr : weights.data(),
            .labels_per_point = labels_per_point,
            .label_weights = label_weights.empty() ? nullptr : label_weights.data()};
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

/// The same points with three labels each: the given one, and two of any classes. Some have all of
/// their weight on the first, some none on any, some twice the same; of the rest part is left.
void share_labels(Random& random, int classes, Cloud& cloud);

/// Clusters and sheets of points, so that classes meet, blocks stay empty between others, and
/// densities differ.
[[nodiscard]] Cloud random_cloud(Random& random, const CloudOptions& options);

/// Prints the seed of a test and returns it.
std::uint64_t announce_seed(std::uint64_t seed);

}  // namespace tessera::oracle
