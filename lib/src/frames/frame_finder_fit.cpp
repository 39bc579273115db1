// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// From candidates to an answer: they are placed in height, fitted, compared and judged.
#include <cmath>

#include "tessera/base/rigid.hpp"
#include "tessera/frames/frame_finder.hpp"

namespace tessera {

namespace {

Matrix34d turned(const std::array<double, 2>& heading, const Point3d& t) noexcept {
  Matrix34d T;
  T << heading[0], -heading[1], 0.0, t.x(), heading[1], heading[0], 0.0, t.y(), 0.0, 0.0, 1.0,
      t.z();
  return T;
}

/// Whether two transforms put a point over 1 m apart, or differ by over 6 degrees: fits of one
/// place with few surfaces end up to 4 degrees apart.
bool is_elsewhere(const Matrix34d& one, const Matrix34d& other, const Point3d& p_b) noexcept {
  constexpr double kApart_m = 1.0;
  constexpr double kCos6 = 0.99452;
  if (norm(Point3d(apply(one, p_b) - apply(other, p_b))) > kApart_m) return true;
  const Matrix34d between = product(inverse(one), other);
  return (between(0, 0) + between(1, 1) + between(2, 2) - 1.0) / 2.0 < kCos6;
}

// From far to near.
using Round = SurfaceFit::Round;
constexpr std::array<Round, 8> kRankRounds{{{1.5, 0.3},
                                            {1.5, 0.3},
                                            {1.5, 0.3},
                                            {1.5, 0.15},
                                            {1.5, 0.15},
                                            {1.0, 0.08},
                                            {1.0, 0.08},
                                            {1.0, 0.08}}};
constexpr std::array<Round, 8> kFitRounds{{{1.2, 0.1},
                                           {1.2, 0.1},
                                           {1.2, 0.1},
                                           {1.2, 0.1},
                                           {0.8, 0.05},
                                           {0.8, 0.05},
                                           {0.8, 0.05},
                                           {0.8, 0.05}}};
constexpr std::array<Round, 6> kPolishRounds{
    {{0.8, 0.04}, {0.8, 0.04}, {0.8, 0.04}, {0.8, 0.04}, {0.8, 0.04}, {0.8, 0.04}}};
constexpr std::array<Round, 4> kRefineRounds{{{0.8, 0.05}, {0.8, 0.04}, {0.8, 0.04}, {0.8, 0.04}}};

}  // namespace

Point3d FrameFinder::middle_at(const std::array<double, 2>& heading) const noexcept {
  if (question_.is_guess)
    return level_a_.to_level(apply(question_.T_a_b_guess, level_b_.origin_map));
  const Matrix34d turn = turned(heading, Point3d::Zero());
  const Matrix3& A = level_a_.rows;
  const Matrix34d back = [&] {
    Matrix34d T;
    T << A[0], A[3], A[6], 0.0, A[1], A[4], A[7], 0.0, A[2], A[5], A[8], 0.0;
    return T;
  }();
  const Matrix3& B = level_b_.rows;
  Matrix34d to_level;
  to_level << B[0], B[1], B[2], 0.0, B[3], B[4], B[5], 0.0, B[6], B[7], B[8], 0.0;
  const Matrix34d R = product(product(back, turn), to_level);
  const Matrix34d& guess = question_.T_a_b_guess;
  const Point3d t{guess(0, 3), guess(1, 3), guess(2, 3)};
  return level_a_.to_level(Point3d(apply(R, level_b_.origin_map) + t));
}

double FrameFinder::height_of(const Candidate& candidate) const noexcept {
  constexpr double kBin_m = 0.2;
  constexpr int kBins = 160;
  std::array<std::uint32_t, kBins> bins{};
  const double around_m = middle_at({candidate.cosine, candidate.sine}).z();
  for (std::uint32_t i = 0; i < b_.surface_count(); ++i) {
    const MapSketch::Surface& surface = b_.surface(i);
    if (surface.kind != MapSketch::Kind::kFlat) continue;
    const Point3d p = level_b_.to_level(b_.center_of(surface));
    const int x = columns_.place(candidate.cosine * p.x() - candidate.sine * p.y() + candidate.x_m);
    const int y = columns_.place(candidate.sine * p.x() + candidate.cosine * p.y() + candidate.y_m);
    if (x < 0 || y < 0 || x >= Columns::kEdge || y >= Columns::kEdge ||
        (columns_.marks(x, y) & ColumnMarks::kSeen) == 0)
      continue;
    const double z_m = columns_.lowest_m(x, y) - p.z() - around_m;
    if (z_m > question_.reach_z_m + 1.0 || z_m < -question_.reach_z_m - 1.0) continue;
    const int bin = floor_to_int(z_m / kBin_m) + kBins / 2;
    if (bin >= 0 && bin < kBins) ++bins[static_cast<std::size_t>(bin)];
  }
  std::size_t best = kBins / 2;
  std::uint32_t most = 0;
  for (std::size_t i = 1; i + 1 < kBins; ++i) {
    const std::uint32_t count = bins[i - 1] + 2 * bins[i] + bins[i + 1];
    if (count <= most) continue;
    most = count;
    best = i;
  }
  return around_m + (static_cast<double>(best) - kBins / 2.0 + 0.5) * kBin_m;
}

Matrix34d FrameFinder::place_of(std::size_t candidate, int columns_x,
                                int columns_y) const noexcept {
  const Candidate& at = search_.candidates()[candidate];
  const Matrix34d between = turned(
      {at.cosine, at.sine}, {at.x_m + columns_x * columns_.width_m(),
                             at.y_m + columns_y * columns_.width_m(), ranked_[candidate].height_m});
  return product(product(inverse(level_a_.transform()), between), level_b_.transform());
}

void FrameFinder::begin_next() noexcept {
  ++at_;
  const auto at = static_cast<std::size_t>(at_);
  if (phase_ == Phase::kRank) {
    if (at < search_.candidates().size()) return begin_ranked(at);
    choose_rivals();
    phase_ = Phase::kRival;
    at_ = 0;
  }
  if (phase_ == Phase::kRival) {
    const auto start = static_cast<std::size_t>(at_);
    if (start < rival_count_ * kStarts) return begin_rival(start);
    phase_ = Phase::kFit;
    at_ = 0;
  }
  const auto finalist = static_cast<std::size_t>(at_);
  if (finalist >= finalist_count_) return begin_best();
  fit_.begin(a_, b_, finalists_[finalist].T_a_b, level_b_.origin_map,
             {kFitRounds, kFittedSurfaces, kCheckedSurfaces});
}

void FrameFinder::begin_ranked(std::size_t at) noexcept {
  ranked_[at] = {height_of(search_.candidates()[at]), 0.0};
  fit_.begin(a_, b_, place_of(at, 0, 0), level_b_.origin_map,
             {kRankRounds, kRankedSurfaces, kRankedSurfaces});
}

void FrameFinder::begin_rival(std::size_t at) noexcept {
  // The columns about the one that it was fitted from.
  const auto turn = static_cast<int>(at % kStarts);
  const int place = turn < 4 ? turn : turn + 1;
  fit_.begin(a_, b_, place_of(rivals_[at / kStarts], place % 3 - 1, place / 3 - 1),
             level_b_.origin_map, {kRankRounds, kRivalSurfaces, kRankedSurfaces});
}

void FrameFinder::begin_best() noexcept {
  if (finalist_count_ == 0) {
    answer_.verdict = FrameVerdict::kNoneFits;
    phase_ = Phase::kDone;
    return;
  }
  best_ = 0;
  for (std::size_t i = 1; i < finalist_count_; ++i) {
    if (finalists_[i].support > finalists_[best_].support) best_ = i;
  }
  fit_.begin(a_, b_, finalists_[best_].T_a_b, level_b_.origin_map,
             {kPolishRounds, kCheckedSurfaces, kCheckedSurfaces});
  phase_ = Phase::kPolish;
}

void FrameFinder::begin_refinement() noexcept {
  fit_.begin(a_, b_, question_.T_a_b_guess, level_b_.origin_map,
             {kRefineRounds, kCheckedSurfaces, kCheckedSurfaces});
  phase_ = Phase::kPolish;
}

void FrameFinder::choose_rivals() noexcept {
  // The best is one of them: it too may have ended a column beside.
  rival_count_ = 0;
  if (finalist_count_ == 0) return;
  std::array<bool, YawSearch::kMostCandidates> is_taken{};
  const std::size_t count = search_.candidates().size();
  while (rival_count_ < kRivals) {
    std::size_t next = count;
    for (std::size_t i = 0; i < count; ++i) {
      if (is_taken[i]) continue;
      const bool by_columns = rival_count_ < kRivalsByColumns;
      if (next == count || (!by_columns && ranked_[i].support > ranked_[next].support)) next = i;
    }
    if (next == count) return;
    is_taken[next] = true;
    rivals_[rival_count_++] = next;
  }
}

void FrameFinder::take_ranked() noexcept {
  const Finalist found{fit_.transform(), fit_.agreement(), fit_.agreement().support()};
  if (phase_ == Phase::kRank) ranked_[static_cast<std::size_t>(at_)].support = found.support;
  if (fit_.is_held()) keep_finalist(found);
  begin_next();
}

void FrameFinder::take_fitted() noexcept {
  const Agreement& there = fit_.agreement();
  finalists_[static_cast<std::size_t>(at_)] = {fit_.transform(), there, there.support()};
  begin_next();
}

void FrameFinder::keep_finalist(const Finalist& finalist) noexcept {
  // Of those at one place the best stays.
  for (std::size_t i = 0; i < finalist_count_; ++i) {
    if (is_elsewhere(finalists_[i].T_a_b, finalist.T_a_b, level_b_.origin_map)) continue;
    if (finalists_[i].support >= finalist.support) return;
    for (std::size_t k = i + 1; k < finalist_count_; ++k) finalists_[k - 1] = finalists_[k];
    --finalist_count_;
    break;
  }
  if (finalist_count_ == kFinalists) {
    if (finalists_.back().support >= finalist.support) return;
    --finalist_count_;
  }
  std::size_t place = finalist_count_++;
  while (place > 0 && finalists_[place - 1].support < finalist.support) {
    finalists_[place] = finalists_[place - 1];
    --place;
  }
  finalists_[place] = finalist;
}

void FrameFinder::take_polished() noexcept {
  phase_ = Phase::kDone;
  const FitSums& sums = fit_.fit().sums();
  answer_.T_a_b = fit_.transform();
  answer_.middle_a = fit_.fit().pivot_a();
  answer_.pairs = sums.pairs;
  answer_.agreement = fit_.agreement();
  answer_.support = answer_.agreement.support();
  // Of other places the one that makes this one most doubtful.
  double least_clear = 0.0;
  for (std::size_t i = 0; i < finalist_count_; ++i) {
    const Finalist& other = finalists_[i];
    const double clear = other.support / most_second(answer_.agreement, other.agreement);
    if (i == best_ || clear <= least_clear ||
        !is_elsewhere(answer_.T_a_b, other.T_a_b, level_b_.origin_map))
      continue;
    least_clear = clear;
    answer_.support_second = other.support;
    answer_.agreement_second = other.agreement;
  }
  answer_.verdict = verdict(fit_.is_held() && find_covariance(sums), least_clear);
}

bool FrameFinder::find_covariance(const FitSums& sums) noexcept {
  Matrix6 covariance{};
  if (!invert(sums.information, covariance)) return false;
  // Surfaces beside each other err together, and the squares tell by how much they err.
  const double of_square = sums.weight > 0.0 ? sums.squares / sums.weight : 1.0;
  const double factor = kPairsAsOne * (of_square > 1.0 ? of_square : 1.0);
  for (double& entry : covariance) entry *= factor;
  answer_.covariance = covariance;
  const Matrix6& C = covariance;
  answer_.worst_sigma_m = std::sqrt(eigen_of({C[0], C[1], C[2], C[7], C[8], C[14]}).values[2]);
  answer_.worst_sigma_rad =
      std::sqrt(eigen_of({C[21], C[22], C[23], C[28], C[29], C[35]}).values[2]);
  return true;
}

bool FrameFinder::is_in_reach() const noexcept {
  const Point3d about_b = question_.is_guess ? level_b_.origin_map : Point3d(Point3d::Zero());
  const Point3d off = apply(answer_.T_a_b, about_b) - apply(question_.T_a_b_guess, about_b);
  const auto is_within = [](double value, double reach_m) {
    return value <= reach_m && value >= -reach_m;
  };
  const double reach_m = question_.reach_m + Columns::width_of(a_);
  return is_within(off.x(), reach_m) && is_within(off.y(), reach_m) &&
         is_within(off.z(), question_.reach_z_m + 1.0);
}

double FrameFinder::most_second(const Agreement& best, const Agreement& second) noexcept {
  const bool has_ground = static_cast<double>(second.flat_agreed) >=
                          kLeastGround * static_cast<double>(best.flat_agreed);
  return has_ground && second.share() >= kLeastShare ? kMostCleanSecond : kMostSecond;
}

double FrameFinder::needed() const noexcept {
  const Agreement& found = answer_.agreement;
  const auto agreed = static_cast<double>(found.agreed);
  const double all = agreed + static_cast<double>(found.contradicted + found.unseen);
  const double of_all = all > 0.0 ? agreed / all : 0.0;
  const double of_thickness =
      ((a_.is_fine() ? kOfFine : 1.0) + (b_.is_fine() ? kOfFine : 1.0)) / 2.0;
  const double least = of_thickness * kLeastSupport * (1.0 - of_all / kMuch);
  return least > kLeastOfAll ? least : kLeastOfAll;
}

FrameVerdict FrameFinder::verdict(bool is_held, double least_clear) const noexcept {
  const double least = needed();
  if (static_cast<double>(answer_.agreement.agreed) < least) return FrameVerdict::kNoneFits;
  if (answer_.support < least || answer_.agreement.share() < kLeastShare)
    return FrameVerdict::kContradicted;
  if (least_clear > answer_.support) return FrameVerdict::kAmbiguous;
  if (!is_held || answer_.worst_sigma_m > kMostSigma_m || answer_.worst_sigma_rad > kMostSigma_rad)
    return FrameVerdict::kLoose;
  return is_in_reach() ? FrameVerdict::kFound : FrameVerdict::kOutOfReach;
}

}  // namespace tessera
