// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a scan saw through, by brute force.
#include <catch2/catch.hpp>
#include <cmath>

#include "laws/image_scenes.hpp"
#include "oracle/carve_image_oracle.hpp"

namespace tessera::oracle {
TEST_CASE("seen through: in some pixel and in all of the window, it is what brute force says") {
  struct Case {
    double resolution_m;
    double row_deg;
    double column_deg;
    float margin_voxels;
  };
  const Case drawn =
      GENERATE(Case{0.1, 0.5, 0.17, 1.0F}, Case{0.05, 0.4, 0.3, 3.0F}, Case{0.03, 1.2, 0.11, 0.0F});
  const bool in_all = GENERATE(false, true);
  CAPTURE(drawn.resolution_m, in_all);
  const double range_m = 3.4;
  const ScanCapacity capacity{.points = 800000, .tiles = 1, .ray_blocks = 60000};
  AlignedMemory memory(FreeSpace::required_bytes(capacity, Carving::kImage) +
                       ImageCarver::required_bytes() + ScanPoints::required_bytes(capacity.points));
  Arena arena(memory.span());
  FreeSpace free_space = *FreeSpace::make(arena, capacity, Carving::kImage);
  ImageCarver carver = *ImageCarver::make(arena);
  ScanPoints points = ScanPoints::make(arena, capacity.points);
  const Lattice lattice(drawn.resolution_m);
  const InferenceConfig config = by_image(range_m);
  const Vector origin{0.213, -0.127, 0.341};
  const Cloud scan = scan_of(broken_room, -88.0, 89.0, drawn.row_deg, drawn.column_deg);
  ScanWork work;
  ScanReport report;
  work.begin(nullptr);
  REQUIRE(points.begin(lattice, Point3d(origin[0], origin[1], origin[2])));
  points.register_returns(lattice, scan.view(pose_at(origin)), config, 6, work, report);
  REQUIRE(report.left_out() == 0);
  free_space.begin(config.free_space, lattice, points.origin_map());
  carver.see(points, config);
  static_cast<void>(
      carver.carve(lattice, config.free_space, free_space, work, 0, ~std::uint64_t{0}));
  std::vector<Vector> returns;
  std::vector<Vector> beyond;
  for (const ScanPoint& point : points.returns()) returns.push_back(vector_of(point.p_map));
  for (const ScanPoint& point : points.returns_beyond()) beyond.push_back(vector_of(point.p_map));
  REQUIRE(beyond.size() > 500);
  const CarveImageOracle oracle({drawn.resolution_m, range_m, 2.0, 3}, origin, returns, beyond);
  Random random(announce_seed(223));
  std::map<Freed, int> judged;
  int wrong = 0;
  for (int i = 0; i < 40000; ++i) {
    const double reach_m = range_m * 1.02 * random.uniform(0.02, 1.0);
    Vector at{};
    for (std::size_t k = 0; k < 3; ++k) at[k] = origin[k] + random.uniform(-reach_m, reach_m);
    const Voxel cell = cell_of(at, drawn.resolution_m);
    const VoxelCoord voxel{static_cast<std::int32_t>(cell[0]), static_cast<std::int32_t>(cell[1]),
                           static_cast<std::int32_t>(cell[2])};
    Vector centre{};
    for (std::size_t k = 0; k < 3; ++k)
      centre[k] = (static_cast<double>(cell[k]) + 0.5) * drawn.resolution_m;
    const bool is =
        has_row(carver.seen_through(block_of(voxel), in_all ? SeenBy::kAll : SeenBy::kSome,
                                    drawn.margin_voxels),
                row_order(voxel));
    const Freed seen = oracle.judge_seen(centre, in_all, static_cast<double>(drawn.margin_voxels));
    ++judged[seen];
    wrong += (is && seen == Freed::kNo) || (!is && seen == Freed::kYes) ? 1 : 0;
  }
  CAPTURE(judged[Freed::kYes], judged[Freed::kNo], judged[Freed::kEither]);
  CHECK(wrong == 0);
  CHECK(judged[Freed::kYes] > 2000);
  CHECK(judged[Freed::kNo] > 2000);
  CHECK(judged[Freed::kEither] < 3000);
}

}  // namespace tessera::oracle
