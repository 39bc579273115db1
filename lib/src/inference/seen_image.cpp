// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/seen_image.hpp"

#include <algorithm>

#include "image_rows.hpp"

namespace tessera {

namespace {

using Value = std::int16_t;

using OfThree = void (*)(const Value* a, const Value* b, const Value* c, Value* into,
                         int count) noexcept;

/// One of three neighbours in a row, for all but its first and last, which become `outside`.
void of_three_columns(OfThree one_of, const Value* row, Value* into, int edge,
                      Value outside) noexcept {
  into[0] = outside;
  one_of(row, row + 1, row + 2, into + 1, edge - 2);
  into[edge - 1] = outside;
}

}  // namespace

SeenImage SeenImage::make(Arena& arena, int edge, const ImageRows& rows) noexcept {
  SeenImage made;
  made.row_functions_ = &rows;
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
    of_three_columns(row_functions_->least_of_three, row_at(face.nearest, r), row_at(scratch, r),
                     edge_, face.none);
  for (int r = face.first; r <= face.last; ++r) {
    const int down = std::max(r - 1, face.first);
    const int up = std::min(r + 1, face.last);
    Value* const into = row_at(images_.data() + pixels(edge_), r);
    row_functions_->least_of_three(row_at(scratch, down), row_at(scratch, r), row_at(scratch, up),
                                   into, edge_);
    row_functions_->replace(into, face.none, face.unseen, edge_);
    const int lowest = face.goes_up ? std::max(r - kRowsBelow, face.first) : down;
    for (int below = lowest; below < down; ++below)
      row_functions_->take_less(into, row_at(scratch, below), edge_);
  }
}

void SeenImage::set_some(const Face& face, Value* scratch) noexcept {
  const auto row_at = [this](auto* values, int r) { return values + std::ptrdiff_t{r} * edge_; };
  Value* const image = images_.data();
  for (int r = face.first; r <= face.last; ++r) {
    Value* const own = row_at(image, r);
    std::copy_n(row_at(face.nearest, r), edge_, own);
    row_functions_->replace(own, face.none, face.unseen, edge_);
    of_three_columns(row_functions_->most_of_three, own, row_at(scratch, r), edge_, face.unseen);
  }
  for (int r = face.first; r <= face.last; ++r) {
    const int down = std::max(r - 1, face.first);
    const int up = std::min(r + 1, face.last);
    row_functions_->most_of_three(row_at(scratch, down), row_at(scratch, r), row_at(scratch, up),
                                  row_at(image, r), edge_);
  }
}

}  // namespace tessera
