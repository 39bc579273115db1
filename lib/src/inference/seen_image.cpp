// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/seen_image.hpp"

#include <algorithm>
#include <array>

namespace tessera {

namespace {

using Value = std::int16_t;

/// The least of two or, where farther is asked for, the greater one.
template <bool kFarther>
Value one_of(Value a, Value b) noexcept {
  return kFarther ? std::max(a, b) : std::min(a, b);
}

/// One of three neighbours in a row, for all but its first and last, which become `outside`.
template <bool kFarther>
void of_three_columns(const Value* row, Value* into, int edge, Value outside) noexcept {
  into[0] = outside;
  for (int c = 1; c < edge - 1; ++c)
    into[c] = one_of<kFarther>(one_of<kFarther>(row[c - 1], row[c]), row[c + 1]);
  into[edge - 1] = outside;
}

/// One of each column of three rows.
template <bool kFarther>
void of_three_rows(const std::array<const Value*, 3>& rows, Value* into, int edge) noexcept {
  for (int i = 0; i < edge; ++i)
    into[i] = one_of<kFarther>(one_of<kFarther>(rows[0][i], rows[1][i]), rows[2][i]);
}

void replace(Value* row, int edge, Value what, Value by) noexcept {
  for (int i = 0; i < edge; ++i) row[i] = row[i] == what ? by : row[i];
}

}  // namespace

SeenImage SeenImage::make(Arena& arena, int edge) noexcept {
  SeenImage made;
  made.images_ = arena.take<Value>(kWays * pixels(edge));
  made.edge_ = edge;
  return made;
}

void SeenImage::set(const Face& face, Value* scratch) noexcept {
  set_all(face, scratch);
  set_some(face, scratch);
}

void SeenImage::set_all(const Face& face, Value* scratch) noexcept {
  const auto row_at = [this](auto* values, int r) { return values + std::ptrdiff_t{r} * edge_; };
  for (int r = face.first; r <= face.last; ++r)
    of_three_columns<false>(row_at(face.nearest, r), row_at(scratch, r), edge_, face.none);
  for (int r = face.first; r <= face.last; ++r) {
    const int down = std::max(r - 1, face.first);
    const int up = std::min(r + 1, face.last);
    Value* const into = row_at(images_.data() + pixels(edge_), r);
    of_three_rows<false>({row_at(scratch, down), row_at(scratch, r), row_at(scratch, up)}, into,
                         edge_);
    replace(into, edge_, face.none, face.unseen);
    const int lowest = face.goes_up ? std::max(r - kRowsBelow, face.first) : down;
    for (int below = lowest; below < down; ++below) {
      const Value* const row = row_at(scratch, below);
      for (int i = 0; i < edge_; ++i) into[i] = std::min(into[i], row[i]);
    }
  }
}

void SeenImage::set_some(const Face& face, Value* scratch) noexcept {
  const auto row_at = [this](auto* values, int r) { return values + std::ptrdiff_t{r} * edge_; };
  Value* const image = images_.data();
  for (int r = face.first; r <= face.last; ++r) {
    Value* const own = row_at(image, r);
    std::copy_n(row_at(face.nearest, r), edge_, own);
    replace(own, edge_, face.none, face.unseen);
    of_three_columns<true>(own, row_at(scratch, r), edge_, face.unseen);
  }
  for (int r = face.first; r <= face.last; ++r) {
    const int down = std::max(r - 1, face.first);
    const int up = std::min(r + 1, face.last);
    of_three_rows<true>({row_at(scratch, down), row_at(scratch, r), row_at(scratch, up)},
                        row_at(image, r), edge_);
  }
}

}  // namespace tessera
