// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/fuse_frames.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstdint>
#include <span>

#include "base/number_text.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/frames/team_frames.hpp"

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

bool is_whole(const FuseInput& input) { return input.id.submap == 0; }

Matrix34d frame_of(const FuseInput& input) {
  return product(input.T_global_map, input.T_map_submap);
}

/// T_first_second as the frames have it.
Matrix34d between(const FuseInput& first, const FuseInput& second) {
  const Matrix34d of_first = frame_of(first);
  const Matrix34d of_second = frame_of(second);
  return of_first == of_second ? Matrix34d(Matrix34d::Identity())
                               : product(inverse(of_first), of_second);
}

std::string names_of(const FuseInput& first, const FuseInput& second) {
  return first.path + " and " + second.path;
}

/// Near where the frames put it.
FrameQuestion near_question(const Matrix34d& T_first_second) {
  FrameQuestion question;
  question.T_a_b_guess = T_first_second;
  question.is_guess = true;
  question.reach_m = 3.0;
  question.reach_z_m = 2.0;
  question.yaw_steps = 4;
  return question;
}

/// How far a frame that was found is from the given one: in the middle of the overlap, and turned.
struct Offset {
  Point3d shift_m;
  double turn_deg = 0.0;
};
Offset offset_of(const FrameAnswer& found, const Matrix34d& given) {
  const Point3d middle_b = apply(inverse(found.T_a_b), found.middle_a);
  return {found.middle_a - apply(given, middle_b), angle_deg(product(found.T_a_b, inverse(given)))};
}

/// The warning about a pair whose surfaces lie on each other elsewhere; empty: they lie well.
std::optional<Message> surface_warning(const FuseInput& first, const FuseInput& second,
                                       const FrameAnswer& found, const Matrix34d& given) {
  if (found.verdict != FrameVerdict::kFound) return std::nullopt;
  const double resolution_m = first.stored->map.config().resolution_m;
  const Offset off = offset_of(found, given);
  if (norm(off.shift_m) < std::max(kOff_m, kOff_voxels * resolution_m) && off.turn_deg < kOff_deg)
    return std::nullopt;
  return Message(fmt::format(
      "{} are misaligned: they agree better if the second is moved by {:.2f}, {:.2f}, {:.2f} m "
      "there and turned by {:.1f} degrees in the frame of the first; check their transforms, or "
      "have them found",
      names_of(first, second), off.shift_m.x(), off.shift_m.y(), off.shift_m.z(), off.turn_deg));
}

/// is_placed: surfaces say that the frames are right, and know better.
std::optional<Message> label_warning(const FuseInput& first, const FuseInput& second,
                                     const Alignment& alignment, bool is_placed) {
  const double resolution_m = first.stored->map.config().resolution_m;
  if (alignment.common < kLeastCommon) return std::nullopt;
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

/// By labels; empty: none are common.
std::optional<Alignment> labels_of(const FuseInput& first, const FuseInput& second,
                                   const Matrix34d& T_first_second) {
  const LocalMap& map = first.stored->map;
  const Result<GridTransform> T = GridTransform::make(T_first_second, map.config().resolution_m);
  if (!T.ok()) return std::nullopt;
  const Alignment alignment = AlignmentCheck::measure(map, second.stored->map, *T, kCompared);
  return alignment.common == 0 ? std::nullopt : std::optional(alignment);
}

/// What a search says of a pair, for TeamFrames. The members are the places of the inputs.
FrameLink link_of(std::size_t from, std::size_t to, const FrameAnswer& answer) {
  FrameLink link;
  link.from = static_cast<std::uint32_t>(from);
  link.to = static_cast<std::uint32_t>(to);
  link.revision = 1;
  link.T_from_to = answer.T_a_b;
  link.covariance.about_a = answer.middle_a;
  for (std::size_t row = 0; row < FrameCovariance::kSize; ++row) {
    for (std::size_t column = 0; column <= row; ++column)
      link.covariance.values[FrameCovariance::index(row, column)] =
          answer.covariance[FrameCovariance::kSize * row + column];
  }
  return link;
}

/// Anywhere; near where both were placed first.
Outcome<FrameAnswer> search(FrameRun& run, const FuseInput& a, const FuseInput& b) {
  const LocalMap& map_a = a.stored->map;
  const LocalMap& map_b = b.stored->map;
  if (a.placed && b.placed) {
    TESSERA_TRY_ASSIGN(const FrameAnswer near, run.find(map_a, map_b, question_of(between(a, b))));
    if (near.verdict == FrameVerdict::kFound) return near;
  }
  return run.find(map_a, map_b, question_of(std::nullopt));
}

/// Searches all pairs from both sides; links of those that were found.
Outcome<std::vector<PairAlignment>> search_pairs(const std::vector<FuseInput>& inputs,
                                                 std::vector<FrameLink>& links) {
  TESSERA_TRY_ASSIGN(const std::unique_ptr<FrameRun> run, FrameRun::prepare());
  std::vector<PairAlignment> pairs;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    for (std::size_t j = 0; j < inputs.size(); ++j) {
      if (i == j) continue;
      TESSERA_TRY_ASSIGN(const FrameAnswer answer, search(*run, inputs[i], inputs[j]));
      if (answer.verdict == FrameVerdict::kFound) links.push_back(link_of(i, j, answer));
      if (i < j) pairs.push_back({i, j, std::nullopt, answer});
    }
  }
  return pairs;
}

