// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/pair_alignment.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/number_text.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

/// Compared voxels of a pair.
constexpr std::uint32_t kCompared = 20000;
/// Below this share of equal labels a pair is warned about.
constexpr double kLeastAgreement = 0.5;
constexpr std::uint32_t kLeastCommon = 100;
/// A frame that is found near the given one is another one from here on.
constexpr double kOff_m = 0.15;
constexpr double kOff_voxels = 1.0;
constexpr double kOff_deg = 0.5;

Matrix34d frame_of(const FuseInput& input) {
  return product(input.T_global_map, input.T_map_submap);
}

/// The middle of a map's blocks, and how far from there they reach; metres, map frame.
struct Ball {
  Point3d middle = Point3d::Zero();
  double radius_m = 0.0;
};
Ball ball_of(const LocalMap& map) {
  constexpr double kFar = 1e9;
  Point3d low{kFar, kFar, kFar};
  Point3d high{-kFar, -kFar, -kFar};
  SweepCursor cursor;
  map.visit_blocks(cursor, map.index().slots(), [&](BlockKey key, SlabHandle) {
    const BlockCoord at = unpack(key);
    const Point3d corner = Point3d(at.x, at.y, at.z) * (kBlockEdge * map.lattice().resolution_m());
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
    return true;
  });
  if (high.x() < low.x()) return {};
  return {(low + high) / 2.0,
          norm(Point3d(high - low)) / 2.0 + 2.0 * kBlockEdge * map.lattice().resolution_m()};
}

bool may_meet(const Ball& first, const Ball& second, const Matrix34d& T_first_second) {
  const Point3d apart = apply(T_first_second, second.middle) - first.middle;
  return norm(apart) <= first.radius_m + second.radius_m;
}

std::string names_of(const FuseInput& first, const FuseInput& second) {
  return first.path + " and " + second.path;
}

/// The warning about a pair whose surfaces lie on each other markedly better elsewhere; empty: they
/// lie well.
std::optional<Message> surface_warning(const FuseInput& first, const FuseInput& second,
                                       const FrameAnswer& found, const Matrix34d& given) {
  constexpr double kBetter = 0.9;
  constexpr double kSigmas = 3.0;
  if (found.verdict != FrameVerdict::kFound ||
      found.agreement_guess.support() > kBetter * found.support)
    return std::nullopt;
  const double resolution_m = first.stored->map.config().resolution_m;
  const Point3d middle_b = apply(inverse(found.T_a_b), found.middle_a);
  const Point3d shift_m = found.middle_a - apply(given, middle_b);
  const Matrix34d turn = product(found.T_a_b, inverse(given));
  const double off_m =
      std::max({kOff_m, kOff_voxels * resolution_m, kSigmas * found.worst_sigma_m});
  const double off_deg = std::max(kOff_deg, kSigmas * degrees_of(found.worst_sigma_rad));
  if (norm(shift_m) < off_m && angle_deg(turn) < off_deg) return std::nullopt;
  return Message(fmt::format(
      "{} are misaligned: they agree better if the second is moved by {:.2f}, {:.2f}, {:.2f} m in "
      "the middle of the overlap, and turned by {:.1f} degrees about z, in the frame of the first; "
      "check their transforms, or have frames found (align)",
      names_of(first, second), shift_m.x(), shift_m.y(), shift_m.z(),
      degrees_of(std::atan2(turn(1, 0), turn(0, 0)))));
}

