// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The dense count tuple: a float for each of the components 1 .. C + 1 of each voxel, exact to
// float addition. Eight voxels of an octet lie together, a plane of eight counts a component, so
// that adding a scan writes only the planes of the classes it saw; the cap reads all. Most octets
// only ever see one component: the first that an octet gets has its plane beside the header, and
// those of the others follow in their order.
//
// A tuple policy is a type with the static functions of this one. Component 0 (free) is never part
// of a tuple.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "tessera/base/internal/shared_words.hpp"
#include "tessera/semantics/estimate.hpp"
#include "tessera/semantics/evidence.hpp"

namespace tessera {

class DenseTuple {
 public:
  using Plane = OctetEvidence::Plane;

  /// The header and the first component's plane.
  static constexpr std::size_t kFirstBytes = 64;

  /// Bytes of an octet of tuples with num_components = C + 2 components.
  [[nodiscard]] static constexpr std::uint32_t octet_bytes(int num_components) noexcept {
    return static_cast<std::uint32_t>(kHeaderBytes +
                                      static_cast<std::size_t>(num_components - 1) * sizeof(Plane));
  }

  /// Bytes of a new octet that must be zero: its header. Planes that its mask does not name may
  /// be anything.
  [[nodiscard]] static constexpr std::uint32_t zeroed_bytes() noexcept { return kHeaderBytes; }

  /// Adds evidence, plane by plane, and returns what label_sums is then. Component 0 of added is
  /// ignored. Voxels that it adds to have the nearer centroid then. Evidence: OctetEvidence or
  /// OctetOfBlock. O(components in added or present).
  template <class Evidence>
  static Plane add(std::byte* octet, const Evidence& added) noexcept {
    const std::uint64_t labels = added.components() & ~std::uint64_t{1};
    const Header header = header_for(octet, labels);
    const std::uint64_t present = header.components;
    Plane sums{};
    unsigned given = 0;
    for (std::uint64_t rest = labels | present; rest != 0; rest &= rest - 1) {
      const std::uint64_t bit = rest & (~rest + 1);
      std::byte* const plane = octet + header.offset(std::countr_zero(rest));
      Plane counts{};
      if ((present & bit) != 0) std::memcpy(&counts, plane, sizeof(counts));
      if ((labels & bit) != 0) {
        const Plane& more = added.read(std::countr_zero(rest));
        given |= bits_above(more.data(), 0.0F);
        for (std::size_t v = 0; v < kOctetVoxels; ++v)
          counts[v] = counts[v] + more[v] < kLargestCount ? counts[v] + more[v] : kLargestCount;
        store_shared_words(plane, &counts, sizeof(counts));
      }
      for (std::size_t v = 0; v < kOctetVoxels; ++v) sums[v] += counts[v];
    }
    Header now{present | labels, header.first, header.centroids};
    const OctetCentroids seen = added.centroids();
    for (std::size_t v = 0; v < kOctetVoxels; ++v)
      if (((given >> v) & 1U) != 0) now.centroids[v] = now.centroids[v].nearer(seen[v]);
    if (now != header) set_header(octet, now);
    return sums;
  }

  /// Prefetches the planes in use. O(components present in the octet).
  static void prefetch_planes(const std::byte* octet) noexcept {
    const Header header = header_of(octet);
    for (std::uint64_t rest = header.components; rest != 0; rest &= rest - 1)
      __builtin_prefetch(octet + header.offset(std::countr_zero(rest)), 1);
  }

  /// Sum over the components of each voxel, in component order. O(components present in the octet).
  [[nodiscard]] static Plane label_sums(const std::byte* octet) noexcept {
    Plane sums{};
    for_planes(octet, [&](int, const std::byte* plane) {
      for (int v = 0; v < kOctetVoxels; ++v)
        sums[static_cast<std::size_t>(v)] += count_at(plane, v);
    });
    return sums;
  }

  /// Multiplies one voxel's counts by factor in [0, 1]. What is then under kLeastCount becomes 0.
  static void scale(std::byte* octet, int voxel, float factor) noexcept {
    Header header = header_of(octet);
    bool any = false;
    for (std::uint64_t rest = header.components; rest != 0; rest &= rest - 1) {
      std::byte* const plane = octet + header.offset(std::countr_zero(rest));
      const float scaled = count_at(plane, voxel) * factor;
      set_count(plane, voxel, scaled >= kLeastCount ? scaled : 0.0F);
      any = any || scaled >= kLeastCount;
    }
    Centroid& centroid = header.centroids[static_cast<std::size_t>(voxel)];
    if (any || !centroid.known()) return;
    centroid = {};
    set_header(octet, header);
  }

  /// Whether a tuple can have these: all are counts (is_count), and there is no rest.
  /// O(components).
  [[nodiscard]] static bool holds(const VoxelEvidence& evidence) noexcept {
    for (int l = 1; l < evidence.num_components; ++l)
      if (!is_count(evidence.sigma[static_cast<std::size_t>(l)])) return false;
    return evidence.rest == 0.0F;
  }
  /// Sets a voxel without evidence to counts that a tuple can have, or to sums of such: these end
  /// at kLargestCount.
  static void restore(std::byte* octet, int voxel, const VoxelEvidence& evidence) noexcept {
    Header header = header_of(octet);
    for (int l = 1; l < evidence.num_components; ++l) {
      const float count = evidence.sigma[static_cast<std::size_t>(l)];
      if (!(count > 0.0F)) continue;
      const std::uint64_t bit = std::uint64_t{1} << static_cast<unsigned>(l);
      if (header.components == 0) header.first = static_cast<std::uint64_t>(l);
      std::byte* const plane = octet + header.offset(l);
      if ((header.components & bit) == 0) clear_shared_words(plane, sizeof(Plane));
      set_count(plane, voxel, count < kLargestCount ? count : kLargestCount);
      header.components |= bit;
      header.centroids[static_cast<std::size_t>(voxel)] = evidence.centroid;
    }
    set_header(octet, header);
  }

