// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is decided about a block, in which order, and what each decision's probability depends on:
// one text for the encoder, which knows the answers, and the decoder, which reads them.
// docs/reference/wire-format.md says the same in words.
#pragma once

#include "centroid_model.hpp"
#include "level_planes.hpp"

namespace tessera::detail {

/// Coder: bool bit(unsigned context, bool answer) and bool even(bool answer) give the answer that
/// counts.
template <class Coder>
class BlockModel {
 public:
  BlockModel(Coder& coder, bool labels, bool passes) noexcept
      : coder_(coder), labels_(labels), passes_(passes), centroids_(coder) {}

  /// Whether there are labels and passes at all; before all octets. False, as all that follows, iff
  /// answers contradict each other or are not the shortest for what they say.
  bool code_head() noexcept {
    labels_ = coder_.bit(kLabels, labels_);
    passes_ = coder_.bit(kPasses, passes_);
    return labels_ || passes_;
  }
  [[nodiscard]] bool labels() const noexcept { return labels_; }
  [[nodiscard]] bool passes() const noexcept { return passes_; }

  /// octet: higher with every call.
  bool code_octet(int octet, OctetCode& code) noexcept {
    Seen& seen = seen_[static_cast<std::size_t>(octet)];
    const Past past = past_of(static_cast<std::size_t>(octet));
    if (labels_ && !code_labels(past, seen, code)) return false;
    return !passes_ || code_passes(past, seen, code);
  }

 private:
  enum Freed : std::uint8_t { kNoneFreed = 0, kSomeFreed = 1, kWhollyFreed = 2 };
  /// What later octets' probabilities depend on.
  struct Seen {
    bool labelled = false;
    bool passed = false;
    Freed freed = kNoneFreed;
    std::uint8_t voxels_freed = 0;
    std::uint8_t passes = 0;
    LevelPlane levels{};  ///< Of the first slot.
  };
  /// The octets before one along x, y and z; where there is none, one without evidence.
  using Past = std::array<const Seen*, 3>;

  [[nodiscard]] Past past_of(std::size_t octet) const noexcept {
    return {(octet & 3U) != 0 ? &seen_[octet - 1] : &nothing_,
            (octet & 12U) != 0 ? &seen_[octet - 4] : &nothing_,
            octet >= 16 ? &seen_[octet - 16] : &nothing_};
  }
  [[nodiscard]] static bool in_mask(unsigned mask, unsigned v) noexcept {
    return ((mask >> v) & 1U) != 0;
  }

  bool code_labels(const Past& past, Seen& seen, OctetCode& code) noexcept {
    unsigned by = 0;
    for (unsigned axis = 0; axis < 3; ++axis) by |= past[axis]->labelled ? 1U << axis : 0U;
    seen.labelled = coder_.bit(kLabelled + by, code.labelled != 0);
    if (!seen.labelled) return true;
    if (!code_labelled(code)) return false;
    planes_.begin_octet(first_level(past));
    bool first = true;
    for (unsigned v = 0; v < kOctetVoxels; ++v) {
      const bool there = in_mask(code.labelled, v);
      VoxelCode& voxel = code.voxels[v];
      if (there && !code_set(first, voxel.set)) return false;
      if (!code_levels(v, there, voxel)) return false;
      if (there && !voxel.set.full()) centroids_.code(voxel);
      first = first && !there;
    }
    seen.levels = planes_.first_plane();
    return true;
  }
  [[nodiscard]] static int first_level(const Past& past) noexcept {
    constexpr int kUsual = 49;  // a count of one
    int sum = 0;
    int count = 0;
    for (unsigned axis = 0; axis < 3; ++axis) {
      if (!past[axis]->labelled) continue;
      sum += past[axis]->levels[std::size_t{1} << axis];
      ++count;
    }
    return count == 0 ? kUsual : sum / count;
  }

