// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The search over headings and shifts, against sums over all of them one by one.
#include "tessera/frames/internal/yaw_search.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "finder_rig.hpp"

namespace tessera {

namespace {

void draw_sketch(MapSketch& sketch, const LocalMap& map) {
  std::vector<KeyedIndex> scratch(MapSketch::kScratch);
  sketch.begin(map.lattice().resolution_m());
  SweepCursor cursor;
  map.visit_blocks(cursor, ~std::size_t{0} / 2, [&](BlockKey, SlabHandle handle) {
    sketch.add(map, handle);
    return true;
  });
  sketch.finish(scratch);
}

/// What a column of the fixed sketch is worth to one that stands.
int worth(const Columns& fixed, int x, int y, std::uint8_t stands, std::uint8_t free, int same) {
  if (x < 0 || y < 0 || x >= Columns::kEdge || y >= Columns::kEdge) return 0;
  const auto has = [&](int u, int v, std::uint8_t mark) {
    return u >= 0 && v >= 0 && u < Columns::kEdge && v < Columns::kEdge &&
           (fixed.marks(u, v) & mark) != 0;
  };
  if (has(x, y, stands)) return same;
  if (has(x - 1, y, stands) || has(x + 1, y, stands) || has(x, y - 1, stands) ||
      has(x, y + 1, stands))
    return 1;
  return has(x, y, free) ? -2 : 0;
}

int score_of(const Columns& moved, const Columns& fixed, const Candidate& at) {
  int sum = 0;
  for (int y = 0; y < Columns::kEdge; ++y) {
    for (int x = 0; x < Columns::kEdge; ++x) {
      const std::uint8_t marks = moved.marks(x, y);
      if ((marks & (ColumnMarks::kTall | ColumnMarks::kLow)) == 0) continue;
      const double u = at.cosine * moved.center_m(x) - at.sine * moved.center_m(y) + at.x_m;
      const double v = at.sine * moved.center_m(x) + at.cosine * moved.center_m(y) + at.y_m;
      const int column = fixed.place(u);
      const int row = fixed.place(v);
      if ((marks & ColumnMarks::kTall) != 0)
        sum += worth(fixed, column, row, ColumnMarks::kTall, ColumnMarks::kTallFree, 4);
      if ((marks & ColumnMarks::kLow) != 0)
        sum += worth(fixed, column, row, ColumnMarks::kLow, ColumnMarks::kLowFree, 3);
    }
  }
  return sum;
}

}  // namespace

TEST_CASE(
    "each candidate's score is the sum over all columns, and none is left out that is better") {
  const auto a = map_of(large_hall(), left_of(22.0), room_classes());
  const auto b =
      map_of(large_hall(), right_of(8.0, frame_of(40.0, 1.0, 0.0, {2, 3, 0})), room_classes());
  AlignedMemory memory(2 * MapSketch::required_bytes() + 2 * Columns::required_bytes() +
                       YawSearch::required_bytes());
  Arena arena = memory.arena();
  MapSketch sketch_a = *MapSketch::make(arena);
  MapSketch sketch_b = *MapSketch::make(arena);
  Columns fixed = *Columns::make(arena);
  Columns moved = *Columns::make(arena);
  YawSearch search = *YawSearch::make(arena);
  draw_sketch(sketch_a, a->map);
  draw_sketch(sketch_b, b->map);
  fixed.draw(sketch_a, level_of(sketch_a));
  moved.draw(sketch_b, level_of(sketch_b));
  search.take_moved(moved);
  constexpr double kReach_m = 4.0;
  search.take_fixed(fixed, kReach_m);
  const std::vector<int> steps{159, 160, 161};
  for (const int step : steps) {
    const std::array<double, 2> at = YawSearch::direction(step);
    search.try_heading({at[0], at[1], -2.0, 0.5, step, 0});
  }
  REQUIRE_FALSE(search.candidates().empty());
  for (const Candidate& candidate : search.candidates())
    CHECK(candidate.score == score_of(moved, fixed, candidate));
  // All shifts, one by one: none that is further inside the window is better than the best.
  int best = 0;
  for (const int step : steps) {
    const std::array<double, 2> at = YawSearch::direction(step);
    for (int v = -4; v <= 4; ++v) {
      for (int u = -4; u <= 4; ++u)
        best = std::max(best, score_of(moved, fixed,
                                       {at[0], at[1], -2.0 + u * fixed.width_m(),
                                        0.5 + v * fixed.width_m(), step, 0}));
    }
  }
  CHECK(search.candidates().front().score == best);
  // Sorted, and apart from each other.
  for (std::size_t i = 1; i < search.candidates().size(); ++i)
    CHECK(search.candidates()[i - 1].score >= search.candidates()[i].score);
}

TEST_CASE("headings are two degrees apart") {
  for (int step = 0; step < YawSearch::kYaws; ++step) {
    const std::array<double, 2> at = YawSearch::direction(step);
    CHECK(at[0] == Approx(std::cos(step * std::numbers::pi / 90.0)).margin(1e-12));
    CHECK(at[1] == Approx(std::sin(step * std::numbers::pi / 90.0)).margin(1e-12));
  }
}

}  // namespace tessera
