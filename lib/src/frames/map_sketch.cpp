// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/map_sketch.hpp"

#include <bit>
#include <cmath>

#include "tessera/base/internal/digest.hpp"

namespace tessera {

namespace {

constexpr std::array<std::size_t, 6> kFirst{0, 0, 0, 1, 1, 2};
constexpr std::array<std::size_t, 6> kSecond{0, 1, 2, 1, 2, 2};
/// Places in voxels are summed up in this share of a voxel, as whole numbers.
constexpr std::int64_t kSteps = std::int64_t{2} * Centroid::kLevels;

/// Whether a key is among the one in 2^levels that are kept.
constexpr bool is_kept(std::uint64_t key, unsigned levels) noexcept {
  return (mix64(key + 1) & ((std::uint64_t{1} << levels) - 1)) == 0;
}

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
}

void MapSketch::add(const LocalMap& map, SlabHandle handle) noexcept {
  const Block& block = map.block_at(handle);
  const BlockCoord at = unpack(BlockKey{block.key});
  const int voxels_cell = kPartsEdge * voxels_part_;
  const int cells_edge = kBlockEdge / voxels_cell;
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): all are initialised
  std::array<CellSums, 8> cells{};
  for (int octet = 0; octet < kBlockOctets; ++octet) {
    const unsigned labelled = map.observed_labels(block, octet);
    const OctetCentroids centroids = labelled != 0 ? map.centroids(block, octet) : OctetCentroids{};
    for (int v = 0; v < kOctetVoxels; ++v) {
      const bool has_labels = ((labelled >> static_cast<unsigned>(v)) & 1U) != 0;
      if (!has_labels && map.free_passes(block, octet, v) == 0) continue;
      const Estimate estimate = map.query(block, voxel_at(at, octet, v));
      if (map.classes().moves(estimate.label)) continue;
      const VoxelCoord in_block = voxel_at({0, 0, 0}, octet, v);
      const VoxelCoord cell{in_block.x / voxels_cell, in_block.y / voxels_cell,
                            in_block.z / voxels_cell};
      const VoxelCoord local{in_block.x % voxels_cell, in_block.y % voxels_cell,
                             in_block.z % voxels_cell};
      const int part =
          local.x / voxels_part_ +
          kPartsEdge * (local.y / voxels_part_ + kPartsEdge * (local.z / voxels_part_));
      cells[static_cast<std::size_t>(cell.x + cells_edge * (cell.y + cells_edge * cell.z))].add(
          estimate, local, centroids[static_cast<std::size_t>(v)],
          std::uint64_t{1} << static_cast<unsigned>(part));
    }
  }
  for (int n = 0; n < cells_edge * cells_edge * cells_edge; ++n) {
    add_cell(cells[static_cast<std::size_t>(n)],
             {at.x * cells_edge + n % cells_edge, at.y * cells_edge + n / cells_edge % cells_edge,
              at.z * cells_edge + n / (cells_edge * cells_edge)});
  }
}

void MapSketch::add_cell(const CellSums& sums, VoxelCoord cell) noexcept {
  const Result<BlockKey> key = pack({cell.x, cell.y, cell.z});
  if (!key.ok() || (sums.occupied | sums.free) == 0) return;
  const std::uint64_t free = sums.free & ~sums.occupied;
  if (sums.occupied == 0) return keep_free({key->bits, free});
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
}

void MapSketch::keep_surface(const Surface& surface) noexcept {
  if (!is_kept(surface.key, surface_levels_)) return;
  while (surface_count_ == kMostSurfaces) {
    ++surface_levels_;
    std::uint32_t kept = 0;
    for (std::uint32_t i = 0; i < surface_count_; ++i) {
      if (is_kept(surfaces_[i].key, surface_levels_)) surfaces_[kept++] = surfaces_[i];
    }
    surface_count_ = kept;
    if (!is_kept(surface.key, surface_levels_)) return;
  }
  surfaces_[surface_count_++] = surface;
}

void MapSketch::keep_free(const FreeCell& cell) noexcept {
  if (!is_kept(cell.key, free_levels_)) return;
  while (free_count_ == kMostFreeCells) {
    ++free_levels_;
    std::uint32_t kept = 0;
    for (std::uint32_t i = 0; i < free_count_; ++i) {
      if (is_kept(free_cells_[i].key, free_levels_)) free_cells_[kept++] = free_cells_[i];
    }
    free_count_ = kept;
    if (!is_kept(cell.key, free_levels_)) return;
  }
  free_cells_[free_count_++] = cell;
}

void MapSketch::finish(std::span<KeyedIndex> scratch) noexcept {
  TESSERA_ASSERT(scratch.size() >= kScratch);
  const std::span<KeyedIndex> items = scratch.first(surface_count_);
  for (std::uint32_t i = 0; i < surface_count_; ++i) items[i] = {surfaces_[i].key, i};
  radix_sort(items, scratch.subspan(kMostSurfaces));
  for (std::uint32_t& entry : table_) entry = 0;
  for (std::uint32_t i = 0; i < surface_count_; ++i) {
    order_[i] = items[i].index;
    enter(items[i].key, items[i].index + 1);
  }
  for (std::uint32_t i = 0; i < free_count_; ++i) enter(free_cells_[i].key, kFreeBit | (i + 1));
}

void MapSketch::enter(std::uint64_t key, std::uint32_t entry) noexcept {
  auto place = static_cast<std::uint32_t>(mix64(key) >> 32U) % kBuckets;
  while (table_[place] != 0) place = (place + 1) % kBuckets;
  table_[place] = entry;
}

std::uint32_t MapSketch::entry_of(VoxelCoord cell) const noexcept {
  const Result<BlockKey> key = pack({cell.x, cell.y, cell.z});
  if (!key.ok()) return 0;
  auto place = static_cast<std::uint32_t>(mix64(key->bits) >> 32U) % kBuckets;
  for (std::uint32_t entry = table_[place]; entry != 0; entry = table_[place]) {
    const std::uint64_t found = (entry & kFreeBit) != 0 ? free_cells_[(entry & ~kFreeBit) - 1].key
                                                        : surfaces_[entry - 1].key;
    if (found == key->bits) return entry;
    place = (place + 1) % kBuckets;
  }
  return 0;
}

const MapSketch::Surface* MapSketch::find_surface(VoxelCoord cell) const noexcept {
  const std::uint32_t entry = entry_of(cell);
  return entry == 0 || (entry & kFreeBit) != 0 ? nullptr : &surfaces_[entry - 1];
}

MapSketch::Parts MapSketch::parts(VoxelCoord cell) const noexcept {
  const std::uint32_t entry = entry_of(cell);
  if (entry == 0) return {};
  if ((entry & kFreeBit) != 0) return {0, free_cells_[(entry & ~kFreeBit) - 1].free, nullptr};
  const Surface& surface = surfaces_[entry - 1];
  return {surface.occupied, surface.free, &surface};
}

}  // namespace tessera
