// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/label_writer.hpp"

#include <bit>
#include <utility>

#include "octet_points.hpp"
#include "tessera/inference/internal/write_in_time.hpp"
#include "tessera/map/internal/block_editor.hpp"

namespace tessera {

namespace {

/// A unit's points and those of its face neighbours; shift takes a neighbour's coordinates into the
/// unit's tile.
struct UnitPoints {
  const UnitSample* own = nullptr;
  std::array<const UnitSample*, 6> faces{};
  std::array<Point3f, 6> shift{};
};

/// Of a tile's units, by face, those whose neighbour there has points.
std::array<std::uint64_t, 6> with_neighbours(const ScanTiles& tiles, const Tile& tile) noexcept {
  std::array<std::uint64_t, 6> faces{};
  for (std::size_t face = 0; face < faces.size(); ++face) {
    const Tile* const beside = tiles.beside(tile, face);
    faces[face] = beside == nullptr ? 0 : beside->occupied;
  }
  return neighbour_masks(tile.occupied, faces);
}

/// neighbours: with_neighbours() of the tile.
void look_around(const ScanTiles& tiles, const Tile& tile,
                 const std::array<std::uint64_t, 6>& neighbours, int unit,
                 UnitPoints& around) noexcept {
  for (std::size_t face = 0; face < 6; ++face) {
    if ((neighbours[face] & unit_bit(unit)) == 0) continue;
    const std::size_t axis = face / 2;
    const int direction = (face & 1U) != 0 ? 1 : -1;
    const int step = 1 << (2 * axis);
    const int along = (unit >> (2 * axis)) & 3;
    const bool inside = along + direction >= 0 && along + direction <= 3;
    const Tile& from = inside ? tile : *tiles.beside(tile, face);
    const int neighbour = inside ? unit + direction * step : unit - direction * 3 * step;
    around.faces[face] = &tiles.sample(from, neighbour);
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

/// Which points a unit learns from, and at which length. False: from none. neighbours:
/// with_neighbours() of the tile.
bool decide_unit(const ScanTiles& tiles, const Tile& tile, const InferenceConfig& config,
                 const std::array<std::uint64_t, 6>& neighbours, int unit, UnitPoints& around,
                 EntropyDecision& decision) noexcept {
  // Most units learn from their own points alone.
  if (around.own == nullptr || around.own->class_entropy > config.entropy.smooth_above)
    look_around(tiles, tile, neighbours, unit, around);
  decision = decide(config.entropy, around.own, around.faces);
  return decision.length_voxels > 0.0F;
}

/// Calls add(points, shift) for the points that were decided on.
template <class Add>
void for_points(const ScanTiles& tiles, const UnitPoints& around, const EntropyDecision& decision,
                Add&& add) noexcept {
  if (decision.own) add(points_of(tiles, around.own), Point3f(0.0F, 0.0F, 0.0F));
  for (std::size_t face = 0; decision.neighbours && face < 6; ++face) {
    if (around.faces[face] != nullptr)
      add(points_of(tiles, around.faces[face]), around.shift[face]);
  }
}

/// The kernel's sums of one octet of a unit, of the points that were decided on.
void sum_points(const ScanTiles& tiles, const UnitPoints& around, const EntropyDecision& decision,
                const KernelShape& kernel, AddOctetPoints wide, const OctetPlace& octet,
                OctetEvidence& sums, EvidenceWork& work) noexcept {
  if (wide == nullptr) {
    for_points(tiles, around, decision,
               [&](std::span<const TilePoint> points, const Point3f& shift) {
                 add_points(points, shift, octet, kernel, nullptr, sums, work);
               });
    return;
  }
  OctetPoints all = octet_points(octet, kernel, sums);
  for_points(tiles, around, decision, [&](std::span<const TilePoint> points, const Point3f& shift) {
    add_points(points, shift, octet, wide, all, work);
  });
  sums.set_touched(all.components);
}

/// Makes evidence of classes evidence of one, so that a tuple has room for it.
void gather_classes(int classes, std::uint8_t into, OctetEvidence& evidence) noexcept {
  const std::uint64_t of_classes =
      evidence.components() & ((std::uint64_t{2} << static_cast<unsigned>(classes)) - 2);
  if (of_classes == 0 || of_classes == std::uint64_t{1} << into) return;
  OctetEvidence::Plane sums{};
  for (std::uint64_t rest = of_classes; rest != 0; rest &= rest - 1) {
    const OctetEvidence::Plane& more = evidence.read(std::countr_zero(rest));
    for (std::size_t v = 0; v < sums.size(); ++v) sums[v] += more[v];
  }
  evidence.forget(of_classes);
  evidence.assign(into, sums);
}

void count_cut(const ScanTiles& tiles, const Tile& tile, ScanReport& report) noexcept {
  ++report.tiles_cut;
  if (tile.occupied == 0) return;
  const std::uint32_t begin = tiles.sample(tile, std::countr_zero(tile.occupied)).begin;
  const std::uint32_t end = tiles.sample(tile, 63 - std::countl_zero(tile.occupied)).end;
  report.points_cut += end - begin;
}

}  // namespace

Result<LabelWriter> LabelWriter::make(Arena& arena, const InferenceConfig& config) noexcept {
  LabelWriter writer;
  writer.config_ = config;
  writer.octet_ = arena.take<OctetEvidence>(1);
  writer.wide_ = widest_octet_points();
  if (config.mode == InferenceMode::kLattice) {
    const Result<LabelField> field = LabelField::make(arena);
    if (!field.ok()) return field.status();
    writer.field_ = *field;
  }
  if (config.mode != InferenceMode::kKernel) return writer;
  const Result<StripWriter> strips = StripWriter::make(arena);
  if (!strips.ok()) return strips.status();
  writer.strips_ = *strips;
  return writer;
}

void LabelWriter::begin(const LocalMap& map, KernelReach reach) noexcept {
  const double resolution_m = map.lattice().resolution_m();
  const double length = static_cast<double>(config_.kernel_length_m) / resolution_m;
  strips_.begin(config_, static_cast<float>(length), reach);
  votes_ = config_.mode == InferenceMode::kLattice && map.keeps_votes();
  if (votes_) field_.begin(config_.lattice, map.classes(), resolution_m);
}

void LabelWriter::write(LocalMap& map, ScanTiles& tiles, const VoxelCoord& origin_voxel,
                        ScanWork& time, ScanReport& report) noexcept {
  EvidenceWork work;
  const bool kernel = config_.mode == InferenceMode::kKernel;
  const bool by_octets = config_.mode != InferenceMode::kCounting && tiles.unit_edge() == 2;
  // All votes before the first label: what a tile's labels are does not depend on the order.
  if (votes_) report.write_faults += LabelField::vote(map, tiles);
  const auto write = [&](const Tile& tile) {
    if (tile.wanted == 0) return;
    const Tile* const alone = &tile;
    if (kernel)
      strips_.write(map, tiles, {&alone, 1}, work, report);
    else if (by_octets)
      write_octets(map, tiles, tile, work, report);
    else
      write_units(map, tiles, tile, work, report);
  };
  const auto leave = [&](const Tile& tile) {
    if (tile.wanted != 0) count_cut(tiles, tile, report);
  };
  if (kernel && !time.has_deadline()) {
    strips_.write_all(map, tiles, work, report);
  } else {
    const ScanTiles& all = tiles;
    write_in_time(all.tiles(), ScanTiles::place_of(origin_voxel, tiles.unit_edge()).tile, 1, time,
                  write, leave);
  }
  if (votes_) {
    for (const Tile& tile : std::as_const(tiles).tiles())
      if (tile.wanted != 0 && tile.blocks[0] != 0) map.close_empty_label_layers(tile.blocks[0]);
  }
  report.voxel_updates = work.updates;
  report.evaluations = work.evaluations;
}

void LabelWriter::write_units(LocalMap& map, const ScanTiles& tiles, const Tile& tile,
                              EvidenceWork& work, ScanReport& report) noexcept {
  const bool counting = config_.mode == InferenceMode::kCounting;
  const std::array<std::uint64_t, 6> neighbours = with_neighbours(tiles, tile);
  for (std::uint64_t rest = tile.wanted; rest != 0; rest &= rest - 1) {
    const int unit = std::countr_zero(rest);
    UnitPoints around;
    if ((tile.occupied & unit_bit(unit)) != 0) around.own = &tiles.sample(tile, unit);
    EntropyDecision decision;
    if (!counting && !decide_unit(tiles, tile, config_, neighbours, unit, around, decision))
      continue;
    const UnitOctets octets = octets_of_unit(unit, tiles.unit_edge());
    for (const OctetPlace& octet : octets.places()) {
      OctetEvidence& sums = octet_[0];
      sums.clear();
      if (counting) {
        count_points(points_of(tiles, around.own), octet, config_.min_weight, sums, work);
      } else {
        sum_points(tiles, around, decision, kernel_shape(config_, decision.length_voxels), wide_,
                   octet, sums, work);
      }
      if (sums.components() == 0) continue;
      if (around.own != nullptr)
        sums.set_centroids(centroids_of(points_of(tiles, around.own), octet));
      const BlockOctet at = locate(tile, octet, tiles.unit_edge());
      const SlabHandle block = tile.blocks[static_cast<std::size_t>(at.block)];
      if (block == 0) continue;  // beyond the grid's edge, where only coarse units reach
      const Status status = map.add_labels(block, at.octet, sums);
      TESSERA_ASSERT(status == Status::kOk);
      ++(status == Status::kOk ? report.label_octets : report.write_faults);
    }
  }
}

/// Units of two voxels are octets, and tiles are blocks. Room was reserved before anything was
/// written, so this does not fail.
void LabelWriter::write_octets(LocalMap& map, const ScanTiles& tiles, const Tile& tile,
                               EvidenceWork& work, ScanReport& report) noexcept {
  if (votes_) field_.look(map, tile.coord, LabelField::layers_of(tile.wanted));
  if (tile.blocks[0] == 0) return;
  OctetWriter octets(map, tile.blocks[0]);
  const std::array<std::uint64_t, 6> neighbours = with_neighbours(tiles, tile);
  OctetEvidence& sums = octet_[0];
  for (std::uint64_t rest = tile.wanted; rest != 0; rest &= rest - 1) {
    const int unit = std::countr_zero(rest);
    octets.prefetch(unit);
    UnitPoints around;
    if ((tile.occupied & unit_bit(unit)) != 0) around.own = &tiles.sample(tile, unit);
    EntropyDecision decision;
    if (!decide_unit(tiles, tile, config_, neighbours, unit, around, decision)) continue;
    const OctetPlace octet = octet_of_unit(unit);
    sums.clear();
    sum_points(tiles, around, decision, kernel_shape(config_, decision.length_voxels), wide_, octet,
               sums, work);
    if (sums.components() == 0) continue;
    if (around.own != nullptr)
      sums.set_centroids(centroids_of(points_of(tiles, around.own), octet));
    LabelShares shares;
    if (votes_) shares = field_.shares(unit);
    if (shares.count != 0) gather_classes(map.classes().num_classes(), shares.labels[0], sums);
    const Status status = octets.add(unit, sums, shares);
    TESSERA_ASSERT(status == Status::kOk);
    ++(status == Status::kOk ? report.label_octets : report.write_faults);
  }
}

}  // namespace tessera
