// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The kernel's sums of a strip of tiles: the same bits in lanes of four and of eight and in strips
// of any length, and the sum of eq. 7.
#include "tessera/inference/internal/kernel_strip.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "support/aligned_memory.hpp"
#include "support/random.hpp"
#include "tessera/inference/kernel.hpp"

namespace tessera {
namespace {

using oracle::Random;

constexpr int kComponents = 5;
constexpr int kTiles = KernelStrip::kTiles;

/// Sums of a tile, by component and row order.
using Sums = std::vector<std::vector<float>>;
const Sums kNothing(kComponents, std::vector<float>(kBlockVoxels, 0.0F));

/// Points in the coordinates of their tile, which lies so many tiles from the strip's first one.
struct TilePoints {
  std::array<int, 3> offset{};
  std::vector<TilePoint> points;
};

struct Case {
  float length;  ///< D, voxels.
  float min_weight;
  float radius_factor;  ///< Of the length.

  [[nodiscard]] float radius() const { return length * radius_factor; }
};

class StripSums {
 public:
  explicit StripSums(LaneWidth lanes) : memory_(KernelStrip::required_bytes()) {
    Arena arena = memory_.arena();
    strip_ = *KernelStrip::make(arena, lanes);
  }

  /// The strip's first tile is `from` tiles along x from where the points' offsets count.
  void sum_up(int from, int tiles, const std::vector<TilePoints>& scan, const Case& given) {
    const KernelShape kernel{.inverse_square = 1.0F / (given.length * given.length),
                             .scale = 1.0F,
                             .min_weight = given.min_weight};
    strip_.begin(tiles);
    for (int tile = 0; tile < tiles; ++tile) REQUIRE(strip_.touched(tile) == 0);
    for (const TilePoints& tile : scan) {
      const std::array<int, 3> offset{tile.offset[0] - from, tile.offset[1], tile.offset[2]};
      strip_.add_points(tile.points, offset, given.radius(), kernel, work);
    }
  }

  /// Octets that are not touched are zero, and those with a component have some of it.
  Sums sums(int tile) const {
    Sums result = kNothing;
    const BlockEvidence evidence = strip_.sums(tile);
    for (int octet = 0; octet < kBlockOctets; ++octet) {
      const std::uint64_t components = evidence.components_of(octet);
      const bool touched = ((strip_.touched(tile) >> static_cast<unsigned>(octet)) & 1U) != 0;
      REQUIRE((components == 0 || touched));
      for (int c = 0; c < kComponents; ++c) {
        const OctetEvidence::Plane plane = evidence.read(octet, c);
        const bool some = ((components >> static_cast<unsigned>(c)) & 1U) != 0;
        REQUIRE(some == (bits_above(plane.data(), 0.0F) != 0));
        for (int v = 0; v < kOctetVoxels; ++v)
          result[static_cast<std::size_t>(c)][static_cast<std::size_t>(row_order(octet, v))] =
              plane[static_cast<std::size_t>(v)];
      }
    }
    return result;
  }
  EvidenceWork work;

