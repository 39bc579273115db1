// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/kernel_strip.hpp"

#include <bit>
#include <cstring>

#include "kernel_rows.hpp"

namespace tessera {

static_assert(kBlockEdge == kRowVoxels && KernelStrip::kTiles == kStripTiles);

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

}  // namespace

bool KernelStrip::has_wide_lanes() noexcept {
  return has_avx2() && kernel_rows_of_eight() != nullptr;
}

Result<KernelStrip> KernelStrip::make(Arena& arena, LaneWidth lanes) noexcept {
  KernelStrip strip;
  const std::span<Planes> planes = arena.take<Planes>(1);
  if (planes.empty()) return Status::kResourceExhausted;
  strip.planes_ = planes.data();
  const bool wide = lanes == LaneWidth::kWidest && has_wide_lanes();
  strip.add_rows_ = wide ? kernel_rows_of_eight() : kernel_rows_of_four();
  return strip;
}

void KernelStrip::begin(int tiles) noexcept {
  static_assert(kPlane == kStripPlane);
  TESSERA_ASSERT(tiles >= 1 && tiles <= kTiles);
  for (std::uint64_t rest = components_; rest != 0; rest &= rest - 1) {
    const auto component = static_cast<std::size_t>(std::countr_zero(rest));
    std::uint64_t rows = 0;
    for (std::size_t tile = 0; tile < kTiles; ++tile) {
      std::uint64_t& touched = planes_->touched[component * kTiles + tile];
      rows |= touched;
      touched = 0;
    }
    for (; rows != 0; rows &= rows - 1) {
      const auto row = static_cast<std::size_t>(std::countr_zero(rows));
      std::memset(&planes_->sums[component * kStripPlane + row * kStripRow], 0,
                  kStripRow * sizeof(float));
    }
  }
  components_ = 0;
  tiles_ = tiles;
}

void KernelStrip::add_points(std::span<const TilePoint> points, const std::array<int, 3>& offset,
                             float radius, const KernelShape& kernel, EvidenceWork& work) noexcept {
  const auto corner = [&](std::size_t axis) {
    return static_cast<float>(offset[axis] * kBlockEdge);
  };
  KernelRows rows{.points = points.data(),
                  .count = 0,
                  .corner = {corner(0), corner(1), corner(2), 0.0F},
                  .columns = static_cast<float>(tiles_ * kBlockEdge),
                  .radius = radius,
                  .weight_scale = kernel.scale,
                  .inverse_square = kernel.inverse_square,
                  .least = least_counted(kernel.min_weight),
                  .least_share = kLeastCount,
                  .planes = planes_->sums.data(),
                  .touched = planes_->touched.data()};
  KernelRowsDone done;
  // Updates are counted in 32 bits a lane, up to 512 a point.
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

std::uint64_t KernelStrip::touched(int tile) const noexcept {
  std::uint64_t rows = 0;
  for (std::uint64_t rest = components_; rest != 0; rest &= rest - 1)
    rows |= planes_->touched[static_cast<std::size_t>(std::countr_zero(rest)) * kTiles +
                             static_cast<std::size_t>(tile)];
  return octets_of_rows(rows);
}

BlockEvidence KernelStrip::sums(int tile) const noexcept {
  const auto t = static_cast<std::size_t>(tile);
  return {.sums = planes_->sums.data() + t * kBlockEdge,
          .row = kStripRow,
          .component = kStripPlane,
          .components = components_,
          .touched = planes_->touched.data() + t,
          .touched_stride = kTiles,
          .has_rest = (components_ & 1U) != 0};
}

}  // namespace tessera
