// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/tile_evidence.hpp"

#include <bit>
#include <cstddef>

#include "octet_points.hpp"
#include "tessera/base/internal/bits.hpp"
#include "tessera/base/internal/lane_width.hpp"
#include "tessera/base/internal/lanes.hpp"
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
        least_(all_lanes(least_counted(kernel.min_weight))) {}

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

/// Of a share of what is counted, what is a count.
Float4 counts_of(Float4 share) noexcept { return keep(share >= all_lanes(kLeastCount), share); }

Int4 lanes_of(unsigned voxels) noexcept {
  const auto lane = [voxels](unsigned v) { return -static_cast<std::int32_t>((voxels >> v) & 1U); };
  return Int4{lane(0), lane(1), lane(2), lane(3)};
}

/// Which voxel of an octet a point of the octet is in.
std::size_t voxel_of(const TilePoint& point, const OctetPlace& octet) noexcept {
  const auto side = [](float coordinate, int corner) {
    return coordinate >= static_cast<float>(corner + 1) ? std::size_t{1} : std::size_t{0};
  };
  return side(point.x, octet.corner[0]) | (side(point.y, octet.corner[1]) << 1U) |
         (side(point.z, octet.corner[2]) << 2U);
}

}  // namespace

OctetCentroids centroids_of(std::span<const TilePoint> points, const OctetPlace& octet) noexcept {
  OctetCentroids found{};
  const Float4 corner{static_cast<float>(octet.corner[0]), static_cast<float>(octet.corner[1]),
                      static_cast<float>(octet.corner[2]), 0.0F};
  for (const TilePoint& point : points) {
    const Float4 at{point.x, point.y, point.z, 0.0F};
    const Int4 upper = at >= corner + 1.0F;
    const std::size_t v = bits_of(upper) & 7U;
    const Float4 place = at - (corner + keep(upper, all_lanes(1.0F)));
    const bool inside = bits_of((place >= 0.0F) & (place < 1.0F)) == 15U;
    if (((octet.voxels >> v) & 1U) != 0 && inside)
      found[v] = found[v].nearer(Centroid::at(place[0], place[1], place[2]));
  }
  return found;
}

AddOctetPoints widest_octet_points() noexcept {
  return has_avx2() ? octet_points_by_eights() : nullptr;
}

OctetPoints octet_points(const OctetPlace& octet, const KernelShape& kernel,
                         OctetEvidence& into) noexcept {
  return {.scale = kernel.scale,
          .inverse_square = kernel.inverse_square,
          .least = least_counted(kernel.min_weight),
          .least_share = kLeastCount,
          .voxels = octet.voxels,
          .planes = into.planes(),
          .components = into.components()};
}

void add_points(std::span<const TilePoint> points, const Point3f& shift, const OctetPlace& octet,
                AddOctetPoints wide, OctetPoints& all, EvidenceWork& work) noexcept {
  all.points = points.data();
  all.count = points.size();
  all.x = static_cast<float>(octet.corner[0]) + 0.5F - shift.x();
  all.y = static_cast<float>(octet.corner[1]) + 0.5F - shift.y();
  all.z = static_cast<float>(octet.corner[2]) + 0.5F - shift.z();
  work.evaluations += points.size() * static_cast<std::uint64_t>(count_ones(octet.voxels));
  work.updates += wide(all);
}

void add_points(std::span<const TilePoint> points, const Point3f& shift, const OctetPlace& octet,
                const KernelShape& kernel, AddOctetPoints wide, OctetEvidence& into,
                EvidenceWork& work) noexcept {
  if (wide != nullptr) {
    OctetPoints all = octet_points(octet, kernel, into);
    add_points(points, shift, octet, wide, all, work);
    into.set_touched(all.components);
    return;
  }
  const float x0 = static_cast<float>(octet.corner[0]) + 0.5F - shift.x();
  const float y0 = static_cast<float>(octet.corner[1]) + 0.5F - shift.y();
  const float z0 = static_cast<float>(octet.corner[2]) + 0.5F - shift.z();
  work.evaluations += points.size() * static_cast<std::uint64_t>(count_ones(octet.voxels));
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
    const Float4 kept_low = keep(low_voxels, low);
    const Float4 kept_high = keep(high_voxels, high);
    const auto add = [&](std::uint8_t component, Float4 to_low, Float4 to_high) {
      float* const plane = into.plane(component).data();
      store4(plane, load4(plane) + to_low);  // eq. (7)
      store4(plane + 4, load4(plane + 4) + to_high);
    };
    if (point.label_weights == kOneLabel) {
      add(point.component, kept_low, kept_high);
      continue;
    }
    for_labels(point, [&](std::uint8_t component, std::uint8_t label_weight) {
      const float share = share_of(label_weight);
      add(component, counts_of(kept_low * share), counts_of(kept_high * share));
    });
  }
  work.updates += static_cast<std::uint64_t>(sum_of(updates));
}

void count_points(std::span<const TilePoint> points, const OctetPlace& octet, float min_weight,
                  OctetEvidence& into, EvidenceWork& work) noexcept {
  for (const TilePoint& point : points) {
    const std::size_t v = voxel_of(point, octet);
    ++work.evaluations;
    if (((octet.voxels >> v) & 1U) == 0 || !(point.weight >= least_counted(min_weight))) continue;
    ++work.updates;
    if (point.label_weights == kOneLabel) {
      into.plane(point.component)[v] += point.weight;
      continue;
    }
    for_labels(point, [&](std::uint8_t component, std::uint8_t label_weight) {
      const float share = point.weight * share_of(label_weight);
      if (share >= kLeastCount) into.plane(component)[v] += share;
    });
  }
}

}  // namespace tessera
