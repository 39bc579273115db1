// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "image_rows.hpp"

#include <cstddef>

// The compiler makes vectors of these loops, as wide as a function's target has them. The pragma
// says that it may: a row that overlaps the one that is written lies ahead of it, so each value is
// read before it is written.
#if defined(__clang__)
// With what sanitizers add to them they cannot be vectors, which is no error.
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wpass-failed"
#define TESSERA_ROWS _Pragma("clang loop vectorize(assume_safety)")
#else
#define TESSERA_ROWS _Pragma("GCC ivdep")
#endif

namespace tessera {

namespace {

using Value = ImageRows::Value;

[[gnu::always_inline]] inline Value less_of(Value a, Value b) noexcept { return b < a ? b : a; }
[[gnu::always_inline]] inline Value more_of(Value a, Value b) noexcept { return a < b ? b : a; }

[[gnu::always_inline]] inline void less(Value* into, const Value* other, int count) noexcept {
  TESSERA_ROWS
  for (int i = 0; i < count; ++i) into[i] = less_of(into[i], other[i]);
}
[[gnu::always_inline]] inline void more(Value* into, const Value* other, int count) noexcept {
  TESSERA_ROWS
  for (int i = 0; i < count; ++i) into[i] = more_of(into[i], other[i]);
}
[[gnu::always_inline]] inline void least(const Value* a, const Value* b, const Value* c,
                                         Value* into, int count) noexcept {
  TESSERA_ROWS
  for (int i = 0; i < count; ++i) into[i] = less_of(less_of(a[i], b[i]), c[i]);
}
[[gnu::always_inline]] inline void most(const Value* a, const Value* b, const Value* c, Value* into,
                                        int count) noexcept {
  TESSERA_ROWS
  for (int i = 0; i < count; ++i) into[i] = more_of(more_of(a[i], b[i]), c[i]);
}
[[gnu::always_inline]] inline void halves(const Value* upper, const Value* lower, Value* into,
                                          int count) noexcept {
  TESSERA_ROWS
  for (std::ptrdiff_t i = 0; i < count; ++i)
    into[i] =
        less_of(less_of(upper[2 * i], lower[2 * i]), less_of(upper[2 * i + 1], lower[2 * i + 1]));
}
[[gnu::always_inline]] inline void replaced(Value* row, Value what, Value by, int count) noexcept {
  TESSERA_ROWS
  for (int i = 0; i < count; ++i) row[i] = row[i] == what ? by : row[i];
}
[[gnu::always_inline]] inline void chosen(const Value* seen, Value none, const Value* values,
                                          Value otherwise, Value* into, int count) noexcept {
  TESSERA_ROWS
  for (int i = 0; i < count; ++i) {
    const Value value = values[i];  // read whatever was seen, so that it is done by vectors
    into[i] = seen[i] == none ? otherwise : value;
  }
}

// A width: functions that are compiled for it, and their table.
// NOLINTBEGIN(bugprone-macro-parentheses): an attribute
#define TESSERA_WIDTH(name, target)                                                                \
  struct name {                                                                                    \
    target static void take_less(Value* into, const Value* other, int count) noexcept {            \
      less(into, other, count);                                                                    \
    }                                                                                              \
    target static void take_more(Value* into, const Value* other, int count) noexcept {            \
      more(into, other, count);                                                                    \
    }                                                                                              \
    target static void least_of_three(const Value* a, const Value* b, const Value* c, Value* into, \
                                      int count) noexcept {                                        \
      least(a, b, c, into, count);                                                                 \
    }                                                                                              \
    target static void most_of_three(const Value* a, const Value* b, const Value* c, Value* into,  \
                                     int count) noexcept {                                         \
      most(a, b, c, into, count);                                                                  \
    }                                                                                              \
    target static void halve(const Value* upper, const Value* lower, Value* into,                  \
                             int count) noexcept {                                                 \
      halves(upper, lower, into, count);                                                           \
    }                                                                                              \
    target static void replace(Value* row, Value what, Value by, int count) noexcept {             \
      replaced(row, what, by, count);                                                              \
    }                                                                                              \
    target static void choose(const Value* seen, Value none, const Value* values, Value otherwise, \
                              Value* into, int count) noexcept {                                   \
      chosen(seen, none, values, otherwise, into, count);                                          \
    }                                                                                              \
    static constexpr ImageRows kTable{take_less, take_more, least_of_three, most_of_three,         \
                                      halve,     replace,   choose};                               \
  };

TESSERA_WIDTH(AnyMachine, )
#if defined(__x86_64__)
TESSERA_WIDTH(WithAvx2, [[gnu::target("avx2")]])
#endif
// NOLINTEND(bugprone-macro-parentheses)

}  // namespace

const ImageRows& image_rows([[maybe_unused]] LaneWidth lanes) noexcept {
#if defined(__x86_64__)
  if (lanes == LaneWidth::kWidest && has_avx2()) return WithAvx2::kTable;
#endif
  return AnyMachine::kTable;
}

}  // namespace tessera

#if defined(__clang__)
#pragma clang diagnostic pop
#endif
