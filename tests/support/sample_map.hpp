// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Maps with something of everything in them, made from a list of observations, so that the same
// content can be reached in another order or in other memory.
#pragma once

#include <cstdint>
#include <vector>

#include "support/small_map.hpp"

namespace tessera {

/// splitmix64.
class SampleRandom {
 public:
  explicit SampleRandom(std::uint64_t seed) : state_(seed) {}
  std::uint64_t bits();
  /// In [low, high], both included.
  int integer(int low, int high);
  /// In [low, high).
  double uniform(double low, double high);

 private:
  std::uint64_t state_;
};

/// Label evidence in a component, or with component 0 one free pass.
struct Observation {
  VoxelCoord voxel;
  int component = 0;
  float weight = 1.0F;
};

inline constexpr int kSampleClasses = 3;

/// Random hits and passes in voxels of [-reach, reach] on each axis, each voxel and component once,
/// so that their order cannot matter.
std::vector<Observation> sample_observations(std::uint64_t seed, int count, int reach);

/// Applies them in order.
void observe(LocalMap& map, const std::vector<Observation>& observations);

/// A map of sample_observations in storage of so many pages, at revision 1.
SmallMap sample_map(std::uint64_t seed, int count = 60, int reach = 12, std::size_t pages = 64);

}  // namespace tessera