/// at: a map that is not in the anchor's group.
Failure not_placed(const std::vector<FuseInput>& inputs, std::size_t anchor, std::size_t at,
                   std::span<const RobotFrame> frames, const std::vector<PairAlignment>& pairs) {
  // The reason is that of the pair, of one map of each group, which came nearest.
  const auto is_of = [&](std::size_t map, std::size_t group_of) {
    return frames[map].group == frames[group_of].group;
  };
  const PairAlignment* best = nullptr;
  for (const PairAlignment& pair : pairs) {
    const bool joins = (is_of(pair.first, anchor) && is_of(pair.second, at)) ||
                       (is_of(pair.first, at) && is_of(pair.second, anchor));
    if (joins && (best == nullptr || pair.frame->support > best->frame->support)) best = &pair;
  }
  const bool is_open = best == nullptr || best->frame->verdict == FrameVerdict::kFound;
  return Failure{
      fmt::format("{} could not be placed in the frame of {}: {}; map more of what both have seen, "
                  "or give the transform",
                  inputs[at].path, inputs[anchor].path,
                  is_open ? "searches of several pairs, or from both sides, contradict each other"
                          : to_string(best->frame->verdict)),
      FailureKind::kFailure};
}

}  // namespace

Outcome<std::vector<PairAlignment>> find_frames(std::vector<FuseInput>& inputs) {
  if (inputs.size() > kMostAligned)
    return Failure{
        fmt::format("{} maps are too many to find their frames, at most {}; fuse them "
                    "in parts, or give the transforms",
                    inputs.size(), kMostAligned)};
  for (const FuseInput& input : inputs) {
    if (!is_whole(input))
      return Failure{input.path + " is in submaps; frames are found of whole maps"};
  }
  std::vector<FrameLink> links;
  TESSERA_TRY_ASSIGN(std::vector<PairAlignment> pairs, search_pairs(inputs, links));
  const auto placed = std::find_if(inputs.begin(), inputs.end(),
                                   [](const FuseInput& input) { return input.placed; });
  const auto anchor =
      placed == inputs.end() ? std::size_t{0} : static_cast<std::size_t>(placed - inputs.begin());
  FramePrior prior;
  prior.robot = static_cast<std::uint32_t>(anchor);
  prior.T_team_robot = inputs[anchor].T_global_map;
  std::vector<FrameMember> members;
  for (std::size_t i = 0; i < inputs.size(); ++i)
    members.push_back({static_cast<std::uint32_t>(i), 0});
  const auto most_robots = static_cast<std::uint32_t>(inputs.size());
  const auto most_links = static_cast<std::uint32_t>(links.size() + 1);
  const ArenaMemory memory(TeamFrames::required_bytes(most_robots, most_links));
  Arena arena(memory.span());
  Result<TeamFrames> team = TeamFrames::make(arena, most_robots, most_links);
  if (!team.ok())
    return Failure{"finding the frames of maps: the memory is too small", FailureKind::kFailure};
  const Result<TeamSolution> solution = team->solve(links, std::span(&prior, 1), members);
  if (!solution.ok())
    return Failure{inputs[anchor].path + ": its transform cannot hold the frames of others"};
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const RobotFrame& frame = solution->frames[i];
    if (frame.group != solution->frames[anchor].group)
      return not_placed(inputs, anchor, i, solution->frames, pairs);
    inputs[i].T_global_map = frame.T_team_robot;
    inputs[i].placed = true;
    const Result<GridTransform> grid =
        GridTransform::make(frame.T_team_robot, inputs[i].stored->map.config().resolution_m);
    if (!grid.ok()) return Failure{inputs[i].path + ": its frame is outside of the grid"};
    inputs[i].frame = *grid;
  }
  for (PairAlignment& pair : pairs) {
    const FuseInput& first = inputs[pair.first];
    const FuseInput& second = inputs[pair.second];
    pair.labels = labels_of(first, second, between(first, second));
  }
  return pairs;
}

std::vector<PairAlignment> align_inputs(const std::vector<FuseInput>& inputs,
                                        std::vector<Message>& warnings) {
  std::vector<PairAlignment> pairs;
  std::unique_ptr<FrameRun> run;
  if (inputs.size() <= kMostAligned) {
    Outcome<std::unique_ptr<FrameRun>> prepared = FrameRun::prepare();
    if (prepared.ok()) run = std::move(*prepared);
  }
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    for (std::size_t j = i + 1; j < inputs.size(); ++j) {
      const FuseInput& first = inputs[i];
      const FuseInput& second = inputs[j];
      // Those of one robot are as its poses have them.
      if (first.id.robot == second.id.robot && first.id.submap != second.id.submap) continue;
      const Matrix34d given = between(first, second);
      PairAlignment pair{i, j, labels_of(first, second, given), std::nullopt};
      std::optional<Message> warning;
      if (run && is_whole(first) && is_whole(second)) {
        const Outcome<FrameAnswer> answer =
            run->find(first.stored->map, second.stored->map, near_question(given));
        if (answer.ok()) pair.frame = *answer;
      }
      if (pair.frame) warning = surface_warning(first, second, *pair.frame, given);
      const bool is_placed = pair.frame && pair.frame->verdict == FrameVerdict::kFound;
      if (!warning && pair.labels) warning = label_warning(first, second, *pair.labels, is_placed);
      if (warning) warnings.push_back(*std::move(warning));
      if (pair.labels || pair.frame) pairs.push_back(pair);
    }
  }
  return pairs;
}

Outcome<std::vector<PairAlignment>> pairs_of(const FuseOptions& options,
                                             std::vector<FuseInput>& inputs,
                                             std::vector<Message>& warnings) {
  if (options.align) return find_frames(inputs);
  return align_inputs(inputs, warnings);
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
