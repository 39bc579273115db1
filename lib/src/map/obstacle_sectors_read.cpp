// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>

#include "tessera/map/obstacle_sectors.hpp"

namespace tessera {
namespace {

/// A bit for each byte that is not zero, the first one lowest.
std::uint64_t nonzero_bytes(std::uint64_t word) noexcept {
  std::uint64_t bits = 0;
  for (unsigned i = 0; i < 8; ++i)
    bits |= std::uint64_t{((word >> (8 * i)) & 0xffU) != 0 ? 1U : 0U} << i;
  return bits;
}

/// Columns (bit 8 * y + x) of an octet's voxels that a mask of its voxels names.
std::uint64_t columns_of(int octet, unsigned voxels) noexcept {
  const unsigned flat = (voxels | voxels >> 4U) & 0xfU;  // Those above each other.
  const auto x = static_cast<unsigned>((octet & 3) << 1);
  const auto y = static_cast<unsigned>(((octet >> 2) & 3) << 1);
  return std::uint64_t{flat & 3U} << (8 * y + x) | std::uint64_t{flat >> 2U} << (8 * (y + 1) + x);
}

}  // namespace

/// False iff a block was busy; then nothing of the column is counted, and it may be read again.
bool ObstacleSectors::read_column(MapReader& reader, const Column& column) noexcept {
  std::uint64_t known = 0;
  for (std::int32_t z = first_block_z_; z <= last_block_z_; ++z) {
    ++current().blocks;
    const Result<BlockSnapshot> block = reader.snapshot({column.x, column.y, z}, workspace_);
    if (!block.ok()) {
      ++current().busy;
      return false;
    }
    if (!block->empty()) read_block(*block, known);
  }
  ++current().columns;
  count_known(column, known);
  return true;
}

void ObstacleSectors::read_block(const BlockSnapshot& block, std::uint64_t& known) noexcept {
  ++current().present;
  const std::int32_t bottom = block.coord().z * kBlockEdge;
  const std::int32_t low = std::max<std::int32_t>(low_z_ - bottom, 0);
  const std::int32_t high = std::min<std::int32_t>(high_z_ - bottom, kBlockEdge - 1);
  const std::span<const std::byte> rows = block.free_rows();
  std::array<std::uint64_t, kBlockEdge> passed{};  // By y, over the layers of the band.
  for (std::int32_t z = low; z <= high; ++z) {
    for (std::size_t y = 0; y < kBlockEdge; ++y) {
      std::uint64_t row = 0;
      std::memcpy(&row, &rows[(static_cast<std::size_t>(z) * kBlockEdge + y) * kBlockEdge], 8);
      passed[y] |= row;
    }
  }
  for (std::size_t y = 0; y < kBlockEdge; ++y) known |= nonzero_bytes(passed[y]) << (8 * y);
  for (int octet = 0; octet < kBlockOctets; ++octet) {
    unsigned labelled = block.observed_labels(octet);
    const std::int32_t z = ((octet >> 4) & 3) << 1;
    if (z < low) labelled &= 0xf0U;
    if (z + 1 < low) labelled = 0;
    if (z + 1 > high) labelled &= 0x0fU;
    if (z > high) labelled = 0;
    known |= columns_of(octet, labelled);
    unsigned candidates = labelled;
    if (!only_labels_occupy_) candidates = 0xff;
    for (; candidates != 0; candidates &= candidates - 1) {
      const VoxelCoord voxel = voxel_at(block.coord(), octet, std::countr_zero(candidates));
      if (voxel.z >= low_z_ && voxel.z <= high_z_) read_voxel(block, voxel);
    }
  }
}

void ObstacleSectors::read_voxel(const BlockSnapshot& block, VoxelCoord voxel) noexcept {
  const double resolution_m = lattice_.resolution_m();
  const Point3d center = lattice_.center_of(voxel);
  const double x = center.x() - x_m_;
  const double y = center.y() - y_m_;
  const double distance_m = std::sqrt(squared_norm(x, y, 0.0));
  if (distance_m > config_.max_range_m || distance_m < config_.own_radius_m) return;
  const Touched touched = touched_by(x - resolution_m / 2.0, y - resolution_m / 2.0, resolution_m);
  const auto sector_at = [&](int i) {
    return static_cast<std::size_t>((touched.first + i) % config_.count);
  };
  bool nearer = false;
  for (int i = 0; i < touched.count; ++i) nearer |= distance_m <= nearest_m_[sector_at(i)];
  if (!nearer) return;
  ++current().voxels_read;
  const Estimate found =
      estimate(block.evidence(octet_in_block(voxel), voxel_in_octet(voxel)), reading_);
  if (found.state != VoxelState::kOccupied) return;
  const auto place = [](VoxelCoord v) { return std::array{v.z, v.y, v.x}; };
  for (int i = 0; i < touched.count; ++i) {
    ObstacleSector& sector = current().sectors[sector_at(i)];
    double& nearest_m = nearest_m_[sector_at(i)];
    // Of those that are as near, the surest; so it does not matter which one comes first.
    const bool wins =
        distance_m < nearest_m ||
        (distance_m == nearest_m &&
         (found.occupancy > sector.occupancy ||
          (found.occupancy == sector.occupancy && place(voxel) < place(sector.voxel))));
    if (!wins) continue;
    nearest_m = distance_m;
    sector.occupied = true;
    sector.distance_m = std::max(0.0, distance_m - resolution_m * std::sqrt(0.5));
    sector.voxel = voxel;
    sector.label = found.label;
    sector.probability = found.probability;
    sector.occupancy = found.occupancy;
  }
}

void ObstacleSectors::count_known(const Column& column, std::uint64_t known) noexcept {
  for (int bit = 0; bit < kBlockEdge * kBlockEdge; ++bit) {
    const VoxelCoord voxel{column.x * kBlockEdge + (bit & 7), column.y * kBlockEdge + (bit >> 3),
                           0};
    const Point3d center = lattice_.center_of(voxel);
    const double x = center.x() - x_m_;
    const double y = center.y() - y_m_;
    const double distance_m = std::sqrt(squared_norm(x, y, 0.0));
    if (distance_m >= config_.max_range_m || distance_m < config_.own_radius_m) continue;
    const auto ring = static_cast<std::size_t>(
        std::min<std::int32_t>(floor_to_int(distance_m / config_.ring_m), kMostRings - 1));
    Share& counted = share(static_cast<std::size_t>(sector_of(x, y)), ring);
    ++counted.all;
    counted.known += static_cast<std::uint32_t>((known >> static_cast<unsigned>(bit)) & 1U);
  }
}

}  // namespace tessera
