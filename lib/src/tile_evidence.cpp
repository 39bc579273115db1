// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/tile_evidence.hpp"

#include <bit>

#include "tessera/inference/kernel.hpp"

namespace tessera {

BlockOctet locate(const Tile& tile, const OctetPlace& octet, int unit_edge) noexcept {
  std::array<int, 3> c = octet.corner;
  if (unit_edge == 1)
    c = {c[0] + 4 * (tile.coord.x & 1), c[1] + 4 * (tile.coord.y & 1),
         c[2] + 4 * (tile.coord.z & 1)};
  const auto octet_axis = [&](std::size_t axis) { return (c[axis] & 7) >> 1; };
  return {.block = (c[0] >> 3) | ((c[1] >> 3) << 1) | ((c[2] >> 3) << 2),
          .octet = octet_axis(0) | (octet_axis(1) << 2) | (octet_axis(2) << 4)};
}

BlockCoord block_of_tile(const BlockCoord& tile, int unit_edge, int i) noexcept {
  if (unit_edge == 2) return tile;
  if (unit_edge == 1) return {tile.x >> 1, tile.y >> 1, tile.z >> 1};
  return {2 * tile.x + (i & 1), 2 * tile.y + ((i >> 1) & 1), 2 * tile.z + (i >> 2)};
}

int octets_of_unit(int unit, int unit_edge, std::array<OctetPlace, 8>& out) noexcept {
  const std::array<int, 3> corner{(unit & 3) * unit_edge, ((unit >> 2) & 3) * unit_edge,
                                  (unit >> 4) * unit_edge};
  if (unit_edge == 1) {
    // A tile of four voxels starts at an even voxel of the map, so parity in the tile is parity in
    // the map.
    const int voxel = (corner[0] & 1) | ((corner[1] & 1) << 1) | ((corner[2] & 1) << 2);
    out[0] = {.corner = {corner[0] & ~1, corner[1] & ~1, corner[2] & ~1},
              .voxels = static_cast<std::uint8_t>(1U << static_cast<unsigned>(voxel))};
    return 1;
  }
  if (unit_edge == 2) {
    out[0] = {.corner = corner};
    return 1;
  }
  for (int i = 0; i < 8; ++i) {
    out[static_cast<std::size_t>(i)] = {.corner = {corner[0] + 2 * (i & 1),
                                                   corner[1] + 2 * ((i >> 1) & 1),
                                                   corner[2] + 2 * (i >> 2)}};
  }
  return 8;
}

void add_points(std::span<const TilePoint> points, const Point3f& shift, const OctetPlace& octet,
                const KernelShape& kernel, OctetEvidence& into, EvidenceWork& work) noexcept {
  const float x0 = static_cast<float>(octet.corner[0]) + 0.5F - shift.x();
  const float y0 = static_cast<float>(octet.corner[1]) + 0.5F - shift.y();
  const float z0 = static_cast<float>(octet.corner[2]) + 0.5F - shift.z();
  for (const TilePoint& point : points) {
    const float weight = point.weight * kernel.scale;
    OctetEvidence::Plane* plane = nullptr;
    for (unsigned v = 0; v < kOctetVoxels; ++v) {
      if (((octet.voxels >> v) & 1U) == 0) continue;
      const float dx = x0 + static_cast<float>(v & 1U) - point.x;
      const float dy = y0 + static_cast<float>((v >> 1U) & 1U) - point.y;
      const float dz = z0 + static_cast<float>(v >> 2U) - point.z;
      const float k =
          weight * KernelTable::at((dx * dx + dy * dy + dz * dz) * kernel.inverse_square);
      ++work.evaluations;
      if (!(k >= kernel.min_weight) || !(k > 0.0F)) continue;
      if (plane == nullptr) plane = &into.plane(point.component);
      (*plane)[v] += k;  // eq. (7)
      ++work.updates;
    }
  }
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

/// A point at px on a row of voxels; dyz: its squared distance from the row.
struct PointBesideRow {
  float px = 0.0F;
  float dyz = 0.0F;
  float weight = 0.0F;
};

/// Adds the point to voxels x0 .. x1 of a row.
inline void add_row(const PointBesideRow& point, const KernelShape& kernel, int x0, int x1,
                    float* row, EvidenceWork& work) noexcept {
  for (int x = x0; x <= x1; ++x) {
    const float dx = static_cast<float>(x) + 0.5F - point.px;
    const float k = point.weight * KernelTable::at((dx * dx + point.dyz) * kernel.inverse_square);
    ++work.evaluations;
    if (!(k >= kernel.min_weight) || !(k > 0.0F)) continue;
    row[x] += k;  // eq. (7)
    ++work.updates;
  }
}

}  // namespace

void KernelTile::add_points(std::span<const TilePoint> points, const Point3f& shift, float radius,
                            const KernelShape& kernel, EvidenceWork& work) noexcept {
  // The voxels of an axis whose centres may lie within radius: coordinates are at most a few tens,
  // so int is exact.
  const auto first = [radius](float p) {
    const float from = p - radius - 0.5F;
    return from <= 0.0F ? 0 : static_cast<int>(from);
  };
  const auto last = [radius](float p) {
    const float to = p + radius - 0.5F;
    return to >= static_cast<float>(kBlockEdge - 1) ? kBlockEdge - 1
                                                    : (to < 0.0F ? -1 : static_cast<int>(to));
  };
  for (const TilePoint& point : points) {
    const float px = point.x + shift.x();
    const float py = point.y + shift.y();
    const float pz = point.z + shift.z();
    const int x0 = first(px);
    const int x1 = last(px);
    const int y0 = first(py);
    const int y1 = last(py);
    const int z1 = last(pz);
    if (x0 > x1 || y0 > y1) continue;
    const float weight = point.weight * kernel.scale;
    std::array<float, kBlockVoxels>& plane = planes_->plane[point.component];
    components_ |= std::uint64_t{1} << point.component;
    for (int z = first(pz); z <= z1; ++z) {
      const float dz = static_cast<float>(z) + 0.5F - pz;
      for (int y = y0; y <= y1; ++y) {
        const float dy = static_cast<float>(y) + 0.5F - py;
        const float dyz = dy * dy + dz * dz;
        if (dyz > radius * radius) continue;
        float* const row = &plane[static_cast<std::size_t>((z * kBlockEdge + y) * kBlockEdge)];
        add_row({px, dyz, weight}, kernel, x0, x1, row, work);
      }
    }
  }
}

bool KernelTile::read(int octet, OctetEvidence& into) const noexcept {
  bool any = false;
  const int corner = row_order_corner(octet);
  for (std::uint64_t rest = components_; rest != 0; rest &= rest - 1) {
    const int component = std::countr_zero(rest);
    const float* const from =
        &planes_->plane[static_cast<std::size_t>(component)][static_cast<std::size_t>(corner)];
    constexpr std::array<int, kOctetVoxels> kOffsets{0, 1, 8, 9, 64, 65, 72, 73};
    OctetEvidence::Plane values{};
    bool here = false;
    for (std::size_t v = 0; v < kOctetVoxels; ++v) {
      values[v] = from[kOffsets[v]];
      here = here || values[v] > 0.0F;
    }
    if (!here) continue;
    into.plane(component) = values;
    any = true;
  }
  return any;
}

}  // namespace tessera
