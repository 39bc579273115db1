// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "support/sample_map.hpp"

#include <catch2/catch.hpp>
#include <set>
#include <tuple>

#include "tessera/base/internal/digest.hpp"

namespace tessera {

std::uint64_t SampleRandom::bits() {
  state_ += 0x9e3779b97f4a7c15U;
  return mix64(state_);
}

int SampleRandom::integer(int low, int high) {
  return low + static_cast<int>(bits() % static_cast<std::uint64_t>(high - low + 1));
}

double SampleRandom::uniform(double low, double high) {
  return low + (high - low) * static_cast<double>(bits() >> 11U) * 0x1p-53;
}

std::vector<Observation> sample_observations(std::uint64_t seed, int count, int reach) {
  SampleRandom random(seed);
  std::vector<Observation> observations;
  std::set<std::tuple<int, int, int, int>> taken;
  while (static_cast<int>(observations.size()) < count) {
    const VoxelCoord v{random.integer(-reach, reach), random.integer(-reach, reach),
                       random.integer(-reach, reach)};
    const int component = random.integer(0, kSampleClasses + 1);
    const auto weight = static_cast<float>(random.integer(1, 16)) / 8.0F;
    if (taken.insert({v.x, v.y, v.z, component}).second)
      observations.push_back({v, component, weight});
  }
  return observations;
}

void observe(LocalMap& map, const std::vector<Observation>& observations) {
  for (const Observation& o : observations) {
    REQUIRE((o.component == 0 ? carve(map, o.voxel) : hit(map, o.voxel, o.component, o.weight)) ==
            Status::kOk);
  }
}

SmallMap sample_map(std::uint64_t seed, int count, int reach, std::size_t pages) {
  SmallMap sample(config_of_pages(pages), kSampleClasses);
  sample.map.begin_revision();
  observe(sample.map, sample_observations(seed, count, reach));
  return sample;
}

}  // namespace tessera