  bool code_labelled(OctetCode& code) noexcept {
    constexpr unsigned kAll = 0xff;
    if (coder_.bit(kFull, code.labelled == kAll)) {
      code.labelled = kAll;
      return true;
    }
    unsigned mask = 0;
    for (unsigned v = 0; v < kOctetVoxels; ++v) {
      unsigned before = 0;
      unsigned labelled = 0;
      for (unsigned step = 1; step < kOctetVoxels; step *= 2) {
        if ((v & step) == 0) continue;
        ++before;
        labelled += in_mask(mask, v - step) ? 1U : 0U;
      }
      const bool there = in_mask(code.labelled, v);
      if (coder_.bit(kVoxel + 4 * before + labelled, there)) mask |= 1U << v;
    }
    code.labelled = static_cast<std::uint8_t>(mask);
    return mask != 0 && mask != kAll;
  }

  bool code_set(bool first, ComponentSet& set) noexcept {
    if (coder_.bit(kSame + (first ? 0U : 1U), set == last_set_)) {
      set = last_set_;
      return set.any();
    }
    ComponentSet found;
    found.rest = coder_.bit(kRest, set.rest);
    unsigned n = found.rest ? 0 : 1;
    while (n < kCodedClasses && coder_.bit(kMore + n, n < set.classes)) ++n;
    found.classes = static_cast<std::uint8_t>(n);
    unsigned last = 0;
    for (unsigned i = 0; i < n; ++i) {
      const unsigned component = code_component(set.components[i]);
      if (component <= last) return false;
      found.components[i] = static_cast<std::uint8_t>(component);
      last = component;
    }
    const bool changed = found != last_set_;
    set = last_set_ = found;
    return changed;
  }
  unsigned code_component(unsigned component) noexcept {
    unsigned node = 1;
    for (unsigned i = 6; i-- > 0;)
      node = 2 * node + (coder_.bit(kComponent + node, in_mask(component, i)) ? 1U : 0U);
    return node - 64;
  }

  bool code_levels(unsigned v, bool there, VoxelCode& voxel) noexcept {
    for (int slot = 0; slot < kSlots; ++slot) {
      const bool has = there && voxel.set.has(slot);
      if (!planes_.used(slot)) {
        if (!has) continue;
        planes_.use(slot, v);
      }
      const int expected = planes_.expected(slot, v);
      if (!has) {
        planes_.expect(slot, v, expected);
        continue;
      }
      const unsigned group = slot == 0 ? v : 8 + (v == 0 ? 0U : 1U);
      std::uint8_t& level = voxel.levels[static_cast<std::size_t>(slot)];
      if (!code_level(group, expected, kMostLevel, level)) return false;
      planes_.set(slot, v, level);
    }
    return true;
  }

  /// A level of 1 .. most by its difference to the expected one: whether less than 16, then in
  /// which of 0, 1, 2-3, 4-7, 8-15 without its sign, the sign, and where in these; else itself.
  bool code_level(unsigned group, int expected, int most, std::uint8_t& level) noexcept {
    const unsigned context = kDifference + group * kDifferenceContexts;
    const int difference = level - expected;
    int found = 0;
    if (coder_.bit(context, -16 < difference && difference < 16)) {
      found = expected + code_difference(context, difference);
      if (found < 1 || found > most) return false;
    } else {
      unsigned bits = 0;
      for (auto i = static_cast<unsigned>(std::bit_width(static_cast<unsigned>(most))); i-- > 0;)
        bits = 2 * bits + (coder_.even(in_mask(level, i)) ? 1U : 0U);
      found = static_cast<int>(bits);
      const bool near = -16 < found - expected && found - expected < 16;
      if (found < 1 || found > most || near) return false;
    }
    level = static_cast<std::uint8_t>(found);
    return true;
  }
  int code_difference(unsigned context, int difference) noexcept {
    const auto size = static_cast<unsigned>(difference < 0 ? -difference : difference);
    const auto of_size = static_cast<unsigned>(std::bit_width(size));
    unsigned width = 0;
    while (width < 4 && coder_.bit(context + 1 + width, width < of_size)) ++width;
    if (width == 0) return 0;
    const bool negative = coder_.bit(context + 5, difference < 0);
    int found = 1;
    for (unsigned i = width - 1; i-- > 0;) {
      const bool bit = in_mask(size, i);
      // The upper one of the bits below the first is more often zero; the others are even.
      const bool upper = i + 2 == width;
      found =
          2 * found + ((upper ? coder_.bit(context + 4 + width, bit) : coder_.even(bit)) ? 1 : 0);
    }
    return negative ? -found : found;
  }

