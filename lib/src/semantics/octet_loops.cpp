// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "octet_loops.hpp"

#include <cstddef>

// In the compiler's vector types, of as many voxels as a function's target has lanes for. Vectors
// are never arguments by value or results, whose places differ between targets.
namespace tessera {

namespace {

using Word = std::uint32_t;
constexpr std::ptrdiff_t kVoxels = OctetLoops::kVoxels;
constexpr std::ptrdiff_t kSlots = OctetLoops::kSlots;
constexpr unsigned kCountBits = 24;
constexpr std::int32_t kMostCount = (1 << kCountBits) - 1;

/// Four voxels of an octet, or all eight.
struct LanesOfFour {
  static constexpr int kCount = 4;
  using Words = Word __attribute__((vector_size(16)));
  using Ints = std::int32_t __attribute__((vector_size(16)));
  using Floats = float __attribute__((vector_size(16)));
};
struct LanesOfEight {
  static constexpr int kCount = 8;
  using Words = Word __attribute__((vector_size(32)));
  using Ints = std::int32_t __attribute__((vector_size(32)));
  using Floats = float __attribute__((vector_size(32)));
};

template <class Vector>
[[gnu::always_inline]] inline void load(const void* from, Vector& into) noexcept {
  __builtin_memcpy(&into, from, sizeof(into));
}
template <class Vector>
[[gnu::always_inline]] inline void store(void* to, const Vector& from) noexcept {
  __builtin_memcpy(to, &from, sizeof(from));
}

/// Whole quanta, at most what a slot holds. By way of signed integers, which every processor
/// converts in one instruction.
template <class Floats, class Ints>
[[gnu::always_inline]] inline void whole_of(const Floats& exact, Ints& counts) noexcept {
  const Floats most = Floats{} + static_cast<float>(kMostCount);
  counts = __builtin_convertvector(exact < most ? exact : most, Ints);
}
template <class Lanes>
[[gnu::always_inline]] inline void quantise(const float* plane, float quanta,
                                            typename Lanes::Ints& counts) noexcept {
  typename Lanes::Floats exact;
  load(plane, exact);
  whole_of(exact * quanta + 0.5F, counts);
}
/// Counts added to words, whose own counts stay within what a slot holds.
template <class Ints>
[[gnu::always_inline]] inline void add_counts(const Ints& counts, Ints& words) noexcept {
  const Ints room = kMostCount - (words & kMostCount);
  words += counts < room ? counts : room;
}
template <class Ints>
[[gnu::always_inline]] inline void note(const Ints& counts, Word* given) noexcept {
  Ints before;
  load(given, before);
  store(given, before | counts);
}
/// Where words are of a component, all ones.
template <class Lanes>
[[gnu::always_inline]] inline void of_component(const typename Lanes::Ints& words, Word component,
                                                typename Lanes::Ints& own) noexcept {
  typename Lanes::Words of;
  __builtin_memcpy(&of, &words, sizeof(of));
  own = (of >> kCountBits) == component;
}

template <class Lanes>
[[gnu::always_inline]] inline void to_slots(Word* words, Word component, const float* plane,
                                            float quanta, Word* left, Word* given) noexcept {
  for (std::ptrdiff_t v = 0; v < kVoxels; v += Lanes::kCount) {
    typename Lanes::Ints counts;
    quantise<Lanes>(plane + v, quanta, counts);
    note(counts, given + v);
    for (std::ptrdiff_t s = 0; s < kSlots; ++s) {
      typename Lanes::Ints word;
      typename Lanes::Ints own;
      load(words + s * kVoxels + v, word);
      of_component<Lanes>(word, component, own);
      const typename Lanes::Ints more = counts & own;
      add_counts(more, word);
      store(words + s * kVoxels + v, word);
      counts &= ~own;
    }
    store(left + v, counts);
  }
}

template <class Lanes>
[[gnu::always_inline]] inline void to_rests(Word* words, const float* plane, float quanta,
                                            Word* given) noexcept {
  for (std::ptrdiff_t v = 0; v < kVoxels; v += Lanes::kCount) {
    typename Lanes::Ints counts;
    typename Lanes::Ints rests;
    quantise<Lanes>(plane + v, quanta, counts);
    note(counts, given + v);
    load(words + kSlots * kVoxels + v, rests);
    add_counts(counts, rests);
    store(words + kSlots * kVoxels + v, rests);
  }
}

/// Words where they are chosen.
template <class Ints>
[[gnu::always_inline]] inline void put(const Ints& word, const Ints& chosen, Word* at) noexcept {
  Ints before;
  load(at, before);
  store(at, (word & chosen) | (before & ~chosen));
}

template <class Lanes>
[[gnu::always_inline]] inline void shared_out(Word* words, const float* plane, float quanta,
                                              const OctetLoops::Shares& shares,
                                              Word* given) noexcept {
  using Ints = typename Lanes::Ints;
  const Ints most = Ints{} + kMostCount;
  for (std::ptrdiff_t v = 0; v < kVoxels; v += Lanes::kCount) {
    Ints sums{};
    for (std::ptrdiff_t s = 0; s < kSlots; ++s) {
      Ints word;
      load(words + s * kVoxels + v, word);
      sums += word & kMostCount;
    }
    if (plane != nullptr) {
      Ints counts;
      quantise<Lanes>(plane + v, quanta, counts);
      note(counts, given + v);
      // As one slot holds it, before and after.
      sums = sums < most ? sums : most;
      add_counts(counts, sums);
    }
    Ints bits{};
    for (std::ptrdiff_t i = 0; i < Lanes::kCount; ++i) bits[i] = 1 << static_cast<int>(v + i);
    const Ints chosen =
        ((bits & static_cast<std::int32_t>(shares.voxels)) == bits) & (sums != Ints{});
    const auto exact = __builtin_convertvector(sums, typename Lanes::Floats);
    Ints left = sums;
    for (std::ptrdiff_t s = 1; s < kSlots; ++s) {
      Ints count;
      whole_of(exact * shares.shares[s], count);
      left -= count;
      const auto label = static_cast<std::int32_t>(shares.labels[s] << kCountBits);
      const Ints word = (label | count) & (count != Ints{});
      put(word, chosen, words + s * kVoxels + v);
    }
    const auto first = static_cast<std::int32_t>(shares.labels[0] << kCountBits);
    const Ints word = first | (left < most ? left : most);
    put(word, chosen, words + v);
  }
}

template <class Lanes>
[[gnu::always_inline]] inline bool any_slot_of(const Word* words, Word component) noexcept {
  typename Lanes::Ints any{};
  for (std::ptrdiff_t i = 0; i < kSlots * kVoxels; i += Lanes::kCount) {
    typename Lanes::Ints word;
    typename Lanes::Ints own;
    load(words + i, word);
    of_component<Lanes>(word, component, own);
    any |= own;
  }
  // NOLINTNEXTLINE(cppcoreguidelines-avoid-c-arrays): no inline function of another target
  std::uint64_t parts[std::size_t{Lanes::kCount} / 2];
  store(parts, any);
  std::uint64_t bits = 0;
  for (const std::uint64_t part : parts) bits |= part;
  return bits != 0;
}

template <class Lanes>
[[gnu::always_inline]] inline void summed_up(const Word* words, float quantum,
                                             float* sums) noexcept {
  for (std::ptrdiff_t v = 0; v < kVoxels; v += Lanes::kCount) {
    typename Lanes::Ints sum{};
    for (std::ptrdiff_t s = 0; s <= kSlots; ++s) {
      typename Lanes::Ints word;
      load(words + s * kVoxels + v, word);
      sum += word & kMostCount;
    }
    store(sums + v, __builtin_convertvector(sum, typename Lanes::Floats) * quantum);
  }
}

// A width: functions that are compiled for it, and their table.
// NOLINTBEGIN(bugprone-macro-parentheses): an attribute
#define TESSERA_OCTET_WIDTH(name, target, Lanes)                                                   \
  struct name {                                                                                    \
    target static void add_to_slots(Word* words, Word component, const float* plane, float quanta, \
                                    Word* counts, Word* given) noexcept {                          \
      to_slots<Lanes>(words, component, plane, quanta, counts, given);                             \
    }                                                                                              \
    target static void add_to_rests(Word* words, const float* plane, float quanta,                 \
                                    Word* given) noexcept {                                        \
      to_rests<Lanes>(words, plane, quanta, given);                                                \
    }                                                                                              \
    target static void share_out(Word* words, const float* plane, float quanta,                    \
                                 const OctetLoops::Shares& shares, Word* given) noexcept {         \
      shared_out<Lanes>(words, plane, quanta, shares, given);                                      \
    }                                                                                              \
    target static bool any_of(const Word* words, Word component) noexcept {                        \
      return any_slot_of<Lanes>(words, component);                                                 \
    }                                                                                              \
    target static void sum_up(const Word* words, float quantum, float* sums) noexcept {            \
      summed_up<Lanes>(words, quantum, sums);                                                      \
    }                                                                                              \
    static constexpr OctetLoops kTable{add_to_slots, add_to_rests, share_out, any_of, sum_up};     \
  };

TESSERA_OCTET_WIDTH(OctetsOnAny, , LanesOfFour)
#if defined(__x86_64__)
TESSERA_OCTET_WIDTH(OctetsWithAvx2, [[gnu::target("avx2")]], LanesOfEight)
#endif
#undef TESSERA_OCTET_WIDTH
// NOLINTEND(bugprone-macro-parentheses)

}  // namespace

const OctetLoops& octet_loops([[maybe_unused]] LaneWidth lanes) noexcept {
#if defined(__x86_64__)
  if (lanes == LaneWidth::kWidest && has_avx2()) return OctetsWithAvx2::kTable;
#endif
  return OctetsOnAny::kTable;
}

}  // namespace tessera
