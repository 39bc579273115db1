// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The compact count tuple: 16 bytes a voxel, whatever the number of classes. Three slots of a class
// and its count, and a rest, the evidence of all classes that are not in a slot; and beside the
// rest, where in the voxel its returns are (Centroid).
//
// Counts are whole multiples of a quantum, a power of two that follows from the map's cap, so that
// every count and its float are the same number. Where a class has no slot and all are taken, the
// slot with the smallest count (among equals: of the highest class) goes to the rest if the new
// class brings more, else what it brings goes to the rest.
//
// Error against the dense tuple, after n additions to a voxel and no cap reached: a count is too
// small by at most the voxel's rest, plus n / 2 quanta, and too large by at most n / 2 quanta. A
// count saturates at (2^24 - 1) quanta.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#include "tessera/base/internal/lane_width.hpp"
#include "tessera/base/internal/shared_words.hpp"
#include "tessera/semantics/estimate.hpp"
#include "tessera/semantics/evidence.hpp"
#include "tessera/semantics/internal/label_shares.hpp"

namespace tessera {

struct OctetLoops;

class CompactTuple {
 public:
  using Plane = OctetEvidence::Plane;
  static constexpr int kSlots = 3;
  /// Of a point with several labels, those with less of its weight, in 255ths, go to the rest but
  /// for the best, and with them what is of no class.
  static constexpr std::uint8_t kLeastLabelWeight = 16;
  static constexpr std::uint32_t kOctetBytes = sizeof(std::uint32_t) * kOctetVoxels * (kSlots + 1);

  /// The quantum's inverse for a cap of max_evidence in (0, 1e6], or none (0): the largest power of
  /// two with which the cap fits a count; 2^12 without a cap.
  [[nodiscard]] static constexpr float quanta_per_unit(float max_evidence) noexcept {
    if (!(max_evidence > 0.0F)) return 4096.0F;
    float quanta = 16777216.0F;
    while (quanta * max_evidence > static_cast<float>(kMostCount)) quanta *= 0.5F;
    return quanta;
  }

  /// For maps without tuples.
  constexpr CompactTuple() noexcept = default;
  /// quanta: of quanta_per_unit, as in all that follows. lanes: whatever they are, the bits are the
  /// same.
  explicit CompactTuple(float quanta, LaneWidth lanes = LaneWidth::kWidest) noexcept;

  /// Adds evidence, component by component, each rounded to the nearest quantum; what has_rest goes
  /// to the rest. Voxels that it adds to have the nearer centroid then. Returns what
  /// label_sums is then. O(components in added).
  Plane add(std::byte* octet, const OctetEvidence& added) const noexcept {
    return add_planes(octet, added);
  }
  Plane add(std::byte* octet, const OctetOfBlock& added) const noexcept {
    return add_planes(octet, added);
  }
  /// Sum over slots and rest of each voxel.
  [[nodiscard]] Plane label_sums(const std::byte* octet) const noexcept;
  /// Multiplies one voxel's counts by factor in [0, 1], rounded down.
  static void scale(std::byte* octet, int voxel, float factor) noexcept;
  /// Makes the slots' counts of these voxels, but that of unlabelled evidence, counts of classes in
  /// these shares, rounded down and what is left of the sum to the first. Where no slot is free for
  /// the last of them, the first has its share too. The rest stays as it is. A count saturates, as
  /// in add(): so classes in one slot end where one count does.
  void share(std::byte* octet, unsigned voxels, const LabelShares& shares,
             int unlabelled) const noexcept;
  /// What share() with the first class alone, add() and share() give together, where evidence of
  /// classes is of that first class; in one pass where there is nothing unlabelled.
  Plane add_shared(std::byte* octet, const OctetEvidence& added, unsigned voxels,
                   const LabelShares& shares, int unlabelled) const noexcept;
  /// Writes one voxel's counts into sigma and rest; entries of classes without a slot are left as
  /// they are.
  void read(const std::byte* octet, int voxel, VoxelEvidence& into) const noexcept;
  /// Copies an octet that may be written meanwhile (shared_words.hpp).
  static void copy_shared(const std::byte* octet, std::byte* to) noexcept {
    load_shared_words(to, octet, kOctetBytes);
  }
  /// Adds one voxel's counts. Four words are read.
  void summarize(const std::byte* octet, int voxel, CountSummary& into) const noexcept {
    const auto word = [&](std::size_t s) {
      std::uint32_t value = 0;
      std::memcpy(&value, octet + s * sizeof(Words) + static_cast<std::size_t>(voxel) * 4, 4);
      return value;
    };
    std::uint32_t a = word(0);
    std::uint32_t b = word(1);
    std::uint32_t c = word(2);
    // Words sort by class; empty slots, all zero, come first.
    if (b < a) std::swap(a, b);
    if (c < b) std::swap(b, c);
    if (b < a) std::swap(a, b);
    for (const std::uint32_t slot : {a, b, c}) {
      into.add(static_cast<int>(slot >> kCountBits), count_of(slot) * quantum_);
    }
    into.add_rest(count_of(word(kRest)) * quantum_);
  }
  /// Calls label(component, count) for each of a voxel's slots, and rest(count) if there is any.
  template <class Label, class Rest>
  void visit(const std::byte* octet, int voxel, Label&& label, Rest&& rest) const noexcept {
    const std::byte* const words = octet + static_cast<std::size_t>(voxel) * sizeof(std::uint32_t);
    for (std::size_t s = 0; s <= kRest; ++s) {
      std::uint32_t word = 0;
      std::memcpy(&word, words + s * sizeof(Words), sizeof(word));
      if ((word & kMostCount) == 0) continue;
      s == kRest ? rest(count_of(word) * quantum_)
                 : label(static_cast<int>(word >> kCountBits), count_of(word) * quantum_);
    }
  }
  [[nodiscard]] static OctetCentroids centroids(const std::byte* octet) noexcept;
  /// Adds to the rests of an octet, as add().
  void add_rest(std::byte* octet, const Plane& counts,
                const OctetCentroids& centroids) const noexcept;
  /// Whether a tuple can have these counts: of three classes at most, in whole quanta.
  [[nodiscard]] bool holds(const VoxelEvidence& evidence) const noexcept {
    return words_of(evidence)[0] != kNotHeld;
  }
  /// Makes sums of counts that tuples have into counts that one tuple can have: the three largest
  /// keep their class (among equals the lower one), the others go to the rest; each saturates.
  /// O(classes).
  void condense(VoxelEvidence& evidence) const noexcept;
  /// Sets a voxel without evidence to counts that a tuple can have.
  void restore(std::byte* octet, int voxel, const VoxelEvidence& evidence) const noexcept;

