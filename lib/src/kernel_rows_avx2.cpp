// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Compiled with -mavx2 where that is possible. Nothing fused: the same operations as in lanes of
// four. What kernel_rows.hpp says about inline functions holds for all of this file.
#include "kernel_rows.hpp"

#if defined(__AVX2__)

#include "tessera/inference/kernel.hpp"

namespace tessera {

namespace {

using Float8 = float __attribute__((vector_size(32)));
using Int8 = std::int32_t __attribute__((vector_size(32)));

/// A whole row at once.
class RowOfEight {
 public:
  explicit RowOfEight(const KernelRows& rows) noexcept
      : inverse_square_(rows.inverse_square),
        least_(Float8{} + rows.least),
        square_radius_(Float8{} + rows.radius * rows.radius) {}

  [[nodiscard]] static bool beyond(Float4 from, Float4 to) noexcept {
    const Float4 nothing{};
    const Int4 out = (to < nothing) | (from >= nothing + static_cast<float>(kRowVoxels));
    Float4 signs;
    __builtin_memcpy(&signs, &out, sizeof(signs));
    return __builtin_ia32_movmskps(signs) != 0;
  }

  void place(Float4 p, float weight) noexcept {
    const Float8 centers{0.5F, 1.5F, 2.5F, 3.5F, 4.5F, 5.5F, 6.5F, 7.5F};
    weight_ = Float8{} + weight;
    const Float8 dx = centers - p[0];
    const Float8 dy = centers - p[1];
    square_ = dx * dx;
    y_square_ = dy * dy;
  }

  [[nodiscard]] unsigned within(float dz) noexcept {
    const Float8 dyz = y_square_ + dz * dz;
    __builtin_memcpy(dyz_, &dyz, sizeof(dyz));
    const Int8 in_reach = dyz <= square_radius_;
    Float8 signs;
    __builtin_memcpy(&signs, &in_reach, sizeof(signs));
    return static_cast<unsigned>(__builtin_ia32_movmskps256(signs));
  }

  void add(int y, float* row) noexcept {
    const Float8 s = (square_ + dyz_[y]) * inverse_square_;
    const Float8 r = __builtin_ia32_sqrtps256(__builtin_ia32_minps256(s, Float8{} + 1.0F));
    const Float8 k = weight_ * Kernel::of_distance(r);
    const Int8 counted = k >= least_;
    Int8 bits;
    __builtin_memcpy(&bits, &k, sizeof(bits));
    bits &= counted;
    Float8 kept;
    __builtin_memcpy(&kept, &bits, sizeof(kept));
    Float8 sums;
    __builtin_memcpy(&sums, row, sizeof(sums));
    sums += kept;  // eq. (7)
    __builtin_memcpy(row, &sums, sizeof(sums));
    updates_ -= counted;
  }

  [[nodiscard]] std::uint64_t updates() const noexcept {
    std::int64_t sum = 0;
    for (int i = 0; i < kRowVoxels; ++i) sum += updates_[i];
    return static_cast<std::uint64_t>(sum);
  }

 private:
  float inverse_square_;
  Float8 least_;
  Float8 square_radius_;
  Float8 weight_{};
  Float8 square_{};
  Float8 y_square_{};
  // Not std::array, whose operator is an inline function.
  // NOLINTNEXTLINE(cppcoreguidelines-avoid-c-arrays)
  alignas(32) float dyz_[kRowVoxels]{};
  Int8 updates_{};
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