  bool code_passes(const Past& past, Seen& seen, OctetCode& code) noexcept {
    if (code.labelled != 0 && !code_label_passes(past, seen, code)) return false;
    const unsigned others = ~unsigned{code.labelled} & 0xffU;
    if (others == 0) {
      seen.freed = kSomeFreed;
      return true;
    }
    const unsigned by = past[0]->freed + 3U * past[1]->freed + 9U * past[2]->freed;
    if (!coder_.bit(kFreed + by, code.freed != 0)) return true;
    const bool all = coder_.bit(kAllFreed + by, code.freed == others);
    seen.freed = all ? kWhollyFreed : kSomeFreed;
    const unsigned mask = all ? others : code_freed(past, others, code.freed);
    if (mask == 0 || (mask == others) != all) return false;
    seen.passed = true;
    seen.voxels_freed = code.freed = static_cast<std::uint8_t>(mask);
    for (unsigned axis = 3; axis-- > 0;)
      if (past[axis]->voxels_freed != 0) last_passes_ = past[axis]->passes;
    if (!code_passes_level(11, code.passes)) return false;
    seen.passes = code.passes;
    return true;
  }
  unsigned code_freed(const Past& past, unsigned others, unsigned freed) noexcept {
    unsigned mask = 0;
    for (unsigned v = 0; v < kOctetVoxels; ++v) {
      if (!in_mask(others, v)) continue;
      unsigned by = 0;
      for (unsigned axis = 0; axis < 3; ++axis) {
        const unsigned step = 1U << axis;
        const unsigned before = (v & step) != 0 ? mask : past[axis]->voxels_freed;
        by |= in_mask(before, v ^ step) ? step : 0U;
      }
      if (coder_.bit(kVoxelFreed + by, in_mask(freed, v))) mask |= 1U << v;
    }
    return mask;
  }
  bool code_label_passes(const Past& past, Seen& seen, OctetCode& code) noexcept {
    bool any = false;
    for (const VoxelCode& voxel : code.voxels) any = any || voxel.passes != 0;
    unsigned by = 0;
    for (unsigned axis = 0; axis < 3; ++axis) by |= past[axis]->passed ? 1U << axis : 0U;
    seen.passed = coder_.bit(kPassed + by, any);
    if (!seen.passed) return true;
    any = false;
    unsigned last = 2;
    for (unsigned v = 0; v < kOctetVoxels; ++v) {
      if (!in_mask(code.labelled, v)) continue;
      VoxelCode& voxel = code.voxels[v];
      const bool passed = coder_.bit(kVoxelPassed + last, voxel.passes != 0);
      if (passed && !code_passes_level(10, voxel.passes)) return false;
      any = any || passed;
      last = passed ? 1 : 0;
    }
    return any;
  }
  bool code_passes_level(unsigned group, std::uint8_t& level) noexcept {
    const bool ok = code_level(group, last_passes_, kMostPassesLevel, level);
    last_passes_ = level;
    return ok;
  }

  Coder& coder_;
  bool labels_;
  bool passes_;
  CentroidModel<Coder> centroids_;
  ComponentSet last_set_{};
  LevelPlanes planes_;
  int last_passes_ = 1;
  Seen nothing_{};
  std::array<Seen, kBlockOctets> seen_{};
};

}  // namespace tessera::detail
