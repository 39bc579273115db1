// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The transform between two maps of one place, from what both have seen: found without a guess, or
// refused with a reason. docs/frames.md.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "tessera/frames/internal/place_fit.hpp"
#include "tessera/frames/internal/yaw_search.hpp"
#include "tessera/frames/map_sketch.hpp"
#include "tessera/frames/sketch_source.hpp"

namespace tessera {

/// What became of a search.
enum class FrameVerdict : std::uint8_t {
  kFound = 0,
  kTooLittle = 1,     ///< A map has too few surfaces that stand.
  kNoneFits = 2,      ///< Nowhere do enough surfaces lie on each other.
  kContradicted = 3,  ///< Where it fits best, surfaces of one map are in free space of the other.
  kAmbiguous = 4,     ///< It fits elsewhere nearly as well.
  kLoose = 5,         ///< The overlap does not hold it in some direction.
  kOutOfReach = 6     ///< It fits best beyond the reach of the search.
};

/// One line for people; what to do about it is in docs/frames.md.
[[nodiscard]] const char* to_string(FrameVerdict verdict) noexcept;

/// Where to search.
struct FrameQuestion {
  /// Roughly the transform, where is_guess; else the heading may be any, and this is the middle of
  /// what its translation may be.
  Matrix34d T_a_b_guess = Matrix34d(Matrix34d::Identity());
  bool is_guess = false;
  /// How far off the translation may be, along x and y each, and along z; metres. Of a guess: how
  /// far off the middle of b may be. Along x and y at most YawSearch::kMostShifts / 2 columns,
  /// that is 75 m or more; along z kMostReachZ_m.
  double reach_m = 72.0;
  double reach_z_m = 12.0;
  /// How far off the heading of a guess may be, both ways; steps of two degrees.
  int yaw_steps = YawSearch::kYaws / 2;
  /// Of a guess: it was found before, of these maps when they had less. It is fitted from there,
  /// and judged by what lies on each other there; no other place is looked for.
  bool is_refinement = false;
  static constexpr double kMostReachZ_m = 15.0;
};

/// What a search found. Where nothing holds the transform, covariance and sigmas are zero.
struct FrameAnswer {
  FrameVerdict verdict = FrameVerdict::kTooLittle;
  Matrix34d T_a_b = Matrix34d(Matrix34d::Identity());  ///< The best, whatever the verdict.
  /// Of a small motion about middle_a: translation along a's axes in m, then rotation in rad.
  Matrix6 covariance{};
  Point3d middle_a = Point3d::Zero();  ///< Of the overlap.
  Agreement agreement;                 ///< There.
  Agreement agreement_second;          ///< At the other place that makes it most doubtful, or zero.
  Agreement agreement_guess;           ///< Where the guess is; of no refinement.
  double support = 0.0;                ///< Of agreement.
  double support_second = 0.0;         ///< Of agreement_second.
  double worst_sigma_m = 0.0;          ///< Of the translation, in the direction least held.
  double worst_sigma_rad = 0.0;
  std::uint32_t pairs = 0;  ///< Surfaces on surfaces.
};

/// Copies share the memory, and a search goes on in the one that began it alone.
class FrameFinder {
 public:
  /// What is accepted; docs/measured/alignment.md has the figures from which.
  static constexpr double kLeastSupport = 5'000.0;  ///< Where little of the maps is in the overlap;
  static constexpr double kLeastOfAll = 1'000.0;    ///< where much is.
  /// Of maps in fine parts (MapSketch) the first is so much of it: their surfaces are as thick as
  /// one part, those of coarse voxels as two or three.
  static constexpr double kOfFine = 0.5;
  static constexpr double kMuch = 0.5;  ///< Of all samples those that agree: in between it falls.
  static constexpr double kLeastShare = 0.95;
  static constexpr double kMostSecond = 0.5;  ///< Of the support of the best.
  /// The same where the second has kLeastShare too, and ground: it may be the right one, of which
  /// the maps have little. Such seconds have 0.07 or less where the best is right, in recorded maps
  /// and streets, and 0.18 or more where it is wrong, in worlds that look alike.
  static constexpr double kMostCleanSecond = 0.15;
  /// Flat samples that agree, of those at the best: 0.31 and more where the second is right, 0.03
  /// and less where maps touch by their walls alone, as rooms do that are side by side.
  static constexpr double kLeastGround = 0.1;
  static constexpr double kMostSigma_m = 0.1;
  static constexpr double kMostSigma_rad = 0.0087;  ///< Half a degree.

  [[nodiscard]] static constexpr std::size_t required_bytes() noexcept {
    return 2 * MapSketch::required_bytes() + Columns::required_bytes() +
           YawSearch::required_bytes() + arena_bytes<KeyedIndex>(MapSketch::kScratch);
  }
  /// Fails with kResourceExhausted iff the arena has too little memory or is not aligned.
  [[nodiscard]] static Result<FrameFinder> make(Arena& arena) noexcept;
  /// The same in place, with little stack. The place may hold anything if it fails.
  [[nodiscard]] static Status make_at(FrameFinder& place, Arena& arena) noexcept;
  FrameFinder() noexcept = default;

