// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "kernel_rows.hpp"

#include "tessera/inference/kernel.hpp"

namespace tessera {

namespace {

constexpr Float4 kLowCenters{0.5F, 1.5F, 2.5F, 3.5F};
constexpr Float4 kHighCenters{4.5F, 5.5F, 6.5F, 7.5F};

/// A row is two groups of four voxels, and a group out of reach is passed over.
class RowOfFours {
 public:
  explicit RowOfFours(const KernelRows& rows) noexcept
      : inverse_square_(rows.inverse_square),
        least_(all_lanes(rows.least)),
        square_radius_(rows.radius * rows.radius),
        // What is passed over must be nothing: not even where rounding takes a centre that is
        // farther than D for one that is nearer.
        padded_square_(square_radius_ * (1.0F + 0x1p-18F)) {}

  [[nodiscard]] static bool beyond(Float4 from, Float4 to) noexcept {
    return any((to < all_lanes(0.0F)) | (from >= all_lanes(static_cast<float>(kRowVoxels))));
  }

  void place(Float4 p, float weight) noexcept {
    weight_ = weight;
    const float px = p[0];
    const Float4 dx_low = kLowCenters - px;
    const Float4 dx_high = kHighCenters - px;
    low_square_ = dx_low * dx_low;
    high_square_ = dx_high * dx_high;
    const Float4 dy_low = kLowCenters - p[1];
    const Float4 dy_high = kHighCenters - p[1];
    y_low_square_ = dy_low * dy_low;
    y_high_square_ = dy_high * dy_high;
    const float low_near = px > 3.5F ? px - 3.5F : 0.0F;
    const float high_near = px < 4.5F ? 4.5F - px : 0.0F;
    low_reach_ = padded_square_ - low_near * low_near;
    high_reach_ = padded_square_ - high_near * high_near;
  }

  [[nodiscard]] unsigned within(float dz) noexcept {
    const Float4 low = y_low_square_ + dz * dz;
    const Float4 high = y_high_square_ + dz * dz;
    store4(dyz_.data(), low);
    store4(dyz_.data() + 4, high);
    const Float4 limit = all_lanes(square_radius_);
    return bits_of(low <= limit) | (bits_of(high <= limit) << 4U);
  }

  void add(int y, float* row) noexcept {
    const float dyz = dyz_[static_cast<std::size_t>(y)];
    if (dyz <= low_reach_) add_four(low_square_ + dyz, row);
    if (dyz <= high_reach_) add_four(high_square_ + dyz, row + 4);
  }

  [[nodiscard]] std::uint64_t updates() const noexcept {
    std::uint64_t sum = 0;
    for (int i = 0; i < 4; ++i) sum += static_cast<std::uint32_t>(updates_[i]);
    return sum;
  }

 private:
  void add_four(Float4 square, float* row) noexcept {
    const Float4 k = weight_ * Kernel::at(square * inverse_square_);
    const Int4 counted = k >= least_;
    store4(row, load4(row) + keep(counted, k));  // eq. (7)
    updates_ -= counted;
  }

  float inverse_square_;
  Float4 least_;
  float square_radius_;
  float padded_square_;
  float weight_ = 0.0F;
  Float4 low_square_{};
  Float4 high_square_{};
  Float4 y_low_square_{};
  Float4 y_high_square_{};
  float low_reach_ = 0.0F;
  float high_reach_ = 0.0F;
  alignas(16) std::array<float, kRowVoxels> dyz_{};
  Int4 updates_{};
};

void add_rows_of_four(const KernelRows& rows, KernelRowsDone& done) noexcept {
  add_rows<RowOfFours>(rows, done);
}

}  // namespace

AddKernelRows kernel_rows_of_four() noexcept { return add_rows_of_four; }

}  // namespace tessera
