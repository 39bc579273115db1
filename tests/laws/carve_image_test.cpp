// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Carving by the image of the scan: which voxels it frees, by brute force, and what it must leave.
#include <catch2/catch.hpp>
#include <cmath>

#include "laws/image_scenes.hpp"
#include "oracle/carve_image_oracle.hpp"

namespace tessera::oracle {
namespace {

std::vector<Vector> ends_of(std::span<const ScanPoint> points) {
  std::vector<Vector> ends;
  for (const ScanPoint& point : points) ends.push_back(vector_of(point.p_map));
  return ends;
}

}  // namespace

TEST_CASE("carving by the image: what is freed is what brute force frees") {
  struct Case {
    double resolution_m;
    double row_deg;
    double column_deg;
    int neighbours;
    float margin_voxels;
  };
  const Case drawn = GENERATE(Case{0.1, 1.0, 0.7, 3, 2.0F}, Case{0.02, 2.0, 0.5, 3, 2.0F},
                              Case{0.013, 0.9, 0.9, 0, 0.0F}, Case{0.05, 3.0, 1.1, 8, 1.5F});
  CAPTURE(drawn.resolution_m, drawn.row_deg, drawn.neighbours, drawn.margin_voxels);
  const double range_m = 3.4;
  InferenceConfig config = by_image(range_m);
  config.free_space.neighbour_pixels = static_cast<std::uint8_t>(drawn.neighbours);
  config.free_space.margin_voxels = drawn.margin_voxels;
  MapConfig map = uncapped_map(drawn.resolution_m);
  map.storage_bytes = std::size_t{256} << 20U;
  const ScanCapacity capacity{.points = 90000, .tiles = 90000, .ray_blocks = 300000};
  Mapper mapper(map, config, 5, capacity);
  const Vector origin{0.213, -0.127, 0.341};
  const ScanReport report = mapper.integrate(
      scan_of(broken_room, -88.0, 89.0, drawn.row_deg, drawn.column_deg), pose_at(origin));
  REQUIRE(report.left_out() == 0);
  REQUIRE(report.free_blocks_refused + report.carving_cut == 0);
  REQUIRE(report.beyond_range > 500);
  const std::vector<Vector> returns = ends_of(mapper.integrator().admitted());
  const std::vector<Vector> beyond = ends_of(mapper.integrator().admitted_rays());
  const CarveImageOracle oracle(
      {drawn.resolution_m, range_m, static_cast<double>(drawn.margin_voxels), drawn.neighbours},
      origin, returns, beyond);
  std::set<Voxel> hits;
  for (const Vector& end : returns) hits.insert(cell_of(end, drawn.resolution_m));
  Random random(announce_seed(221));
  int freed = 0;
  int left = 0;
  int either = 0;
  int wrong = 0;
  for (int i = 0; i < 40000; ++i) {
    // As many near the sensor as far from it.
    const double reach_m = range_m * 1.02 * random.uniform(0.02, 1.0);
    Vector at{};
    for (std::size_t k = 0; k < 3; ++k) at[k] = origin[k] + random.uniform(-reach_m, reach_m);
    const Voxel voxel = cell_of(at, drawn.resolution_m);
    Vector centre{};
    for (std::size_t k = 0; k < 3; ++k)
      centre[k] = (static_cast<double>(voxel[k]) + 0.5) * drawn.resolution_m;
    const bool is = is_free(mapper, centre);
    if (hits.count(voxel) != 0) {
      wrong += is ? 1 : 0;
      continue;
    }
    switch (oracle.judge(centre)) {
      case Freed::kYes:
        ++freed;
        wrong += is ? 0 : 1;
        break;
      case Freed::kNo:
        ++left;
        wrong += is ? 1 : 0;
        break;
      case Freed::kEither:
        ++either;
        break;
    }
  }
  CAPTURE(freed, left, either);
  CHECK(wrong == 0);
  CHECK(freed > 2000);
  CHECK(left > 2000);
  CHECK(either < 1500);
}

TEST_CASE("carving by the image: far from the sensor nothing between two rows of beams is freed") {
  // Rows 3 degrees apart; at 20 m, 1 m lies between two of them.
  Mapper mapper(uncapped_map(0.1), by_image(25.0), 5,
                {.points = 20000, .tiles = 8192, .ray_blocks = 60000});
  static_cast<void>(
      mapper.integrate(scan_of([](double, double) { return 24.0; }, -3.0, 3.1, 3.0, 0.15),
                       pose_at({0.05, 0.05, 0.05})));
  CHECK(is_free(mapper, {20.05, 0.05, 0.05}));
  for (const double off_m : {0.25, 0.45, 0.55, 0.75})
    CHECK_FALSE(is_free(mapper, {20.05, 0.05, off_m + 0.05}));
  // Near it, a voxel is wider than the way between them.
  CHECK(is_free(mapper, {0.85, 0.05, 0.05}));
}

TEST_CASE("carving by the image: nothing is freed behind a wall, nor close before it") {
  Mapper mapper(uncapped_map(0.1), by_image(25.0), 5,
                {.points = 60000, .tiles = 8192, .ray_blocks = 60000});
  const auto wall = [](double azimuth_rad, double elevation_rad) {
    const double cosine = std::cos(azimuth_rad) * std::cos(elevation_rad);
    return cosine > 0.5 ? 8.0 / cosine : 0.0;
  };
  static_cast<void>(
      mapper.integrate(scan_of(wall, -20.0, 20.0, 0.4, 0.4), pose_at({0.05, 0.05, 0.05})));
  int behind = 0;
  int close = 0;
  int before = 0;
  for (const auto& [voxel, evidence] : observed_voxels(mapper.map())) {
    if (!(evidence.sigma[0] > 0.0F)) continue;
    behind += voxel[0] >= 80 ? 1 : 0;
    // Where the wall is seen from its face.
    const bool straight = std::abs(voxel[1]) < voxel[0] && std::abs(voxel[2]) < voxel[0];
    close += straight && voxel[0] > 77 ? 1 : 0;
    before += voxel[0] <= 77 ? 1 : 0;
  }
  CHECK(behind == 0);
  CHECK(close == 0);
  CHECK(before > 30000);
  CHECK(is_free(mapper, {7.75, 0.05, 0.05}));
}

TEST_CASE("carving by the image: a bar of which a scan meets every second row stays") {
  // By wider windows no pass counts; without them it is what stays beside a hit.
  InferenceConfig config = by_image(25.0);
  config.free_space.neighbour_pixels = static_cast<std::uint8_t>(GENERATE(3, 0));
  Mapper mapper(uncapped_map(0.1), config, 5,
                {.points = 90000, .tiles = 8192, .ray_blocks = 60000});
  constexpr double kRow_deg = 0.4;
  const auto bar = [](bool whole) {
    return [whole](double azimuth_rad, double elevation_rad) {
      const auto row = static_cast<int>(std::lround(elevation_rad / (kRow_deg * kRadians)));
      const bool meets = std::fabs(12.0 * std::tan(azimuth_rad)) < 0.05 &&
                         std::cos(azimuth_rad) > 0.0 && (whole || row % 2 == 0);
      return meets ? 12.0 : 20.0;
    };
  };
  const auto standing = [&] {
    int voxels = 0;
    for (const std::int32_t x : {119, 120}) {
      for (std::int32_t y = -8; y < 8; ++y) {
        for (std::int32_t z = -24; z < 24; ++z) {
          const VoxelEvidence evidence = mapper.map().evidence(VoxelCoord{x, y, z});
          voxels += evidence.sigma[1] > evidence.sigma[0] ? 1 : 0;
        }
      }
    }
    return voxels;
  };
  static_cast<void>(
      mapper.integrate(scan_of(bar(true), -6.0, 6.0, kRow_deg, 0.05), pose_at({0.05, 0.05, 0.05})));
  const int before = standing();
  REQUIRE(before > 20);
  for (int i = 0; i < 12; ++i)
    static_cast<void>(mapper.integrate(scan_of(bar(false), -6.0, 6.0, kRow_deg, 0.05),
                                       pose_at({0.05, 0.05, 0.05})));
  CHECK(standing() == before);
}

TEST_CASE("carving by the image: directions that are no numbers are left out") {
  InferenceConfig config = by_image(25.0);
  config.min_range_m = 0.0F;
  Mapper mapper(uncapped_map(0.1), config, 5);
  Cloud cloud;
  cloud.add(0.0, 0.0, 0.0, 1);
  cloud.add(3.0, 0.0, 0.0, 1);
  static_cast<void>(mapper.integrate(cloud, pose_at({1e-320, 0.0, 0.0})));
  CHECK(mapper.map().block_count() > 0);
}

TEST_CASE("carving by the image: the bits are the same by fours and by eights, and again") {
  const Cloud scan = scan_of(broken_room, -60.0, 60.0, 1.0, 1.0);
  const auto words = [&](LaneWidth lanes) {
    const ScanCapacity capacity{.points = 90000, .tiles = 1, .ray_blocks = 60000};
    AlignedMemory memory(FreeSpace::required_bytes(capacity, Carving::kImage) +
                         ImageCarver::required_bytes() + ScanPoints::required_bytes(90000));
    Arena arena(memory.span());
    FreeSpace free_space = *FreeSpace::make(arena, capacity, Carving::kImage);
    ImageCarver carver = *ImageCarver::make(arena, lanes);
    ScanPoints points = ScanPoints::make(arena, 90000);
    const Lattice lattice(0.05);
    const InferenceConfig config = by_image(3.4);
    ScanWork work;
    ScanReport report;
    work.begin(nullptr);
    REQUIRE(points.begin(lattice, Point3d(0.213, -0.127, 0.341)));
    points.register_returns(lattice, scan.view(pose_at({0.213, -0.127, 0.341})), config, 6, work,
                            report);
    std::vector<std::uint64_t> all;
    for (int i = 0; i < 2; ++i) {
      free_space.begin(config.free_space, lattice, points.origin_map());
      carver.see(points, config);
      CHECK(carver.carve(lattice, config.free_space, free_space, work, 0, ~std::uint64_t{0}));
      free_space.finish();
      for (const RayBlock& block : free_space.blocks())
        all.insert(all.end(), block.passed.begin(), block.passed.end());
    }
    REQUIRE(all.size() > 8000);
    CHECK(std::equal(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2),
                     all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), all.end()));
    return all;
  };
  CHECK(words(LaneWidth::kWidest) == words(LaneWidth::kFour));
}

}  // namespace tessera::oracle
