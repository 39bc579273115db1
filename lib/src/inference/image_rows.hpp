// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is done to rows of the images of a scan, in two widths of lanes with the same bits.
#pragma once

#include <cstdint>

#include "tessera/base/internal/lane_width.hpp"

namespace tessera {

struct ImageRows {
  using Value = std::int16_t;
  /// Each of into becomes the less of itself and of other, which may begin behind it in the same
  /// row.
  void (*take_less)(Value* into, const Value* other, int count) noexcept;
  void (*take_more)(Value* into, const Value* other, int count) noexcept;
  /// into: none of the others.
  void (*least_of_three)(const Value* a, const Value* b, const Value* c, Value* into,
                         int count) noexcept;
  void (*most_of_three)(const Value* a, const Value* b, const Value* c, Value* into,
                        int count) noexcept;
  /// The least of two by two; the rows have 2 count values.
  void (*halve)(const Value* upper, const Value* lower, Value* into, int count) noexcept;
  void (*replace)(Value* row, Value what, Value by, int count) noexcept;
  /// Values, but otherwise where what was seen is none.
  void (*choose)(const Value* seen, Value none, const Value* values, Value otherwise, Value* into,
                 int count) noexcept;
};

[[nodiscard]] const ImageRows& image_rows(LaneWidth lanes) noexcept;

}  // namespace tessera
