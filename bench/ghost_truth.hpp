// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which points of scans with true labels were on moving things that later scans see through, and
// which on others.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "scenes.hpp"
#include "tessera/grid/lattice.hpp"

namespace tessera::bench {

/// Farther points are not judged, and not mapped.
inline constexpr double kGhostRange_m = 40.0;

/// SemanticKITTI's ids of things that moved while they were seen.
constexpr bool is_moving(std::uint32_t id) { return id >= 252 && id <= 259; }

struct Judged {
  Point3f p_map;
  std::uint32_t id = 0;
  bool label_may_move = false;   ///< Its label in the mapper's input.
  std::uint16_t first_seen = 0;  ///< The scan that saw through it first, by index.
  std::uint16_t judged_after = 0;
  int seen_through = 0;  ///< By so many later scans, up to that one.
};

/// What a voxel was met by.
struct Met {
  std::uint32_t id = 0;
  bool others = false;  ///< Ids besides that one.
  bool moving = false;
  std::vector<std::uint16_t> scans;
  [[nodiscard]] bool between(int first, int last) const;
};

struct Truth {
  std::vector<Judged> moving;
  std::vector<Judged> standing;
  std::size_t left_out = 0;  ///< On moving things, in a voxel with others.
  std::size_t too_late = 0;  ///< On moving things, seen through too late to be judged.
  std::unordered_map<std::uint64_t, Met> voxels;
  /// Was the voxel met by scans [first, last]? Was one of the 26 beside it?
  [[nodiscard]] bool met(const VoxelCoord& voxel, int first, int last) const;
  [[nodiscard]] bool met_beside(const VoxelCoord& voxel, int first, int last) const;
};

using TrueIds = std::vector<std::vector<std::uint32_t>>;  ///< Of the points of each scan.

/// The labels of a data set in the KITTI layout, for scans from `first` on.
Outcome<TrueIds> read_true_ids(const std::string& dataset, int first, const Scene& scene);
/// within: moving things are judged so many scans after the one that saw through them first; 0:
/// after the last scan, as all others are. At most 65535 scans. Memory: some 100 bytes a point.
Truth truth_of(const Scene& scene, const TrueIds& ids, const Lattice& lattice, int within);

}  // namespace tessera::bench
