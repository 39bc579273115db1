// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/tile_evidence.hpp"

#include <bit>
#include <cstddef>
#include <cstring>
#include <limits>

#include "tessera/base/bits.hpp"
#include "tessera/base/lanes.hpp"
#include "tessera/inference/kernel.hpp"

namespace tessera {

BlockCoord block_of_tile(const BlockCoord& tile, int unit_edge, int i) noexcept {
  if (unit_edge == 2) return tile;
  if (unit_edge == 1) return {tile.x >> 1, tile.y >> 1, tile.z >> 1};
  return {2 * tile.x + (i & 1), 2 * tile.y + ((i >> 1) & 1), 2 * tile.z + (i >> 2)};
}

namespace {

/// Contributions of weight k_0 at squared distances, in lanes; zero where there is none.
class Contribution {
 public:
  explicit Contribution(const KernelShape& kernel) noexcept
      : inverse_square_(kernel.inverse_square),
        // Anything above zero passes a min_weight of zero.
        least_(all_lanes(kernel.min_weight > 0.0F ? kernel.min_weight
                                                  : std::numeric_limits<float>::denorm_min())) {}

  /// Sets counted to all ones where something is contributed.
  [[nodiscard]] Float4 at(float weight, Float4 square, Int4& counted) const noexcept {
    const Float4 k = weight * Kernel::at(square * inverse_square_);
    counted = k >= least_;
    return keep(counted, k);
  }

 private:
  float inverse_square_;
  Float4 least_;
};

Int4 lanes_of(unsigned voxels) noexcept {
  const auto lane = [voxels](unsigned v) { return -static_cast<std::int32_t>((voxels >> v) & 1U); };
  return Int4{lane(0), lane(1), lane(2), lane(3)};
}

}  // namespace

void add_points(std::span<const TilePoint> points, const Point3f& shift, const OctetPlace& octet,
                const KernelShape& kernel, OctetEvidence& into, EvidenceWork& work) noexcept {
  const float x0 = static_cast<float>(octet.corner[0]) + 0.5F - shift.x();
  const float y0 = static_cast<float>(octet.corner[1]) + 0.5F - shift.y();
  const float z0 = static_cast<float>(octet.corner[2]) + 0.5F - shift.z();
  const Float4 x{x0, x0 + 1.0F, x0, x0 + 1.0F};
  const Float4 y{y0, y0, y0 + 1.0F, y0 + 1.0F};
  const Contribution contribution(kernel);
  const Int4 low_voxels = lanes_of(octet.voxels);
  const Int4 high_voxels = lanes_of(octet.voxels >> 4U);
  Int4 updates{};
  for (const TilePoint& point : points) {
    const float weight = point.weight * kernel.scale;
    const Float4 dx = x - point.x;
    const Float4 dy = y - point.y;
    const float dz_low = z0 - point.z;
    const float dz_high = z0 + 1.0F - point.z;
    const Float4 square = dx * dx + dy * dy;
    Int4 low_counted;
    Int4 high_counted;
    const Float4 low = contribution.at(weight, square + dz_low * dz_low, low_counted);
    const Float4 high = contribution.at(weight, square + dz_high * dz_high, high_counted);
    low_counted &= low_voxels;
    high_counted &= high_voxels;
    if (!any(low_counted | high_counted)) continue;
    updates -= low_counted + high_counted;
    float* const plane = into.plane(point.component).data();
    store4(plane, load4(plane) + keep(low_voxels, low));  // eq. (7)
    store4(plane + 4, load4(plane + 4) + keep(high_voxels, high));
  }
  work.evaluations += points.size() * static_cast<std::uint64_t>(count_ones(octet.voxels));
  work.updates += static_cast<std::uint64_t>(sum_of(updates));
}

void count_points(std::span<const TilePoint> points, const OctetPlace& octet, float min_weight,
                  OctetEvidence& into, EvidenceWork& work) noexcept {
  for (const TilePoint& point : points) {
    const auto side = [](float coordinate, int corner) {
      return coordinate >= static_cast<float>(corner + 1) ? std::size_t{1} : std::size_t{0};
    };
    const std::size_t v = side(point.x, octet.corner[0]) | (side(point.y, octet.corner[1]) << 1U) |
                          (side(point.z, octet.corner[2]) << 2U);
    ++work.evaluations;
    if (((octet.voxels >> v) & 1U) == 0 || !(point.weight > 0.0F) || point.weight < min_weight)
      continue;
    into.plane(point.component)[v] += point.weight;
    ++work.updates;
  }
}

Result<KernelTile> KernelTile::make(Arena& arena) noexcept {
  KernelTile tile;
  const std::span<Planes> planes = arena.take<Planes>(1);
  if (planes.empty()) return Status::kResourceExhausted;
  tile.planes_ = planes.data();
  return tile;
}

void KernelTile::clear() noexcept {
  for (std::uint64_t rest = components_; rest != 0; rest &= rest - 1) {
    planes_->plane[static_cast<std::size_t>(std::countr_zero(rest))].fill(0.0F);
  }
  components_ = 0;
}

namespace {

/// The voxels of one axis whose centres may lie within radius of p, clipped to the tile; none if
/// first > last. Coordinates are at most a few tens, so int is exact.
struct Reach {
  int first = 0;
  int last = 0;

