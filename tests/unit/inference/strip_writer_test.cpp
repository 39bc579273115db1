// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Label evidence of the kernel mode, in strips of tiles: where it goes, and that strips do not show
// in it.
#include "tessera/inference/internal/strip_writer.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "held_points.hpp"
#include "support/random.hpp"
#include "support/small_map.hpp"
#include "tessera/inference/internal/storage_needs.hpp"
#include "tessera/inference/internal/wanted_units.hpp"

namespace tessera {
namespace {

constexpr ScanCapacity kCapacity{.points = 1024, .tiles = 1024, .ray_blocks = 16};

/// Points in a row of tiles along x.
std::vector<float> points_along_x(int count) {
  oracle::Random random(3);
  std::vector<float> xyz;
  for (int i = 0; i < count; ++i) {
    xyz.push_back(static_cast<float>(random.uniform(-3.0, 3.0)));
    xyz.push_back(static_cast<float>(random.uniform(0.0, 0.5)));
    xyz.push_back(static_cast<float>(random.uniform(0.0, 0.5)));
  }
  return xyz;
}

/// Points of one class, their tiles, and a map whose blocks for them are open.
struct Bench {
  explicit Bench(const std::vector<float>& xyz, float length_m = 0.3F)
      : held(kCapacity.points),
        scratch(kCapacity),
        small(config_of_pages(600)),
        memory(StripWriter::required_bytes()) {
    config = config_without_thinning();
    config.mode = InferenceMode::kKernel;
    config.kernel_length_m = length_m;
    Arena arena = memory.arena();
    writer = *StripWriter::make(arena);
    work.begin(nullptr);
    static_cast<void>(held.take(small.map.lattice(), xyz, config, work));
    const double resolution_m = small.map.config().resolution_m;
    reach = kernel_reach(config, resolution_m, 1.0F);
    tiles().reset(unit_edge_of(config));
    REQUIRE(tiles().build(held.points.admitted(), small.map.lattice(), held.points.scratch()) ==
            Status::kOk);
    REQUIRE(want_units(tiles(), config, reach, 3));
    for (Tile& tile : tiles().tiles()) {
      if (tile.wanted != 0) REQUIRE(open_tile(small.map, tiles().unit_edge(), tile, tile.wanted));
    }
    writer.begin(config, static_cast<float>(static_cast<double>(length_m) / resolution_m), reach);
  }
  ScanTiles& tiles() { return scratch.scratch.tiles; }
  void write_all() { writer.write_all(small.map, tiles(), evidence_work, report); }

  HeldPoints held;
  HeldScratch scratch;
  SmallMap small;
  AlignedMemory memory;
  InferenceConfig config;
  KernelReach reach;
  StripWriter writer;
  ScanWork work;
  EvidenceWork evidence_work;
  ScanReport report;
};

}  // namespace

TEST_CASE("StripWriter: a map is the same bits whether its tiles are written in strips or alone") {
  const float length_m = GENERATE(0.3F, 0.9F);
  const std::vector<float> xyz = points_along_x(200);
  Bench strips(xyz, length_m);
  Bench alone(xyz, length_m);
  strips.write_all();
  for (const Tile& tile : alone.tiles().tiles()) {
    if (tile.wanted == 0) continue;
    const Tile* const one = &tile;
    alone.writer.write(alone.small.map, alone.tiles(), std::span(&one, 1), alone.evidence_work,
                       alone.report);
  }
  const Content content = content_of(strips.small.map);
  CHECK(content.label_voxels > 200);
  CHECK(content.evidence == content_of(alone.small.map).evidence);
  CHECK(strips.report.strips < alone.report.strips);
  CHECK(strips.report.label_octets == alone.report.label_octets);
  CHECK(strips.report.write_faults == 0);
}

TEST_CASE("StripWriter: afterwards no tile wants anything, and a second call writes nothing") {
  Bench bench(points_along_x(50));
  bench.write_all();
  for (const Tile& tile : bench.tiles().tiles()) CHECK(tile.wanted == 0);
  const Content before = content_of(bench.small.map);
  const std::uint32_t strips = bench.report.strips;
  bench.write_all();
  CHECK(content_of(bench.small.map) == before);
  CHECK(bench.report.strips == strips);
}

TEST_CASE("StripWriter: tiles of points that follow along x are strips as long as they can be") {
  Bench bench(points_along_x(300));
  int wanted = 0;
  for (Tile& tile : bench.tiles().tiles()) {
    if (tile.coord.y != 0 || tile.coord.z != 0) tile.wanted = 0;
    wanted += tile.wanted != 0 ? 1 : 0;
  }
  REQUIRE(wanted > KernelStrip::kTiles);
  bench.write_all();
  CHECK(bench.report.strips ==
        static_cast<std::uint32_t>((wanted + KernelStrip::kTiles - 1) / KernelStrip::kTiles));
}

TEST_CASE("StripWriter: a point gives its own voxel the most, and nothing beyond its reach") {
  Bench bench({0.05F, 0.05F, 0.05F});
  bench.write_all();
  const Content content = content_of(bench.small.map);
  const float own = content.evidence.at({0, 0, 0})[1];
  for (const auto& [voxel, counts] : content.evidence) {
    const auto [z, y, x] = voxel;
    const auto distance = std::sqrt(static_cast<float>(x * x + y * y + z * z));
    CHECK(counts[1] <= own);
    CHECK(counts[1] > 0.0F);
    CHECK(distance <= bench.reach.radius_voxels);
  }
  CHECK(content.evidence.size() > 1);
}

TEST_CASE("StripWriter: what is not wanted, or not open, gets nothing") {
  const std::vector<float> xyz = points_along_x(100);
  Bench whole(xyz);
  Bench part(xyz);
  whole.write_all();
  for (Tile& tile : part.tiles().tiles()) {
    if (tile.coord.x < 0) tile.wanted = 0;
    if (tile.coord.x == 0) tile.blocks[0] = 0;
  }
  part.write_all();
  const Content all = content_of(whole.small.map);
  const Content some = content_of(part.small.map);
  for (const auto& [voxel, counts] : all.evidence) {
    const auto found = some.evidence.find(voxel);
    const bool is_written = std::get<2>(voxel) >= kBlockEdge;
    REQUIRE((found != some.evidence.end()) == is_written);
    if (is_written) CHECK(found->second == counts);
  }
  CHECK(part.report.write_faults == 0);
}

TEST_CASE("StripWriter: memory that is too small is refused") {
  AlignedMemory memory(StripWriter::required_bytes() - 1);
  Arena arena = memory.arena();
  CHECK(StripWriter::make(arena).status() == Status::kResourceExhausted);
}

}  // namespace tessera
