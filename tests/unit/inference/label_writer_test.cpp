// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How the labels of tiles get into a map: each tile as a whole, once, whatever the mode.
#include "tessera/inference/internal/label_writer.hpp"

#include <catch2/catch.hpp>
#include <map>
#include <set>
#include <tuple>

#include "hand_clock.hpp"
#include "held_points.hpp"
#include "support/random.hpp"
#include "support/small_map.hpp"
#include "tessera/inference/internal/kernel_reach.hpp"
#include "tessera/inference/internal/storage_needs.hpp"
#include "tessera/inference/internal/wanted_units.hpp"

namespace tessera {
namespace {

constexpr ScanCapacity kCapacity{.points = 1024, .tiles = 512, .ray_blocks = 16};

/// Points of one class in a cube of 2.4 m, their tiles, and a map whose blocks for them are open.
struct Bench {
  explicit Bench(InferenceMode mode)
      : held(kCapacity.points),
        scratch(kCapacity),
        small(config_of_pages(400)),
        memory(LabelWriter::required_bytes(mode)) {
    config = config_without_thinning();
    config.mode = mode;
    config.kernel_length_m = 0.3F;
    Arena arena = memory.arena();
    writer = *LabelWriter::make(arena, config);
    work.begin(nullptr);
    oracle::Random random(5);
    std::vector<float> xyz;
    for (int i = 0; i < 3 * 300; ++i) xyz.push_back(static_cast<float>(random.uniform(-1.2, 1.2)));
    static_cast<void>(held.take(small.map.lattice(), xyz, config, work));
    if (mode == InferenceMode::kKernel)
      reach = kernel_reach(config, small.map.config().resolution_m, 1.0F);
    tiles().reset(unit_edge_of(config));
    REQUIRE(tiles().build(held.points.admitted(), small.map.lattice(), held.points.scratch()) ==
            Status::kOk);
    REQUIRE(want_units(tiles(), config, reach, 3));
    for (Tile& tile : tiles().tiles()) {
      if (tile.wanted != 0) REQUIRE(open_tile(small.map, tiles().unit_edge(), tile, tile.wanted));
    }
    writer.begin(small.map, reach);
  }
  ScanTiles& tiles() { return scratch.scratch.tiles; }
  void write() { writer.write(small.map, tiles(), {0, 0, 0}, work, report); }

  HeldPoints held;
  HeldScratch scratch;
  SmallMap small;
  AlignedMemory memory;
  InferenceConfig config;
  KernelReach reach;
  LabelWriter writer;
  ScanWork work;
  ScanReport report;
};

}  // namespace

TEST_CASE("LabelWriter: counting gives each voxel its points, and each tile is written once") {
  Bench bench(InferenceMode::kCounting);
  bench.write();
  std::map<std::tuple<int, int, int>, float> expected;
  for (const ScanPoint& point : bench.held.points.admitted())
    expected[{point.voxel.z, point.voxel.y, point.voxel.x}] += 1.0F;
  const Content content = content_of(bench.small.map);
  REQUIRE(content.evidence.size() == expected.size());
  for (const auto& [voxel, counts] : content.evidence) CHECK(counts[1] == expected[voxel]);
  CHECK(bench.report.evaluations == bench.held.points.admitted().size());
  CHECK(bench.report.tiles_cut == 0);
  CHECK(bench.report.write_faults == 0);
}

TEST_CASE(
    "LabelWriter: the kernel modes spread more than one voxel a point, in blocks that are open") {
  const InferenceMode mode = GENERATE(InferenceMode::kKernel, InferenceMode::kMultiEntropy);
  Bench bench(mode);
  const std::size_t blocks = bench.small.map.block_count();
  bench.write();
  CHECK(bench.small.map.block_count() == blocks);
  CHECK(bench.report.write_faults == 0);
  CHECK(content_of(bench.small.map).evidence.size() > bench.held.points.admitted().size());
}

TEST_CASE(
    "LabelWriter: what a deadline leaves out is whole tiles, counted, and the others are as "
    "without") {
  const InferenceMode mode =
      GENERATE(InferenceMode::kCounting, InferenceMode::kKernel, InferenceMode::kMultiEntropy);
  Bench whole(mode);
  whole.write();
  const Content all = content_of(whole.small.map);
  for (int readings = 1; readings < 60; readings += 7) {
    Bench bench(mode);
    HandClock hand{.time_us = 0, .step_us = 1};
    Deadline deadline(hand.clock());
    deadline.begin(readings);
    bench.work.begin(&deadline);
    bench.write();
    const Content some = content_of(bench.small.map);
    std::map<std::array<int, 3>, std::set<bool>> written;  // by tile
    for (const auto& [voxel, counts] : all.evidence) {
      const auto found = some.evidence.find(voxel);
      const bool is_there = found != some.evidence.end();
      if (is_there) CHECK(found->second == counts);
      const auto [z, y, x] = voxel;
      const int edge = 4 * bench.tiles().unit_edge();
      const auto down = [edge](int a) { return a >= 0 ? a / edge : -((edge - 1 - a) / edge); };
      written[{down(x), down(y), down(z)}].insert(is_there);
    }
    std::size_t missing = 0;
    for (const auto& [tile, states] : written) {
      CHECK(states.size() == 1);
      missing += *states.begin() ? 0U : 1U;
    }
    CHECK(bench.report.tiles_cut >= missing);
    if (missing != 0) CHECK(bench.work.cut());
  }
}

}  // namespace tessera
