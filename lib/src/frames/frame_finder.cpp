// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/frame_finder.hpp"

#include <cmath>

#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

bool is_source(const SketchSource& source) noexcept {
  return source.take != nullptr && source.resolution_m > 0.0;
}
bool is_length(double value) noexcept { return value >= 0.0 && value <= 1000.0; }

}  // namespace

const char* to_string(FrameVerdict verdict) noexcept {
  switch (verdict) {
    case FrameVerdict::kFound:
      return "found";
    case FrameVerdict::kTooLittle:
      return "a map has too few upright surfaces";
    case FrameVerdict::kNoneFits:
      return "the maps have too little in common at any place";
    case FrameVerdict::kContradicted:
      return "where the maps fit best, surfaces of one are in free space of the other";
    case FrameVerdict::kAmbiguous:
      return "the maps fit at another place nearly as well";
    case FrameVerdict::kLoose:
      return "what the maps have in common does not hold them in every direction";
    case FrameVerdict::kOutOfReach:
      return "the maps fit best beyond the reach of the search";
  }
  return "invalid";
}

Result<FrameFinder> FrameFinder::make(Arena& arena) noexcept {
  // One variable is returned, so that it is where the caller wants it, and not on the stack twice.
  Result<FrameFinder> made = FrameFinder();
  if (const Status status = make_at(*made, arena); status != Status::kOk) made = status;
  return made;
}

Status FrameFinder::make_at(FrameFinder& place, Arena& arena) noexcept {
  if (!arena.aligned() || arena.remaining_bytes() < required_bytes())
    return Status::kResourceExhausted;
  place.a_ = *MapSketch::make(arena);
  place.b_ = *MapSketch::make(arena);
  place.columns_ = *Columns::make(arena);
  if (const Status status = YawSearch::make_at(place.search_, arena); status != Status::kOk)
    return status;
  place.scratch_ = arena.take<KeyedIndex>(MapSketch::kScratch);
  return Status::kOk;
}

Status FrameFinder::begin(const LocalMap& a, const LocalMap& b,
                          const FrameQuestion& question) noexcept {
  return begin(sketch_source_of(a), sketch_source_of(b), question);
}

Status FrameFinder::begin(const SketchSource& a, const SketchSource& b,
                          const FrameQuestion& question) noexcept {
  const auto is_near = [&](int axis) {
    constexpr double kFarthest_m = 1e6;
    const double t = question.T_a_b_guess(axis, 3);
    return t <= kFarthest_m && t >= -kFarthest_m;
  };
  const bool is_valid =
      check_rigid(question.T_a_b_guess) == Status::kOk && is_near(0) && is_near(1) && is_near(2) &&
      is_length(question.reach_m) && is_length(question.reach_z_m) &&
      question.reach_z_m <= FrameQuestion::kMostReachZ_m && question.yaw_steps >= 0 &&
      (question.is_guess || !question.is_refinement) && is_source(a) && is_source(b);
  if (!is_valid) return Status::kInvalidArgument;
  source_a_ = a;
  source_b_ = b;
  question_ = question;
  answer_ = {};
  answer_.T_a_b = question.T_a_b_guess;
  finalist_count_ = 0;
  steps_ = 0;
  if (!a.keeps) a_.begin(a.resolution_m);
  if (!b.keeps) b_.begin(b.resolution_m);
  cursor_ = {};
  phase_ = Phase::kTakeA;
  return Status::kOk;
}

