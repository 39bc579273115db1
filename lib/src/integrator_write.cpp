// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Writing: each octet of the map is touched once a scan, with the scan's sums complete.
#include "tessera/inference/integrator.hpp"

namespace tessera {

namespace {

constexpr std::array<BlockCoord, 6> kFaces{BlockCoord{-1, 0, 0}, BlockCoord{1, 0, 0},
                                           BlockCoord{0, -1, 0}, BlockCoord{0, 1, 0},
                                           BlockCoord{0, 0, -1}, BlockCoord{0, 0, 1}};

}  // namespace

void Integrator::write_labels(LocalMap& map, ScanReport& report) noexcept {
  EvidenceWork work;
  for (const Tile& tile : tiles_.tiles()) {
    if (tile.wanted == 0) continue;
    if (config_.mode == InferenceMode::kKernel) {
      write_kernel_tile(map, tile, work, report);
    } else {
      write_units(map, tile, work, report);
    }
  }
  report.voxel_updates = work.updates;
  report.evaluations = work.evaluations;
}

void Integrator::write_units(LocalMap& map, const Tile& tile, EvidenceWork& work,
                             ScanReport& report) noexcept {
  const int edge = tiles_.unit_edge();
  const std::span<const TilePoint> points = tiles_.points();
  std::array<const Tile*, 6> beside;
  for (std::size_t face = 0; face < 6; ++face) {
    const BlockCoord& step = kFaces[face];
    beside[face] =
        tiles_.find({tile.coord.x + step.x, tile.coord.y + step.y, tile.coord.z + step.z});
  }
  for (std::uint64_t rest = tile.wanted; rest != 0; rest &= rest - 1) {
    const int unit = std::countr_zero(rest);
    const auto bit_of = [](int u) { return std::uint64_t{1} << static_cast<unsigned>(u); };
    const UnitSample* const own =
        (tile.occupied & bit_of(unit)) != 0 ? &tiles_.sample(tile, unit) : nullptr;
    std::array<const UnitSample*, 6> faces{};
    std::array<Point3f, 6> shift{};
    EntropyDecision decision{.own = true};
    if (config_.mode == InferenceMode::kMultiEntropy) {
      for (std::size_t face = 0; face < 6; ++face) {
        const std::size_t axis = face / 2;
        const int direction = (face & 1U) != 0 ? 1 : -1;
        const int step = 1 << (2 * axis);
        const int along = (unit >> (2 * axis)) & 3;
        const bool inside = along + direction >= 0 && along + direction <= 3;
        const Tile* const from = inside ? &tile : beside[face];
        const int neighbour = inside ? unit + direction * step : unit - direction * 3 * step;
        if (from == nullptr || (from->occupied & bit_of(neighbour)) == 0) continue;
        faces[face] = &tiles_.sample(*from, neighbour);
        shift[face] = Point3f::Zero();
        if (!inside)
          shift[face][static_cast<Eigen::Index>(axis)] =
              static_cast<float>(direction * tiles_.tile_edge());
      }
      decision = decide(config_.entropy, own, faces);
      if (!(decision.length_voxels > 0.0F)) continue;
    }
    std::array<OctetPlace, 8> octets;
    const int n = octets_of_unit(unit, edge, octets);
    for (int i = 0; i < n; ++i) {
      const OctetPlace& octet = octets[static_cast<std::size_t>(i)];
      OctetEvidence& sums = octets_[0];
      sums.clear();
      if (config_.mode == InferenceMode::kCounting) {
        count_points(points.subspan(own->begin, own->end - own->begin), octet, config_.min_weight,
                     sums, work);
      } else {
        const KernelShape kernel = shape(decision.length_voxels);
        if (decision.own)
          add_points(points.subspan(own->begin, own->end - own->begin), Point3f::Zero(), octet,
                     kernel, sums, work);
        for (std::size_t face = 0; decision.neighbours && face < 6; ++face) {
          if (faces[face] == nullptr) continue;
          add_points(points.subspan(faces[face]->begin, faces[face]->end - faces[face]->begin),
                     shift[face], octet, kernel, sums, work);
        }
      }
      if (sums.components() == 0) continue;
      const BlockOctet at = locate(tile, octet, edge);
      const SlabHandle block = tile.blocks[static_cast<std::size_t>(at.block)];
      if (block == 0) continue;
      const Status status = map.add_labels(block, at.octet, sums);
      TESSERA_ASSERT(status == Status::kOk);
      static_cast<void>(status);
      ++report.label_octets;
    }
  }
}

void Integrator::write_kernel_tile(LocalMap& map, const Tile& tile, EvidenceWork& work,
                                   ScanReport& report) noexcept {
  const double resolution_m = map.lattice().resolution_m();
  const float radius = kernel_radius_;
  const KernelShape kernel =
      shape(static_cast<float>(static_cast<double>(config_.kernel_length_m) / resolution_m));
  const int reach_tiles = (kernel_reach_units_ + 3) / 4;
  kernel_tile_.clear();
  for (int dz = -reach_tiles; dz <= reach_tiles; ++dz) {
    for (int dy = -reach_tiles; dy <= reach_tiles; ++dy) {
      for (int dx = -reach_tiles; dx <= reach_tiles; ++dx) {
        const Tile* const from =
            tiles_.find({tile.coord.x + dx, tile.coord.y + dy, tile.coord.z + dz});
        if (from == nullptr || from->occupied == 0) continue;
        const Point3f shift(static_cast<float>(dx * kBlockEdge),
                            static_cast<float>(dy * kBlockEdge),
                            static_cast<float>(dz * kBlockEdge));
        const auto first = tiles_.sample(*from, std::countr_zero(from->occupied)).begin;
        const auto end = tiles_.sample(*from, 63 - std::countl_zero(from->occupied)).end;
        kernel_tile_.add_points(tiles_.points().subspan(first, end - first), shift, radius, kernel,
                                work);
      }
    }
  }
  for (std::uint64_t rest = tile.wanted; rest != 0; rest &= rest - 1) {
    const int octet = std::countr_zero(rest);
    OctetEvidence& sums = octets_[0];
    sums.clear();
    if (!kernel_tile_.read(octet, sums)) continue;
    const Status status = map.add_labels(tile.blocks[0], octet, sums);
    TESSERA_ASSERT(status == Status::kOk);
    static_cast<void>(status);
    ++report.label_octets;
  }
}

void Integrator::write_free_space(LocalMap& map, ScanReport& report) noexcept {
  for (const RayBlock& ray_block : free_space_.blocks()) {
    if (ray_block.block == 0) continue;
    VoxelMask carved;
    for (std::size_t z = 0; z < carved.size(); ++z)
      carved[z] = ray_block.passed[z] & ~ray_block.hit[z];
    const Status status = map.add_free_pass(ray_block.block, carved);
    TESSERA_ASSERT(status == Status::kOk);
    static_cast<void>(status);
    ++report.free_blocks;
  }
  report.rays = static_cast<std::uint32_t>(admitted_count_ + ray_count_);
  report.ray_steps = free_space_.steps();
}

void Integrator::close_unwritten_blocks(LocalMap& map) noexcept {
  if (tiles_.unit_edge() == 1)
    return map.close_empty_blocks();  // tiles share blocks: a handle must be closed once
  for (const Tile& tile : tiles_.tiles()) {
    for (const SlabHandle block : tile.blocks) {
      if (block != 0) map.close_if_empty(block);
    }
  }
}

}  // namespace tessera
