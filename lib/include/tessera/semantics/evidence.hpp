// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Evidence in transit: one voxel's counts as they are read, and one octet's counts of a scan before
// they are merged.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "tessera/base/lanes.hpp"
#include "tessera/grid/lattice.hpp"
#include "tessera/semantics/class_table.hpp"

namespace tessera {

/// One voxel's counts sigma_0 .. sigma_{C+1}, without the prior.
struct VoxelEvidence {
  int num_components = 0;
  /// Label evidence that the map no longer keeps apart by class: part of the total and of
  /// occupancy, of no class. 0 from a dense map.
  float rest = 0.0F;
  std::array<float, kMaxComponents> sigma{};

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
  /// component: one of components().
  [[nodiscard]] const Plane& read(int component) const noexcept {
    return planes_[static_cast<std::size_t>(component)];
  }
  [[nodiscard]] std::uint64_t components() const noexcept { return components_; }

  /// The voxels that any label component was added to, a bit each.
  [[nodiscard]] unsigned voxels() const noexcept {
    unsigned mask = 0;
    for (std::uint64_t rest = components_ & ~std::uint64_t{1}; rest != 0; rest &= rest - 1) {
      const Plane& plane = planes_[static_cast<std::size_t>(std::countr_zero(rest))];
      mask |= bits_above(plane.data(), 0.0F);
    }
    return mask;
  }

  /// Back to nothing touched. O(1).
  void clear() noexcept { components_ = 0; }

 private:
  std::uint64_t components_ = 0;
  alignas(32) std::array<Plane, kMaxComponents> planes_{};
};

}  // namespace tessera
