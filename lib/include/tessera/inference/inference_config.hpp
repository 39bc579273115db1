// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How scans become evidence: the modes and their constants, with the reference's values as
// defaults.
#pragma once

#include <cstdint>

#include "tessera/base/robot_body.hpp"

namespace tessera {

/// How a point gives evidence to voxels.
enum class InferenceMode : std::uint8_t {
  kCounting = 0,  ///< A point adds its weight to its own voxel.
  kKernel =
      1,  ///< k_0 with a fixed length around every point (Gan et al., RA-L 2020), no block limits.
  kMultiEntropy = 2,  ///< k_e: length and reach follow the scan's entropies (paper eq. 6).
  /// How much evidence voxels get as with kMultiEntropy; of which classes it is, by what points
  /// around said over all scans. Of a map without MapConfig::label_votes it is kMultiEntropy.
  kLattice = 3,
};
/// Voxels from this edge on are without votes: a cell of votes would be wider than most objects.
inline constexpr double kVotesBelow_m = 0.25;
/// Whether a map is to keep votes (MapConfig::label_votes): what Mapper sets.
[[nodiscard]] constexpr bool needs_votes(InferenceMode mode, double resolution_m) noexcept {
  return mode == InferenceMode::kLattice && resolution_m < kVotesBelow_m;
}
/// Whether evidence follows the scan's entropies.
[[nodiscard]] constexpr bool by_entropies(InferenceMode mode) noexcept {
  return mode == InferenceMode::kMultiEntropy || mode == InferenceMode::kLattice;
}

constexpr const char* to_string(InferenceMode mode) noexcept {
  switch (mode) {
    case InferenceMode::kCounting:
      return "counting";
    case InferenceMode::kKernel:
      return "kernel";
    case InferenceMode::kMultiEntropy:
      return "multi-entropy";
    case InferenceMode::kLattice:
      return "lattice";
  }
  return "invalid";
}

/// The weight of the point that stands for a thinned cell, from the weights of the points with the
/// cell's label.
enum class ThinningWeight : std::uint8_t {
  kMean = 0,  ///< One point is one observation, whatever the sensor's density there.
  kSum = 1,   ///< As many observations as there were returns.
};
constexpr const char* to_string(ThinningWeight weight) noexcept {
  return weight == ThinningWeight::kSum ? "sum" : "mean";
}

/// Constants of evidence that follows entropies. Lengths in voxels, 0 .. 16. An entropy block is
/// block_edge voxels a side.
struct EntropyConfig {
  float base_length = 3.0F;  ///< D_m = (base_length + entropy_length * E_c) * resolution.
  float entropy_length = 2.0F;
  /// A block with E_c above this learns from its face neighbours too. 0 .. 2; from 1 on none does.
  float smooth_above = 0.3F;
  float fill_length = 5.0F;  ///< D of a block without points that is filled from its neighbours.
  /// Face neighbours with points that filling takes, 1 .. 6; 7 never fills.
  int fill_neighbours = 2;
  bool fill_one_label = true;  ///< Fill only where all labelled points of the neighbours agree.
  int block_edge = 2;          ///< 1, 2 or 4 voxels; with 1 the grid ends at half its limit.
};

/// Kernels of the lattice mode.
struct LatticeConfig {
  /// Of all classes, 0.001 to 1000; 0: each class has its own, ClassTable::kernel().
  float reach_m = 0.0F;
  float height_m = 0.24F;  ///< With that reach, 0.001 to 1000.
};

/// How a scan's free space is found.
enum class Carving : std::uint8_t {
  kRays = 0,   ///< Each ray is walked through its voxels.
  kImage = 1,  ///< Voxels are compared with the image of the scan.
};
constexpr const char* to_string(Carving carving) noexcept {
  return carving == Carving::kImage ? "image" : "rays";
}

/// How a scan gives free evidence.
struct FreeSpaceConfig {
  bool enabled = true;
  Carving carving = Carving::kImage;
  /// With kImage: pixels (0.15 to 0.18 degrees) on each side of a voxel's direction in which no
  /// return may be nearer than it, 0 .. 8; so what is close to an edge or a grazed surface stays.
  std::uint8_t neighbour_pixels = 3;
  /// With kRays: a ray is carved up to the nearest return in directions within this angle of its
  /// own (radians, 0 .. 0.05), so that rays that graze a surface or pass an edge closely free
  /// nothing of it. No return within the angle is missed; returns up to 0.0148 rad beyond it may
  /// count, as directions are kept in pixels. 0: its own return only.
  float neighbour_angle_rad = 0.015F;
  /// Carving ends this many voxels before that return; with kImage, along the axis of the map that
  /// is nearest to its direction.
  float margin_voxels = 2.0F;
  [[nodiscard]] constexpr bool walks_rays() const noexcept {
    return enabled && carving == Carving::kRays;
  }
  [[nodiscard]] constexpr bool uses_image() const noexcept {
    return enabled && carving == Carving::kImage;
  }
};

struct InferenceConfig {
  InferenceMode mode = InferenceMode::kLattice;
  float kernel_length_m = 0.5F;  ///< D of the kernel mode, 0.001 .. 1000.
  float kernel_scale = 1.0F;     ///< eps_0, 1e-6 .. 1e6.
  /// Smaller contributions are not added, in any mode; 0 .. 1. 0 adds the full ball, but for what
  /// is under kLeastCount.
  float min_weight = 1.0F / 4096.0F;
  EntropyConfig entropy{};  ///< Of kMultiEntropy and kLattice, the latter with block_edge 2.
  LatticeConfig lattice{};
  FreeSpaceConfig free_space{};
  /// Nearer returns are refused: the robot itself, or a sensor's "no return". 0 .. 1e6.
  float min_range_m = 0.5F;
  /// Farther returns add no hit and carve up to here; above min_range_m, to 1e6. 0: no limit.
  float max_range_m = 40.0F;
  /// Directions from which nothing came back (ScanView::no_return) free space up to here, or to
  /// max_range_m if that is nearer; from min_range_m to 1e6. 0: they free nothing. For sensors
  /// that report nothing only where there is nothing: of black, wet or slanted surfaces and of
  /// glass most get no return, and would be seen through.
  float no_return_range_m = 0.0F;
  double thinning_m = 0.1;  ///< Cell of the thinning grid, 0.001 .. 1000; 0: off.
  ThinningWeight thinning_weight = ThinningWeight::kMean;
  /// A scan's kernel evaluations plus ray steps never exceed it; 0: no limit. Where a scan does not
  /// fit the memory, its rays are walked up to twice, all of it within the budget.
  std::uint64_t work_budget = 0;
  /// Returns in it are refused: they add nothing and are no rays. Costs a return one comparison,
  /// and one that is no farther than the body a transform and six comparisons a box.
  RobotBody body{};
};

/// Capacities of an integrator's scratch memory. What goes beyond them is left out and counted.
struct ScanCapacity {
  static constexpr std::uint32_t kMaxPoints = std::uint32_t{1} << 24U;

  std::uint32_t points = 262144;      ///< Returns of a scan, at most kMaxPoints.
  std::uint32_t tiles = 65536;        ///< Blocks that a scan's label evidence may touch.
  std::uint32_t ray_blocks = 131072;  ///< Blocks that a scan's rays may cross.
};

}  // namespace tessera
