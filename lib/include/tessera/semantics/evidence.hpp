// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Evidence in transit: one voxel's counts as they are read, and one octet's counts of a scan before
// they are merged.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "tessera/base/internal/lanes.hpp"
#include "tessera/grid/centroid.hpp"
#include "tessera/grid/lattice.hpp"
#include "tessera/semantics/class_table.hpp"

namespace tessera {

/// A count of label evidence is 0 or in [kLeastCount, kLargestCount], wherever it is kept or comes
/// from: a scan, another robot, a file. Under the floor a count is nothing: of a smaller sum the
/// inverse can be infinite, and diffusion would carry that to all neighbours. What is summed up
/// beyond the ceiling stays there, so that sums over all contributions are finite.
inline constexpr float kLeastCount = 0x1p-60F;
inline constexpr float kLargestCount = 0x1p30F;
/// NaN is none.
[[nodiscard]] constexpr bool is_count(float value) noexcept {
  return value == 0.0F || (value >= kLeastCount && value <= kLargestCount);
}

/// One voxel's counts sigma_0 .. sigma_{C+1}, without the prior.
struct VoxelEvidence {
  int num_components = 0;
  /// Label evidence that the map no longer keeps apart by class: part of the total and of
  /// occupancy, of no class. 0 from a dense map.
  float rest = 0.0F;
  std::array<float, kMaxComponents> sigma{};
  Centroid centroid{};  ///< Where its returns were; with label evidence alone.

  /// Sum of all counts, in component order, then the rest.
  [[nodiscard]] double total() const noexcept {
    double sum = 0.0;
    for (std::size_t l = 0; l < static_cast<std::size_t>(num_components); ++l) {
      sum += static_cast<double>(sigma[l]);
    }
    return sum + static_cast<double>(rest);
  }
};

/// What one scan adds to the eight voxels of an octet: a plane of eight counts for each component.
class OctetEvidence {
 public:
  using Plane = std::array<float, kOctetVoxels>;

  /// The plane of a component, which from now on counts as touched; zeros at first.
  Plane& plane(int component) noexcept {
    const std::uint64_t bit = std::uint64_t{1} << static_cast<unsigned>(component);
    Plane& plane = planes_[static_cast<std::size_t>(component)];
    if ((components_ & bit) == 0) plane = Plane{};
    components_ |= bit;
    return plane;
  }
  /// Sets the plane of a component.
  void assign(int component, const Plane& counts) noexcept {
    components_ |= std::uint64_t{1} << static_cast<unsigned>(component);
    planes_[static_cast<std::size_t>(component)] = counts;
  }
  /// The planes one after the other, for loops that touch them as plane() does: those of components
  /// that were not touched mean nothing. Afterwards set_touched() says which are.
  [[nodiscard]] float* planes() noexcept { return planes_[0].data(); }
  void set_touched(std::uint64_t components) noexcept { components_ = components; }
  /// component: one of components().
  [[nodiscard]] const Plane& read(int component) const noexcept {
    return planes_[static_cast<std::size_t>(component)];
  }
  [[nodiscard]] std::uint64_t components() const noexcept { return components_; }
  /// Where this scan's returns in the voxels are.
  [[nodiscard]] const OctetCentroids& centroids() const noexcept { return centroids_; }
  void set_centroids(const OctetCentroids& centroids) noexcept { centroids_ = centroids; }

  /// Whether plane 0 has evidence of no class that is not to be kept apart (TilePoint).
  [[nodiscard]] bool has_rest() const noexcept { return (components_ & 1U) != 0; }

  /// As if nothing had been added of these components. O(1).
  void forget(std::uint64_t components) noexcept { components_ &= ~components; }
  /// Back to nothing touched. O(1).
  void clear() noexcept {
    components_ = 0;
    centroids_ = {};
  }