bool FrameFinder::step() noexcept {
  if (phase_ != Phase::kDone) ++steps_;
  switch (phase_) {
    case Phase::kTakeA:
      if (!source_a_.take(source_a_.context, cursor_, a_)) break;
      cursor_ = {};
      phase_ = Phase::kTakeB;
      break;
    case Phase::kTakeB:
      if (source_b_.take(source_b_.context, cursor_, b_)) phase_ = Phase::kFinishA;
      break;
    case Phase::kFinishA:
      a_.finish(scratch_);
      level_a_ = level_of(a_);
      phase_ = Phase::kFinishB;
      break;
    case Phase::kFinishB:
      b_.finish(scratch_);
      level_b_ = level_of(b_);
      phase_ = Phase::kMoved;
      if (question_.is_refinement) begin_refinement();
      break;
    case Phase::kMoved:
      columns_.draw(b_, level_b_);
      search_.take_moved(columns_);
      least_standing_ = columns_.standing();
      phase_ = Phase::kFixed;
      break;
    case Phase::kFixed:
      columns_.draw(a_, level_a_);
      search_.take_fixed(columns_, question_.reach_m);
      if (columns_.standing() < least_standing_) least_standing_ = columns_.standing();
      begin_guess();
      break;
    case Phase::kGuess:
      if (!fit_.step()) break;
      answer_.agreement_guess = fit_.agreement();
      at_ = 0;
      phase_ = least_standing_ < kLeastColumns ? Phase::kDone : Phase::kYaw;
      break;
    case Phase::kYaw:
      try_heading();
      break;
    case Phase::kRank:
    case Phase::kRival:
      if (fit_.step()) take_ranked();
      break;
    case Phase::kFit:
      if (fit_.step()) take_fitted();
      break;
    case Phase::kPolish:
      if (fit_.step()) take_polished();
      break;
    case Phase::kDone:
      break;
  }
  return phase_ == Phase::kDone;
}

void FrameFinder::begin_guess() noexcept {
  // The heading of the guess between the levelled frames.
  const Matrix34d T =
      product(product(level_a_.transform(), question_.T_a_b_guess), inverse(level_b_.transform()));
  const double length = std::sqrt(T(0, 0) * T(0, 0) + T(1, 0) * T(1, 0));
  heading_ = length > 0.0 ? std::array<double, 2>{T(0, 0) / length, T(1, 0) / length}
                          : std::array<double, 2>{1.0, 0.0};
  fit_.begin(a_, b_, question_.T_a_b_guess, level_b_.origin_map, {{}, 1, kCheckedSurfaces});
  phase_ = Phase::kGuess;
}

int FrameFinder::headings() const noexcept {
  const bool is_narrow = question_.is_guess && question_.yaw_steps < YawSearch::kYaws / 2;
  return is_narrow ? 2 * question_.yaw_steps + 1 : YawSearch::kYaws;
}

std::uint32_t FrameFinder::percent() const noexcept {
  const auto between = [this](std::uint32_t first, std::uint32_t last, std::size_t count) {
    const auto at = static_cast<std::size_t>(at_ > 0 ? at_ : 0);
    return first + static_cast<std::uint32_t>((last - first) * at / (count == 0 ? 1 : count));
  };
  switch (phase_) {
    case Phase::kTakeA:
      return 0;
    case Phase::kTakeB:
      return 15;
    case Phase::kFinishA:
    case Phase::kFinishB:
    case Phase::kMoved:
    case Phase::kFixed:
    case Phase::kGuess:
      return 30;
    case Phase::kYaw:
      return between(35, 55, static_cast<std::size_t>(headings()));
    case Phase::kRank:
      return between(55, 75, search_.candidates().size());
    case Phase::kRival:
      return between(75, 85, rival_count_ * kStarts);
    case Phase::kFit:
      return between(85, 95, finalist_count_);
    case Phase::kPolish:
      return 95;
    case Phase::kDone:
      break;
  }
  return 100;
}

void FrameFinder::try_heading() noexcept {
  // 0, 1, -1, 2, -2 ... so that a step is tried once.
  const int turn = at_ % 2 == 1 ? (at_ + 1) / 2 : -(at_ / 2);
  const int step = (turn + YawSearch::kYaws) % YawSearch::kYaws;
  const std::array<double, 2> by = YawSearch::direction(step);
  const std::array<double, 2> heading{heading_[0] * by[0] - heading_[1] * by[1],
                                      heading_[1] * by[0] + heading_[0] * by[1]};
  const Point3d middle = middle_at(heading);
  search_.try_heading({heading[0], heading[1], middle.x(), middle.y(), step, 0});
  if (++at_ < headings()) return;
  at_ = -1;
  phase_ = Phase::kRank;
  begin_next();
}

}  // namespace tessera
