// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/prior_map.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "base/number_text.hpp"
#include "settings/map_options.hpp"
#include "tessera/semantics/internal/compact_tuple.hpp"

namespace tessera {

namespace {

/// log2 of the width of a voxel of the file in voxels of the map.
std::optional<int> levels_between(double octree_m, double map_m) {
  for (int levels = 0; levels <= kMostPriorLevels; ++levels) {
    const double wide_m = std::ldexp(map_m, levels);
    if (std::abs(octree_m - wide_m) <= 1e-6 * wide_m) return levels;
  }
  return std::nullopt;
}

/// The next count that the map's tuples can have.
float holdable(float weight, const MapConfig& config) {
  if (config.tuple == TuplePolicy::kDense) return weight;
  const float quanta = CompactTuple::quanta_per_unit(config.max_evidence);
  return std::max(std::round(weight * quanta), 1.0F) / quanta;
}

/// Writes leaves into a map, whose voxels are 2^-levels times as wide as the file's.
class PriorWriter {
 public:
  PriorWriter(LocalMap& map, float weight, int levels) : map_(map), levels_(levels) {
    const auto most = static_cast<float>(map.max_passes());
    const float passes = std::round(weight / map.config().free_weight);
    report_.passes = static_cast<int>(std::clamp(passes, 1.0F, most));
    occupied_.num_components = map.num_components();
    occupied_.sigma[static_cast<std::size_t>(map.num_components() - 1)] =
        holdable(weight, map.config());
    free_.num_components = map.num_components();
    passes_.fill(static_cast<std::byte>(report_.passes));
  }

  /// Cubes of a power of two, aligned to it: each is within a block, or whole blocks.
  void add(const OctreeLeaf& leaf) {
    const VoxelCoord low{leaf.corner.x * (1 << levels_), leaf.corner.y * (1 << levels_),
                         leaf.corner.z * (1 << levels_)};
    const std::int32_t edge = std::int32_t{1} << (leaf.level + levels_);
    const std::int32_t step = std::min(edge, std::int32_t{kBlockEdge});
    for (std::int32_t z = 0; z < edge; z += step)
      for (std::int32_t y = 0; y < edge; y += step)
        for (std::int32_t x = 0; x < edge; x += step)
          add_within_block({low.x + x, low.y + y, low.z + z}, step, leaf.occupied);
  }
  /// Closes blocks in which nothing was written.
  const PriorMapReport& finish() {
    if (last_ != 0) map_.close_if_empty(last_);
    return report_;
  }

 private:
  /// edge: 1, 2, 4 or 8.
  void add_within_block(const VoxelCoord& low, std::int32_t edge, bool occupied) {
    const SlabHandle handle = open(low);
    if (handle == 0) {
      report_.refused += static_cast<std::uint64_t>(edge * edge * edge);
      return;
    }
    if (edge == 1)
      return add_voxels(handle, low, 1U << static_cast<unsigned>(voxel_in_octet(low)), occupied);
    for (std::int32_t z = 0; z < edge; z += 2)
      for (std::int32_t y = 0; y < edge; y += 2)
        for (std::int32_t x = 0; x < edge; x += 2)
          add_voxels(handle, {low.x + x, low.y + y, low.z + z}, 0xFFU, occupied);
  }
  /// mask: of the voxels of low's octet.
  void add_voxels(SlabHandle handle, const VoxelCoord& low, unsigned mask, bool occupied) {
    const int octet = octet_in_block(low);
    unsigned one_by_one = mask;
    if (!occupied) {
      const unsigned plain = mask & ~unsigned{map_.observed_labels(map_.block_at(handle), octet)};
      count(map_.merge_passes(handle, octet, passes_, plain), plain, false);
      one_by_one &= ~plain;
    }
    for (; one_by_one != 0; one_by_one &= one_by_one - 1) {
      const int voxel = std::countr_zero(one_by_one);
      const Status status = occupied ? map_.merge(handle, octet, voxel, occupied_, 0)
                                     : map_.merge(handle, octet, voxel, free_,
                                                  static_cast<std::uint8_t>(report_.passes));
      count(status, 1U << static_cast<unsigned>(voxel), occupied);
    }
    map_.restore_revision(handle, map_.revision());
  }
  void count(Status status, unsigned mask, bool occupied) {
    std::uint64_t& counter = status != Status::kOk ? report_.refused
                             : occupied            ? report_.occupied
                                                   : report_.free;
    counter += static_cast<std::uint64_t>(std::popcount(mask));
  }
  /// 0 if there is no room.
  SlabHandle open(const VoxelCoord& voxel) {
    const BlockCoord block = block_of(voxel);
    if (last_ != 0 && pack_in_grid(block).bits == map_.block_at(last_).key) return last_;
    if (last_ != 0) map_.close_if_empty(last_);
    const Result<SlabHandle> opened = map_.open_block(block);
    last_ = opened.ok() ? *opened : SlabHandle{0};
    return last_;
  }

  LocalMap& map_;
  int levels_;
  SlabHandle last_ = 0;
  VoxelEvidence occupied_;
  VoxelEvidence free_;
  std::array<std::byte, kOctetVoxels> passes_{};
  PriorMapReport report_;
};

}  // namespace

Outcome<Octree> read_prior_map(const std::string& path, double resolution_m) {
  Outcome<Octree> octree = Octree::read(path);
  if (!octree.ok()) return octree.failure();
  const std::optional<int> levels = levels_between(octree->resolution_m(), resolution_m);
  if (!levels) {
    return octree_failure(
        path,
        "its voxels of " + text_of(octree->resolution_m()) +
            " m are not 1, 2, 4, 8, 16, 32 or 64 times as wide as the map's of " +
            text_of(resolution_m) + " m",
        "choose another " + kMapSettings["--resolution"] + ", or write the file at another one");
  }
  const std::uint64_t voxels = octree->num_occupied() + octree->num_free();
  // At most 2^48 of them.
  if (voxels > kMostPriorVoxels >> (3U * static_cast<unsigned>(*levels))) {
    return octree_failure(path,
                          fmt::format("its leaves cover more than {} voxels of {} m",
                                      kMostPriorVoxels, text_of(resolution_m)),
                          "crop it, or choose a coarser " + kMapSettings["--resolution"]);
  }
  return octree;
}

PriorMapReport add_prior_map(const Octree& octree, float weight, LocalMap& map) {
  const int levels = levels_between(octree.resolution_m(), map.config().resolution_m).value_or(0);
  map.begin_revision();
  PriorWriter writer(map, weight, levels);
  octree.for_each_leaf([&](const OctreeLeaf& leaf) { writer.add(leaf); });
  PriorMapReport report = writer.finish();
  report.resolution_m = octree.resolution_m();
  return report;
}

}  // namespace tessera
