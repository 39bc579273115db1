// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Questions that cost most: rays that meet nothing, boxes around everything, blocks that a writer
// never leaves.
#include <cmath>

#include "meter.hpp"
#include "tessera/grid/internal/segment.hpp"
#include "tessera/map/cast_ray.hpp"
#include "tessera/map/map_reader.hpp"
#include "tessera/map/queries.hpp"

namespace tessera::bench {

namespace {

constexpr std::int32_t kEdgeBlocks = 16;

/// A cube of blocks, every voxel of which has been passed.
void pass_all(LocalMap& map) {
  VoxelMask all;
  all.fill(~std::uint64_t{0});
  for (std::int32_t i = 0; i < kEdgeBlocks * kEdgeBlocks * kEdgeBlocks; ++i) {
    const BlockCoord at{i % kEdgeBlocks, i / kEdgeBlocks % kEdgeBlocks,
                        i / (kEdgeBlocks * kEdgeBlocks)};
    const Result<SlabHandle> block = map.open_block(at);
    for (int pass = 0; block.ok() && pass < 20; ++pass)
      static_cast<void>(map.add_free_pass(*block, all));
  }
}

void measure_rays(Meter& meter) {
  OwnedMap owned(config_of(TuplePolicy::kCompact, 32), kMostClasses);
  const LocalMap& map = owned.map;
  constexpr int kRays = 100;
  const auto origin = [](int i) {
    return Point3f(0.01F + 0.01F * static_cast<float>(i % 10), 0.02F, 0.03F);
  };
  const auto direction = [](int i) {
    return Point3f(1.0F, 1.0F - 1e-5F * static_cast<float>(i % 10), 1.0F);
  };
  const double resolution_m = map.lattice().resolution_m();
  // Voxels on the way, as the walk's own steps count them.
  const auto crossed = [&](double range_m) {
    double voxels = 0.0;
    for (int i = 0; i < kRays; ++i) {
      const Point3d from = origin(i).cast<double>();
      const Point3d d = direction(i).cast<double>();
      const SegmentSteps steps(from / resolution_m,
                               (from + d * (range_m / norm(d))) / resolution_m);
      voxels += 1.0 + steps.left[0] + steps.left[1] + steps.left[2];
    }
    return voxels / kRays;
  };
  const auto cast = [&](double range_m, double voxels) {
    int through = 0;
    for (int i = 0; i < kRays; ++i)
      through +=
          cast_ray(map, origin(i), direction(i), range_m).end == RayHit::End::kMaxRange ? 1 : 0;
    return Operations{through == kRays ? voxels : 1e12,
                      std::sqrt(3.0) * range_m / resolution_m + 4.0};
  };
  constexpr double kFar_m = 100.0;
  const double far_voxels = crossed(kFar_m);
  const double through_m = 0.98 * kEdgeBlocks * kBlockEdge * resolution_m * std::sqrt(3.0);
  const double through_voxels = crossed(through_m);
  meter.measure(
      {"cast_ray_empty", "cast_ray", "100 m at 0.1 m along the diagonal of an empty map",
       "range sqrt(3) + 4 voxels"},
      kRays, [] {}, [&] { return cast(kFar_m, far_voxels); });
  pass_all(owned.map);
  meter.measure(
      {"cast_ray_free", "cast_ray", "the same through free space, as far as 16 blocks reach",
       "range sqrt(3) + 4 voxels"},
      kRays, [] {}, [&] { return cast(through_m, through_voxels); });
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  meter.measure(
      {"for_each_in_box", "for_each_in_box",
       "a box around 4,096 blocks of free voxels, and far beyond", "512 blocks"},
      1, [] {},
      [&] {
        double voxels = 0.0;
        for_each_in_box(map, {-100000, -100000, -100000}, {100000, 100000, 100000}, workspace,
                        [&](VoxelCoord, const VoxelEvidence&) { ++voxels; });
        return Operations{voxels, 512.0 * static_cast<double>(map.block_count())};
      });
}

void measure_readers(Meter& meter) {
  OwnedMap owned(config_of(TuplePolicy::kDense, 8), kMostClasses);
  const BlockCoord at{1, 2, 3};
  const SlabHandle handle = fill_block(owned.map, at, 100);
  MapReader reader(owned.map);
  std::vector<std::uint64_t> words(reader.snapshot_bytes() / 8 + 1);
  const std::span<std::byte> workspace = std::as_writable_bytes(std::span(words));
  meter.measure(
      {"snapshot", "MapReader::snapshot",
       "dense: a block with all its octets, every class; one try", "64 octets"},
      10, [] {},
      [&] {
        double read = 0.0;
        for (int i = 0; i < 10; ++i) read += reader.snapshot(at, workspace).ok() ? 1.0 : 0.0;
        return fixed(read == 10.0, 64.0);
      });
  const VoxelCoord voxel = voxel_at(at, 63, 7);
  meter.measure(
      {"reader_query", "MapReader::query", "dense: every class; one try", "C + 2 counts"}, 1000,
      [] {},
      [&] {
        double read = 0.0;
        for (int i = 0; i < 1000; ++i) read += reader.query(voxel).ok() ? 1.0 : 0.0;
        return fixed(read == 1000.0, kMostClasses + 2.0);
      });
  // As a writer leaves a block that is interrupted in the middle of a change. The memory is ours.
  const auto offset = reinterpret_cast<const std::byte*>(&owned.map.block_at(handle)) -
                      std::as_bytes(std::span(owned.lines)).data();
  auto* const block =
      reinterpret_cast<Block*>(std::as_writable_bytes(std::span(owned.lines)).data() + offset);
  block->stamp |= 1U;
  const auto tries_of = [&](auto&& read) {
    const std::uint64_t before = reader.retries();
    for (int i = 0; i < 100; ++i) static_cast<void>(read());
    return Operations{static_cast<double>(reader.retries() - before) / 100.0,
                      MapReader::kMaxAttempts};
  };
  meter.measure(
      {"reader_busy", "MapReader::query", "a block in the middle of a change for ever: busy",
       "64 tries"},
      100, [] {}, [&] { return tries_of([&] { return reader.query(voxel); }); });
  meter.measure(
      {"snapshot_busy", "MapReader::snapshot", "the same", "64 tries"}, 100, [] {},
      [&] { return tries_of([&] { return reader.snapshot(at, workspace); }); });
}

}  // namespace

void measure_reading(Meter& meter) {
  measure_rays(meter);
  measure_readers(meter);
}

}  // namespace tessera::bench
