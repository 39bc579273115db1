// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/frame_run.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// What users may do about it.
const char* remedy_of(FrameVerdict verdict) {
  switch (verdict) {
    case FrameVerdict::kTooLittle:
      return "map more of the place, or give the transform";
    case FrameVerdict::kNoneFits:
    case FrameVerdict::kContradicted:
      return "map more of what both have seen, name a --guess, or give the transform";
    case FrameVerdict::kAmbiguous:
      return "name a --guess that tells the places apart, or give the transform";
    case FrameVerdict::kLoose:
      return "map more that stands across the free direction, or give the transform";
    case FrameVerdict::kOutOfReach:
      return "name a --guess nearer to it";
    case FrameVerdict::kFound:
      break;
  }
  return "";
}

}  // namespace

Outcome<std::unique_ptr<FrameRun>> FrameRun::prepare() {
  std::unique_ptr<FrameRun> run(new FrameRun);
  TESSERA_TRY_ASSIGN(run->memory_,
                     ArenaMemory::allocate(FrameFinder::required_bytes(), "free some memory"));
  Arena arena(run->memory_.span());
  if (FrameFinder::make_at(run->finder_, arena) != Status::kOk)
    return Failure{"aligning maps: the memory is too small", FailureKind::kFailure};
  return run;
}

Outcome<FrameAnswer> FrameRun::find(const LocalMap& a, const LocalMap& b,
                                    const FrameQuestion& question, const PercentDone& done) {
  if (finder_.begin(a, b, question) != Status::kOk)
    return Failure{"the guess is not a rigid transform, or the reach is out of range"};
  while (!finder_.step()) {
    if (done) done(finder_.percent());
  }
  return finder_.answer();
}

FrameQuestion question_of(const std::optional<Matrix34d>& guess, const MapIdentity& a,
                          const MapIdentity& b) noexcept {
  FrameQuestion question = question_of(guess);
  if (!guess && a.is_placed() && b.is_placed())
    question.T_a_b_guess = between_frames(a.place(), b.place());
  return question;
}

bool is_held(const FrameAnswer& answer) noexcept { return answer.worst_sigma_m > 0.0; }

double degrees_of(double rad) noexcept { return rad / kDegree; }

double angle_deg(const Matrix34d& T) {
  // By the sine too, as the cosine says little of small angles.
  const double x = T(2, 1) - T(1, 2);
  const double y = T(0, 2) - T(2, 0);
  const double z = T(1, 0) - T(0, 1);
  const double sine = std::sqrt(x * x + y * y + z * z) / 2.0;
  const double cosine = (T(0, 0) + T(1, 1) + T(2, 2) - 1.0) / 2.0;
  return std::atan2(sine, cosine) / kDegree;
}

std::string motion_text(const Matrix34d& T) {
  return fmt::format("moved by {:.2f}, {:.2f}, {:.2f} m and turned by {:.2f} degrees", T(0, 3),
                     T(1, 3), T(2, 3), angle_deg(T));
}

Json to_json(const Agreement& agreement) {
  return {{"share", agreement.share()},
          {"agreed", agreement.agreed},
          {"contradicted", agreement.contradicted},
          {"unseen", agreement.unseen},
          {"flat_share", agreement.flat_share()},
          {"flat_agreed", agreement.flat_agreed},
          {"labelled", agreement.labelled},
          {"same_label", agreement.same_label}};
}

Json to_json(const FrameAnswer& answer) {
  const bool is_found = answer.verdict == FrameVerdict::kFound;
  std::vector<double> transform(answer.T_a_b.data(), answer.T_a_b.data() + 12);
  transform.insert(transform.end(), {0.0, 0.0, 0.0, 1.0});
  const Point3d& middle = answer.middle_a;
  return {{"transform", transform},
          {"covariance", is_held(answer) ? Json(answer.covariance) : Json()},
          {"covariance_about", {middle.x(), middle.y(), middle.z()}},
          {"sigma_m", is_held(answer) ? Json(answer.worst_sigma_m) : Json()},
          {"sigma_deg", is_held(answer) ? Json(answer.worst_sigma_rad / kDegree) : Json()},
          {"agreement", to_json(answer.agreement)},
          {"agreement_before", to_json(answer.agreement_guess)},
          {"support", answer.support},
          {"support_second", answer.support_second},
          {"agreement_second", to_json(answer.agreement_second)},
          {"pairs", answer.pairs},
          {"accepted", is_found},
          {"reason", is_found ? Json() : Json(to_string(answer.verdict))}};
}

Outcome<void> check_found(const FrameAnswer& answer, const std::string& a, const std::string& b) {
  if (answer.verdict == FrameVerdict::kFound) return {};
  return Failure{fmt::format("{} and {} are not aligned: {}; {}", a, b, to_string(answer.verdict),
                             remedy_of(answer.verdict)),
                 FailureKind::kFailure};
}

}  // namespace tessera