/// is_placed: surfaces say that the frames are right, and know better.
std::optional<Message> label_warning(const FuseInput& first, const FuseInput& second,
                                     const Alignment& alignment, bool is_placed) {
  const double resolution_m = first.stored->map.config().resolution_m;
  if (alignment.common < kLeastCommon) return std::nullopt;
  if (alignment.shifted() && !is_placed && !first.placed && !second.placed)
    return Message(names_of(first, second) +
                   " do not lie on each other where their frames are taken for the same one");
  if (alignment.shifted() && !is_placed) {
    const auto metres = [&](std::size_t axis) {
      return text_of(alignment.best_shift[axis] * resolution_m);
    };
    return Message(names_of(first, second) +
                   " are misaligned: they agree better if the second is moved by " + metres(0) +
                   ", " + metres(1) + ", " + metres(2) +
                   " m in the frame of the first; check their transforms");
  }
  if (alignment.agreement() < kLeastAgreement)
    return Message(names_of(first, second) + " have the same class at " +
                   text_of(100.0 * alignment.agreement()) +
                   " % of their common voxels; check their transforms and labels");
  return std::nullopt;
}

}  // namespace

bool is_whole(const FuseInput& input) { return input.id.submap == 0; }

Matrix34d between(const FuseInput& first, const FuseInput& second) {
  const Matrix34d of_first = frame_of(first);
  const Matrix34d of_second = frame_of(second);
  return of_first == of_second ? Matrix34d(Matrix34d::Identity())
                               : between_frames(of_first, of_second);
}

std::optional<Alignment> labels_of(const FuseInput& first, const FuseInput& second,
                                   const Matrix34d& T_first_second) {
  const LocalMap& map = first.stored->map;
  const Result<GridTransform> T = GridTransform::make(T_first_second, map.config().resolution_m);
  if (!T.ok()) return std::nullopt;
  const Alignment alignment = AlignmentCheck::measure(map, second.stored->map, *T, kCompared);
  return alignment.common == 0 ? std::nullopt : std::optional(alignment);
}

std::vector<PairAlignment> align_inputs(const std::vector<FuseInput>& inputs,
                                        std::vector<Message>& warnings,
                                        const PairsProgress::Done& done) {
  PairsProgress progress(done, inputs.size());
  std::vector<PairAlignment> pairs;
  std::unique_ptr<FrameRun> run;
  if (inputs.size() <= kMostAligned) {
    Outcome<std::unique_ptr<FrameRun>> prepared = FrameRun::prepare();
    if (prepared.ok()) run = std::move(*prepared);
  }
  std::size_t at = 0;
  std::vector<Ball> balls;
  for (const FuseInput& input : inputs) balls.push_back(ball_of(input.stored->map));
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    for (std::size_t j = i + 1; j < inputs.size(); ++j) {
      const FuseInput& first = inputs[i];
      const FuseInput& second = inputs[j];
      if (at != 0) progress.end_pair();
      ++at;
      // Those of one robot are as its poses have them.
      if (first.id.robot == second.id.robot && first.id.submap != second.id.submap) continue;
      const Matrix34d given = between(first, second);
      PairAlignment pair{i, j, labels_of(first, second, given), std::nullopt};
      std::optional<Message> warning;
      if (run && is_whole(first) && is_whole(second) && may_meet(balls[i], balls[j], given)) {
        const Outcome<FrameAnswer> answer =
            run->find(first.stored->map, second.stored->map, question_near(given, kNearGiven),
                      progress.part(0, 100));
        if (answer.ok()) pair.frame = *answer;
      }
      if (pair.frame) warning = surface_warning(first, second, *pair.frame, given);
      const bool is_placed = pair.frame && pair.frame->verdict == FrameVerdict::kFound;
      if (!warning && pair.labels) warning = label_warning(first, second, *pair.labels, is_placed);
      if (warning) warnings.push_back(*std::move(warning));
      if (pair.labels || pair.frame) pairs.push_back(pair);
    }
  }
  if (at != 0) progress.end_pair();
  return pairs;
}

Json frames_json(const std::vector<PairAlignment>& pairs, const std::vector<FuseInput>& inputs) {
  Json json = Json::array();
  for (const PairAlignment& pair : pairs) {
    if (!pair.frame) continue;
    Json row = {{"first", inputs[pair.first].path}, {"second", inputs[pair.second].path}};
    row.update(to_json(*pair.frame));
    json.push_back(std::move(row));
  }
  return json;
}

}  // namespace tessera
