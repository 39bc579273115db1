// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures/ply_mesh.hpp"

#include <cmath>
#include <cstddef>
#include <utility>

namespace tessera {
namespace {

constexpr double kFarthestVoxels = 1.0e6;

/// Points of a cube of 2 x 2 x 2 fall next to each other: neighbours are looked up together, so
/// this saves cache misses.
std::uint64_t hash_of(const LatticePoint& p, std::uint64_t salt) {
  std::uint64_t h = salt;
  std::uint64_t within = 0;
  for (const std::int32_t value : {p.x, p.y, p.z}) {
    const auto bits = static_cast<std::uint32_t>(value);
    h = (h ^ (bits >> 1U)) * 0x9E3779B97F4A7C15ULL;
    h ^= h >> 32U;
    within = within << 1U | (bits & 1U);
  }
  return h << 3U | within;
}

std::uint64_t hash_of(const LatticePoint& p) { return hash_of(p, 0); }

std::uint64_t hash_of(const MeshCorner& corner) {
  const std::uint64_t color = static_cast<std::uint64_t>(corner.color.r) << 16U |
                              static_cast<std::uint64_t>(corner.color.g) << 8U | corner.color.b;
  return hash_of(corner.at, color);
}

/// A set of items that numbers them in order of arrival. The table has only the numbers, the items
/// are in a vector, which its users get without a copy.
template <class Item>
class NumberedSet {
 public:
  static constexpr std::uint32_t kAbsent = 0xFFFFFFFFU;

  NumberedSet() : slots_(1U << 10U, kAbsent) {}

  /// The item's number, kAbsent if it is not in the set.
  [[nodiscard]] std::uint32_t find(const Item& item) const { return slots_[slot_of(item)]; }
  std::uint32_t insert(const Item& item) {
    const std::size_t slot = slot_of(item);
    if (slots_[slot] != kAbsent) return slots_[slot];
    const auto number = static_cast<std::uint32_t>(items_.size());
    slots_[slot] = number;
    items_.push_back(item);
    if (2 * items_.size() > slots_.size()) grow();
    return number;
  }
  [[nodiscard]] const std::vector<Item>& items() const { return items_; }
  [[nodiscard]] std::vector<Item> take_items() && { return std::move(items_); }

 private:
  /// Slot of the item, or a free one for it. At least half of the slots are free, so the search
  /// ends.
  [[nodiscard]] std::size_t slot_of(const Item& item) const {
    const std::size_t mask = slots_.size() - 1;
    std::size_t slot = static_cast<std::size_t>(hash_of(item)) & mask;
    while (slots_[slot] != kAbsent && !(items_[slots_[slot]] == item)) slot = (slot + 1) & mask;
    return slot;
  }
  void grow() {
    slots_.assign(2 * slots_.size(), kAbsent);
    for (std::size_t i = 0; i < items_.size(); ++i) {
      slots_[slot_of(items_[i])] = static_cast<std::uint32_t>(i);
    }
  }

  std::vector<std::uint32_t> slots_;
  std::vector<Item> items_;
};

/// A face of the unit cube: the way to the neighbour behind it, and its corners counter-clockwise
/// from outside.
struct CubeFace {
  LatticePoint towards;
  std::array<LatticePoint, 4> corners;
};

constexpr std::array<CubeFace, 6> kCubeFaces = {{
    {{1, 0, 0}, {{{1, 0, 0}, {1, 1, 0}, {1, 1, 1}, {1, 0, 1}}}},
    {{-1, 0, 0}, {{{0, 0, 0}, {0, 0, 1}, {0, 1, 1}, {0, 1, 0}}}},
    {{0, 1, 0}, {{{0, 1, 0}, {0, 1, 1}, {1, 1, 1}, {1, 1, 0}}}},
    {{0, -1, 0}, {{{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}}}},
    {{0, 0, 1}, {{{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}}},
    {{0, 0, -1}, {{{0, 0, 0}, {0, 1, 0}, {1, 1, 0}, {1, 0, 0}}}},
}};

LatticePoint sum(const LatticePoint& a, const LatticePoint& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}

/// The voxels' lattice, found from the first of them: a caller's centres may be offset against the
/// origin.
struct Lattice {
  std::array<double, 3> first_m{};
  double resolution_m = 1.0;

  /// False if the voxel is too far from the first one.
  bool locate(const PlyVoxel& voxel, LatticePoint& at) const {
    const double x = std::round((static_cast<double>(voxel.x) - first_m[0]) / resolution_m);
    const double y = std::round((static_cast<double>(voxel.y) - first_m[1]) / resolution_m);
    const double z = std::round((static_cast<double>(voxel.z) - first_m[2]) / resolution_m);
    if (std::abs(x) > kFarthestVoxels || std::abs(y) > kFarthestVoxels ||
        std::abs(z) > kFarthestVoxels) {
      return false;
    }
    at = {static_cast<std::int32_t>(x), static_cast<std::int32_t>(y), static_cast<std::int32_t>(z)};
    return true;
  }
};

Lattice make_lattice(std::span<const PlyVoxel> voxels, float resolution_m) {
  Lattice lattice;
  lattice.resolution_m = static_cast<double>(resolution_m);
  for (const PlyVoxel& voxel : voxels) {
    if (!is_finite(voxel)) continue;
    lattice.first_m = {static_cast<double>(voxel.x), static_cast<double>(voxel.y),
                       static_cast<double>(voxel.z)};
    break;
  }
  return lattice;
}

}  // namespace

VoxelMesh make_voxel_mesh(std::span<const PlyVoxel> voxels, float resolution_m) {
  const Lattice lattice = make_lattice(voxels, resolution_m);
  VoxelMesh mesh;
  for (std::size_t i = 0; i < 3; ++i)
    mesh.origin_m[i] = lattice.first_m[i] - 0.5 * lattice.resolution_m;
  NumberedSet<LatticePoint> occupied;
  std::vector<Color> colors;
  for (const PlyVoxel& voxel : voxels) {
    LatticePoint at;
    const bool placed = is_finite(voxel) && lattice.locate(voxel, at);
    if (placed && occupied.insert(at) == colors.size()) {
      colors.push_back(voxel.color);
    } else {
      ++mesh.left_out;
    }
  }
  mesh.voxels = colors.size();
  NumberedSet<MeshCorner> corners;
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const LatticePoint at = occupied.items()[i];
    for (const CubeFace& face : kCubeFaces) {
      if (occupied.find(sum(at, face.towards)) != NumberedSet<LatticePoint>::kAbsent) continue;
      std::array<std::uint32_t, 4> quad{};
      for (std::size_t k = 0; k < 4; ++k) {
        quad[k] = corners.insert({sum(at, face.corners[k]), colors[i]});
      }
      mesh.quads.push_back(quad);
    }
  }
  mesh.corners = std::move(corners).take_items();
  return mesh;
}

}  // namespace tessera
