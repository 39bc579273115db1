// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map's count tuples, in the policy that its configuration chose. The choice is made once an
// octet, not once a voxel.
#pragma once

#include "tessera/semantics/internal/compact_tuple.hpp"
#include "tessera/semantics/internal/dense_tuple.hpp"

namespace tessera {

/// How a voxel's counts are stored.
enum class TuplePolicy : std::uint8_t {
  kDense = 0,    ///< A float for each component.
  kCompact = 1,  ///< Three (class, count) slots and a rest.
};

/// "dense" or "compact".
constexpr const char* to_string(TuplePolicy policy) noexcept {
  return policy == TuplePolicy::kDense ? "dense" : "compact";
}

class TupleStore {
 public:
  using Plane = OctetEvidence::Plane;

  /// Bytes of an octet of tuples with num_components = C + 2 components.
  [[nodiscard]] static constexpr std::uint32_t octet_bytes(TuplePolicy policy,
                                                           int num_components) noexcept {
    return policy == TuplePolicy::kDense ? DenseTuple::octet_bytes(num_components)
                                         : CompactTuple::kOctetBytes;
  }

  constexpr TupleStore() noexcept = default;
  /// max_evidence: the map's cap, 0 for none.
  TupleStore(TuplePolicy policy, float max_evidence) noexcept
      : policy_(policy), compact_(CompactTuple::quanta_per_unit(max_evidence)) {}

  /// Bytes of a new octet that must be zero before the first use.
  [[nodiscard]] constexpr std::uint32_t zeroed_bytes() const noexcept {
    return dense() ? DenseTuple::zeroed_bytes() : CompactTuple::kOctetBytes;
  }
  // As of the policy.
  /// Returns what label_sums is then.
  template <class Evidence>
  Plane add(std::byte* octet, const Evidence& added) const noexcept {
    return dense() ? DenseTuple::add(octet, added) : compact_.add(octet, added);
  }
  /// Adds evidence of no known class: a dense tuple, which has no rest, counts it as component C
  /// + 1.
  void add_rest(std::byte* octet, const Plane& counts, const OctetCentroids& centroids,
                int num_components) const noexcept {
    if (!dense()) return compact_.add_rest(octet, counts, centroids);
    OctetEvidence evidence;
    evidence.assign(num_components - 1, counts);
    evidence.set_centroids(centroids);
    static_cast<void>(DenseTuple::add(octet, evidence));
  }
  [[nodiscard]] Plane label_sums(const std::byte* octet) const noexcept {
    return dense() ? DenseTuple::label_sums(octet) : compact_.label_sums(octet);
  }
  [[nodiscard]] OctetCentroids centroids(const std::byte* octet) const noexcept {
    return dense() ? DenseTuple::centroids(octet) : CompactTuple::centroids(octet);
  }
  void scale(std::byte* octet, int voxel, float factor) const noexcept {
    dense() ? DenseTuple::scale(octet, voxel, factor) : CompactTuple::scale(octet, voxel, factor);
  }
  void read(const std::byte* octet, int voxel, VoxelEvidence& into) const noexcept {
    dense() ? DenseTuple::read(octet, voxel, into) : compact_.read(octet, voxel, into);
  }
  /// Copies an octet while another thread may write to it. What is copied may be a mixture.
  void copy_shared(const std::byte* octet, std::byte* to, int num_components) const noexcept {
    dense() ? DenseTuple::copy_shared(octet, to, num_components)
            : CompactTuple::copy_shared(octet, to);
  }
  void summarize(const std::byte* octet, int voxel, CountSummary& into) const noexcept {
    dense() ? DenseTuple::summarize(octet, voxel, into) : compact_.summarize(octet, voxel, into);
  }
  /// Calls label(component, count) for each count that a voxel has, and rest(count) for its rest.
  template <class Label, class Rest>
  void visit(const std::byte* octet, int voxel, Label&& label, Rest&& rest) const noexcept {
    dense() ? DenseTuple::visit(octet, voxel, label) : compact_.visit(octet, voxel, label, rest);
  }
  /// Makes the counts of these voxels, but those of no class, counts of classes in these shares;
  /// the sums stay, but for rounding in a dense tuple and saturation in a compact one.
  /// O(components) a voxel.
  void share(std::byte* octet, unsigned voxels, const LabelShares& shares,
             int num_components) const noexcept {
    if (!dense()) return compact_.share(octet, voxels, shares, num_components - 1);
    for (; voxels != 0; voxels &= voxels - 1)
      share_dense(octet, std::countr_zero(voxels), shares, num_components);
  }
  /// Adds evidence whose classes are gathered in the first of the shares, and makes the counts of
  /// these voxels, old and new, counts in these shares as share(). Returns what label_sums is then.
  Plane add_shared(std::byte* octet, const OctetEvidence& added, unsigned voxels,
                   const LabelShares& shares, int num_components) const noexcept {
    if (!dense()) return compact_.add_shared(octet, added, voxels, shares, num_components - 1);
    static_cast<void>(DenseTuple::add(octet, added));
    share(octet, voxels, shares, num_components);
    return DenseTuple::label_sums(octet);
  }
  /// Prefetches the memory that summarize reads first; of a dense octet, its header and the first
  /// component's plane.
  void prefetch(const std::byte* octet) const noexcept {
    __builtin_prefetch(octet);
    __builtin_prefetch(octet + first_bytes() / 2);
  }
  /// Prefetches the memory that adding reads first, and once that is there the rest. Inlined, as
  /// a call of what only prefetches is left out as one without effect.
  [[gnu::always_inline]] void prefetch_to_add(const std::byte* octet) const noexcept {
    __builtin_prefetch(octet, 1);
    __builtin_prefetch(octet + first_bytes() / 2, 1);
  }
  void prefetch_planes(const std::byte* octet) const noexcept {
    if (dense()) DenseTuple::prefetch_planes(octet);
  }
  /// Whether a tuple can have these counts.
  [[nodiscard]] bool holds(const VoxelEvidence& evidence) const noexcept {
    return dense() ? DenseTuple::holds(evidence) : compact_.holds(evidence);
  }
  /// Makes sums of counts that tuples have into counts that a tuple can have.
  void condense(VoxelEvidence& evidence) const noexcept {
    if (!dense()) compact_.condense(evidence);
  }
  /// Sets a voxel without evidence to counts that a tuple can have.
  void restore(std::byte* octet, int voxel, const VoxelEvidence& evidence) const noexcept {
    dense() ? DenseTuple::restore(octet, voxel, evidence)
            : compact_.restore(octet, voxel, evidence);
  }

 private:
  [[nodiscard]] constexpr bool dense() const noexcept { return policy_ == TuplePolicy::kDense; }
  /// Where an octet begins, in two cache lines at most.
  [[nodiscard]] constexpr std::size_t first_bytes() const noexcept {
    return dense() ? DenseTuple::kFirstBytes : CompactTuple::kOctetBytes;
  }

  static void share_dense(std::byte* octet, int voxel, const LabelShares& shares,
                          int num_components) noexcept;

  TuplePolicy policy_ = TuplePolicy::kDense;
  CompactTuple compact_{};
};

}  // namespace tessera