 private:
  std::uint64_t components_ = 0;
  OctetCentroids centroids_{};
  alignas(32) std::array<Plane, kMaxComponents> planes_{};
};

/// The voxels of an octet that any label component is added to, a bit each.
template <class Evidence>
[[nodiscard]] unsigned labelled_voxels(const Evidence& added) noexcept {
  unsigned mask = 0;
  for (std::uint64_t rest = added.components() & ~std::uint64_t{1}; rest != 0; rest &= rest - 1) {
    const OctetEvidence::Plane& plane = added.read(std::countr_zero(rest));
    mask |= bits_above(plane.data(), 0.0F);
  }
  return mask;
}

/// What one scan adds to a block of 8 x 8 x 8 voxels, where it was summed up: for each component,
/// rows of sums along x.
struct BlockEvidence {
  const float* sums = nullptr;  ///< Of component 0, at the block's first voxel.
  std::size_t row = 0;          ///< From a row to the next one: y + 8 z.
  std::size_t component = 0;    ///< From a component to the next one.
  std::uint64_t components = 0;
  /// Of each component, the rows that may hold anything, a bit each; stride from one to the next.
  const std::uint64_t* touched = nullptr;
  std::size_t touched_stride = 1;
  bool has_rest = false;  ///< As OctetEvidence.
  /// Where returns are in the voxels, in row order; null: not known of any.
  const Centroid* centroids = nullptr;

  [[nodiscard]] OctetEvidence::Plane read(int octet, int of_component) const noexcept {
    const float* const from = sums + first_row(octet) * row +
                              static_cast<std::size_t>(2 * (octet & 3)) +
                              static_cast<std::size_t>(of_component) * component;
    OctetEvidence::Plane plane;
    // Pairs along x of two rows of each of two slices.
    std::memcpy(plane.data(), from, 8);
    std::memcpy(&plane[2], from + row, 8);
    std::memcpy(&plane[4], from + kBlockEdge * row, 8);
    std::memcpy(&plane[6], from + (kBlockEdge + 1) * row, 8);
    return plane;
  }
  /// Those with anything to add to an octet. O(components).
  [[nodiscard]] std::uint64_t components_of(int octet) const noexcept {
    const std::uint64_t rows = std::uint64_t{0x303} << first_row(octet);
    std::uint64_t found = 0;
    for (std::uint64_t rest = components; rest != 0; rest &= rest - 1) {
      const int c = std::countr_zero(rest);
      if ((touched[static_cast<std::size_t>(c) * touched_stride] & rows) != 0 &&
          bits_above(read(octet, c).data(), 0.0F) != 0)
        found |= rest & (~rest + 1);
    }
    return found;
  }
  [[nodiscard]] OctetCentroids centroids_of(int octet) const noexcept {
    OctetCentroids found{};
    for (int v = 0; centroids != nullptr && v < kOctetVoxels; ++v)
      found[static_cast<std::size_t>(v)] = centroids[row_order(octet, v)];
    return found;
  }

 private:
  [[nodiscard]] static constexpr unsigned first_row(int octet) noexcept {
    return static_cast<unsigned>(2 * ((octet >> 2) & 3) + 2 * kBlockEdge * (octet >> 4));
  }
};

/// One octet of it.
class OctetOfBlock {
 public:
  [[nodiscard]] bool has_rest() const noexcept { return block_.has_rest; }
  /// components: components_of the octet.
  OctetOfBlock(const BlockEvidence& block, int octet, std::uint64_t components) noexcept
      : block_(block), octet_(octet), components_(components) {}
  [[nodiscard]] std::uint64_t components() const noexcept { return components_; }
  [[nodiscard]] OctetEvidence::Plane read(int component) const noexcept {
    return block_.read(octet_, component);
  }
  [[nodiscard]] OctetCentroids centroids() const noexcept { return block_.centroids_of(octet_); }

 private:
  const BlockEvidence& block_;
  int octet_;
  std::uint64_t components_;
};

}  // namespace tessera
