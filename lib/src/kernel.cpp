// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/kernel.hpp"

namespace tessera {

/// The parabola through the ends and the middle of each segment.
constexpr std::array<KernelTable::Segment, KernelTable::kSegments>
KernelTable::make_table() noexcept {
  std::array<Segment, kSegments> table{};
  for (int i = 0; i < kSegments; ++i) {
    const auto value = [i](double t) {
      return kernel_exact(detail::exact_sqrt((static_cast<double>(i) + t) / kSegments));
    };
    const double f0 = value(0.0);
    const double f1 = value(0.5);
    const double f2 = value(1.0);
    const double c = 2.0 * (f0 - 2.0 * f1 + f2);
    table[static_cast<std::size_t>(i)] = {static_cast<float>(f0), static_cast<float>(f2 - f0 - c),
                                          static_cast<float>(c)};
  }
  return table;
}

constinit const std::array<KernelTable::Segment, KernelTable::kSegments> KernelTable::kTable =
    make_table();

}  // namespace tessera
