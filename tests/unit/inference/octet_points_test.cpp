// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Points added to an octet in the widest lanes that this machine has and in lanes of four: the same
// bits, and the same work.
#include <catch2/catch.hpp>

#include "support/cloud.hpp"
#include "tessera/inference/internal/tile_evidence.hpp"

namespace tessera {
namespace {

std::vector<TilePoint> random_points(oracle::Random& random, int count, bool shared) {
  std::vector<TilePoint> points;
  for (int i = 0; i < count; ++i) {
    TilePoint point{
        .x = static_cast<float>(random.uniform(-2.0, 8.0)),
        .y = static_cast<float>(random.uniform(-2.0, 8.0)),
        .z = static_cast<float>(random.uniform(-2.0, 8.0)),
        .weight = random.below(5) == 0 ? 0.0F : static_cast<float>(random.uniform(0.0, 2.0)),
        .component = static_cast<std::uint8_t>(random.below(4))};
    if (shared && random.below(2) == 0) {
      point.second = 5;
      point.third = 6;
      point.fourth = 7;
      const auto weight = [&] { return static_cast<std::uint32_t>(1 + random.below(60)); };
      const std::uint32_t b = weight();
      const std::uint32_t c = weight();
      const std::uint32_t d = weight();
      point.label_weights = (255U - b - c - d) | b << 8U | c << 16U | d << 24U;
    }
    points.push_back(point);
  }
  return points;
}

TEST_CASE("add_points: the widest lanes and lanes of four give the same bits") {
  oracle::Random random(oracle::announce_seed(91));
  const AddOctetPoints wide = widest_octet_points();
  WARN((wide == nullptr ? "this machine has lanes of four only" : "lanes of eight"));
  for (int round = 0; round < 400; ++round) {
    const std::vector<TilePoint> points = random_points(random, random.below(20), round % 3 == 0);
    const auto corner = [&] { return static_cast<std::int8_t>(2 * random.below(4)); };
    const OctetPlace octet{
        .corner = {corner(), corner(), corner()},
        .voxels = static_cast<std::uint8_t>(round % 2 == 0 ? 0xff : random.below(256))};
    const auto length = static_cast<float>(random.uniform(0.5, 6.0));
    const KernelShape kernel{.inverse_square = 1.0F / (length * length),
                             .scale = static_cast<float>(random.uniform(0.5, 2.0)),
                             .min_weight = round % 5 == 0 ? 0.0F : 1.0F / 4096.0F};
    const Point3f shift(static_cast<float>(8 * (random.below(3) - 1)), 0.0F, 0.0F);
    // As LabelWriter has it: cleared, with what was in the planes before.
    OctetEvidence a;
    OctetEvidence b;
    for (OctetEvidence* const evidence : {&a, &b}) {
      for (int component = 0; component < 8; ++component) evidence->plane(component).fill(7.0F);
      evidence->clear();
    }
    EvidenceWork work_a;
    EvidenceWork work_b;
    // Twice, so that planes are begun and added to.
    for (int pass = 0; pass < 2; ++pass) {
      add_points(points, shift, octet, kernel, wide, a, work_a);
      add_points(points, shift, octet, kernel, nullptr, b, work_b);
    }
    REQUIRE(work_a.updates == work_b.updates);
    REQUIRE(work_a.evaluations == work_b.evaluations);
    REQUIRE(a.components() == b.components());
    for (std::uint64_t rest = a.components(); rest != 0; rest &= rest - 1)
      REQUIRE(a.read(std::countr_zero(rest)) == b.read(std::countr_zero(rest)));
  }
}

}  // namespace
}  // namespace tessera
