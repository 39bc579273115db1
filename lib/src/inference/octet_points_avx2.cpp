// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Compiled with -mavx2 where that is possible. Nothing fused: the same operations as in lanes of
// four.
#include "octet_points.hpp"

#if defined(__AVX2__)

#include "lanes_of_eight.hpp"
#include "tessera/inference/kernel.hpp"

namespace tessera {

namespace {

[[gnu::always_inline]] inline void add_to(OctetPoints& octet, std::uint8_t component,
                                          Float8 more) noexcept {
  float* const plane = octet.planes + std::ptrdiff_t{component} * 8;
  const std::uint64_t bit = std::uint64_t{1} << component;
  if ((octet.components & bit) != 0) {
    Float8 sums;
    __builtin_memcpy(&sums, plane, sizeof(sums));
    more = sums + more;  // eq. (7)
  }
  octet.components |= bit;
  __builtin_memcpy(plane, &more, sizeof(more));
}

std::uint64_t add_by_eights(OctetPoints& octet) noexcept {
  const Float8 x = octet.x + Float8{0.0F, 1.0F, 0.0F, 1.0F, 0.0F, 1.0F, 0.0F, 1.0F};
  const Float8 y = octet.y + Float8{0.0F, 0.0F, 1.0F, 1.0F, 0.0F, 0.0F, 1.0F, 1.0F};
  const Float8 z = octet.z + Float8{0.0F, 0.0F, 0.0F, 0.0F, 1.0F, 1.0F, 1.0F, 1.0F};
  const auto bits = static_cast<std::int32_t>(octet.voxels);
  const Int8 lanes{1, 2, 4, 8, 16, 32, 64, 128};
  const Int8 voxels = (lanes & bits) == lanes;
  std::uint64_t updates = 0;
  for (std::size_t i = 0; i < octet.count; ++i) {
    const TilePoint& point = octet.points[i];
    const Float8 dx = x - point.x;
    const Float8 dy = y - point.y;
    const Float8 dz = z - point.z;
    const Float8 s = (dx * dx + dy * dy + dz * dz) * octet.inverse_square;
    const Float8 r = __builtin_ia32_sqrtps256(__builtin_ia32_minps256(s, Float8{} + 1.0F));
    const Float8 k = (point.weight * octet.scale) * Kernel::of_distance(r);
    const Int8 counted = (k >= octet.least) & voxels;
    const unsigned added = bits_of_lanes(counted);
    if (added == 0) continue;
    updates += static_cast<unsigned>(__builtin_popcount(added));
    const Float8 kept = keep_of(counted, k);
    if (point.label_weights == kOneLabel) {
      add_to(octet, point.component, kept);
      continue;
    }
    for_labels(point, [&](std::uint8_t component, std::uint8_t label_weight) {
      const Float8 share = kept * share_of(label_weight);
      add_to(octet, component, keep_of(share >= Float8{} + octet.least_share, share));
    });
  }
  return updates;
}

}  // namespace

AddOctetPoints octet_points_by_eights() noexcept { return add_by_eights; }

}  // namespace tessera

#else

namespace tessera {
AddOctetPoints octet_points_by_eights() noexcept { return nullptr; }
}  // namespace tessera

#endif
