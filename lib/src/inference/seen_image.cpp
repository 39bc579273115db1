// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/seen_image.hpp"

#include <algorithm>

namespace tessera {

namespace {

using Value = std::int16_t;

/// of three neighbours in a row, for all but its first and last, which become `outside`.
template <class Choose>
void of_three(const Value* row, Value* into, int edge, Value outside, Choose&& choose) noexcept {
  into[0] = outside;
  for (int c = 1; c < edge - 1; ++c) into[c] = choose(choose(row[c - 1], row[c]), row[c + 1]);
  into[edge - 1] = outside;
}

Value lesser(Value a, Value b) noexcept { return std::min(a, b); }
Value greater(Value a, Value b) noexcept { return std::max(a, b); }

}  // namespace

SeenImage SeenImage::make(Arena& arena, int edge) noexcept {
  SeenImage made;
  made.images_ = arena.take<Value>(kWays * pixels(edge));
  made.edge_ = edge;
  return made;
}

void SeenImage::set(const Value* nearest, int first, int last, bool below, Value none, Value unseen,
                    Value* scratch) noexcept {
  const int edge = edge_;
  const auto at = [edge](auto* values, int r) { return values + std::ptrdiff_t{r} * edge; };
  Value* const pixel = images_.data();
  Value* const window = images_.data() + pixels(edge);
  // The least of three columns, and where there was a return the farthest of them: of a row and
  // those beside it, what follows needs both.
  for (int r = first; r <= last; ++r) {
    of_three(at(nearest, r), at(scratch, r), edge, none, lesser);
    Value* const seen = at(pixel, r);
    const Value* const row = at(nearest, r);
    for (int c = 0; c < edge; ++c) seen[c] = row[c] == none ? unseen : row[c];
  }
  for (int r = last; r >= first; --r) {
    const int up = std::min(r + 1, last);
    const int down = std::max(r - 1, first);
    const int lowest = below ? std::max(r - kRowsBelow, first) : down;
    Value* const into = at(window, r);
    const Value* const a = at(scratch, down);
    const Value* const b = at(scratch, r);
    const Value* const c = at(scratch, up);
    for (int i = 0; i < edge; ++i) into[i] = std::min(std::min(a[i], b[i]), c[i]);
    for (int i = 0; i < edge; ++i) into[i] = into[i] == none ? unseen : into[i];
    for (int other = lowest; other < down; ++other) {
      const Value* const row = at(scratch, other);
      for (int i = 0; i < edge; ++i) into[i] = std::min(into[i], row[i]);
    }
  }
  // Nothing reads scratch any more: the farthest of three columns.
  for (int r = first; r <= last; ++r)
    of_three(at(pixel, r), at(scratch, r), edge, unseen, greater);
  for (int r = first; r <= last; ++r) {
    const Value* const a = at(scratch, std::max(r - 1, first));
    const Value* const b = at(scratch, r);
    const Value* const c = at(scratch, std::min(r + 1, last));
    Value* const into = at(pixel, r);
    for (int i = 0; i < edge; ++i) {
      const Value most = std::max(std::max(a[i], b[i]), c[i]);
      into[i] = into[i] == unseen ? most : into[i];
    }
  }
}

}  // namespace tessera
