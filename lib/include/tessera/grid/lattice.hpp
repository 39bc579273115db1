// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where a point, a voxel and a block are: the only place that rounds coordinates. Voxel v covers
// [v, v + 1) * resolution on each axis; a block is 8 x 8 x 8 voxels, an octet 2 x 2 x 2. Negative
// coordinates floor like positive ones.
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "tessera/base/geometry.hpp"
#include "tessera/base/status.hpp"

namespace tessera {

inline constexpr int kBlockEdge = 8;
inline constexpr int kBlockVoxels = kBlockEdge * kBlockEdge * kBlockEdge;
inline constexpr int kOctetVoxels = 8;
inline constexpr int kBlockOctets = kBlockVoxels / kOctetVoxels;
/// Block coordinates are in [-kBlockLimit, kBlockLimit), so that three fit a 64-bit key with a bit
/// to spare.
inline constexpr std::int32_t kBlockLimit = 1 << 20;
inline constexpr std::int32_t kVoxelLimit = kBlockLimit * kBlockEdge;

/// A voxel: it covers [v, v + 1) * resolution on each axis.
struct VoxelCoord {
  std::int32_t x = 0;
  std::int32_t y = 0;
  std::int32_t z = 0;
  friend constexpr bool operator==(const VoxelCoord&, const VoxelCoord&) = default;
  friend constexpr VoxelCoord operator-(const VoxelCoord& a, const VoxelCoord& b) noexcept {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
};

/// A block of 8 x 8 x 8 voxels, by its place in the grid of blocks.
struct BlockCoord {
  std::int32_t x = 0;
  std::int32_t y = 0;
  std::int32_t z = 0;
  friend constexpr bool operator==(const BlockCoord&, const BlockCoord&) = default;
  friend constexpr BlockCoord operator+(const BlockCoord& a, const BlockCoord& b) noexcept {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
};

/// To the six neighbours that share a face, in the order -x, +x, -y, +y, -z, +z.
inline constexpr std::array<BlockCoord, 6> kFaceSteps{BlockCoord{-1, 0, 0}, BlockCoord{1, 0, 0},
                                                      BlockCoord{0, -1, 0}, BlockCoord{0, 1, 0},
                                                      BlockCoord{0, 0, -1}, BlockCoord{0, 0, 1}};

/// A block's coordinates in 63 bits. Keys compare as (z, y, x), the order in which maps are
/// iterated, saved and digested.
struct BlockKey {
  std::uint64_t bits = 0;
  friend constexpr bool operator==(BlockKey, BlockKey) = default;
  friend constexpr auto operator<=>(BlockKey, BlockKey) = default;
};

namespace detail {

/// True iff all are in [-limit, limit). limit: a power of two, so that one comparison will do.
constexpr bool all_within(std::int32_t limit, std::int32_t x, std::int32_t y,
                          std::int32_t z) noexcept {
  const auto bound = static_cast<std::uint32_t>(limit);
  const auto biased = [&](std::int32_t v) { return static_cast<std::uint32_t>(v) + bound; };
  return (biased(x) | biased(y) | biased(z)) < 2 * bound;
}

}  // namespace detail

constexpr bool in_grid(BlockCoord block) noexcept {
  return detail::all_within(kBlockLimit, block.x, block.y, block.z);
}
/// True iff each coordinate is in [-limit, limit). limit: a power of two.
constexpr bool is_within(std::int32_t limit, VoxelCoord voxel) noexcept {
  return detail::all_within(limit, voxel.x, voxel.y, voxel.z);
}
constexpr bool in_grid(VoxelCoord voxel) noexcept { return is_within(kVoxelLimit, voxel); }

/// Fails with kOutOfRange iff a coordinate is outside [-kBlockLimit, kBlockLimit).
constexpr Result<BlockKey> pack(BlockCoord block) noexcept {
  if (!in_grid(block)) return Status::kOutOfRange;
  constexpr auto biased = [](std::int32_t v) {
    return static_cast<std::uint64_t>(v + kBlockLimit);
  };
  return BlockKey{(biased(block.z) << 42U) | (biased(block.y) << 21U) | biased(block.x)};
}
/// pack for a coordinate known to be in the grid.
constexpr BlockKey pack_in_grid(BlockCoord block) noexcept {
  TESSERA_ASSERT(in_grid(block));
  return *pack(block);
}
constexpr BlockCoord unpack(BlockKey key) noexcept {
  constexpr auto field = [](std::uint64_t bits) {
    return static_cast<std::int32_t>(bits & 0x1fffffU) - kBlockLimit;
  };
  return {field(key.bits), field(key.bits >> 21U), field(key.bits >> 42U)};
}

/// The block that holds a voxel: an arithmetic shift, so negatives floor.
constexpr BlockCoord block_of(VoxelCoord voxel) noexcept {
  return {voxel.x >> 3, voxel.y >> 3, voxel.z >> 3};
}
/// The octet of a voxel in its block, x fastest: 0 .. 63.
constexpr int octet_in_block(VoxelCoord voxel) noexcept {
  return ((voxel.x >> 1) & 3) | (((voxel.y >> 1) & 3) << 2) | (((voxel.z >> 1) & 3) << 4);
}
/// The place of a voxel in its octet, x fastest: 0 .. 7.
constexpr int voxel_in_octet(VoxelCoord voxel) noexcept {
  return (voxel.x & 1) | ((voxel.y & 1) << 1) | ((voxel.z & 1) << 2);
}
/// Inverse of block_of, octet_in_block and voxel_in_octet together.
constexpr VoxelCoord voxel_at(BlockCoord block, int octet, int voxel) noexcept {
  return {block.x * kBlockEdge + ((octet & 3) << 1) + (voxel & 1),
          block.y * kBlockEdge + (((octet >> 2) & 3) << 1) + ((voxel >> 1) & 1),
          block.z * kBlockEdge + (((octet >> 4) & 3) << 1) + ((voxel >> 2) & 1)};
}

/// Place of a voxel in its block's row order: x fastest, then y, then z; 0 .. 511.
constexpr int row_order(int octet, int voxel) noexcept {
  const VoxelCoord v = voxel_at({0, 0, 0}, octet, voxel);
  return v.x + kBlockEdge * (v.y + kBlockEdge * v.z);
}
/// The same for a voxel of the grid.
constexpr int row_order(VoxelCoord voxel) noexcept {
  return (voxel.x & 7) | ((voxel.y & 7) << 3) | ((voxel.z & 7) << 6);
}
/// Row order of an octet's first voxel.
constexpr int row_order_corner(int octet) noexcept { return row_order(octet, 0); }
/// The voxel of a block that row_order names.
constexpr VoxelCoord voxel_of_row(BlockCoord block, int row) noexcept {
  return {block.x * kBlockEdge + (row & 7), block.y * kBlockEdge + ((row >> 3) & 7),
          block.z * kBlockEdge + (row >> 6)};
}

/// Largest integer not above value; |value| < 2^62. Without libm, so the same everywhere and
/// inlined on every target.
constexpr std::int64_t floor_to_int64(double value) noexcept {
  const auto truncated = static_cast<std::int64_t>(value);
  return truncated - (static_cast<double>(truncated) > value ? 1 : 0);
}
constexpr std::int32_t floor_to_int(double value) noexcept {
  const auto truncated = static_cast<std::int32_t>(value);
  return truncated - (static_cast<double>(truncated) > value ? 1 : 0);
}

/// The regular grid of cubic voxels with the given edge, its corner at the map frame's origin.
class Lattice {
 public:
  /// resolution_m > 0 and finite, else the caller has a bug; maps check it at their front door.
  explicit constexpr Lattice(double resolution_m) noexcept : resolution_m_(resolution_m) {
    TESSERA_ASSERT(resolution_m > 0.0);
  }
  [[nodiscard]] constexpr double resolution_m() const noexcept { return resolution_m_; }