  Reach(float p, float radius) noexcept {
    const float from = p - radius - 0.5F;
    const float to = p + radius - 0.5F;
    first = from <= 0.0F ? 0 : static_cast<int>(from);
    last = to >= static_cast<float>(kBlockEdge - 1) ? kBlockEdge - 1
                                                    : (to < 0.0F ? -1 : static_cast<int>(to));
  }
  [[nodiscard]] bool empty() const noexcept { return first > last; }
};

}  // namespace

void KernelTile::add_points(std::span<const TilePoint> points, const Point3f& shift, float radius,
                            const KernelShape& kernel, EvidenceWork& work) noexcept {
  const Contribution contribution(kernel);
  const float square_radius = radius * radius;
  constexpr Float4 kLowCenters{0.5F, 1.5F, 2.5F, 3.5F};
  constexpr Float4 kHighCenters{4.5F, 5.5F, 6.5F, 7.5F};
  Int4 updates{};
  for (const TilePoint& point : points) {
    const float px = point.x + shift.x();
    const float py = point.y + shift.y();
    const float pz = point.z + shift.z();
    const Reach x(px, radius);
    const Reach y(py, radius);
    const Reach z(pz, radius);
    if (x.empty() || y.empty() || z.empty()) continue;
    const float weight = point.weight * kernel.scale;
    float* const plane = planes_->plane[point.component].data();
    components_ |= std::uint64_t{1} << point.component;
    // A row is two groups of four voxels; how near each comes to the point along x.
    const float low_near = px > 3.5F ? px - 3.5F : 0.0F;
    const float high_near = px < 4.5F ? 4.5F - px : 0.0F;
    const float low_reach = square_radius - low_near * low_near;
    const float high_reach = square_radius - high_near * high_near;
    const Float4 dx_low = kLowCenters - px;
    const Float4 dx_high = kHighCenters - px;
    const Float4 low_square = dx_low * dx_low;
    const Float4 high_square = dx_high * dx_high;
    for (int iz = z.first; iz <= z.last; ++iz) {
      const float dz = static_cast<float>(iz) + 0.5F - pz;
      for (int iy = y.first; iy <= y.last; ++iy) {
        const float dy = static_cast<float>(iy) + 0.5F - py;
        const float dyz = dy * dy + dz * dz;
        if (dyz > square_radius) continue;
        work.evaluations += static_cast<std::uint64_t>(x.last - x.first + 1);
        float* const row = plane + std::ptrdiff_t{iz * kBlockEdge + iy} * kBlockEdge;
        Int4 counted;
        if (dyz <= low_reach) {
          store4(row, load4(row) + contribution.at(weight, low_square + dyz, counted));  // eq. (7)
          updates -= counted;
        }
        if (dyz <= high_reach) {
          store4(row + 4, load4(row + 4) + contribution.at(weight, high_square + dyz, counted));
          updates -= counted;
        }
      }
    }
  }
  work.updates += static_cast<std::uint64_t>(sum_of(updates));
}

bool KernelTile::read(int octet, OctetEvidence& into) const noexcept {
  bool any = false;
  const int corner = row_order_corner(octet);
  for (std::uint64_t rest = components_; rest != 0; rest &= rest - 1) {
    const int component = std::countr_zero(rest);
    const float* const from = planes_->plane[static_cast<std::size_t>(component)].data() + corner;
    // Pairs along x of the octet's four rows. No sum is negative, so bits tell zero from the rest.
    constexpr std::array<int, 4> kRows{0, 8, 64, 72};
    std::array<std::uint64_t, 4> pairs{};
    for (std::size_t i = 0; i < 4; ++i) std::memcpy(&pairs[i], from + kRows[i], 8);
    if ((pairs[0] | pairs[1] | pairs[2] | pairs[3]) == 0) continue;
    std::memcpy(into.plane(component).data(), pairs.data(), sizeof(pairs));
    any = true;
  }
  return any;
}

}  // namespace tessera
