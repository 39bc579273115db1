// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/kernel_samples.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>

#include "base/arena_memory.hpp"
#include "tessera/inference/label_field.hpp"

namespace tessera {

namespace {

/// The place of the value that is nearest by its ratio, the first of equals.
template <std::size_t N>
std::size_t nearest_of(const std::array<float, N>& values, float to) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < N; ++i) {
    if (std::fabs(std::log(values[i] / to)) < std::fabs(std::log(values[best] / to))) best = i;
  }
  return best;
}

}  // namespace

std::size_t KernelGrid::nearest(const ClassKernel& kernel) {
  return nearest_of(kReach_m, kernel.reach_m) * kHeight_m.size() +
         nearest_of(kHeight_m, kernel.height_m);
}

void KernelSamples::add_point(const LocalMap& map, const Point3f& p_map, std::uint8_t label,
                              std::uint32_t fold) {
  const Result<VoxelCoord> voxel = map.lattice().voxel_of(p_map);
  if (!voxel.ok()) return;
  points_.push_back({.block = pack_in_grid(block_of(*voxel)),
                     .octet = static_cast<std::uint8_t>(octet_in_block(*voxel)),
                     .label = label,
                     .fold = fold,
                     .count = 1});
  if (points_.size() < merge_at_) return;
  merge();
  merge_at_ = 2 * points_.size() + (std::size_t{1} << 20U);
}

void KernelSamples::merge() {
  std::sort(points_.begin(), points_.end(),
            [](const Point& a, const Point& b) { return a.place() < b.place(); });
  std::size_t kept = 0;
  for (const Point& point : points_) {
    if (kept != 0 && points_[kept - 1].place() == point.place())
      points_[kept - 1].count += point.count;
    else
      points_[kept++] = point;
  }
  points_.resize(kept);
}

Outcome<void> KernelSamples::read_votes(LocalMap& map) {
  TESSERA_TRY_ASSIGN(const ArenaMemory memory, ArenaMemory::allocate(LabelField::required_bytes()));
  Arena arena(memory.span());
  Result<LabelField> field = LabelField::make(arena);
  if (!field.ok()) return Failure{"no memory for the votes", FailureKind::kFailure};
  merge();
  for (const Point& point : points_) {
    const bool same = !places_.empty() && places_.back().block == point.block &&
                      places_.back().octet == point.octet;
    if (!same) {
      places_.push_back({point.block, point.octet});
      octets_.push_back({.truth_begin = static_cast<std::uint32_t>(truth_.size())});
    }
    truth_.push_back({point.label, point.fold, point.count});
    octets_.back().truth_end = static_cast<std::uint32_t>(truth_.size());
  }
  points_ = {};
  // The largest kernel first: what it does not reach no other does.
  for (std::size_t kernel = KernelGrid::kKernels; kernel-- > 0;) {
    const bool first = kernel == KernelGrid::kKernels - 1;
    const ClassKernel shape = KernelGrid::kernel(kernel);
    field->begin({.reach_m = shape.reach_m, .height_m = shape.height_m}, map.classes(),
                 map.lattice().resolution_m());
    for (std::size_t i = 0; i < octets_.size(); ++i) {
      if (i == 0 || places_[i].block != places_[i - 1].block)
        field->look(map, unpack(places_[i].block), kAllLayers);
      const int octet = places_[i].octet;
      if (first) {
        octets_[i].votes_begin = static_cast<std::uint32_t>(votes_.size());
        for (std::uint64_t rest = field->found(); rest != 0; rest &= rest - 1) {
          const int label = std::countr_zero(rest);
          if (field->sum_of(label, octet) > 0.0F)
            votes_.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint8_t>(label), {}});
        }
        octets_[i].votes_end = static_cast<std::uint32_t>(votes_.size());
      }
      for (Votes& votes : std::span(votes_).subspan(octets_[i].votes_begin,
                                                    octets_[i].votes_end - octets_[i].votes_begin))
        votes.sums[kernel] = field->sum_of(votes.label, octet);
    }
  }
  return {};
}

}  // namespace tessera
