// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "support/cloud.hpp"

#include <cmath>
#include <iostream>
#include <utility>

namespace tessera::oracle {

namespace {

double border_of(double value) { return std::round(value * 10.0) / 10.0; }

}  // namespace

Cloud random_cloud(Random& random, const CloudOptions& options) {
  Cloud cloud;
  while (static_cast<int>(cloud.size()) < options.points) {
    const double cx = random.uniform(-options.reach_m, options.reach_m);
    const double cy = random.uniform(-options.reach_m, options.reach_m);
    const double cz = random.uniform(-options.reach_m, options.reach_m);
    const int first = 1 + random.below(options.classes);
    const int second = 1 + random.below(options.classes);
    const double mix = random.uniform() < 0.5 ? 0.0 : random.uniform(0.0, 0.6);
    const bool sheet = random.uniform() < 0.4;
    const double size_m = options.cluster_m * (sheet ? 2.0 : 1.0);
    const int members = 10 + random.below(60);
    for (int i = 0; i < members && static_cast<int>(cloud.size()) < options.points; ++i) {
      double x = cx + random.uniform(-size_m, size_m);
      double y = cy + random.uniform(-size_m, size_m);
      double z = cz + random.uniform(-size_m, size_m) * (sheet ? 0.05 : 1.0);
      if (options.on_borders) {
        x = border_of(x);
        y = border_of(y);
        z = border_of(z);
      }
      int component = random.uniform() < mix ? second : first;
      if (random.uniform() < options.unlabelled) component = options.classes + 1;
      if (options.weighted) {
        cloud.add(x, y, z, component, random.uniform() < 0.05 ? 0.0 : random.uniform(0.05, 2.0));
      } else {
        cloud.add(x, y, z, component);
      }
    }
  }
  return cloud;
}

void share_labels(Random& random, int classes, Cloud& cloud) {
  const std::vector<std::uint8_t> given = std::move(cloud.components);
  cloud.components.clear();
  cloud.labels_per_point = kMostLabels;
  for (const std::uint8_t component : given) {
    const int kind = random.below(10);
    const int first = kind < 2 ? 255 : kind == 2 ? 0 : random.below(256);
    const int second = kind == 2 ? 0 : random.below(256 - first);
    const int third = kind == 2 ? 0 : random.below(256 - first - second);
    const auto any = static_cast<std::uint8_t>(1 + random.below(classes + 1));
    const auto other = static_cast<std::uint8_t>(1 + random.below(classes));
    for (const std::uint8_t label : {component, any, kind == 3 ? component : other})
      cloud.components.push_back(label);
    for (const int weight : {first, second, third})
      cloud.label_weights.push_back(static_cast<std::uint8_t>(weight));
  }
}

std::uint64_t announce_seed(std::uint64_t seed) {
  std::cout << "seed " << seed << '\n';
  return seed;
}

}  // namespace tessera::oracle
