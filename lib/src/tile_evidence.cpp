// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/tile_evidence.hpp"

#include <bit>
#include <cstddef>
#include <cstring>
#include <limits>

#include "kernel_rows.hpp"
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

/// Anything above zero passes a min_weight of zero.
constexpr float least_counted(float min_weight) noexcept {
  return min_weight > 0.0F ? min_weight : std::numeric_limits<float>::denorm_min();
}

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

namespace {

/// Whether this machine has AVX2 and its system keeps the registers.
bool has_avx2() noexcept {
#if defined(__x86_64__)
  const auto cpuid = [](std::uint32_t leaf) {
    std::array<std::uint32_t, 4> r{};
    __asm__ volatile("cpuid" : "=a"(r[0]), "=b"(r[1]), "=c"(r[2]), "=d"(r[3]) : "a"(leaf), "c"(0));
    return r;
  };
  constexpr std::uint32_t kSavesAndAvx = (1U << 27U) | (1U << 28U);
  if (cpuid(0)[0] < 7 || (cpuid(1)[2] & kSavesAndAvx) != kSavesAndAvx) return false;
  std::uint32_t low = 0;
  std::uint32_t high = 0;
  __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  return (low & 6U) == 6U && (cpuid(7)[1] & (1U << 5U)) != 0;
#else
  return false;
#endif
}

}  // namespace

static_assert(kBlockEdge == kRowVoxels);

bool KernelTile::has_wide_lanes() noexcept {
  return has_avx2() && kernel_rows_of_eight() != nullptr;
}

Result<KernelTile> KernelTile::make(Arena& arena, KernelLanes lanes) noexcept {
  KernelTile tile;
  const std::span<Planes> planes = arena.take<Planes>(1);
  if (planes.empty()) return Status::kResourceExhausted;
  tile.planes_ = planes.data();
  const bool wide = lanes == KernelLanes::kWidest && has_wide_lanes();
  tile.add_rows_ = wide ? kernel_rows_of_eight() : kernel_rows_of_four();
  return tile;
}

void KernelTile::clear() noexcept {
  for (std::uint64_t rest = components_; rest != 0; rest &= rest - 1) {
    const auto component = static_cast<std::size_t>(std::countr_zero(rest));
    planes_->plane[component].fill(0.0F);
    planes_->touched[component] = 0;
  }
  components_ = 0;
}

void KernelTile::add_points(std::span<const TilePoint> points, const Point3f& shift, float radius,
                            const KernelShape& kernel, EvidenceWork& work) noexcept {
  KernelRows rows{.points = points.data(),
                  .count = 0,
                  .shift = {shift.x(), shift.y(), shift.z(), 0.0F},
                  .radius = radius,
                  .weight_scale = kernel.scale,
                  .inverse_square = kernel.inverse_square,
                  .least = least_counted(kernel.min_weight),
                  .planes = planes_->plane[0].data(),
                  .touched = planes_->touched.data()};
  KernelRowsDone done;
  // Updates are counted in 32 bits a lane, up to 128 a point.
  constexpr std::size_t kMostPoints = std::size_t{1} << 20U;
  for (; !points.empty(); points = points.subspan(rows.count)) {
    rows.points = points.data();
    rows.count = points.size() < kMostPoints ? points.size() : kMostPoints;
    add_rows_(rows, done);
  }
  components_ |= done.components;
  work.updates += done.updates;
  work.evaluations += done.evaluations;
}

namespace {

/// The octets that rows y + 8 z go through.
std::uint64_t octets_of_rows(std::uint64_t rows) noexcept {
  rows |= rows >> 1U;  // pairs along y, then along z
  rows |= rows >> 8U;
  // Bits 0, 2, 4, 6 of every other byte to bits 0, 4, 8, 12 of every two.
  rows &= 0x0055005500550055U;
  rows = (rows | (rows << 4U)) & 0x0505050505050505U;
  rows = (rows | (rows << 2U)) & 0x1111111111111111U;
  return rows * 0xfU;
}

/// Two rows of each of two slices.
std::uint64_t rows_of_octet(int octet) noexcept {
  return std::uint64_t{0x303} << static_cast<unsigned>(row_order_corner(octet) / kBlockEdge);
}

}  // namespace

std::uint64_t KernelTile::touched() const noexcept {
  std::uint64_t rows = 0;
  for (std::uint64_t rest = components_; rest != 0; rest &= rest - 1)
    rows |= planes_->touched[static_cast<std::size_t>(std::countr_zero(rest))];
  return octets_of_rows(rows);
}

bool KernelTile::read(int octet, OctetEvidence& into) const noexcept {
  const auto corner = static_cast<std::size_t>(row_order_corner(octet));
  const std::uint64_t rows = rows_of_octet(octet);
  for (std::uint64_t rest = components_; rest != 0; rest &= rest - 1) {
    const int component = std::countr_zero(rest);
    const auto c = static_cast<std::size_t>(component);
    if ((planes_->touched[c] & rows) == 0) continue;
    const float* const from = planes_->plane[c].data() + corner;
    OctetEvidence::Plane sums;
    // Pairs along x of the four rows.
    constexpr std::array<int, 4> kRows{0, 8, 64, 72};
    for (std::size_t i = 0; i < 4; ++i) std::memcpy(&sums[2 * i], from + kRows[i], 8);
    if (bits_above(sums.data(), 0.0F) != 0) into.assign(component, sums);
  }
  return into.components() != 0;
}

}  // namespace tessera
