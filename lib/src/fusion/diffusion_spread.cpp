// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/diffusion_spread.hpp"

#include <array>

// In the compiler's vector types. Vectors are never arguments by value or results, whose places
// differ between targets.
namespace tessera {

namespace {

using Four = float __attribute__((vector_size(16)));
using Eight = float __attribute__((vector_size(32)));

template <class Vector>
[[gnu::always_inline]] inline void load(const float* from, Vector& into) noexcept {
  __builtin_memcpy(&into, from, sizeof(into));
}

/// Vectors of one width, one after the other: what edges bring to one node.
template <class Vector, std::size_t kCount>
struct Sums {
  static constexpr std::size_t kLanes = sizeof(Vector) / sizeof(float);
  Vector sums[kCount]{};  // NOLINT(cppcoreguidelines-avoid-c-arrays): for any width

  [[gnu::always_inline]] void add(const float* z, float weight) noexcept {
    for (std::size_t i = 0; i < kCount; ++i) {
      Vector there;
      load(z + i * kLanes, there);
      sums[i] += weight * there;
    }
  }
  /// own: nullptr, or what is added of the node itself.
  [[gnu::always_inline]] void finish(const float* b, const float* own, float share,
                                     float* to) const noexcept {
    for (std::size_t i = 0; i < kCount; ++i) {
      Vector here;
      load(b + i * kLanes, here);
      Vector spread = share * sums[i];
      if (own != nullptr) {
        Vector z;
        load(own + i * kLanes, z);
        spread = z + spread;
      }
      here += spread;
      __builtin_memcpy(to + i * kLanes, &here, sizeof(here));
    }
  }
};
template <class Vector>
struct Sums<Vector, 0> {
  [[gnu::always_inline]] void add(const float* /*z*/, float /*weight*/) noexcept {}
  [[gnu::always_inline]] void finish(const float* /*b*/, const float* /*own*/, float /*share*/,
                                     float* /*to*/) const noexcept {}
};

template <std::size_t kEights, std::size_t kFours>
[[gnu::always_inline]] inline void spread(const DiffusionRun& run, std::size_t lane) noexcept {
  constexpr std::size_t kWide = 8 * kEights;
  const float* const from = run.from + lane;
  for (std::size_t at = run.first; at < run.last; ++at) {
    const DiffusionNode& node = run.nodes[at];
    Sums<Eight, kEights> wide{};
    Sums<Four, kFours> narrow{};
    const std::uint32_t* edge = run.edges + node.first_edge;
    const float* weight = run.weights + node.first_edge;
    const std::uint32_t* const end = edge + node.edges;
    // By fours: what those behind the last one weigh, nothing, changes no sum.
    for (; edge < end; edge += 4, weight += 4) {
      for (std::size_t i = 0; i < 4; ++i) {
        const float* const z = from + edge[i];
        wide.add(z, weight[i]);
        narrow.add(z + kWide, weight[i]);
      }
    }
    const std::size_t place = at * run.stride + lane;
    const float* const b = run.sums + place;
    float* const to = run.to + place;
    const float* const own = run.adds_own ? run.from + place : nullptr;
    wide.finish(b, own, node.share, to);
    narrow.finish(b + kWide, own == nullptr ? nullptr : own + kWide, node.share, to + kWide);
  }
}

template <std::size_t kFours>
void by_fours(const DiffusionRun& run, std::size_t lane) noexcept {
  spread<0, kFours>(run, lane);
}
#if defined(__x86_64__)
template <std::size_t kFours>
[[gnu::target("avx2")]] void by_eights(const DiffusionRun& run, std::size_t lane) noexcept {
  spread<kFours / 2, kFours % 2>(run, lane);
}
#endif

}  // namespace

SpreadLanes spread_lanes(std::size_t fours, [[maybe_unused]] LaneWidth width) noexcept {
#if defined(__x86_64__)
  constexpr std::array<SpreadLanes, 4> kByEights{&by_eights<1>, &by_eights<2>, &by_eights<3>,
                                                 &by_eights<4>};
  if (width == LaneWidth::kWidest && has_avx2()) return kByEights[fours - 1];
#endif
  constexpr std::array<SpreadLanes, 4> kByFours{&by_fours<1>, &by_fours<2>, &by_fours<3>,
                                                &by_fours<4>};
  return kByFours[fours - 1];
}

}  // namespace tessera
