// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The dense count tuple: a float for each of the components 1 .. C + 1 of each voxel, exact to
// float addition. Eight voxels of an octet lie together, a plane of eight counts a component, so
// that adding a scan writes only the planes of the classes it saw; the cap reads all.
//
// A tuple policy is a type with the static functions of this one. Component 0 (free) is never part
// of a tuple.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "tessera/base/shared_words.hpp"
#include "tessera/semantics/estimate.hpp"
#include "tessera/semantics/evidence.hpp"

namespace tessera {

class DenseTuple {
 public:
  using Plane = OctetEvidence::Plane;

  /// Bytes of an octet of tuples with num_components = C + 2 components.
  [[nodiscard]] static constexpr std::uint32_t octet_bytes(int num_components) noexcept {
    return static_cast<std::uint32_t>(kHeaderBytes +
                                      static_cast<std::size_t>(num_components - 1) * sizeof(Plane));
  }

  /// Bytes of a new octet that must be zero: its mask. Planes that it does not name may be
  /// anything.
  [[nodiscard]] static constexpr std::uint32_t zeroed_bytes() noexcept { return kHeaderBytes; }

  /// Adds evidence, plane by plane, and returns what label_sums is then. Component 0 of added is
  /// ignored. O(components in added or present).
  static Plane add(std::byte* octet, const OctetEvidence& added) noexcept {
    const std::uint64_t labels = added.components() & ~std::uint64_t{1};
    const std::uint64_t present = components(octet);
    Plane sums{};
    for (std::uint64_t rest = labels | present; rest != 0; rest &= rest - 1) {
      const std::uint64_t bit = rest & (~rest + 1);
      const int component = std::countr_zero(rest);
      Plane counts{};
      if ((present & bit) != 0) counts = read_plane(octet, component);
      if ((labels & bit) != 0) {
        const Plane& more = added.read(component);
        for (std::size_t v = 0; v < kOctetVoxels; ++v) counts[v] += more[v];
        store_shared_words(octet + offset(component), &counts, sizeof(counts));
      }
      for (std::size_t v = 0; v < kOctetVoxels; ++v) sums[v] += counts[v];
    }
    if ((labels & ~present) != 0) set_components(octet, present | labels);
    return sums;
  }

  /// Sum over the components of each voxel, in component order. O(components present in the octet).
  [[nodiscard]] static Plane label_sums(const std::byte* octet) noexcept {
    Plane sums{};
    for (std::uint64_t rest = components(octet); rest != 0; rest &= rest - 1) {
      const float* const counts = plane(octet, std::countr_zero(rest));
      for (std::size_t v = 0; v < kOctetVoxels; ++v) sums[v] += counts[v];
    }
    return sums;
  }

  /// Multiplies one voxel's counts by factor in [0, 1].
  static void scale(std::byte* octet, int voxel, float factor) noexcept {
    for (std::uint64_t rest = components(octet); rest != 0; rest &= rest - 1) {
      const int component = std::countr_zero(rest);
      set_count(octet, component, voxel, plane(octet, component)[voxel] * factor);
    }
  }

  /// Whether a tuple can have these counts: a dense one has no rest.
  [[nodiscard]] static bool holds(const VoxelEvidence& evidence) noexcept {
    return !(evidence.rest > 0.0F);
  }
  /// Sets a voxel without evidence to counts that a tuple can have.
  static void restore(std::byte* octet, int voxel, const VoxelEvidence& evidence) noexcept {
    std::uint64_t present = components(octet);
    for (int l = 1; l < evidence.num_components; ++l) {
      const float count = evidence.sigma[static_cast<std::size_t>(l)];
      if (!(count > 0.0F)) continue;
      const std::uint64_t bit = std::uint64_t{1} << static_cast<unsigned>(l);
      if ((present & bit) == 0) clear_shared_words(octet + offset(l), sizeof(Plane));
      set_count(octet, l, voxel, count);
      present |= bit;
    }
    set_components(octet, present);
  }

  /// Copies of an octet that may be written meanwhile (shared_words.hpp) what its mask names.
  static void copy_shared(const std::byte* octet, std::byte* to, int num_components) noexcept {
    load_shared_words(to, octet, sizeof(std::uint64_t));
    const std::uint64_t known = (std::uint64_t{2} << static_cast<unsigned>(num_components - 1)) - 2;
    for (std::uint64_t rest = components(to) & known; rest != 0; rest &= rest - 1) {
      const std::size_t at = offset(std::countr_zero(rest));
      load_shared_words(to + at, octet + at, sizeof(Plane));
    }
  }

  /// Writes one voxel's counts into sigma[1 .. C + 1]; entries of absent components are left as
  /// they are.
  static void read(const std::byte* octet, int voxel, VoxelEvidence& into) noexcept {
    for (std::uint64_t rest = components(octet); rest != 0; rest &= rest - 1) {
      const int component = std::countr_zero(rest);
      into.sigma[static_cast<std::size_t>(component)] = plane(octet, component)[voxel];
    }
  }

  /// Adds one voxel's counts. O(components present in the octet).
  static void summarize(const std::byte* octet, int voxel, CountSummary& into) noexcept {
    for (std::uint64_t rest = components(octet); rest != 0; rest &= rest - 1) {
      const int component = std::countr_zero(rest);
      into.add(component, plane(octet, component)[voxel]);
    }
  }

 private:
  /// The mask of components that any voxel of the octet has, padded so that planes are 32-byte
  /// aligned.
  static constexpr std::size_t kHeaderBytes = 32;

  [[nodiscard]] static std::uint64_t components(const std::byte* octet) noexcept {
    std::uint64_t mask = 0;
    std::memcpy(&mask, octet, sizeof(mask));
    return mask;
  }
  static void set_components(std::byte* octet, std::uint64_t mask) noexcept {
    store_shared_words(octet, &mask, sizeof(mask));
  }
  [[nodiscard]] static Plane read_plane(const std::byte* octet, int component) noexcept {
    Plane counts{};
    std::memcpy(&counts, octet + offset(component), sizeof(counts));
    return counts;
  }
  /// By the word: two counts share one.
  static void set_count(std::byte* octet, int component, int voxel, float count) noexcept {
    std::array<float, 2> pair{};
    std::byte* const word =
        octet + offset(component) + static_cast<std::size_t>(voxel / 2) * sizeof(pair);
    std::memcpy(&pair, word, sizeof(pair));
    pair[static_cast<std::size_t>(voxel % 2)] = count;
    store_shared_words(word, &pair, sizeof(pair));
  }
  [[nodiscard]] static const float* plane(const std::byte* octet, int component) noexcept {
    return reinterpret_cast<const float*>(octet + offset(component));
  }
  [[nodiscard]] static std::size_t offset(int component) noexcept {
    return kHeaderBytes + static_cast<std::size_t>(component - 1) * sizeof(Plane);
  }
};

}  // namespace tessera