 private:
  static constexpr unsigned kCountBits = 24;
  static constexpr std::uint32_t kMostCount = (std::uint32_t{1} << kCountBits) - 1;
  static constexpr std::size_t kRest = kSlots;
  /// A slot's word is class << 24 | count; 0 if empty. The rest's word is centroid << 24 | count.
  using Words = std::array<std::uint32_t, kOctetVoxels>;
  struct Octet {
    std::array<Words, kSlots + 1> words;
  };
  static_assert(sizeof(Octet) == kOctetBytes);
  /// By way of a signed integer, which every processor converts in one instruction.
  [[nodiscard]] static float count_of(std::uint32_t word) noexcept {
    return static_cast<float>(static_cast<std::int32_t>(word & kMostCount));
  }

  /// No slot's word: there is no class 255.
  static constexpr std::uint32_t kNotHeld = ~std::uint32_t{0};
  /// A voxel's words; the first is kNotHeld if no tuple can have the counts.
  [[nodiscard]] std::array<std::uint32_t, kSlots + 1> words_of(
      const VoxelEvidence& evidence) const noexcept;
  template <class Evidence>
  Plane add_planes(std::byte* octet, const Evidence& added) const noexcept;
  [[nodiscard]] Plane sums_of(const Octet& octet) const noexcept;
  /// added: counts that are not zero get bits.
  void add_plane(Octet& octet, std::uint32_t component, const Plane& plane,
                 Words& added) const noexcept;
  /// Where added has bits.
  static void join_centroids(Octet& octet, const OctetCentroids& seen, const Words& added) noexcept;
  /// Of a count, rounded down; at most what a slot holds.
  [[nodiscard]] static std::uint32_t part_of(std::uint32_t count, float share) noexcept {
    const float exact = static_cast<float>(static_cast<std::int32_t>(count)) * share;
    constexpr auto kMost = static_cast<float>(kMostCount);
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(exact < kMost ? exact : kMost));
  }
  static void share_voxel(Octet& octet, std::size_t voxel, const LabelShares& shares,
                          std::uint32_t unlabelled) noexcept;
  /// Without unlabelled evidence; plane: what is added before, of a class, or null.
  void share_voxels(Octet& octet, const Plane* plane, unsigned voxels, const LabelShares& shares,
                    Words& given) const noexcept;
  static void add_to_rest(Octet& octet, std::size_t voxel, std::uint32_t count) noexcept;
  static void find_slot(Octet& octet, std::size_t voxel, std::uint32_t component,
                        std::uint32_t count) noexcept;

  float quanta_ = 4096.0F;
  float quantum_ = 1.0F / 4096.0F;
  const OctetLoops* loops_ = nullptr;
};

}  // namespace tessera
