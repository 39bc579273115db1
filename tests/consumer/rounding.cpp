// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A user's translation unit, compiled by each compiler at each optimisation (rounding.py). Prints a
// digest of what the inline headers compute about points far from the origin, where a coordinate's
// last digits decide its voxel, and the digest of a map of these points.
#include <cstdio>

#include "tessera/base/internal/digest.hpp"
#include "tessera/inference/integrator.hpp"
#include "tessera/map/queries.hpp"

namespace {

using namespace tessera;

constexpr MapConfig kMap{.tuple = TuplePolicy::kDense, .storage_bytes = 8U << 20U};
constexpr ScanCapacity kCapacity{.points = 2048, .tiles = 4096, .ray_blocks = 2048};
constexpr std::size_t kBytes =
    required_bytes(kMap) +
    Integrator::required_bytes(kCapacity, InferenceConfig{.free_space = {.enabled = false}});
alignas(kArenaAlignment) std::byte memory[kBytes];
KeyedIndex workspace[65536];
float points[3 * 1500];
std::uint8_t labels[1500];

class Numbers {
 public:
  /// In [-1, 1).
  double next() noexcept {
    state_ += 0x9e3779b97f4a7c15U;
    return static_cast<double>(static_cast<std::int64_t>(mix64(state_))) * 0x1p-63;
  }

 private:
  std::uint64_t state_ = 19;
};

void add(Digest& digest, const Result<VoxelCoord>& voxel) noexcept {
  digest.add(voxel.ok() ? 1U : 0U);
  if (!voxel.ok()) return;
  for (const std::int32_t v : {voxel->x, voxel->y, voxel->z})
    digest.add(static_cast<std::uint32_t>(v));
}

/// Everything that widens what was rounded, as the headers do it and as users may.
std::uint64_t digest_of_points(const Lattice& lattice, const Matrix34d& T, Numbers& numbers) {
  Digest digest;
  for (int i = 0; i < 1500; ++i) {
    const float p_sensor[3] = {static_cast<float>(30.0 * numbers.next()),
                               static_cast<float>(30.0 * numbers.next()),
                               static_cast<float>(3.0 * numbers.next())};
    for (int axis = 0; axis < 3; ++axis) points[3 * i + axis] = p_sensor[axis];
    labels[i] = static_cast<std::uint8_t>(1 + i % 2);
    const Point3f p_map = transform(T, p_sensor);
    add(digest, lattice.voxel_of(p_map));
    add(digest, lattice.voxel_of(Point3d(p_map.cast<double>())));
    const Point3d q = lattice.to_voxels(p_map);
    for (const double v : {q.x(), q.y(), q.z()}) digest.add(std::bit_cast<std::uint64_t>(v));
    // In braces: they are evaluated from left to right.
    const Point3d p{8e5 + numbers.next(), 8e5 + numbers.next(), 8e5 + numbers.next()};
    add(digest, lattice.voxel_of(p));
    add(digest, lattice.voxel_of(round_to_float(p)));
    add(digest, lattice.voxel_of(Point3d(round_to_float(p).cast<double>())));
    add(digest, lattice.voxel_of(Point3f(static_cast<float>(p.x()), static_cast<float>(p.y()),
                                         static_cast<float>(p.z()))));
    add(digest, lattice.voxel_of(p.cast<float>()));
  }
  return digest.value();
}

}  // namespace

int main() {
  ClassTable classes;
  if (classes.add("road", {128, 64, 128}) != Status::kOk) return 1;
  if (classes.add("car", {0, 0, 255}) != Status::kOk) return 1;
  Arena arena(memory);
  Result<LocalMap> map = LocalMap::make(arena, kMap, classes);
  Result<Integrator> integrator =
      Integrator::make(arena, {.free_space = {.enabled = false}}, kCapacity);
  if (!map.ok() || !integrator.ok()) return 2;
  Numbers numbers;
  Matrix34d T = Matrix34d::Identity();
  T.leftCols<2>() << 0.6, -0.8, 0.8, 0.6, 0.0, 0.0;
  T.col(3) = Point3d(412345.678, -298765.432, 1234.567);
  const std::uint64_t of_points = digest_of_points(map->lattice(), T, numbers);
  const ScanView scan{
      .T_map_sensor = T, .points = points, .stride_floats = 3, .count = 1500, .components = labels};
  if (integrator->integrate(*map, scan).admitted == 0) return 3;
  std::printf("%016llx %016llx\n", static_cast<unsigned long long>(of_points),
              static_cast<unsigned long long>(digest(*map, workspace)));
  return 0;
}
