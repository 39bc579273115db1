// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The kernel mode's sums of eq. 7. Tiles that follow each other along x share a strip, so that a
// point adds a row of its ball at once, whichever tile's border runs through it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/internal/lane_width.hpp"
#include "tessera/inference/internal/tile_evidence.hpp"

namespace tessera {

struct KernelRows;
struct KernelRowsDone;

class KernelStrip {
 public:
  /// Tiles of 8 x 8 x 8 voxels that it has room for.
  static constexpr int kTiles = 4;

  [[nodiscard]] static constexpr std::size_t required_bytes() noexcept {
    return arena_bytes<Planes>(1);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<KernelStrip> make(Arena& arena,
                                                LaneWidth lanes = LaneWidth::kWidest) noexcept;
  /// Whether kWidest is more than four here.
  [[nodiscard]] static bool has_wide_lanes() noexcept;
  KernelStrip() noexcept = default;

  /// Starts anew with so many tiles, 1 .. kTiles. O(rows touched).
  void begin(int tiles) noexcept;
  /// Adds the points of the tile that lies offset tiles from the strip's first one, in that tile's
  /// coordinates; radius: no contribution reaches a voxel centre farther away (voxels). A voxel's
  /// sum is the same whatever strip it is in. O(points * 64 (2 radius + 8)) for what lies in it.
  void add_points(std::span<const TilePoint> points, const std::array<int, 3>& offset, float radius,
                  const KernelShape& kernel, EvidenceWork& work) noexcept;
  /// The octets of a tile that anything may have been added to, a bit each.
  [[nodiscard]] std::uint64_t touched(int tile) const noexcept;
  /// The sums of a tile.
  [[nodiscard]] BlockEvidence sums(int tile) const noexcept;

 private:
  static constexpr std::size_t kPlane = std::size_t{64} * kBlockEdge * (kTiles + 1);
  struct Planes {
    std::array<float, kMaxComponents * kPlane> sums{};
    /// Rows y + 8 z, by component and tile.
    std::array<std::uint64_t, std::size_t{kMaxComponents} * kTiles> touched{};
  };
  using AddRows = void (*)(const KernelRows& rows, KernelRowsDone& done) noexcept;

  Planes* planes_ = nullptr;
  AddRows add_rows_ = nullptr;
  std::uint64_t components_ = 0;
  int tiles_ = 1;
};

}  // namespace tessera
