// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "kernel_rows.hpp"

#include <array>

#include "tessera/inference/kernel.hpp"

namespace tessera {

namespace {

constexpr Float4 kLowCenters{0.5F, 1.5F, 2.5F, 3.5F};
constexpr Float4 kHighCenters{4.5F, 5.5F, 6.5F, 7.5F};

/// A row is two groups of four voxels, and a group out of reach is skipped.
class RowOfFours {
 public:
  explicit RowOfFours(const KernelRows& rows) noexcept
      : corner_(rows.corner),
        y_low_centers_(kLowCenters - rows.corner[1]),
        y_high_centers_(kHighCenters - rows.corner[1]),
        z_low_centers_(kLowCenters - rows.corner[2]),
        z_high_centers_(kHighCenters - rows.corner[2]),
        columns_(rows.columns),
        weight_scale_(rows.weight_scale),
        inverse_square_(rows.inverse_square),
        square_radius_(padded(rows.radius) * padded(rows.radius)),
        least_(all_lanes(rows.least)),
        least_share_(all_lanes(rows.least_share)) {}

  [[nodiscard]] static bool beyond(Float4 from, Float4 to, Float4 size) noexcept {
    return any((to < all_lanes(0.0F)) | (from >= size));
  }

  void place(const TilePoint& point, float square_reach) noexcept {
    weight_ = point.weight * weight_scale_;
    x_ = point.x;
    const Float4 dy_low = y_low_centers_ - point.y;
    const Float4 dy_high = y_high_centers_ - point.y;
    y_low_square_ = dy_low * dy_low;
    y_high_square_ = dy_high * dy_high;
    const Float4 dz_low = z_low_centers_ - point.z;
    const Float4 dz_high = z_high_centers_ - point.z;
    store4(z_square_.data(), dz_low * dz_low);
    store4(z_square_.data() + 4, dz_high * dz_high);
    reach_ = all_lanes(square_reach);
  }

  [[nodiscard]] unsigned within(int z) noexcept {
    const float z_square = z_square_[static_cast<std::size_t>(z)];
    const Float4 low = y_low_square_ + z_square;
    const Float4 high = y_high_square_ + z_square;
    float* const slice = dyz_.data() + std::ptrdiff_t{z} * kRowVoxels;
    store4(slice, low);
    store4(slice + 4, high);
    return bits_of(low <= reach_) | (bits_of(high <= reach_) << 4U);
  }

  void at(int column) noexcept {
    const auto from = static_cast<float>(column);
    const Float4 low = (kLowCenters + (from - corner_[0])) - x_;
    const Float4 high = (kHighCenters + (from - corner_[0])) - x_;
    low_square_ = low * low;
    high_square_ = high * high;
    const float low_apart = distance_to(low[0], low[3], 0.0F);
    const float high_apart = distance_to(high[0], high[3], 0.0F);
    low_reach_ = square_radius_ - low_apart * low_apart;
    high_reach_ = square_radius_ - high_apart * high_apart;
    low_inside_ = kLowCenters < all_lanes(columns_ - from);
    high_inside_ = kHighCenters < all_lanes(columns_ - from);
  }

  void add(int row, const RowPlanes& planes, std::ptrdiff_t offset) noexcept {
    const float dyz = dyz_[static_cast<std::size_t>(row)];
    if (dyz <= low_reach_) add_four(low_square_ + dyz, low_inside_, planes, offset);
    if (dyz <= high_reach_) add_four(high_square_ + dyz, high_inside_, planes, offset + 4);
  }

  [[nodiscard]] std::uint64_t updates() const noexcept {
    std::uint64_t sum = 0;
    for (int i = 0; i < 4; ++i) sum += static_cast<std::uint32_t>(updates_[i]);
    return sum;
  }

 private:
  void add_four(Float4 square, Int4 inside, const RowPlanes& planes,
                std::ptrdiff_t offset) noexcept {
    const Float4 k = weight_ * Kernel::at(square * inverse_square_);
    const Int4 counted = (k >= least_) & inside;
    const Float4 kept = keep(counted, k);
    updates_ -= counted;
    if (planes.labels == 0) {
      float* const at = planes.first + offset;
      store4(at, load4(at) + kept);  // eq. (7)
      return;
    }
    for (int j = 0; j < planes.labels; ++j) {
      float* const at = planes.of_label[j] + offset;
      const Float4 share = kept * planes.share[j];
      store4(at, load4(at) + keep(share >= least_share_, share));
    }
  }

  Float4 corner_;
  Float4 y_low_centers_;  ///< In the points' tile.
  Float4 y_high_centers_;
  Float4 z_low_centers_;
  Float4 z_high_centers_;
  float columns_;
  float weight_scale_;
  float inverse_square_;
  float square_radius_;
  Float4 least_;
  Float4 least_share_;
  float weight_ = 0.0F;
  float x_ = 0.0F;
  Float4 y_low_square_{};
  Float4 y_high_square_{};
  Float4 reach_{};
  Float4 low_square_{};
  Float4 high_square_{};
  float low_reach_ = 0.0F;
  float high_reach_ = 0.0F;
  Int4 low_inside_{};  ///< Of the columns, those of the strip.
  Int4 high_inside_{};
  Int4 updates_{};
  alignas(16) std::array<float, kRowVoxels> z_square_{};
  alignas(16) std::array<float, kTileRows> dyz_{};
};

void add_rows_of_four(const KernelRows& rows, KernelRowsDone& done) noexcept {
  add_rows<RowOfFours>(rows, done);
}

}  // namespace

AddKernelRows kernel_rows_of_four() noexcept { return add_rows_of_four; }

}  // namespace tessera