  /// Copies of an octet that may be written meanwhile (shared_words.hpp) what its mask names.
  static void copy_shared(const std::byte* octet, std::byte* to, int num_components) noexcept {
    load_shared_words(to, octet, sizeof(Header));
    Header header = header_of(to);
    const std::uint64_t known = (std::uint64_t{2} << static_cast<unsigned>(num_components - 1)) - 2;
    header.components &= known;
    // Anything may be found where a block was given back meanwhile.
    if (header.first >= std::uint64_t{kMaxComponents} ||
        ((header.components >> header.first) & 1U) == 0)
      header = {};
    set_header(to, header);
    for (std::uint64_t rest = header.components; rest != 0; rest &= rest - 1) {
      const std::size_t at = header.offset(std::countr_zero(rest));
      load_shared_words(to + at, octet + at, sizeof(Plane));
    }
  }

  /// Writes one voxel's counts into sigma[1 .. C + 1]; entries of absent components are left as
  /// they are.
  static void read(const std::byte* octet, int voxel, VoxelEvidence& into) noexcept {
    for_planes(octet, [&](int component, const std::byte* plane) {
      into.sigma[static_cast<std::size_t>(component)] = count_at(plane, voxel);
    });
    into.centroid = centroids(octet)[static_cast<std::size_t>(voxel)];
  }
  [[nodiscard]] static OctetCentroids centroids(const std::byte* octet) noexcept {
    return header_of(octet).centroids;
  }

  /// Calls label(component, count) for each component that a voxel has. O(components present).
  template <class Label>
  static void visit(const std::byte* octet, int voxel, Label&& label) noexcept {
    for_planes(octet, [&](int component, const std::byte* plane) {
      const float count = count_at(plane, voxel);
      if (count > 0.0F) label(component, count);
    });
  }

  /// Adds one voxel's counts. O(components present in the octet).
  static void summarize(const std::byte* octet, int voxel, CountSummary& into) noexcept {
    for_planes(octet, [&](int component, const std::byte* plane) {
      into.add(component, count_at(plane, voxel));
    });
  }

 private:
  /// Padded so that planes are 32-byte aligned.
  static constexpr std::size_t kHeaderBytes = 32;

  struct Header {
    std::uint64_t components = 0;  ///< Those that any voxel of the octet has, a bit each.
    std::uint64_t first = 0;       ///< The one that came first; 0 while there is none.
    OctetCentroids centroids{};

    [[nodiscard]] std::size_t offset(int component) const noexcept {
      const auto l = static_cast<std::uint64_t>(component);
      const std::uint64_t place = l == first ? 0 : l + (l < first ? 1 : 0) - 1;
      return kHeaderBytes + static_cast<std::size_t>(place) * sizeof(Plane);
    }
    bool operator==(const Header&) const noexcept = default;
  };

  [[nodiscard]] static Header header_of(const std::byte* octet) noexcept {
    Header header;
    std::memcpy(&header, octet, sizeof(header));
    return header;
  }
  /// The octet's, or for one that has no component what it is once it has these.
  [[nodiscard]] static Header header_for(const std::byte* octet, std::uint64_t labels) noexcept {
    Header header = header_of(octet);
    if (header.components == 0) header.first = static_cast<std::uint64_t>(std::countr_zero(labels));
    return header;
  }
  /// Planes are words to those who share them, so a count is copied out, never read in place.
  [[nodiscard]] static float count_at(const std::byte* plane, int voxel) noexcept {
    float count = 0.0F;
    std::memcpy(&count, plane + static_cast<std::size_t>(voxel) * sizeof(count), sizeof(count));
    return count;
  }
  /// Calls visit(component, its plane) for all that are there, in ascending order.
  template <class Visit>
  static void for_planes(const std::byte* octet, Visit&& visit) noexcept {
    const Header header = header_of(octet);
    const std::byte* const first = octet + kHeaderBytes;
    constexpr auto kStride = static_cast<std::ptrdiff_t>(sizeof(Plane));
    const std::uint64_t below = (std::uint64_t{1} << header.first) - 1;
    // Planes of components under the first one lie one place further than those above it.
    for (std::uint64_t rest = header.components & below; rest != 0; rest &= rest - 1)
      visit(std::countr_zero(rest), first + std::countr_zero(rest) * kStride);
    if (header.components == 0) return;
    visit(static_cast<int>(header.first), first);
    const std::byte* const before = first - kStride;
    for (std::uint64_t rest = header.components & ~below & ~(below + 1); rest != 0;
         rest &= rest - 1)
      visit(std::countr_zero(rest), before + std::countr_zero(rest) * kStride);
  }
  static void set_header(std::byte* octet, const Header& header) noexcept {
    store_shared_words(octet, &header, sizeof(header));
  }
  /// By the word: two counts share one.
  static void set_count(std::byte* plane, int voxel, float count) noexcept {
    std::array<float, 2> pair{};
    std::byte* const word = plane + static_cast<std::size_t>(voxel / 2) * sizeof(pair);
    std::memcpy(&pair, word, sizeof(pair));
    pair[static_cast<std::size_t>(voxel % 2)] = count;
    store_shared_words(word, &pair, sizeof(pair));
  }
};

}  // namespace tessera