  /// The voxel that contains p_map (metres). Fails with kOutOfRange iff p_map is not finite or
  /// outside the grid.
  [[nodiscard]] Result<VoxelCoord> voxel_of(const Point3f& p_map) const noexcept {
    return voxel_of(widen(p_map));
  }
  /// The same for a point or an expression of doubles, of which nothing is rounded: far from the
  /// origin the voxel can be another than that of round_to_float(p_map). A template, because a sum
  /// of vectors would fit two functions of points.
  template <class Expression>
  requires std::is_same_v<typename Expression::Scalar, double>
  [[nodiscard]] Result<VoxelCoord> voxel_of(
      const Eigen::MatrixBase<Expression>& p_map) const noexcept {
    const Point3d q = p_map / resolution_m_;
    constexpr double limit = kVoxelLimit;
    // Written so that NaN fails.
    const bool inside = q.x() >= -limit && q.x() < limit && q.y() >= -limit && q.y() < limit &&
                        q.z() >= -limit && q.z() < limit;
    if (!inside) return Status::kOutOfRange;
    return VoxelCoord{floor_to_int(q.x()), floor_to_int(q.y()), floor_to_int(q.z())};
  }

  /// p_map in units of voxels: a division in double, as anyone would compute it who checks a voxel
  /// by hand.
  [[nodiscard]] Point3d to_voxels(const Point3f& p_map) const noexcept {
    return widen(p_map) / resolution_m_;
  }

  /// The centre of a voxel, metres, map frame.
  [[nodiscard]] Point3d center_of(VoxelCoord voxel) const noexcept {
    return {(voxel.x + 0.5) * resolution_m_, (voxel.y + 0.5) * resolution_m_,
            (voxel.z + 0.5) * resolution_m_};
  }

 private:
  double resolution_m_;
};

}  // namespace tessera