  /// Starts anew. The sources must stay where they are, and what they take from must be there,
  /// until step() has taken them in (taken_in()). Fails with kInvalidArgument iff the guess is not
  /// rigid or over 1000 km, a refinement has none, a reach is not finite, negative or too large, or
  /// a source has no function or no positive resolution; the search that was under way goes on
  /// then.
  [[nodiscard]] Status begin(const SketchSource& a, const SketchSource& b,
                             const FrameQuestion& question) noexcept;
  /// The same for two maps, which must stay as they are until they are taken in.
  [[nodiscard]] Status begin(const LocalMap& a, const LocalMap& b,
                             const FrameQuestion& question) noexcept;
  /// The next piece of work: a piece of a source; a sketch finished or drawn; one heading; or a
  /// piece of a fit or a check. True iff all is done. At most what a source states of a piece,
  /// 38 million additions of small numbers (one heading), 58,000 look-ups, or a sketch's cells and
  /// columns once.
  bool step() noexcept;
  [[nodiscard]] bool taken_in() const noexcept { return phase_ > Phase::kTakeB; }
  /// After the last step.
  [[nodiscard]] const FrameAnswer& answer() const noexcept { return answer_; }
  [[nodiscard]] const MapSketch& sketch_a() const noexcept { return a_; }
  [[nodiscard]] const MapSketch& sketch_b() const noexcept { return b_; }
  /// Steps of this search so far.
  [[nodiscard]] std::uint32_t steps() const noexcept { return steps_; }
  /// Roughly how much of the search is done, in hundredths; for people. O(1).
  [[nodiscard]] std::uint32_t percent() const noexcept;

 private:
  enum class Phase : std::uint8_t {
    kTakeA,
    kTakeB,
    kFinishA,
    kFinishB,
    kMoved,
    kFixed,
    kGuess,
    kYaw,
    kRank,
    kRival,
    kFit,
    kPolish,
    kDone
  };
  static constexpr std::size_t kFinalists = 6;
  /// Candidates that are fitted from the columns beside as well, as one fit may end a metre off and
  /// contradicted where the candidate is right: the first by their columns, others by their
  /// support.
  static constexpr std::size_t kRivals = 9;
  static constexpr std::size_t kRivalsByColumns = 4;
  static constexpr std::size_t kStarts = 8;  ///< Of each.
  static constexpr std::uint32_t kRankedSurfaces = 512;
  static constexpr std::uint32_t kRivalSurfaces = 256;
  static constexpr std::uint32_t kFittedSurfaces = 2'048;
  static constexpr std::uint32_t kCheckedSurfaces = 8'192;
  static constexpr std::uint32_t kLeastColumns = 24;  ///< That stand, in each map.
  /// Of neighbouring surfaces this number errs as one.
  static constexpr double kPairsAsOne = 16.0;

  /// Of a candidate, after its first fit.
  struct Ranked {
    double height_m = 0.0;
    double support = 0.0;
  };
  struct Finalist {
    Matrix34d T_a_b = Matrix34d(Matrix34d::Identity());
    Agreement agreement;
    double support = 0.0;
  };

  void begin_guess() noexcept;
  [[nodiscard]] int headings() const noexcept;
  void begin_refinement() noexcept;
  void try_heading() noexcept;
  /// Begins the fit of the next candidate, rival or finalist, or of the best, or ends.
  void begin_next() noexcept;
  void begin_ranked(std::size_t at) noexcept;
  void begin_rival(std::size_t at) noexcept;
  void begin_best() noexcept;
  /// Among candidates that are ranked. O(kRivals candidates).
  void choose_rivals() noexcept;
  void take_ranked() noexcept;
  void keep_finalist(const Finalist& finalist) noexcept;
  void take_fitted() noexcept;
  void take_polished() noexcept;
  /// False iff the surfaces do not hold it.
  [[nodiscard]] bool find_covariance(const FitSums& sums) noexcept;
  [[nodiscard]] bool is_in_reach() const noexcept;
  /// How much support a second place may have, of that of the best.
  [[nodiscard]] static double most_second(const Agreement& best, const Agreement& second) noexcept;
  /// How much support is needed.
  [[nodiscard]] double needed() const noexcept;
  /// least_clear: with less support than this the best is ambiguous.
  [[nodiscard]] FrameVerdict verdict(bool is_held, double least_clear) const noexcept;
  /// Where the middle of b is in a's levelled frame at a heading between these, by the guess or by
  /// the translation.
  [[nodiscard]] Point3d middle_at(const std::array<double, 2>& heading) const noexcept;
  [[nodiscard]] double height_of(const Candidate& candidate) const noexcept;
  /// Where a candidate puts b, so many columns beside.
  [[nodiscard]] Matrix34d place_of(std::size_t candidate, int columns_x,
                                   int columns_y) const noexcept;

  MapSketch a_;
  MapSketch b_;
  Columns columns_;
  YawSearch search_;
  std::span<KeyedIndex> scratch_;
  SketchSource source_a_;
  SketchSource source_b_;
  FrameQuestion question_;
  FrameAnswer answer_;
  Level level_a_;
  Level level_b_;
  std::array<Ranked, YawSearch::kMostCandidates> ranked_{};
  std::array<std::size_t, kRivals> rivals_{};  ///< Of the candidates.
  std::size_t rival_count_ = 0;
  std::array<Finalist, kFinalists> finalists_{};
  std::size_t finalist_count_ = 0;
  std::size_t best_ = 0;              ///< Of them.
  std::uint32_t least_standing_ = 0;  ///< Columns that stand, of the map with fewer.
  PlaceFit fit_;
  std::array<double, 2> heading_{1.0, 0.0};  ///< Cosine and sine of the guess, levelled.
  SketchSource::Cursor cursor_;
  Phase phase_ = Phase::kDone;
  int at_ = 0;
  std::uint32_t steps_ = 0;
};

}  // namespace tessera
