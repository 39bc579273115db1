// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/alignment.hpp"

#include <bit>

#include "tessera/base/internal/digest.hpp"

namespace tessera {

namespace {

using Shift = std::array<int, 3>;

struct Tally {
  std::uint32_t compared = 0;
  std::uint32_t common = 0;
  std::uint32_t agreed = 0;
};

/// Calls visit(voxel, label) for one in `stride` label voxels of a map. Which of a block's these
/// are follows from its key, so that it is no matter in what order blocks came.
template <class Visit>
void for_samples(const LocalMap& map, std::uint32_t stride, Visit&& visit) noexcept {
  SweepCursor cursor;
  map.visit_blocks(cursor, ~std::size_t{0} / 2, [&](BlockKey key, SlabHandle handle) {
    const Block& block = map.block_at(handle);
    std::uint64_t place = mix64(key.bits) >> 1U;
    for (std::uint64_t octets = map.octets_of(block); octets != 0; octets &= octets - 1) {
      const int octet = std::countr_zero(octets);
      for (unsigned v = map.observed_labels(block, octet); v != 0; v &= v - 1) {
        if (place++ % stride != 0) continue;
        const VoxelCoord voxel = voxel_at(unpack(key), octet, std::countr_zero(v));
        const int label = map.query(block, voxel).label;
        if (label != 0) visit(voxel, label);
      }
    }
    return true;
  });
}

/// How the maps agree at each shift along an axis, from -kMostShift on.
using Tallies = std::array<Tally, 2 * AlignmentCheck::kMostShift + 1>;

/// All places of an axis are tried together, so that samples are taken once for them.
Tallies tally_axis(const LocalMap& first, const LocalMap& second, const GridTransform& T,
                   std::uint32_t stride, const Shift& from, std::size_t axis) noexcept {
  constexpr int kMost = AlignmentCheck::kMostShift;
  Tallies tallies{};
  for_samples(second, stride, [&](VoxelCoord voxel, int label) {
    const std::array<double, 3> center = T.to_global(voxel);
    for (int shift = -kMost; shift <= kMost; ++shift) {
      Shift tried = from;
      tried[axis] = shift;
      const VoxelCoord there{floor_to_int(center[0]) + tried[0], floor_to_int(center[1]) + tried[1],
                             floor_to_int(center[2]) + tried[2]};
      const int other = in_grid(there) ? first.query(there).label : 0;
      Tally& tally = tallies[static_cast<std::size_t>(shift + kMost)];
      ++tally.compared;
      tally.common += other != 0 ? 1U : 0U;
      tally.agreed += other == label ? 1U : 0U;
    }
  });
  return tallies;
}

void take_best(const Tallies& tallies, std::size_t axis, Alignment& alignment) noexcept {
  for (std::size_t i = 0; i < tallies.size(); ++i) {
    if (tallies[i].agreed <= alignment.agreed_shifted) continue;
    alignment.agreed_shifted = tallies[i].agreed;
    alignment.best_shift[axis] = static_cast<int>(i) - AlignmentCheck::kMostShift;
  }
}

}  // namespace

Alignment AlignmentCheck::measure(const LocalMap& first, const LocalMap& second,
                                  const GridTransform& T_first_second,
                                  std::uint32_t max_voxels) noexcept {
  const std::uint64_t voxels = second.usage().label_voxels;
  const std::uint64_t most = max_voxels == 0 ? 1 : max_voxels;
  const auto stride = static_cast<std::uint32_t>(voxels / most + 1);
  Alignment alignment;
  for (std::size_t i = 0; i < 6; ++i) {  // two rounds of three axes
    const std::size_t axis = i % 3;
    const Tallies tallies =
        tally_axis(first, second, T_first_second, stride, alignment.best_shift, axis);
    if (i == 0) {
      const Tally& here = tallies[kMostShift];
      alignment.compared = here.compared;
      alignment.common = here.common;
      alignment.agreed = alignment.agreed_shifted = here.agreed;
      if (here.common == 0) return alignment;
    }
    take_best(tallies, axis, alignment);
  }
  return alignment;
}

}  // namespace tessera
