// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The same scans give the same map, to the bit, whatever the compiler, its optimisation and the
// architecture: each build that runs this compares itself with all others. A digest here changes
// only if inference does; say so in the release notes then.
#include <array>
#include <catch2/catch.hpp>

#include "oracle/mapper.hpp"
#include "tessera/map/queries.hpp"

namespace tessera::oracle {
namespace {

struct Golden {
  InferenceMode mode;
  ThinningWeight weight;
  bool free_space;
  std::uint64_t digest;
};

/// Walls, ground and scattered points around the sensor, with some beyond the range, seen from two
/// places; drawn with basic arithmetic only.
std::uint64_t digest_of_scans(const Golden& golden, std::uint64_t hash_seed) {
  InferenceConfig config;
  config.mode = golden.mode;
  config.thinning_weight = golden.weight;
  config.free_space.enabled = golden.free_space;
  config.kernel_length_m = 0.35F;
  config.max_range_m = 12.0F;
  MapConfig map = uncapped_map(0.1);
  map.storage_bytes = std::size_t{128} << 20U;
  map.max_evidence = 30.0F;
  map.free_weight = 0.4F;
  map.hash_seed = hash_seed;
  Mapper mapper(map, config, 6);
  Random random(7300);
  for (int scan = 0; scan < 2; ++scan) {
    Cloud cloud;
    for (int i = 0; i < 2500; ++i) {
      const double u = random.uniform(-14, 14);
      const double v = random.uniform(-1.7, 3);
      const int label = 1 + random.below(7);
      const double weight = random.uniform(0, 2);
      switch (i % 3) {
        case 0:
          cloud.add(u, 8.0 + 0.05 * v, v, label, weight);
          break;
        case 1:
          cloud.add(u, 3.0 * v, -1.7, label, weight);
          break;
        default:
          cloud.add(u, random.uniform(-14, 14), v, label, weight);
      }
    }
    Matrix34d T_map_sensor;  // a turn by the angle of the 3-4-5 triangle
    T_map_sensor << 0.8, -0.6, 0.0, 1.23 * scan, 0.6, 0.8, 0.0, -0.77, 0.0, 0.0, 1.0, 0.5;
    REQUIRE(mapper.integrate(cloud, T_map_sensor).left_out() == 0);
  }
  std::vector<KeyedIndex> workspace(2 * mapper.map().block_count());
  return digest(mapper.map(), workspace);
}

constexpr std::array<Golden, 7> kGolden{{
    {InferenceMode::kCounting, ThinningWeight::kMean, false, 0xed39d1d483ad2b32U},
    {InferenceMode::kCounting, ThinningWeight::kMean, true, 0xeb6b9db202ba73f8U},
    {InferenceMode::kKernel, ThinningWeight::kMean, false, 0xef34f93f57be561dU},
    {InferenceMode::kKernel, ThinningWeight::kSum, true, 0xdd544afda7bd27bdU},
    {InferenceMode::kMultiEntropy, ThinningWeight::kMean, false, 0x8b0c6bf3c6a3b902U},
    {InferenceMode::kMultiEntropy, ThinningWeight::kMean, true, 0x9f49d65105d014e5U},
    {InferenceMode::kMultiEntropy, ThinningWeight::kSum, true, 0xbd259ab494e40389U},
}};

}  // namespace

TEST_CASE("golden digest: integrating the same scans gives the same map on every machine") {
  for (std::size_t i = 0; i < kGolden.size(); ++i) {
    INFO("setting " << i);
    CHECK(digest_of_scans(kGolden[i], 0) == kGolden[i].digest);
    CHECK(digest_of_scans(kGolden[i], 0x7e55e4a) == kGolden[i].digest);
  }
}

}  // namespace tessera::oracle