 private:
  AlignedMemory memory_;
  KernelStrip strip_;
};

/// Points in tiles in and around a strip; some on the borders between voxels.
std::vector<TilePoints> random_scan(Random& random, float radius) {
  const int reach = static_cast<int>(radius / 8.0F) + 1;
  std::vector<TilePoints> scan(12);
  for (TilePoints& tile : scan) {
    const auto offset = [&](int last) { return random.below(last + 1 + 2 * reach) - reach; };
    tile.offset = {offset(kTiles - 1), offset(0), offset(0)};
    tile.points.resize(8);
    for (TilePoint& point : tile.points) {
      const auto coordinate = [&] {
        const double anywhere = random.uniform(0.0, 7.999);
        return static_cast<float>(random.below(4) == 0 ? std::floor(2.0 * anywhere) / 2.0
                                                       : anywhere);
      };
      point = {
          .x = coordinate(),
          .y = coordinate(),
          .z = coordinate(),
          .weight = random.below(8) == 0 ? 0.0F : static_cast<float>(random.uniform(0.01, 3.0)),
          .component = static_cast<std::uint8_t>(random.below(kComponents))};
      if (random.below(3) != 0) continue;
      point.second = static_cast<std::uint8_t>((point.component + 1) % kComponents);
      point.third = static_cast<std::uint8_t>((point.component + 2) % kComponents);
      point.fourth = static_cast<std::uint8_t>((point.component + 3) % kComponents);
      const auto first = static_cast<std::uint32_t>(64 + random.below(150));
      const auto second = static_cast<std::uint32_t>(1 + random.below(20));
      point.label_weights = first | (second << 8U) | (1U << 16U) | ((254 - first - second) << 24U);
    }
  }
  return scan;
}

std::size_t different_bits(const Sums& a, const Sums& b) {
  std::size_t different = 0;
  for (std::size_t c = 0; c < a.size(); ++c) {
    for (std::size_t i = 0; i < a[c].size(); ++i)
      different +=
          std::bit_cast<std::uint32_t>(a[c][i]) != std::bit_cast<std::uint32_t>(b[c][i]) ? 1U : 0U;
  }
  return different;
}

/// Eq. (7) as it stands; the radius only saves work.
double largest_error(const Sums& sums, int tile, const std::vector<TilePoints>& scan,
                     float length) {
  double largest = 0.0;
  for (std::size_t c = 0; c < sums.size(); ++c) {
    for (int i = 0; i < kBlockVoxels; ++i) {
      const std::array<double, 3> center{8.0 * tile + (i & 7) + 0.5, ((i >> 3) & 7) + 0.5,
                                         (i >> 6) + 0.5};
      double sum = 0.0;
      for (const TilePoints& from : scan) {
        for (const TilePoint& point : from.points) {
          double share = 0.0;
          for_labels(point, [&](std::uint8_t component, std::uint8_t weight) {
            share += component == c ? weight / 255.0 : 0.0;
          });
          if (share == 0.0) continue;
          const double dx = center[0] - 8.0 * from.offset[0] - static_cast<double>(point.x);
          const double dy = center[1] - 8.0 * from.offset[1] - static_cast<double>(point.y);
          const double dz = center[2] - 8.0 * from.offset[2] - static_cast<double>(point.z);
          sum += share * static_cast<double>(point.weight) *
                 kernel_exact(std::sqrt(dx * dx + dy * dy + dz * dz) / static_cast<double>(length));
        }
      }
      const double error =
          std::abs(sum - static_cast<double>(sums[c][static_cast<std::size_t>(i)]));
      largest = error > largest ? error : largest;
    }
  }
  return largest;
}

}  // namespace

TEST_CASE("kernel strip: the same bits in four and in eight lanes and in any strip, as eq. 7 has") {
  // Beyond its factor a kernel is under its min_weight.
  const Case given =
      GENERATE(Case{0.4F, 0.0F, 1.0F}, Case{1.0F, 0.0F, 1.0F}, Case{3.0F, 0.0F, 1.0F},
               Case{3.0F, 1.0F / 4096.0F, 0.97F}, Case{3.7F, 1e-6F, 1.0F}, Case{11.0F, 0.0F, 1.0F});
  Random random(19);
  StripSums four(LaneWidth::kFour);
  StripSums widest(LaneWidth::kWidest);
  StripSums alone(LaneWidth::kWidest);
  for (int round = 0; round < 12; ++round) {
    INFO(given.length << " " << round);
    const std::vector<TilePoints> scan = random_scan(random, given.radius());
    four.sum_up(0, kTiles, scan, given);
    widest.sum_up(0, kTiles, scan, given);
    for (int tile = 0; tile < kTiles; ++tile) {
      const Sums sums = four.sums(tile);
      REQUIRE(different_bits(sums, widest.sums(tile)) == 0);
      alone.sum_up(tile, 1, scan, given);
      REQUIRE(different_bits(sums, alone.sums(0)) == 0);
      // What is under min_weight may be missing of each point.
      REQUIRE(largest_error(sums, tile, scan, given.length) <
              96 * (3e-6 + static_cast<double>(given.min_weight)));
    }
    REQUIRE(four.work.updates == widest.work.updates);
    REQUIRE(four.work.updates == alone.work.updates);
    REQUIRE(four.work.evaluations == widest.work.evaluations);
    REQUIRE(four.work.evaluations >= four.work.updates);
  }
  CHECK(four.work.updates > 10);
}

#if defined(__x86_64__)
TEST_CASE("kernel strip: the wide lanes are used where compiler and machine have them") {
  // The compiler's own question to the machine.
  const bool machine = __builtin_cpu_supports("avx2") != 0;
  CHECK(KernelStrip::has_wide_lanes() == machine);
}
#endif

}  // namespace tessera
