// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Points that cost an integrator most.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "meter.hpp"
#include "tessera/map/internal/label_votes.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera::bench {

inline constexpr double kResolution_m = 0.1;
inline constexpr float kEdge_m = 0.1F;
inline constexpr std::uint32_t kSeed = 1;

struct Cloud {
  std::vector<float> xyz;
  std::vector<std::uint8_t> components;
  std::vector<std::uint8_t> label_weights{};
  std::size_t labels_per_point = 1;

  void add(float x, float y, float z, int component) {
    xyz.insert(xyz.end(), {x, y, z});
    components.push_back(static_cast<std::uint8_t>(component));
  }
  [[nodiscard]] std::size_t size() const { return components.size() / labels_per_point; }
  [[nodiscard]] ScanView view() const {
    ScanView scan;
    scan.points = xyz.data();
    scan.stride_floats = 3;
    scan.count = size();
    scan.components = components.data();
    scan.labels_per_point = labels_per_point;
    if (!label_weights.empty()) scan.label_weights = label_weights.data();
    return scan;
  }
};

/// A point in the middle of every voxel of a cube, each of another class than those beside it.
inline Cloud full_cube(int edge) {
  Cloud cloud;
  for (int i = 0; i < edge * edge * edge; ++i) {
    const auto at = [](int v) { return (static_cast<float>(v) + 0.5F) * kEdge_m; };
    cloud.add(at(i % edge), at(i / edge % edge), at(i / (edge * edge)), 1 + i % kMostClasses);
  }
  return cloud;
}

/// The same points, with three labels each and something left of one.
inline Cloud with_three_labels(const Cloud& cloud) {
  Cloud shared = cloud;
  shared.components.clear();
  shared.labels_per_point = 3;
  for (const std::uint8_t component : cloud.components) {
    for (int k = 0; k < 3; ++k)
      shared.components.push_back(
          static_cast<std::uint8_t>(1 + (component - 1 + 7 * k) % kMostClasses));
    shared.label_weights.insert(shared.label_weights.end(), {80, 75, 70});
  }
  return shared;
}

/// Points within a thousandth of a voxel around its middle.
inline Cloud one_voxel(int count) {
  Cloud cloud;
  std::mt19937 random(kSeed);
  const auto near_middle = [&random] {
    return kEdge_m * (0.5F + 1e-3F * (static_cast<float>(random() >> 8U) * 0x1p-24F - 0.5F));
  };
  for (int i = 0; i < count; ++i)
    cloud.add(near_middle(), near_middle(), near_middle(), 1 + i % kMostClasses);
  return cloud;
}

/// Points where eight blocks meet, at multiples of blocks along each axis.
inline Cloud corners(int edge, int blocks) {
  Cloud cloud;
  for (int i = 0; i < edge * edge * edge; ++i) {
    const auto at = [blocks](int v) {
      return static_cast<float>(v * blocks) * kEdge_m * kBlockEdge;
    };
    cloud.add(at(i % edge), at(i / edge % edge), at(i / (edge * edge)), 1 + i % kMostClasses);
  }
  return cloud;
}

/// A cube of blocks, in each of whose layers there are points of five classes, others in the next.
inline Cloud classes_in_layers(int blocks) {
  constexpr int kClasses = static_cast<int>(LabelVotes::kClasses);
  Cloud cloud;
  for (int layer = 0; layer < blocks * blocks * blocks * kBlockLayers; ++layer) {
    const int column = layer / (blocks * kBlockLayers);
    const auto corner = [](int v, int voxel) {
      return (static_cast<float>(v * kBlockEdge + voxel) + 0.5F) * kEdge_m;
    };
    for (int i = 0; i < kClasses; ++i) {
      cloud.add(corner(column % blocks, 2 * (i & 1) + 3), corner(column / blocks, i & 6),
                (static_cast<float>(2 * (layer % (blocks * kBlockLayers))) + 0.5F) * kEdge_m,
                1 + (kClasses * layer + i) % kMostClasses);
    }
  }
  return cloud;
}

/// Returns beyond the range, near the grid's diagonal, where a ray crosses most voxels.
inline Cloud diagonals(int count, float range_m) {
  Cloud cloud;
  std::mt19937 random(kSeed);
  const auto beside = [&](float x) {
    return x * (1.0F + 0.02F * (static_cast<float>(random() >> 8U) * 0x1p-24F - 0.5F));
  };
  const float far = 1.1F * range_m / std::sqrt(3.0F);
  for (int i = 0; i < count; ++i)
    cloud.add(beside(far), beside(far), beside(far), 1 + i % kMostClasses);
  return cloud;
}

}  // namespace tessera::bench
