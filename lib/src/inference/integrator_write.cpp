// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Writing: each octet of the map is touched once a scan, with the scan's sums complete.
#include "tessera/inference/integrator.hpp"
#include "write_in_time.hpp"

namespace tessera {

namespace {

/// A unit's points and those of its face neighbours; shift takes a neighbour's coordinates into the
/// unit's tile.
struct UnitPoints {
  const UnitSample* own = nullptr;
  std::array<const UnitSample*, 6> faces{};
  std::array<Point3f, 6> shift{};
};

void look_around(const ScanTiles& tiles, const Tile& tile, int unit, UnitPoints& around) noexcept {
  for (std::size_t face = 0; face < 6; ++face) {
    const std::size_t axis = face / 2;
    const int direction = (face & 1U) != 0 ? 1 : -1;
    const int step = 1 << (2 * axis);
    const int along = (unit >> (2 * axis)) & 3;
    const bool inside = along + direction >= 0 && along + direction <= 3;
    const Tile* const from = inside ? &tile : tiles.beside(tile, face);
    const int neighbour = inside ? unit + direction * step : unit - direction * 3 * step;
    if (from == nullptr || (from->occupied & unit_bit(neighbour)) == 0) continue;
    around.faces[face] = &tiles.sample(*from, neighbour);
    around.shift[face] = Point3f::Zero();
    if (!inside)
      around.shift[face][static_cast<Eigen::Index>(axis)] =
          static_cast<float>(direction * tiles.tile_edge());
  }
}

std::span<const TilePoint> points_of(const ScanTiles& tiles, const UnitSample* sample) noexcept {
  if (sample == nullptr) return {};
  return tiles.points().subspan(sample->begin, sample->end - sample->begin);
}

/// The kernel's sums of one octet of a unit, of the points that were decided on.
void sum_points(const ScanTiles& tiles, const UnitPoints& around, const EntropyDecision& decision,
                const KernelShape& kernel, const OctetPlace& octet, OctetEvidence& sums,
                EvidenceWork& work) noexcept {
  if (decision.own)
    add_points(points_of(tiles, around.own), Point3f::Zero(), octet, kernel, sums, work);
  for (std::size_t face = 0; decision.neighbours && face < 6; ++face) {
    if (around.faces[face] == nullptr) continue;
    add_points(points_of(tiles, around.faces[face]), around.shift[face], octet, kernel, sums, work);
  }
}

}  // namespace

void Integrator::write(LocalMap& map, ScanReport& report) noexcept {
  write_labels(map, report);
  if (config_.free_space.enabled) write_free_space(map, report);
}

void Integrator::write_labels(LocalMap& map, ScanReport& report) noexcept {
  EvidenceWork work;
  const bool kernel = config_.mode == InferenceMode::kKernel;
  const auto write = [&](const Tile& tile) {
    if (tile.wanted == 0) return;
    const Tile* const alone = &tile;
    kernel ? write_strip(map, {&alone, 1}, work, report) : write_units(map, tile, work, report);
  };
  const auto leave = [&](const Tile& tile) {
    if (tile.wanted != 0) count_cut_tile(tile, report);
  };
  if (kernel && deadline_ == nullptr) {
    write_strips(map, work, report);
  } else {
    const ScanTiles& tiles = tiles_;
    write_in_time(tiles.tiles(), sensor_place(false), 1, write, leave);
  }
  report.voxel_updates = work.updates;
  report.evaluations = work.evaluations;
}

void Integrator::write_units(LocalMap& map, const Tile& tile, EvidenceWork& work,
                             ScanReport& report) noexcept {
  const bool counting = config_.mode == InferenceMode::kCounting;
  for (std::uint64_t rest = tile.wanted; rest != 0; rest &= rest - 1) {
    const int unit = std::countr_zero(rest);
    UnitPoints around;
    if ((tile.occupied & unit_bit(unit)) != 0) around.own = &tiles_.sample(tile, unit);
    EntropyDecision decision;
    if (!counting) {
      // Most units learn from their own points alone.
      if (around.own == nullptr || around.own->class_entropy > config_.entropy.smooth_above)
        look_around(tiles_, tile, unit, around);
      decision = decide(config_.entropy, around.own, around.faces);
      if (!(decision.length_voxels > 0.0F)) continue;
    }
    const UnitOctets octets = octets_of_unit(unit, tiles_.unit_edge());
    for (const OctetPlace& octet : octets.places()) {
      OctetEvidence& sums = octet_[0];
      sums.clear();
      if (counting) {
        count_points(points_of(tiles_, around.own), octet, config_.min_weight, sums, work);
      } else {
        sum_points(tiles_, around, decision, shape(decision.length_voxels), octet, sums, work);
      }
      if (sums.components() == 0) continue;
      const BlockOctet at = locate(tile, octet, tiles_.unit_edge());
      write_octet(map, tile.blocks[static_cast<std::size_t>(at.block)], at.octet, report);
    }
  }
}

/// Room was reserved before anything was written, so this does not fail.
void Integrator::write_octet(LocalMap& map, SlabHandle block, int octet,
                             ScanReport& report) noexcept {
  if (block == 0) return;  // beyond the grid's edge, where only coarse units reach
  const Status status = map.add_labels(block, octet, octet_[0]);
  TESSERA_ASSERT(status == Status::kOk);
  ++(status == Status::kOk ? report.label_octets : report.write_faults);
}

void Integrator::write_free_space(LocalMap& map, ScanReport& report) noexcept {
  const auto write = [&](const RayBlock& ray_block) {
    if (ray_block.block == 0) return;
    VoxelMask carved;
    for (std::size_t z = 0; z < carved.size(); ++z)
      carved[z] = ray_block.passed[z] & ~ray_block.hit[z];
    const Status status = map.add_free_pass(ray_block.block, carved);
    TESSERA_ASSERT(status == Status::kOk);
    ++(status == Status::kOk ? report.free_blocks : report.write_faults);
  };
  const auto leave = [&](const RayBlock& ray_block) {
    report.ray_blocks_cut += ray_block.block == 0 ? 0U : 1U;
  };
  const std::span<const RayBlock> blocks = free_space_.blocks();
  write_in_time(blocks, sensor_place(true), kBlockBatch, write, leave);
  report.rays_cut = static_cast<std::uint32_t>(rays_cut_);
  report.rays = static_cast<std::uint32_t>(admitted_count_ + ray_count_ - rays_cut_);
}

/// Blocks were opened by a bound; those that nothing was written to are taken back.
void Integrator::close_unwritten_blocks(LocalMap& map, bool all_written) noexcept {
  if (open_failed_) return map.close_empty_blocks();
  // Tiles and rays share blocks, and each must be closed once.
  const auto close = [&map](const BlockCoord& coord) {
    if (map.find(coord) != nullptr) map.close_if_empty(*map.open_block(coord));
  };
  const int edge = tiles_.unit_edge();
  for (const Tile& tile : tiles_.tiles()) {
    for (int i = 0; i < blocks_of_tile(edge); ++i) {
      const SlabHandle block = tile.blocks[static_cast<std::size_t>(i)];
      if (!all_written || (block != 0 && edge == 1)) {
        close(block_of_tile(tile.coord, edge, i));
      } else if (((unsigned{tile.opened} >> static_cast<unsigned>(i)) & 1U) != 0) {
        map.close_if_empty(block);
      }
    }
  }
  if (all_written || !config_.free_space.enabled) return;
  for (const RayBlock& ray_block : free_space_.blocks()) close(ray_block.coord);
}

}  // namespace tessera
