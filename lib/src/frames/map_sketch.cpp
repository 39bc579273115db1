// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/map_sketch.hpp"

#include <bit>
#include <cmath>

namespace tessera {

namespace {

constexpr std::array<std::size_t, 6> kFirst{0, 0, 0, 1, 1, 2};
constexpr std::array<std::size_t, 6> kSecond{0, 1, 2, 1, 2, 2};
/// Places in voxels are summed up in this share of a voxel, as whole numbers.
constexpr std::int64_t kSteps = std::int64_t{2} * Centroid::kLevels;

MapSketch::Kind kind_of(const Symmetric3& spread, const Eigen3& eigen, std::uint32_t voxels,
                        double cell_m) noexcept {
  const double upright_m = 0.2 * cell_m;
  if (spread[5] >= upright_m * upright_m) return MapSketch::Kind::kUpright;
  constexpr std::uint32_t kLeastVoxels = 4;
  constexpr double kSteep = 0.87;
  const double thin_m = 0.12 * cell_m;
  const double z = eigen.vectors[0].z();
  const bool is_flat = voxels >= kLeastVoxels && eigen.values[0] <= thin_m * thin_m &&
                       eigen.values[1] >= thin_m * thin_m / 4.0 && (z < 0.0 ? -z : z) >= kSteep;
  return is_flat ? MapSketch::Kind::kFlat : MapSketch::Kind::kOther;
}

/// How little a cell says of where its surface is: along an axis on which it goes through the cell
/// it goes on in the next one, and the mean is where the cell is, not the surface.
Symmetric3 looseness_of(const Eigen3& eigen, double cell_m) noexcept {
  const double through_m = 0.18 * cell_m;
  constexpr double kThrough = 16.0;
  Symmetric3 sum{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double value = eigen.values[axis] > 0.0 ? eigen.values[axis] : 0.0;
    const double loose = value >= through_m * through_m ? kThrough * value : value;
    const Point3d& v = eigen.vectors[axis];
    const std::array<double, 3> along{v.x(), v.y(), v.z()};
    for (std::size_t i = 0; i < 6; ++i) sum[i] += loose * along[kFirst[i]] * along[kSecond[i]];
  }
  return sum;
}

/// From the middle of a cell's occupied parts to that of its free ones, if that tells a side.
std::array<std::int8_t, 3> open_side(std::uint64_t occupied, std::uint64_t free) noexcept {
  const auto sum_of = [](std::uint64_t parts) {
    std::array<int, 3> sum{};
    for (; parts != 0; parts &= parts - 1) {
      const int part = std::countr_zero(parts);
      sum[0] += part % 4;
      sum[1] += part / 4 % 4;
      sum[2] += part / 16;
    }
    return sum;
  };
  const int taken = std::popcount(occupied);
  const int seen = std::popcount(free);
  if (taken == 0 || seen == 0) return {};
  const std::array<int, 3> of_taken = sum_of(occupied);
  const std::array<int, 3> of_seen = sum_of(free);
  std::array<double, 3> way{};
  for (std::size_t i = 0; i < 3; ++i)
    way[i] = static_cast<double>(of_seen[i]) / seen - static_cast<double>(of_taken[i]) / taken;
  const double length = std::sqrt(squared_norm(way[0], way[1], way[2]));
  constexpr double kLeastParts = 0.5;
  if (length < kLeastParts) return {};
  std::array<std::int8_t, 3> side{};
  for (std::size_t i = 0; i < 3; ++i)
    side[i] = static_cast<std::int8_t>(floor_to_int(100.0 * way[i] / length + 0.5));
  return side;
}

}  // namespace

struct MapSketch::CellSums {
  /// Whole numbers, so that a sum does not depend on the order.
  struct Moments {
    std::uint32_t count = 0;
    std::array<std::int64_t, 3> first{};
    std::array<std::int64_t, 6> second{};

    void add(const std::array<std::int64_t, 3>& place) noexcept {
      ++count;
      for (std::size_t i = 0; i < 3; ++i) first[i] += place[i];
      for (std::size_t i = 0; i < 6; ++i) second[i] += place[kFirst[i]] * place[kSecond[i]];
    }
  };

  std::uint64_t occupied = 0;
  std::uint64_t free = 0;
  Moments returns;  ///< Of voxels where it is known where the returns were.
  Moments all;
  std::array<std::uint16_t, kMaxComponents> labels{};

