// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Scans that cost an integrator most.
#include <cmath>
#include <limits>

#include "costly_scans.hpp"
#include "meter.hpp"
#include "tessera/inference/integrator.hpp"

namespace tessera::bench {

namespace {

/// All around, squares of directions with a return near by turn with squares without any up to
/// beyond the range: every cube has some far direction before it, and is divided.
Cloud checkerboard(float near_m, float beyond_m) {
  constexpr double kStep_rad = 0.0122;
  constexpr int kSquare = 4;
  constexpr int kRows = 257;
  Cloud cloud;
  for (int row = 0; row < kRows; ++row) {
    const double elevation_rad = (row - kRows / 2) * kStep_rad;
    for (int column = 0; column < 2 * kRows; ++column) {
      const double azimuth_rad = column * kStep_rad;
      const bool is_near = (row / kSquare + column / kSquare) % 2 == 0;
      const double range_m = static_cast<double>(is_near ? near_m : beyond_m);
      cloud.add(static_cast<float>(range_m * std::cos(elevation_rad) * std::cos(azimuth_rad)),
                static_cast<float>(range_m * std::cos(elevation_rad) * std::sin(azimuth_rad)),
                static_cast<float>(range_m * std::sin(elevation_rad)), 1);
    }
  }
  return cloud;
}

/// A point in each of so many blocks that the index of tiles has few places for.
Cloud colliding(std::size_t count, std::uint32_t tiles) {
  const std::uint64_t buckets = tiles / 4 + 2;  // as KeyIndex has them
  const auto bucket_of = [&](std::uint64_t part) {
    return ((part & 0xffffffffU) * buckets) >> 32U;
  };
  Cloud cloud;
  const auto together = [&](std::uint32_t, std::uint64_t mixed) {
    return bucket_of(mixed) < 12 && bucket_of(mixed >> 32U) < 12;
  };
  for (const BlockCoord& block : blocks_with_hash(count, together)) {
    const auto at = [](int v) { return (static_cast<float>(v * kBlockEdge) + 0.5F) * kEdge_m; };
    cloud.add(at(block.x), at(block.y), at(block.z), 1);
  }
  return cloud;
}

struct Setting {
  InferenceConfig inference{};
  MapConfig map{};
  ScanCapacity capacity{.points = 4096, .tiles = 8192, .ray_blocks = 65536};
};

Setting setting_of(InferenceMode mode, bool free_space) {
  Setting setting;
  setting.inference.mode = mode;
  setting.inference.kernel_length_m = 0.3F;
  setting.inference.thinning_m = 0.0;
  setting.inference.min_range_m = 0.0F;
  setting.inference.max_range_m = free_space ? 40.0F : 0.0F;
  setting.inference.free_space.enabled = free_space;
  setting.inference.free_space.carving = Carving::kRays;
  setting.map =
      config_of(mode == InferenceMode::kKernel ? TuplePolicy::kDense : TuplePolicy::kCompact, 192);
  setting.map.label_votes = mode == InferenceMode::kLattice;
  return setting;
}

/// bound: of the operations that count gives.
template <class Count>
void measure_scan(Meter& meter, const WorstCase& worst, const Setting& setting, const Cloud& cloud,
                  double bound, Count&& count, bool full_map = false) {
  OwnedMap owned(setting.map, kMostClasses);
  std::vector<OwnedMap::Line> scratch(
      Integrator::required_bytes(setting.capacity, setting.inference) / kArenaAlignment + 1);
  Arena arena(std::as_writable_bytes(std::span(scratch)));
  Result<Integrator> integrator = Integrator::make(arena, setting.inference, setting.capacity);
  if (!integrator.ok()) return;
  const auto prepare = [&] {
    owned.map.clear();
    for (std::int32_t i = 0; full_map && fill_block(owned.map, {-2 - i, 0, 0}, 1) != 0;) ++i;
  };
  meter.measure(worst, 1, prepare, [&] {
    const ScanReport report = integrator->integrate(owned.map, cloud.view());
    return Operations{static_cast<double>(count(report)), bound};
  });
}

std::uint64_t evaluations(const ScanReport& report) { return report.evaluations; }
std::uint64_t ray_steps(const ScanReport& report) { return report.ray_steps; }

}  // namespace

void measure_integrate(Meter& meter) {
  const auto n_of = [](const Cloud& cloud) { return static_cast<double>(cloud.size()); };
  const Setting counting = setting_of(InferenceMode::kCounting, false);
  const Setting kernel = setting_of(InferenceMode::kKernel, false);
  const Setting entropy = setting_of(InferenceMode::kMultiEntropy, false);
  Setting rays = setting_of(InferenceMode::kMultiEntropy, true);
  const Cloud cube = full_cube(16);
  const Cloud voxel = one_voxel(4096);
  const Cloud corner = corners(8, 1);
  const Cloud alone = corners(8, 2);
  const Cloud diagonal = diagonals(1024, rays.inference.max_range_m);
  const double steps =
      n_of(diagonal) *
      (static_cast<double>(rays.inference.max_range_m) / kResolution_m * std::sqrt(3.0) + 4.0);
  constexpr const char* kCall = "Integrator::integrate";
  constexpr const char* kKernelFormula = "n (2 D + 2)^3 evaluations";
  constexpr const char* kEntropyFormula = "56 n evaluations";

  measure_scan(meter,
               {"integrate_counting", kCall, "counting: 4,096 points, each in a voxel of its own",
                "n evaluations"},
               counting, cube, n_of(cube), evaluations);
  measure_scan(meter,
               {"integrate_kernel_corners", kCall,
                "kernel of 3 voxels: 512 points, each where eight blocks meet", kKernelFormula},
               kernel, corner, 512.0 * n_of(corner), evaluations);
  measure_scan(
      meter,
      {"integrate_kernel_own_blocks", kCall,
       "kernel of 3 voxels: 512 points, each where eight blocks meet that no other reaches",
       kKernelFormula},
      kernel, alone, 512.0 * n_of(alone), evaluations);
  measure_scan(meter,
               {"integrate_kernel_one_voxel", kCall,
                "kernel of 3 voxels: 4,096 points in one voxel, of every class", kKernelFormula},
               kernel, voxel, 512.0 * n_of(voxel), evaluations);
  measure_scan(meter,
               {"integrate_entropy_every_class", kCall,
                "multi-entropy: a full cube of 4,096 voxels, every class at once", kEntropyFormula},
               entropy, cube, 56.0 * n_of(cube), evaluations);
  measure_scan(meter,
               {"integrate_entropy_three_labels", kCall,
                "multi-entropy: the same cube, three labels a point", kEntropyFormula},
               entropy, with_three_labels(cube), 56.0 * n_of(cube), evaluations);
  measure_scan(meter,
               {"integrate_kernel_three_labels", kCall,
                "kernel of 3 voxels: the 512 points where eight blocks meet, three labels each",
                kKernelFormula},
               kernel, with_three_labels(corner), 512.0 * n_of(corner), evaluations);
  measure_scan(meter,
               {"integrate_entropy_one_voxel", kCall,
                "multi-entropy: 4,096 points in one voxel, of every class", kEntropyFormula},
               entropy, voxel, 56.0 * n_of(voxel), evaluations);
  measure_scan(meter,
               {"integrate_lattice", kCall,
                "lattice: the full cube of 4,096 voxels, every class at once", kEntropyFormula},
               setting_of(InferenceMode::kLattice, false), cube, 56.0 * n_of(cube), evaluations);
  const Cloud layers = classes_in_layers(5);
  measure_scan(meter,
               {"integrate_lattice_layers", kCall,
                "lattice: 125 blocks, in each layer a point of each of five classes, 62 in all",
                kEntropyFormula},
               setting_of(InferenceMode::kLattice, false), layers, 56.0 * n_of(layers),
               evaluations);
  measure_scan(meter,
               {"integrate_rays", kCall,
                "free space: 1,024 rays through empty space, 40 m at 0.1 m along the diagonal",
                "n (range sqrt(3) + 4) ray steps"},
               rays, diagonal, steps, ray_steps);
  rays.map.storage_bytes = std::size_t{1} << 20U;
  measure_scan(meter,
               {"integrate_rays_full_map", kCall, "the same rays, and a map that is exactly full",
                "3 n (range sqrt(3) + 4) ray steps"},
               rays, diagonal, 3.0 * steps, ray_steps, true);
  Setting image = setting_of(InferenceMode::kMultiEntropy, true);
  image.inference.free_space.carving = Carving::kImage;
  image.inference.max_range_m = 20.0F;
  image.capacity = {.points = 1U << 18U, .tiles = 1U << 16U, .ray_blocks = 1U << 17U};
  const Cloud board = checkerboard(3.0F, 25.0F);
  const double blocks = std::pow(
      2.0 * static_cast<double>(image.inference.max_range_m) / (kBlockEdge * kResolution_m) + 2.0,
      3.0);
  measure_scan(meter,
               {"integrate_image", kCall,
                "carving by the image: a checkerboard of 3 m and nothing, all around, to 20 m",
                "100 (range / (4 r) + 2)^3 steps"},
               image, board, 100.0 * blocks, ray_steps);
  Setting crowd = counting;
  crowd.capacity.tiles = 1024;
  const Cloud collide = colliding(200, crowd.capacity.tiles);
  measure_scan(
      meter,
      {"integrate_colliding_tiles", kCall,
       "counting: 200 points in blocks that collide in the index of tiles", "n evaluations"},
      crowd, collide, n_of(collide), evaluations);
  Cloud refused = cube;
  for (float& x : refused.xyz) x = std::numeric_limits<float>::quiet_NaN();
  measure_scan(
      meter, {"integrate_refused", kCall, "4,096 returns that are not finite", "n returns"},
      counting, refused, n_of(refused), [](const ScanReport& report) { return report.non_finite; });
}

}  // namespace tessera::bench
