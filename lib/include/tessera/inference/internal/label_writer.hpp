// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Writes the label evidence of the points in the tiles: each octet of the map is touched once a
// scan, with the scan's sums complete.
#pragma once

#include <span>

#include "tessera/inference/internal/scan_work.hpp"
#include "tessera/inference/internal/strip_writer.hpp"
#include "tessera/inference/label_field.hpp"

namespace tessera {

class LabelWriter {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(InferenceMode mode) noexcept {
    return arena_bytes<OctetEvidence>(1) +
           (mode == InferenceMode::kKernel ? StripWriter::required_bytes() : 0) +
           (mode == InferenceMode::kLattice ? LabelField::required_bytes() : 0);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<LabelWriter> make(Arena& arena,
                                                const InferenceConfig& config) noexcept;
  /// No memory: for maps and tiles without points alone.
  LabelWriter() noexcept = default;

  /// Begins a scan of a map. O(C).
  void begin(const LocalMap& map, KernelReach reach) noexcept;
  /// Writes the wanted units of all tiles, whose blocks are open: nearest first where there is a
  /// deadline, and what it leaves out is counted. Room was reserved before: a write that fails is
  /// counted as a fault. Cost: 7 e^3 evaluations for a point (multi-entropy, unit edge e), one
  /// (counting), or as StripWriter::write_all(). The clock is read once a tile.
  void write(LocalMap& map, ScanTiles& tiles, const VoxelCoord& origin_voxel, ScanWork& time,
             ScanReport& report) noexcept;

 private:
  void write_units(LocalMap& map, const ScanTiles& tiles, const Tile& tile, EvidenceWork& work,
                   ScanReport& report) noexcept;
  void write_octets(LocalMap& map, const ScanTiles& tiles, const Tile& tile, EvidenceWork& work,
                    ScanReport& report) noexcept;

  InferenceConfig config_{};
  std::span<OctetEvidence> octet_;  ///< Sums of the current octet.
  StripWriter strips_{};            ///< In the kernel mode.
  LabelField field_{};              ///< In the lattice mode.
  bool votes_ = false;              ///< Labels are of field_.
  AddOctetPoints wide_ = nullptr;   ///< Of this machine.
};

}  // namespace tessera