  /// local: the voxel's place in the cell. part: its bit.
  void add(const Estimate& estimate, VoxelCoord local, Centroid centroid,
           std::uint64_t part) noexcept {
    if (estimate.state == VoxelState::kFree) free |= part;
    if (estimate.state != VoxelState::kOccupied) return;
    occupied |= part;
    ++labels[static_cast<std::size_t>(estimate.label)];
    constexpr std::int64_t kMiddle = kSteps / 2;
    std::array<std::int64_t, 3> place{local.x, local.y, local.z};
    const std::array<int, 3> levels = centroid.known() ? centroid.levels() : std::array<int, 3>{};
    for (std::size_t i = 0; i < 3; ++i)
      place[i] = place[i] * kSteps + (centroid.known() ? 2 * levels[i] + 1 : kMiddle);
    all.add(place);
    if (centroid.known()) returns.add(place);
  }
};

Result<MapSketch> MapSketch::make(Arena& arena) noexcept {
  if (!arena.aligned() || arena.remaining_bytes() < required_bytes())
    return Status::kResourceExhausted;
  MapSketch result;
  result.surfaces_ = arena.take<Surface>(kMostSurfaces);
  result.free_cells_ = arena.take<FreeCell>(kMostFreeCells);
  result.order_ = arena.take<std::uint32_t>(kMostSurfaces);
  result.table_ = arena.take<std::uint32_t>(kBuckets);
  return result;
}

void MapSketch::begin(double resolution_m) noexcept {
  constexpr double kFine_m = 0.15;
  resolution_m_ = resolution_m;
  voxels_part_ = resolution_m < kFine_m ? 2 : 1;
  cell_m_ = resolution_m * kPartsEdge * voxels_part_;
  surface_count_ = free_count_ = 0;
  surface_levels_ = free_levels_ = 0;
  surface_hashes_ = free_hashes_ = {};
  owner_ = {};
  has_forgotten_ = is_finished_ = false;
}

MapSketch::BlockCells MapSketch::add(const LocalMap& map, SlabHandle handle) noexcept {
  const Block& block = map.block_at(handle);
  const BlockCoord at = unpack(BlockKey{block.key});
  const int part_shift = voxels_part_ - 1;  // a part is one voxel wide or two
  const int cell_shift = part_shift + 2;
  const int edge = cells_edge();
  const auto within = [&](VoxelCoord voxel, int shift, int mask) {
    return VoxelCoord{(voxel.x >> shift) & mask, (voxel.y >> shift) & mask,
                      (voxel.z >> shift) & mask};
  };
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): all are initialised
  std::array<CellSums, 8> cells{};
  for (int octet = 0; octet < kBlockOctets; ++octet) {
    const unsigned labelled = map.observed_labels(block, octet);
    const OctetCentroids centroids = labelled != 0 ? map.centroids(block, octet) : OctetCentroids{};
    for (int v = 0; v < kOctetVoxels; ++v) {
      const bool has_labels = ((labelled >> static_cast<unsigned>(v)) & 1U) != 0;
      if (!has_labels && map.free_passes(block, octet, v) == 0) continue;
      const VoxelCoord voxel = voxel_at(at, octet, v);
      Estimate estimate;
      // By far the most are free space without labels, of which the passes tell the state.
      estimate.state = has_labels ? VoxelState::kOccupied : map.state(block, voxel);
      if (estimate.state == VoxelState::kOccupied) estimate = map.query(block, voxel);
      if (estimate.state == VoxelState::kUnknown || map.classes().moves(estimate.label)) continue;
      const VoxelCoord in_block = voxel_at({0, 0, 0}, octet, v);
      const VoxelCoord cell = within(in_block, cell_shift, 7);
      const VoxelCoord part = within(in_block, part_shift, kPartsEdge - 1);
      cells[static_cast<std::size_t>(cell.x + edge * (cell.y + edge * cell.z))].add(
          estimate, within(in_block, 0, (kPartsEdge << part_shift) - 1),
          centroids[static_cast<std::size_t>(v)],
          std::uint64_t{1} << static_cast<unsigned>(part.x +
                                                    kPartsEdge * (part.y + kPartsEdge * part.z)));
    }
  }
  BlockCells kinds = 0;
  for (int n = 0; n < edge * edge * edge; ++n) {
    const CellKind kind = add_cell(cells[static_cast<std::size_t>(n)], cell_of_block(at, n, edge));
    kinds = static_cast<BlockCells>(kinds | static_cast<unsigned>(kind) << (2 * n));
  }
  is_finished_ = false;
  return kinds;
}

MapSketch::CellKind MapSketch::add_cell(const CellSums& sums, VoxelCoord cell) noexcept {
  const Result<BlockKey> key = pack({cell.x, cell.y, cell.z});
  if (!key.ok() || (sums.occupied | sums.free) == 0) return CellKind::kNone;
  const std::uint64_t free = sums.free & ~sums.occupied;
  if (sums.occupied == 0) {
    keep_free({key->bits, free});
    return CellKind::kFree;
  }
  constexpr std::uint32_t kLeastReturns = 3;
  const bool is_known = sums.returns.count >= kLeastReturns;
  const CellSums::Moments& moments = is_known ? sums.returns : sums.all;
  const double step_m = resolution_m_ / static_cast<double>(kSteps);
  const double n = moments.count;
  Surface surface{.key = key->bits, .occupied = sums.occupied, .free = free};
  std::array<double, 3> mean{};
  for (std::size_t i = 0; i < 3; ++i) {
    mean[i] = static_cast<double>(moments.first[i]) / n;
    surface.offset_m[i] = static_cast<float>(mean[i] * step_m);
  }
  const double within = is_known ? 0.0 : resolution_m_ * resolution_m_ / 12.0;
  Symmetric3 spread{};
  for (std::size_t i = 0; i < 6; ++i) {
    const double of_places =
        static_cast<double>(moments.second[i]) / n - mean[kFirst[i]] * mean[kSecond[i]];
    spread[i] = of_places * step_m * step_m + (kFirst[i] == kSecond[i] ? within : 0.0);
  }
  surface.open = open_side(sums.occupied, free);
  const Eigen3 eigen = eigen_of(spread);
  surface.kind = kind_of(spread, eigen, moments.count, cell_m_);
  surface.normal = {static_cast<float>(eigen.vectors[0].x()),
                    static_cast<float>(eigen.vectors[0].y()),
                    static_cast<float>(eigen.vectors[0].z())};
  const Symmetric3 looseness = looseness_of(eigen, cell_m_);
  for (std::size_t i = 0; i < 6; ++i) surface.looseness_m2[i] = static_cast<float>(looseness[i]);
  for (std::size_t label = 1; label < sums.labels.size(); ++label) {
    if (sums.labels[label] > sums.labels[surface.label])
      surface.label = static_cast<std::uint8_t>(label);
  }
  keep_surface(surface);
  return CellKind::kSurface;
}

}  // namespace tessera
