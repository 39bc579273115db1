// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Label evidence in the kernel mode: the sums of a strip of tiles along x, then the map's blocks
// under it.
#pragma once

#include <span>

#include "tessera/inference/internal/kernel_reach.hpp"
#include "tessera/inference/internal/kernel_strip.hpp"
#include "tessera/inference/internal/scan_tiles.hpp"
#include "tessera/inference/scan_report.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

class StripWriter {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes() noexcept {
    return KernelStrip::required_bytes();
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<StripWriter> make(Arena& arena) noexcept;
  /// No memory: writes nothing.
  StripWriter() noexcept = default;

  /// Begins a scan of that reach; length_voxels: of the kernel. O(1).
  void begin(const InferenceConfig& config, float length_voxels, KernelReach reach) noexcept {
    kernel_ = kernel_shape(config, length_voxels);
    reach_ = reach;
  }
  /// Writes all wanted tiles, in strips as long as they can be; their Tile::wanted is 0 afterwards.
  /// Room was reserved before: a write that fails is counted as a fault. Cost: points in reach of
  /// a tile times its 512 voxels.
  void write_all(LocalMap& map, ScanTiles& tiles, EvidenceWork& work, ScanReport& report) noexcept;
  /// Writes tiles that follow each other along x, at most KernelStrip::kTiles. A voxel's sum is the
  /// same whatever strip it is in.
  void write(LocalMap& map, const ScanTiles& tiles, std::span<const Tile* const> strip,
             EvidenceWork& work, ScanReport& report) noexcept;

 private:
  void sum(const LocalMap& map, const ScanTiles& tiles, std::span<const Tile* const> strip,
           EvidenceWork& work) noexcept;
  void add_row(const ScanTiles& tiles, std::span<const Tile* const> strip,
               std::span<const Tile* const> row, int dy, int dz, EvidenceWork& work) noexcept;
  void add_tile(const ScanTiles& scan_tiles, const Tile* from, const std::array<int, 3>& offset,
                int tiles, EvidenceWork& work) noexcept;

  KernelStrip strip_{};
  KernelShape kernel_{};
  KernelReach reach_{};
};

}  // namespace tessera
