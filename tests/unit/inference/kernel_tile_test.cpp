// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The kernel's sums of a tile: the same bits in lanes of four and of eight, and the sum of eq. 7.
#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "oracle/random.hpp"
#include "tessera/inference/kernel.hpp"
#include "tessera/inference/tile_evidence.hpp"

namespace tessera {
namespace {

using oracle::Random;

constexpr int kComponents = 5;

/// Sums of a tile, by component and row order.
using Sums = std::vector<std::vector<float>>;

class TileSums {
 public:
  explicit TileSums(KernelLanes lanes) : memory_(KernelTile::required_bytes() + kArenaAlignment) {
    const auto at = reinterpret_cast<std::uintptr_t>(memory_.data());
    const std::size_t skipped = (kArenaAlignment - at % kArenaAlignment) % kArenaAlignment;
    Arena arena(std::span<std::byte>(memory_).subspan(skipped));
    tile_ = *KernelTile::make(arena, lanes);
  }
  KernelTile& tile() { return tile_; }

  /// Octets that are not touched must be zero, and read says so.
  Sums sums() const {
    Sums result(kComponents, std::vector<float>(kBlockVoxels, 0.0F));
    for (int octet = 0; octet < kBlockOctets; ++octet) {
      OctetEvidence evidence;
      const bool some = tile_.read(octet, evidence);
      REQUIRE(some == (evidence.components() != 0));
      REQUIRE((!some || ((tile_.touched() >> static_cast<unsigned>(octet)) & 1U) != 0));
      for (int c = 0; c < kComponents; ++c) {
        if (((evidence.components() >> static_cast<unsigned>(c)) & 1U) == 0) continue;
        for (int v = 0; v < kOctetVoxels; ++v)
          result[static_cast<std::size_t>(c)][static_cast<std::size_t>(row_order(octet, v))] =
              evidence.read(c)[static_cast<std::size_t>(v)];
      }
    }
    return result;
  }

 private:
  std::vector<std::byte> memory_;
  KernelTile tile_;
};

/// Points in and around a tile of eight voxels; some on the borders between voxels.
std::vector<TilePoint> random_points(Random& random, std::size_t n, float radius) {
  std::vector<TilePoint> points(n);
  for (TilePoint& point : points) {
    const auto coordinate = [&] {
      const double anywhere = random.uniform(-1.2 * static_cast<double>(radius),
                                             8.0 + 1.2 * static_cast<double>(radius));
      return static_cast<float>(random.below(4) == 0 ? std::round(2.0 * anywhere) / 2.0 : anywhere);
    };
    point = {.x = coordinate(),
             .y = coordinate(),
             .z = coordinate(),
             .weight = random.below(8) == 0 ? 0.0F : static_cast<float>(random.uniform(0.01, 3.0)),
             .component = static_cast<std::uint8_t>(random.below(kComponents))};
  }
  return points;
}

struct Case {
  float length;  ///< D, voxels.
  float min_weight;
  float radius_factor;  ///< Of the length.
};

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
double largest_error(const Sums& sums, const std::vector<TilePoint>& points, const Point3f& shift,
                     float length) {
  double largest = 0.0;
  for (std::size_t c = 0; c < sums.size(); ++c) {
    for (int i = 0; i < kBlockVoxels; ++i) {
      const std::array<double, 3> center{(i & 7) + 0.5, ((i >> 3) & 7) + 0.5, (i >> 6) + 0.5};
      double sum = 0.0;
      for (const TilePoint& point : points) {
        if (point.component != c) continue;
        const double dx = center[0] - static_cast<double>(point.x + shift.x());
        const double dy = center[1] - static_cast<double>(point.y + shift.y());
        const double dz = center[2] - static_cast<double>(point.z + shift.z());
        sum += static_cast<double>(point.weight) *
               kernel_exact(std::sqrt(dx * dx + dy * dy + dz * dz) / static_cast<double>(length));
      }
      const double error =
          std::abs(sum - static_cast<double>(sums[c][static_cast<std::size_t>(i)]));
      largest = error > largest ? error : largest;
    }
  }
  return largest;
}

}  // namespace

TEST_CASE("kernel tile: eight lanes give the bits of four, and both the sum of eq. 7") {
  // Beyond its factor a kernel is under its min_weight.
  const Case given =
      GENERATE(Case{0.4F, 0.0F, 1.0F}, Case{1.0F, 0.0F, 1.0F}, Case{3.0F, 0.0F, 1.0F},
               Case{3.0F, 1.0F / 4096.0F, 0.97F}, Case{3.7F, 1e-6F, 1.0F}, Case{11.0F, 0.0F, 1.0F});
  Random random(19);
  std::uint64_t updates = 0;
  for (int round = 0; round < 40; ++round) {
    const float radius = given.length * given.radius_factor;
    const std::vector<TilePoint> points = random_points(random, 60, radius);
    const Point3f shift(static_cast<float>(8 * (random.below(3) - 1)), 0.0F,
                        static_cast<float>(8 * (random.below(3) - 1)));
    std::vector<TilePoint> before = points;  // in their own tile
    for (TilePoint& point : before) {
      point.x -= shift.x();
      point.z -= shift.z();
    }
    const KernelShape kernel{.inverse_square = 1.0F / (given.length * given.length),
                             .scale = 1.0F,
                             .min_weight = given.min_weight};
    TileSums four(KernelLanes::kFour);
    TileSums widest(KernelLanes::kWidest);
    EvidenceWork work_of_four;
    EvidenceWork work_of_widest;
    four.tile().add_points(before, shift, radius, kernel, work_of_four);
    widest.tile().add_points(before, shift, radius, kernel, work_of_widest);
    const Sums sums = four.sums();
    REQUIRE(different_bits(sums, widest.sums()) == 0);
    REQUIRE(work_of_four.updates == work_of_widest.updates);
    REQUIRE(work_of_four.evaluations == work_of_widest.evaluations);
    REQUIRE(work_of_four.evaluations >= work_of_four.updates);
    updates += work_of_four.updates;
    // What is under min_weight may be missing of each point.
    INFO(given.length << " " << round << " " << shift.transpose());
    REQUIRE(largest_error(sums, before, shift, given.length) <
            60 * (3e-6 + static_cast<double>(given.min_weight)));
    four.tile().clear();
    REQUIRE(four.tile().touched() == 0);
    REQUIRE(different_bits(four.sums(), Sums(kComponents, std::vector<float>(kBlockVoxels))) == 0);
  }
  CHECK(updates > 50);
}

#if defined(__x86_64__)
TEST_CASE("kernel tile: the wide lanes are used where compiler and machine have them") {
  // The compiler's own question to the machine.
  const bool machine = __builtin_cpu_supports("avx2") != 0;
  CHECK(KernelTile::has_wide_lanes() == machine);
}
#endif

}  // namespace tessera
