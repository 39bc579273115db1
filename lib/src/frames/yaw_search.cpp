// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/internal/yaw_search.hpp"

#include "tessera/base/internal/digest.hpp"

namespace tessera {

namespace {

/// What it is worth that a column that stands is where the other sketch has one, beside one, or
/// where it has seen through.
struct Worth {
  std::int16_t same;
  std::int16_t beside;
  std::int16_t free;
};
constexpr Worth kTallWorth{4, 1, -2};
constexpr Worth kLowWorth{3, 1, -2};

std::int16_t worth_at(const Columns& columns, int x, int y, std::uint8_t stands, std::uint8_t free,
                      const Worth& worth) noexcept {
  if ((columns.marks(x, y) & stands) != 0) return worth.same;
  const bool is_inside = x > 0 && y > 0 && x + 1 < Columns::kEdge && y + 1 < Columns::kEdge;
  if (is_inside && ((columns.marks(x - 1, y) | columns.marks(x + 1, y) | columns.marks(x, y - 1) |
                     columns.marks(x, y + 1)) &
                    stands) != 0)
    return worth.beside;
  return (columns.marks(x, y) & free) != 0 ? worth.free : std::int16_t{0};
}

constexpr double kCosStep = 0.99939082701909573;
constexpr double kSinStep = 0.034899496702500972;

}  // namespace

Result<YawSearch> YawSearch::make(Arena& arena) noexcept {
  YawSearch result;
  if (const Status status = make_at(result, arena); status != Status::kOk) return status;
  return result;
}

Status YawSearch::make_at(YawSearch& place, Arena& arena) noexcept {
  if (!arena.aligned() || arena.remaining_bytes() < required_bytes())
    return Status::kResourceExhausted;
  place.tall_ = arena.take<std::int16_t>(kImage);
  place.low_ = arena.take<std::int16_t>(kImage);
  place.sums_ = arena.take<std::int16_t>(kSums);
  place.features_ = arena.take<Feature>(kMostFeatures);
  return Status::kOk;
}

std::array<double, 2> YawSearch::direction(int step) noexcept {
  std::array<double, 2> at{1.0, 0.0};
  for (int i = 0; i < step; ++i)
    at = {at[0] * kCosStep - at[1] * kSinStep, at[0] * kSinStep + at[1] * kCosStep};
  return at;
}

void YawSearch::take_moved(const Columns& columns) noexcept {
  candidate_count_ = 0;
  unsigned levels = 0;
  while (!gather(columns, levels)) ++levels;
}

bool YawSearch::gather(const Columns& columns, unsigned levels) noexcept {
  feature_count_ = 0;
  for (int place = 0; place < Columns::kEdge * Columns::kEdge; ++place) {
    const int x = place % Columns::kEdge;
    const int y = place / Columns::kEdge;
    const std::uint64_t hash = mix64(static_cast<std::uint64_t>(place) + 1);
    if ((hash & ((std::uint64_t{1} << levels) - 1)) != 0) continue;
    for (const std::uint8_t stands : {ColumnMarks::kTall, ColumnMarks::kLow}) {
      if ((columns.marks(x, y) & stands) == 0) continue;
      if (feature_count_ == kMostFeatures) return false;
      features_[feature_count_++] = {static_cast<float>(columns.center_m(x)),
                                     static_cast<float>(columns.center_m(y)),
                                     stands == ColumnMarks::kTall};
    }
  }
  return true;
}

void YawSearch::take_fixed(const Columns& columns, double reach_m) noexcept {
  width_m_ = columns.width_m();
  // One more on each side, as a peak is higher than its neighbours.
  const int wanted = 2 * (floor_to_int(reach_m / width_m_) + 2) + 1;
  shifts_ = wanted < kMostShifts ? wanted : kMostShifts;
  for (int y = 0; y < kPadded; ++y) {
    for (int x = 0; x < kPadded; ++x) {
      const auto at = static_cast<std::size_t>(y) * kPadded + static_cast<std::size_t>(x);
      tall_[at] = worth_at(columns, x, y, ColumnMarks::kTall, ColumnMarks::kTallFree, kTallWorth);
      low_[at] = worth_at(columns, x, y, ColumnMarks::kLow, ColumnMarks::kLowFree, kLowWorth);
    }
  }
}

void YawSearch::try_heading(const Candidate& around) noexcept {
  const int half = shifts_ / 2;
  const double half_m = half * width_m_;
  Candidate first = around;
  first.x_m -= half_m;
  first.y_m -= half_m;
  for (std::int16_t& sum : sums_) sum = 0;
  for (std::size_t i = 0; i < feature_count_; ++i) add_feature(features_[i], first);
  keep_peaks(first);
}

void YawSearch::add_feature(const Feature& feature, const Candidate& first) noexcept {
  const auto of_x = static_cast<double>(feature.x_m);
  const auto of_y = static_cast<double>(feature.y_m);
  const double x_m = first.cosine * of_x - first.sine * of_y + first.x_m;
  const double y_m = first.sine * of_x + first.cosine * of_y + first.y_m;
  const int first_x = floor_to_int(x_m / width_m_) + kPadded / 2;
  const int first_y = floor_to_int(y_m / width_m_) + kPadded / 2;
  const int from_x = first_x < 0 ? -first_x : 0;
  const int to_x = first_x + shifts_ > kPadded ? kPadded - first_x : shifts_;
  const int from_y = first_y < 0 ? -first_y : 0;
  const int to_y = first_y + shifts_ > kPadded ? kPadded - first_y : shifts_;
  if (from_x >= to_x) return;
  const std::span<const std::int16_t> image = feature.is_tall ? tall_ : low_;
  for (int y = from_y; y < to_y; ++y) {
    std::int16_t* const sums = &sums_[static_cast<std::size_t>(y) * kMostShifts];
    const std::int16_t* const row =
        image.data() + static_cast<std::ptrdiff_t>(first_y + y) * kPadded + (first_x + from_x);
    for (int x = from_x; x < to_x; ++x)
      sums[x] = static_cast<std::int16_t>(sums[x] + row[x - from_x]);
  }
}

void YawSearch::keep_peaks(const Candidate& first) noexcept {
  const auto sum = [&](int x, int y) {
    return sums_[static_cast<std::size_t>(y) * kMostShifts + static_cast<std::size_t>(x)];
  };
  for (int y = 1; y + 1 < shifts_; ++y) {
    for (int x = 1; x + 1 < shifts_; ++x) {
      const std::int16_t here = sum(x, y);
      if (here <= 0) continue;
      if (candidate_count_ == kMostCandidates && here <= candidates_.back().score) continue;
      if (sum(x - 1, y) > here || sum(x + 1, y) >= here || sum(x, y - 1) > here ||
          sum(x, y + 1) >= here)
        continue;
      Candidate found = first;
      found.x_m += x * width_m_;
      found.y_m += y * width_m_;
      found.score = here;
      keep(found);
    }
  }
}

void YawSearch::keep(const Candidate& candidate) noexcept {
  const double near_m = 2.5 * width_m_;
  const auto is_near = [&](const Candidate& other) {
    const int turn = other.yaw_step - candidate.yaw_step;
    const int steps = (turn < 0 ? -turn : turn) % kYaws;
    const double dx = other.x_m - candidate.x_m;
    const double dy = other.y_m - candidate.y_m;
    return (steps <= 2 || steps >= kYaws - 2) && dx < near_m && -dx < near_m && dy < near_m &&
           -dy < near_m;
  };
  for (std::size_t i = 0; i < candidate_count_; ++i) {
    if (is_near(candidates_[i]) && candidates_[i].score >= candidate.score) return;
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < candidate_count_; ++i) {
    if (!is_near(candidates_[i])) candidates_[kept++] = candidates_[i];
  }
  candidate_count_ = kept;
  if (candidate_count_ == kMostCandidates) --candidate_count_;
  std::size_t place = candidate_count_++;
  while (place > 0 && candidates_[place - 1].score < candidate.score) {
    candidates_[place] = candidates_[place - 1];
    --place;
  }
  candidates_[place] = candidate;
}

}  // namespace tessera
