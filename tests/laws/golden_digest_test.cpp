// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The same scans give the same map, to the bit, whatever the compiler, its optimisation and the
// architecture: each build that runs this compares itself with all others. A digest by rows changes
// only if inference does; say so in the release notes then.
#include <array>
#include <catch2/catch.hpp>

#include "support/digest_by_rows.hpp"
#include "support/mapper.hpp"
#include "tessera/map/queries.hpp"

namespace tessera::oracle {
namespace {

struct Golden {
  InferenceMode mode;
  ThinningWeight weight;
  bool free_space;
  std::uint64_t digest;
  std::uint64_t by_rows;
  Carving carving = Carving::kRays;
  bool weighted = false;  ///< Points have three labels with weights.
  TuplePolicy tuple = TuplePolicy::kDense;
};

struct Digests {
  std::uint64_t digest;
  std::uint64_t by_rows;
};

/// Walls, ground and scattered points around the sensor, with some beyond the range, seen from two
/// places; drawn with basic arithmetic only.
Digests digests_of_scans(const Golden& golden, std::uint64_t hash_seed) {
  InferenceConfig config;
  config.mode = golden.mode;
  config.thinning_weight = golden.weight;
  config.free_space.enabled = golden.free_space;
  config.free_space.carving = golden.carving;
  config.kernel_length_m = 0.35F;
  config.max_range_m = 12.0F;
  MapConfig map = uncapped_map(0.1);
  map.storage_bytes = std::size_t{128} << 20U;
  map.max_evidence = 30.0F;
  map.free_weight = 0.4F;
  map.hash_seed = hash_seed;
  map.tuple = golden.tuple;
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
    if (golden.weighted) share_labels(random, 6, cloud);
    Matrix34d T_map_sensor;  // a turn by the angle of the 3-4-5 triangle
    T_map_sensor << 0.8, -0.6, 0.0, 1.23 * scan, 0.6, 0.8, 0.0, -0.77, 0.0, 0.0, 1.0, 0.5;
    REQUIRE(mapper.integrate(cloud, T_map_sensor).left_out() == 0);
  }
  std::vector<KeyedIndex> workspace(2 * mapper.map().block_count());
  return {digest(mapper.map(), workspace), digest_by_rows(mapper.map())};
}

constexpr std::array<Golden, 17> kGolden{{
    {InferenceMode::kCounting, ThinningWeight::kMean, false, 0xf7bdef67ace907c0U,
     0xed39d1d483ad2b32U},
    {InferenceMode::kCounting, ThinningWeight::kMean, true, 0x71eb3030312c239fU,
     0xeb6b9db202ba73f8U},
    {InferenceMode::kKernel, ThinningWeight::kMean, false, 0x80f7ba8a244d3e88U,
     0xef34f93f57be561dU},
    {InferenceMode::kKernel, ThinningWeight::kSum, true, 0x4d349c7364da3808U, 0xdd544afda7bd27bdU},
    {InferenceMode::kMultiEntropy, ThinningWeight::kMean, false, 0xb9ede0f2967dcf7fU,
     0x8b0c6bf3c6a3b902U},
    {InferenceMode::kMultiEntropy, ThinningWeight::kMean, true, 0x0831efcb0470e57fU,
     0x9f49d65105d014e5U},
    {InferenceMode::kMultiEntropy, ThinningWeight::kSum, true, 0xb09f44517cce1925U,
     0xbd259ab494e40389U},
    {InferenceMode::kCounting, ThinningWeight::kMean, true, 0xb42d57a26c912b20U,
     0x407f62849988b93aU, Carving::kImage},
    {InferenceMode::kKernel, ThinningWeight::kSum, true, 0x20a7c2cf17f6f35fU, 0x226d3bc53bb18f33U,
     Carving::kImage},
    {InferenceMode::kMultiEntropy, ThinningWeight::kMean, true, 0xf800729eef9ef1f1U,
     0x52a958e2530441cfU, Carving::kImage},
    {InferenceMode::kMultiEntropy, ThinningWeight::kSum, true, 0x6a04af92b6597e3bU,
     0xfaa6fd6552b7e251U, Carving::kImage},
    {InferenceMode::kCounting, ThinningWeight::kMean, false, 0xf4310364bfbd131eU,
     0x4e4b8908a1626eb2U, Carving::kRays, true, TuplePolicy::kCompact},
    {InferenceMode::kKernel, ThinningWeight::kSum, false, 0x59d941435a883255U, 0x7a7bae50f3d35fb1U,
     Carving::kRays, true, TuplePolicy::kDense},
    {InferenceMode::kMultiEntropy, ThinningWeight::kMean, true, 0xfd525c6a14675caaU,
     0xf6c10e66000a8be6U, Carving::kImage, true, TuplePolicy::kCompact},
    {InferenceMode::kLattice, ThinningWeight::kMean, false, 0x046897a38b0b0408U,
     0xc8777caa53dfa02fU},
    {InferenceMode::kLattice, ThinningWeight::kMean, true, 0x66669bc75c74c7a6U, 0x0406e3b4e8130ea5U,
     Carving::kImage, false, TuplePolicy::kCompact},
    {InferenceMode::kLattice, ThinningWeight::kMean, true, 0x3d03638c32ab7945U, 0xea8a89bcb20c6785U,
     Carving::kImage, true, TuplePolicy::kCompact},
}};

}  // namespace

TEST_CASE("golden digest: integrating the same scans gives the same map on every machine") {
  for (std::size_t i = 0; i < kGolden.size(); ++i) {
    INFO("setting " << i);
    for (const std::uint64_t hash_seed : {0U, 0x7e55e4aU}) {
      const Digests digests = digests_of_scans(kGolden[i], hash_seed);
      CHECK(digests.digest == kGolden[i].digest);
      CHECK(digests.by_rows == kGolden[i].by_rows);
    }
  }
}

}  // namespace tessera::oracle
