// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/carve_image.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "image_rows.hpp"
#include "seen_returns.hpp"

namespace tessera {

namespace {

using Value = std::int16_t;
using Value4 = Value __attribute__((vector_size(8)));
static_assert(CarveLayout::far_edge_of(0, CarveLayout::kFarSteps - 1) <= 4);

/// Rows that are made beyond those with returns: no window reaches farther, on any level.
constexpr int kMargin = 24;
constexpr int kCoarsest = 8;

/// Row r of an image so wide.
template <class V>
V* row_of(V* values, int edge, int r) noexcept {
  return values + std::ptrdiff_t{r} * edge;
}

/// One image of a face, or rows of it.
struct Rectangle {
  Value* values = nullptr;
  int edge = 0;
  int first = 0;
  int last = 0;
  [[nodiscard]] Value* row(int r) const noexcept { return row_of(values, edge, r); }
};

/// Each value becomes the least of the square that begins with it and is 2 radius + 1 wide, so the
/// one around a pixel is found radius rows and columns before it. Cut off at the last row.
void least_of_squares(const ImageRows& rows, const Rectangle& image, int radius) noexcept {
  const int width = 2 * radius + 1;
  const auto widen = [&](int step) {
    for (int r = image.first; r <= image.last; ++r) {
      Value* const row = image.row(r);
      rows.take_less(row, row + step, image.edge - step);
    }
    for (int r = image.first; r + step <= image.last; ++r)
      rows.take_less(image.row(r), image.row(r + step), image.edge);
  };
  int covered = 1;
  for (; 2 * covered <= width; covered *= 2) widen(covered);
  if (covered < width) widen(width - covered);
}

void copy(const Rectangle& from, const Rectangle& to) noexcept {
  std::copy(from.row(from.first), from.row(from.last + 1), to.row(from.first));
}

/// What of two by two values is least.
void halve(const ImageRows& rows, const Rectangle& from, const Rectangle& to) noexcept {
  for (int r = to.first; r <= to.last; ++r)
    rows.halve(from.row(2 * r), from.row(2 * r + 1), to.row(r), to.edge);
}

}  // namespace

Result<CarveImage> CarveImage::make(Arena& arena, LaneWidth lanes) noexcept {
  if (arena.remaining_bytes() < required_bytes()) return Status::kResourceExhausted;
  CarveImage made;
  made.row_functions_ = &image_rows(lanes);
  made.by_fours_ = lanes == LaneWidth::kWidest && has_avx2();
  made.image_ = arena.take<Value>(kImage);
  made.nearest_ = arena.take<Value>(kFace);
  made.seen_ = arena.take<Value>(kFace);
  for (SeenImage& seen : made.seen_images_)
    seen = SeenImage::make(arena, kEdge, *made.row_functions_);
  made.farthest_ = arena.take<Value>(kFarthest + kReadBeyond);
  std::ranges::fill(made.image_.first(CubeFace::kCount * kFace), kNone);
  return made;
}

void CarveImage::begin(double range_m, int neighbours) noexcept {
  per_m_ = static_cast<double>(kMostDepth) / range_m;
  neighbours_ = neighbours;
  for (int face = 0; face < CubeFace::kCount; ++face) {
    Rows& rows = rows_[static_cast<std::size_t>(face)];
    if (rows.any()) {
      Value* const values = level_of_face(face, 0);
      std::fill(row_of(values, kEdge, rows.first), row_of(values, kEdge, rows.last + 1), kNone);
    }
    rows = {};
  }
}

namespace {

/// The tangent up to which a face's padding shows what is beside the face.
constexpr double kMostTangent = 1.09;
static_assert(CarveImage::pixel(kMostTangent) > CarveImage::kEdge &&
              CarveImage::pixel(-kMostTangent) < 0.0);

}  // namespace

void CarveImage::put(int axis, bool negative, int row, int column, Value value) noexcept {
  const int face = 2 * axis + (negative ? 1 : 0);
  Value& at = row_of(level_of_face(face, 0), kEdge, row)[column];
  at = std::min(at, value);
  Rows& rows = rows_[static_cast<std::size_t>(face)];
  rows.first = std::min(rows.first, row);
  rows.last = std::max(rows.last, row);
}

void CarveImage::add(const Point3d& d, bool is_hit) noexcept {
  for (int axis = 0; axis < 3; ++axis) {
    const std::array<int, 2> across = axes_across(axis);
    const double depth_m = std::abs(d[axis]);
    const double widest_m = kMostTangent * depth_m;
    if (!(std::abs(d[across[0]]) < widest_m && std::abs(d[across[1]]) < widest_m)) continue;
    const double column = pixel(d[across[0]] / depth_m);
    const double row = pixel(d[across[1]] / depth_m);
    const auto is_inside = [](double p) { return p >= 0.0 && p < kEdge; };
    if (!is_inside(column) || !is_inside(row)) continue;
    const auto depth = static_cast<std::int32_t>(std::min<double>(depth_m * per_m_, kMostDepth));
    put(axis, d[axis] < 0.0, static_cast<int>(row), static_cast<int>(column),
        is_hit ? static_cast<Value>(depth - kDepths) : kBeyond);
  }
}

void CarveImage::add_hits(std::span<const ScanPoint> hits, const Point3d& origin_map) noexcept {
  const SeeReturns see = by_fours_ ? see_returns_by_fours() : nullptr;
  SeenReturns four{.stride = sizeof(ScanPoint) / sizeof(float),
                   .origin = {origin_map.x(), origin_map.y(), origin_map.z()},
                   .per_m = per_m_,
                   .most_depth = kMostDepth,
                   .widest = kMostTangent,
                   .slope = static_cast<double>(kSlope),
                   .bend = static_cast<double>(kBend),
                   .middle = static_cast<double>(kMiddle),
                   .edge = kEdge};
  static_assert(sizeof(ScanPoint) % sizeof(float) == 0);
  constexpr auto kCount = static_cast<std::size_t>(SeenReturns::kCount);
  std::size_t done = 0;
  for (; see != nullptr && hits.size() - done >= kCount; done += kCount) {
    four.points = hits[done].p_map.data();
    see(four);
    for (int axis = 0; axis < 3; ++axis) {
      for (unsigned rest = four.is_on_face[axis]; rest != 0; rest &= rest - 1) {
        const int i = std::countr_zero(rest);
        put(axis, (four.is_negative[axis] >> i & 1U) != 0, four.row[axis][i], four.column[axis][i],
            static_cast<Value>(four.depth[axis][i] - kDepths));
      }
    }
  }
  for (const ScanPoint& hit : hits.subspan(done)) add(hit.p_map.cast<double>() - origin_map, true);
}

void CarveImage::finish() noexcept {
  for (int face = 0; face < CubeFace::kCount; ++face) {
    Rows& rows = rows_[static_cast<std::size_t>(face)];
    if (!rows.any()) continue;
    rows.first = std::max(rows.first - kMargin, 0) / kCoarsest * kCoarsest;
    rows.last = std::min(rows.last + kMargin, kEdge - 1) / kCoarsest * kCoarsest + kCoarsest - 1;
    seen_images_[static_cast<std::size_t>(face)].set({.nearest = level(face, 0),
                                                      .first = rows.first,
                                                      .last = rows.last,
                                                      .goes_up = CubeFace::of(face).axis != 2,
                                                      .none = kNone,
                                                      .unseen = kUnseen},
                                                     nearest_.data());
    make_levels(face);
    for (int i = 0; i < kLevels; ++i) make_farthest(face, i);
  }
}

void CarveImage::make_farthest(int face, int level) noexcept {
  const Rows& rows = rows_[static_cast<std::size_t>(face)];
  const int shift = CarveLayout::shift_of(level);
  const int edge = CarveLayout::edge_of(level);
  const auto far_row = [&](int step, int r) {
    return row_of(farthest_.data() + far_begin(face, level, step),
                  CarveLayout::far_edge_of(level, step), r);
  };
  int far_edge = CarveLayout::far_edge_of(level, 0);
  std::fill_n(far_row(0, 0), far_edge * far_edge, kUnseen);
  std::array<Value, kEdge + 4> most{};  // the last four of a row may be fewer
  for (int four = (rows.first >> shift) / 4; four <= (rows.last >> shift) / 4; ++four) {
    most.fill(kUnseen);
    for (int r = 4 * four; r < 4 * four + 4; ++r) {
      if (r < rows.first >> shift || r > rows.last >> shift) continue;
      row_functions_->take_more(most.data(), row_of(this->level(face, level), edge, r), edge);
    }
    Value* const into = far_row(0, four);
    for (std::ptrdiff_t i = 0; i < far_edge; ++i) {
      const Value* const of_four = most.data() + 4 * i;
      into[i] = std::max(std::max(of_four[0], of_four[1]), std::max(of_four[2], of_four[3]));
    }
  }
  for (int step = 1; step < CarveLayout::kFarSteps; ++step) {
    const int edge_before = far_edge;
    far_edge = CarveLayout::far_edge_of(level, step);
    std::fill_n(far_row(step, 0), far_edge * far_edge, kUnseen);
    for (int r = 0; r < edge_before; ++r) {
      const Value* const from = far_row(step - 1, r);
      Value* const into = far_row(step, r / 2);
      for (std::ptrdiff_t c = 0; c < edge_before / 2; ++c)
        into[c] = std::max(into[c], std::max(from[2 * c], from[2 * c + 1]));
      if (edge_before % 2 != 0)
        into[far_edge - 1] = std::max(into[far_edge - 1], from[edge_before - 1]);
    }
  }
}

void CarveImage::make_levels(int face) noexcept {
  const Rows& rows = rows_[static_cast<std::size_t>(face)];
  const auto rectangle = [&](Value* values, int shift) {
    return Rectangle{values, kEdge >> shift, rows.first >> shift, rows.last >> shift};
  };
  const Rectangle finest = rectangle(level_of_face(face, 0), 0);
  for (int i = 2; i < kLevels; ++i) {
    const Rectangle from =
        i == 2 ? finest : rectangle(level_of_face(face, i - 1), CarveLayout::shift_of(i - 1));
    halve(*row_functions_, from, rectangle(level_of_face(face, i), CarveLayout::shift_of(i)));
  }
  // The finest comes last: level 1 is made from its returns too.
  for (int i = kLevels - 1; i >= 0; --i) {
    const int shift = CarveLayout::shift_of(i);
    const int seen_radius = i == 0 ? 0 : 1;
    const int radius = std::max(seen_radius, (neighbours_ + (1 << shift) - 1) >> shift);
    const Rectangle into = rectangle(level_of_face(face, i), shift);
    const Rectangle from = i == 1 ? finest : into;
    const Rectangle nearest = rectangle(nearest_.data(), shift);
    const Rectangle seen = rectangle(seen_.data(), shift);
    // The finest two have one radius, but for 0.
    if (i != 0 || radius == 0) {
      copy(from, nearest);
      least_of_squares(*row_functions_, nearest, radius);
    }
    copy(from, seen);
    least_of_squares(*row_functions_, seen, seen_radius);
    for (int r = into.first + radius; r <= into.last; ++r) {
      const Value* const nearest_row = nearest.row(r - radius);
      const Value* const seen_row = seen.row(r - seen_radius) + (radius - seen_radius);
      std::fill_n(into.row(r), radius, kUnseen);
      row_functions_->choose(seen_row, kNone, nearest_row, kUnseen, into.row(r) + radius,
                             into.edge - radius);
    }
    for (int r = into.first; r < into.first + radius; ++r)
      std::fill_n(into.row(r), into.edge, kUnseen);
  }
}

bool CarveImage::may_reach(int face, int level, std::int32_t least, std::array<int, 2> columns,
                           std::array<int, 2> rows) const noexcept {
  for (std::array<int, 2>* const side : {&columns, &rows}) {
    (*side)[0] = std::clamp((*side)[0], 0, kEdge - 1);
    (*side)[1] = std::clamp((*side)[1], 0, kEdge - 1);
  }
  int step = 0;
  int shift = CarveLayout::shift_of(level) + 2;
  const auto span = [&](const std::array<int, 2>& side) {
    return (side[1] >> shift) - (side[0] >> shift);
  };
  while (step + 1 < CarveLayout::kFarSteps && (span(columns) > 3 || span(rows) > 3)) {
    ++step;
    ++shift;
  }
  const int edge = CarveLayout::far_edge_of(level, step);
  const Value* const values = farthest_.data() + far_begin(face, level, step);
  // The last step has two of a row at most, so that there are no more than four. What was read
  // behind the last one does not count.
  const int first_column = columns[0] >> shift;
  Value4 most = Value4{} + kUnseen;
  for (int r = rows[0] >> shift; r <= rows[1] >> shift; ++r) {
    Value4 four;
    __builtin_memcpy(&four, row_of(values, edge, r) + first_column, sizeof(four));
    most = four > most ? four : most;
  }
  const Value4 reached = most >= static_cast<Value>(least);
  std::uint64_t bits = 0;
  __builtin_memcpy(&bits, &reached, sizeof(bits));
  static_assert(std::endian::native == std::endian::little);
  return (bits & (~std::uint64_t{0} >> (16 * (3 - span(columns))))) != 0;
}

}  // namespace tessera
