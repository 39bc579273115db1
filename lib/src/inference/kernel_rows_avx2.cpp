// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Compiled with -mavx2 where that is possible. Nothing fused: the same operations as in lanes of
// four. What kernel_rows.hpp says about inline functions holds for all of this file.
#include "kernel_rows.hpp"

#if defined(__AVX2__)

#include "lanes_of_eight.hpp"
#include "tessera/inference/kernel.hpp"

namespace tessera {

namespace {

/// A whole row at once.
class RowOfEight {
 public:
  explicit RowOfEight(const KernelRows& rows) noexcept
      : y_centers_(kCenters - rows.corner[1]),
        z_centers_(kCenters - rows.corner[2]),
        corner_(rows.corner),
        columns_(rows.columns),
        weight_scale_(rows.weight_scale),
        inverse_square_(rows.inverse_square),
        least_(rows.least),
        least_share_(rows.least_share) {}

  [[nodiscard]] static bool beyond(Float4 from, Float4 to, Float4 size) noexcept {
    const Int4 out = (to < Float4{}) | (from >= size);
    Float4 signs;
    __builtin_memcpy(&signs, &out, sizeof(signs));
    return __builtin_ia32_movmskps(signs) != 0;
  }

  void place(const TilePoint& point, float square_reach) noexcept {
    weight_ = Float8{} + point.weight * weight_scale_;
    x_ = point.x;
    const Float8 dy = y_centers_ - point.y;
    y_square_ = dy * dy;
    const Float8 dz = z_centers_ - point.z;
    const Float8 z_square = dz * dz;
    __builtin_memcpy(z_square_, &z_square, sizeof(z_square));
    reach_ = Float8{} + square_reach;
  }

  [[nodiscard]] unsigned within(int z) noexcept {
    const Float8 dyz = y_square_ + z_square_[z];
    __builtin_memcpy(dyz_ + std::ptrdiff_t{z} * kRowVoxels, &dyz, sizeof(dyz));
    return bits_of_lanes(dyz <= reach_);
  }

  void at(int column) noexcept {
    const auto from = static_cast<float>(column);
    const Float8 dx = (kCenters + (from - corner_[0])) - x_;
    square_ = dx * dx;
    inside_ = kCenters < Float8{} + (columns_ - from);
  }

  void add(int row, const RowPlanes& planes, std::ptrdiff_t offset) noexcept {
    const Float8 s = (square_ + dyz_[row]) * inverse_square_;
    const Float8 r = __builtin_ia32_sqrtps256(__builtin_ia32_minps256(s, Float8{} + 1.0F));
    const Float8 k = weight_ * Kernel::of_distance(r);
    const Int8 counted = (k >= least_) & inside_;
    const Float8 kept = keep_of(counted, k);
    updates_ -= counted;
    if (planes.labels == 0) {
      add_to(planes.first + offset, kept);
      return;
    }
    for (int j = 0; j < planes.labels; ++j) {
      const Float8 share = kept * planes.share[j];
      add_to(planes.of_label[j] + offset, keep_of(share >= Float8{} + least_share_, share));
    }
  }

  [[nodiscard]] std::uint64_t updates() const noexcept {
    std::uint64_t sum = 0;
    for (int i = 0; i < kRowVoxels; ++i) sum += static_cast<std::uint32_t>(updates_[i]);
    return sum;
  }

 private:
  [[gnu::always_inline]] static void add_to(float* at, Float8 more) noexcept {
    Float8 sums;
    __builtin_memcpy(&sums, at, sizeof(sums));
    sums += more;  // eq. (7)
    __builtin_memcpy(at, &sums, sizeof(sums));
  }

  static constexpr Float8 kCenters{0.5F, 1.5F, 2.5F, 3.5F, 4.5F, 5.5F, 6.5F, 7.5F};

  Float8 y_centers_;  ///< In the points' tile.
  Float8 z_centers_;
  Float8 weight_{};
  Float8 y_square_{};
  Float8 reach_{};
  Float8 square_{};
  Int8 inside_{};  ///< Of the eight columns, those of the strip.
  Int8 updates_{};
  // Not std::array, whose operator is an inline function.
  // NOLINTBEGIN(cppcoreguidelines-avoid-c-arrays)
  alignas(32) float z_square_[kRowVoxels]{};
  alignas(32) float dyz_[kTileRows]{};
  // NOLINTEND(cppcoreguidelines-avoid-c-arrays)
  Float4 corner_;
  float columns_;
  float weight_scale_;
  float inverse_square_;
  float least_;
  float least_share_;
  float x_ = 0.0F;
};

void add_rows_of_eight(const KernelRows& rows, KernelRowsDone& done) noexcept {
  add_rows<RowOfEight>(rows, done);
}

}  // namespace

AddKernelRows kernel_rows_of_eight() noexcept { return add_rows_of_eight; }

}  // namespace tessera

#else

namespace tessera {
AddKernelRows kernel_rows_of_eight() noexcept { return nullptr; }
}  // namespace tessera

#endif
