// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Answers against the map itself, and bounds of work.
#include <catch2/catch.hpp>
#include <vector>

#include "support/sample_map.hpp"
#include "support/team.hpp"
#include "tessera/map/cast_ray.hpp"
#include "unit/service/service_bench.hpp"

namespace tessera {
namespace {

/// A cell as its definition has it.
std::uint8_t cell_by_hand(const LocalMap& map, VoxelCoord low, int edge) {
  int free = 0;
  std::array<int, 64> labels{};
  for (int z = 0; z < edge; ++z) {
    for (int y = 0; y < edge; ++y) {
      for (int x = 0; x < edge; ++x) {
        const Estimate estimate = map.query(VoxelCoord{low.x + x, low.y + y, low.z + z});
        free += estimate.state == VoxelState::kFree ? 1 : 0;
        if (estimate.state == VoxelState::kOccupied)
          ++labels[static_cast<std::size_t>(estimate.label)];
      }
    }
  }
  int best = -1;
  for (int label = 0; label < 64; ++label) {
    const int count = labels[static_cast<std::size_t>(label)];
    if (count > 0 && (best < 0 || count > labels[static_cast<std::size_t>(best)])) best = label;
  }
  if (best >= 0) return cell_of(VoxelState::kOccupied, best);
  return cell_of(2 * free >= edge * edge * edge ? VoxelState::kFree : VoxelState::kUnknown, 0);
}

TEST_CASE("QueryService: points are answered as the map answers") {
  const SmallMap sample = sample_map(3, 900, 8, 100);
  ServiceBench bench({.local = MapReader(sample.map)});
  MapQuery query = query_of(QueryKind::kPoints);
  query.count = 32;
  SampleRandom random(4);
  for (Point3f& point : query.points) {
    for (int axis = 0; axis < 3; ++axis)
      point[axis] = static_cast<float>(random.uniform(-0.9, 0.9));
  }
  const MapReply reply = bench.ask(query);
  REQUIRE(reply.error == QueryError::kNone);
  CHECK(reply.request == 5);
  CHECK(reply.client == 77);
  CHECK(reply.count == 32);
  CHECK(reply.work == 32);
  CHECK(reply.resolution_m == 0.1);
  for (std::size_t i = 0; i < 32; ++i) {
    const Estimate estimate = sample.map.query(query.points[i]);
    CHECK(state_of_cell(reply.cells[i]) == estimate.state);
    CHECK(label_of_cell(reply.cells[i]) == estimate.label);
    CHECK(reply.probability[i] == static_cast<float>(estimate.probability));
    CHECK(reply.variance[i] == static_cast<float>(estimate.variance));
  }
}

TEST_CASE("QueryService: a region's pages together are the box, cell by cell") {
  const SmallMap sample = sample_map(5, 3000, 9, 200);
  ServiceBench bench({.local = MapReader(sample.map)});
  for (const std::int32_t edge : {1, 2, 4, 8, 16}) {
    INFO("cells of " << edge);
    MapQuery query = box(-0.85F, 0.75F, edge);
    std::vector<std::uint8_t> cells;
    MapReply reply;
    do {
      reply = bench.ask(query);
      REQUIRE(reply.error == QueryError::kNone);
      REQUIRE(reply.count > 0);
      cells.insert(cells.end(), reply.cells.begin(), reply.cells.begin() + reply.count);
      query.cursor = reply.next_cursor;
    } while (reply.next_cursor >= 0);
    const auto [nx, ny, nz] = reply.size_cells;
    REQUIRE(cells.size() == static_cast<std::size_t>(nx * ny * nz));
    CHECK(reply.voxel.x <= -9);
    CHECK(reply.voxel.x + nx * edge > 7);
    std::size_t i = 0;
    for (int z = 0; z < nz; ++z) {
      for (int y = 0; y < ny; ++y) {
        for (int x = 0; x < nx; ++x, ++i) {
          const VoxelCoord low{reply.voxel.x + x * edge, reply.voxel.y + y * edge,
                               reply.voxel.z + z * edge};
          REQUIRE(cells[i] == cell_by_hand(sample.map, low, edge));
        }
      }
    }
  }
}

TEST_CASE("QueryService: a region stops where its work is used up, and goes on from there") {
  const SmallMap sample = sample_map(5, 3000, 9, 200);
  ServiceBench tight({.local = MapReader(sample.map)}, {.max_region_work = 8'192});
  ServiceBench wide({.local = MapReader(sample.map)}, {.max_region_work = 1 << 24});
  // Cells of 64: a cell is 512 blocks, of which one takes all that a request may.
  MapQuery query = box(-0.85F, 12.0F, 64);
  const MapReply all = wide.ask(query);
  CHECK_FALSE(all.incomplete);
  CHECK(all.next_cursor == -1);
  std::vector<std::uint8_t> cells;
  int requests = 0;
  while (query.cursor >= 0) {
    const MapReply reply = tight.ask(query);
    REQUIRE(reply.count > 0);
    CHECK(reply.work <= 8'192);
    cells.insert(cells.end(), reply.cells.begin(), reply.cells.begin() + reply.count);
    query.cursor = reply.next_cursor;
    ++requests;
  }
  CHECK(requests > 1);
  CHECK(tight.service.report().incomplete == static_cast<std::uint64_t>(requests - 1));
  CHECK(std::equal(cells.begin(), cells.end(), all.cells.begin()));
  CHECK(cells.size() == static_cast<std::size_t>(all.count));
}

TEST_CASE("QueryService: each row of a region's cells reads its blocks") {
  SmallMap sample(config_of_pages(64), kSampleClasses);
  observe(sample.map, {{{0, 0, 0}, 2, 1.0F}});
  ServiceBench bench({.local = MapReader(sample.map)});
  // 32 x 32 x 1 voxels, four blocks along each of the long axes.
  MapQuery query = box(0.05F, 0.05F, 1);
  query.points[1] = {3.15F, 3.15F, 0.05F};
  const MapReply reply = bench.ask(query);
  REQUIRE(reply.error == QueryError::kNone);
  CHECK(reply.size_cells == std::array<std::int32_t, 3>{32, 32, 1});
  // Eight rows have a block that is there, 16, and three that are not; in the others none is.
  CHECK(reply.work == 8 * (16 + 3) + 24 * 4);
  // Cells of a block's edge: each block once.
  query.cell_voxels = 8;
  CHECK(bench.ask(query).work == 16 + 15);
}

TEST_CASE("QueryService: rays are cast_ray's") {
  const SmallMap sample = sample_map(1, 900, 12, 200);
  ServiceBench bench({.local = MapReader(sample.map)});
  SampleRandom random(6);
  int hits = 0;
  for (int i = 0; i < 100; ++i) {
    MapQuery query = query_of(QueryKind::kRay);
    for (int axis = 0; axis < 3; ++axis) {
      query.points[0][axis] = static_cast<float>(random.uniform(-1.2, 1.2));
      query.points[1][axis] = static_cast<float>(random.uniform(-1.0, 1.0));
    }
    query.length_m = 3.0;
    query.stop_at_unknown = i % 2 == 1;
    const MapReply reply = bench.ask(query);
    const RayHit hit =
        cast_ray(sample.map, query.points[0], query.points[1], 3.0, query.stop_at_unknown);
    REQUIRE(reply.error == QueryError::kNone);
    CHECK(reply.found == (hit.end == RayHit::End::kOccupied));
    CHECK(reply.at_unknown == (hit.end == RayHit::End::kUnknown));
    CHECK(reply.distance_m == static_cast<float>(hit.distance_m));
    CHECK(label_of_cell(reply.cells[0]) == hit.estimate.label);
    hits += reply.found ? 1 : 0;
  }
  CHECK(hits > 10);
  ServiceBench tight({.local = MapReader(sample.map)}, {.max_ray_voxels = 5});
  MapQuery query = query_of(QueryKind::kRay);
  query.points[0] = {5.0F, 5.0F, 5.0F};
  query.points[1] = {1.0F, 0.0F, 0.0F};
  query.length_m = 3.0;
  const MapReply reply = tight.ask(query);
  CHECK(reply.incomplete);
  CHECK(reply.work == 5);
  CHECK(reply.searched_m < 0.6F);
}

TEST_CASE("QueryService: the nearest obstacle, of a class or of any, and an honest end") {
  SmallMap sample(config_of_pages(64), kSampleClasses);
  observe(sample.map, {{{10, 0, 0}, 2, 1.0F}, {{5, 0, 0}, 1, 1.0F}});
  ServiceBench bench({.local = MapReader(sample.map)});
  MapQuery query = query_of(QueryKind::kNearest);
  query.points[0] = {0.05F, 0.05F, 0.05F};
  query.length_m = 3.0;
  MapReply reply = bench.ask(query);
  REQUIRE(reply.found);
  CHECK(reply.voxel == VoxelCoord{5, 0, 0});
  CHECK(reply.distance_m == Approx(0.45F));
  query.class_mask = 1U << 2U;
  reply = bench.ask(query);
  REQUIRE(reply.found);
  CHECK(label_of_cell(reply.cells[0]) == 2);
  CHECK(reply.voxel == VoxelCoord{10, 0, 0});
  query.class_mask = 1U << 3U;
  reply = bench.ask(query);
  CHECK_FALSE(reply.found);
  CHECK_FALSE(reply.incomplete);
  CHECK(reply.searched_m == 3.0F);
  ServiceBench tight({.local = MapReader(sample.map)}, {.max_nearest_work = 40});
  reply = tight.ask(query);
  CHECK(reply.incomplete);
  CHECK(reply.searched_m < 3.0F);
}

TEST_CASE("QueryService: the global map is answered as a whole generation") {
  oracle::Team team(oracle::team_config());
  oracle::Random random(91);
  static_cast<void>(oracle::publish_random(team, random, 2, 100));
  ServiceBench bench({.global = &team.global()});
  int occupied = 0;
  for (const auto& [voxel, counts] : oracle::voxels_of(team.global().map())) {
    const VoxelCoord coord = oracle::coord_of(voxel);
    const Point3f center = team.global().map().lattice().center_of(coord).cast<float>();
    const Estimate expected = team.global().query(coord);
    MapQuery points = query_of(QueryKind::kPoints, QueryMap::kGlobal);
    points.count = 1;
    points.points[0] = center;
    const MapReply reply = bench.ask(points);
    REQUIRE(reply.error == QueryError::kNone);
    CHECK(reply.cells[0] == cell_of(expected.state, expected.label));
    if (expected.state != VoxelState::kOccupied) continue;
    ++occupied;
    MapQuery nearest = query_of(QueryKind::kNearest, QueryMap::kGlobal);
    nearest.points[0] = center;
    nearest.length_m = 1.0;
    CHECK(bench.ask(nearest).voxel == coord);
    MapQuery region = box(0.0F, 0.0F, 1);
    region.map = static_cast<std::int32_t>(QueryMap::kGlobal);
    region.points[0] = region.points[1] = center;
    CHECK(bench.ask(region).cells[0] == reply.cells[0]);
  }
  CHECK(occupied > 20);
  CHECK(bench.error(query_of(QueryKind::kPoints)) == QueryError::kNoMap);
}

}  // namespace
}  // namespace tessera
