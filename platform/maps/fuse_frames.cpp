// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/fuse_frames.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstdint>
#include <span>

#include "tessera/base/rigid.hpp"
#include "tessera/frames/answer_link.hpp"
#include "tessera/frames/team_frames.hpp"

namespace tessera {

namespace {

/// What a search says of a pair, for TeamFrames. The members are the places of the inputs.
FrameLink link_of(std::size_t from, std::size_t to, const FrameAnswer& answer) {
  FrameLink link = tessera::link_of(answer, Matrix34d::Identity(), Matrix34d::Identity());
  link.from = static_cast<std::uint32_t>(from);
  link.to = static_cast<std::uint32_t>(to);
  link.revision = 1;
  return link;
}

/// Near where both were placed, if they were; then anywhere, about there.
Outcome<FrameAnswer> search(FrameRun& run, const FuseInput& a, const FuseInput& b,
                            const PairsProgress& progress, std::uint32_t from) {
  constexpr std::uint32_t kNear = 10;  // of the 50 of a side
  constexpr std::uint32_t kSide = 50;
  const LocalMap& map_a = a.stored->map;
  const LocalMap& map_b = b.stored->map;
  FrameQuestion anywhere = question_of(std::nullopt);
  if (a.placed && b.placed) {
    anywhere.T_a_b_guess = between(a, b);
    TESSERA_TRY_ASSIGN(const FrameAnswer near, run.find(map_a, map_b, question_of(between(a, b)),
                                                        progress.part(from, from + kNear)));
    if (near.verdict == FrameVerdict::kFound) return near;
  }
  return run.find(map_a, map_b, anywhere, progress.part(from + kNear, from + kSide));
}

/// Searches all pairs from both sides; links of those that were found from both.
Outcome<std::vector<PairAlignment>> search_pairs(const std::vector<FuseInput>& inputs,
                                                 std::vector<FrameLink>& links,
                                                 PairsProgress progress) {
  TESSERA_TRY_ASSIGN(const std::unique_ptr<FrameRun> run, FrameRun::prepare());
  std::vector<PairAlignment> pairs;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    for (std::size_t j = i + 1; j < inputs.size(); ++j) {
      TESSERA_TRY_ASSIGN(const FrameAnswer there, search(*run, inputs[i], inputs[j], progress, 0));
      PairAlignment pair{i, j, std::nullopt, there};
      if (there.verdict == FrameVerdict::kFound) {
        TESSERA_TRY_ASSIGN(const FrameAnswer back,
                           search(*run, inputs[j], inputs[i], progress, 50));
        if (back.verdict == FrameVerdict::kFound) {
          links.push_back(link_of(i, j, there));
          links.push_back(link_of(j, i, back));
        } else {
          pair.frame->verdict = back.verdict;
        }
      }
      pairs.push_back(pair);
      progress.end_pair();
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

Outcome<std::vector<PairAlignment>> find_frames(std::vector<FuseInput>& inputs, bool with_sessions,
                                                const PairsProgress::Done& done) {
  if (inputs.size() > kMostAligned)
    return Failure{
        fmt::format("{} maps are too many to find their frames, at most {}; fuse them "
                    "in parts, or give the transforms",
                    inputs.size(), kMostAligned)};
  for (const FuseInput& input : inputs) {
    if (!is_whole(input))
      return Failure{input.path + " is in submaps; frames are found of whole maps"};
  }
  const auto placed = std::find_if(inputs.begin(), inputs.end(),
                                   [](const FuseInput& input) { return input.placed; });
  if (with_sessions && placed == inputs.end())
    return Failure{
        "sessions are not placed by the maps that are aligned; give the transform of one "
        "of these maps"};
  std::vector<FrameLink> links;
  TESSERA_TRY_ASSIGN(std::vector<PairAlignment> pairs,
                     search_pairs(inputs, links, PairsProgress(done, inputs.size())));
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
    return Failure{inputs[anchor].path +
                   ": its transform is too far from the origin; use a nearer one"};
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

Outcome<std::vector<PairAlignment>> pairs_of(const FuseOptions& options, bool with_sessions,
                                             std::vector<FuseInput>& inputs,
                                             std::vector<Message>& warnings,
                                             const PairsProgress::Done& done) {
  if (options.align) return find_frames(inputs, with_sessions, done);
  return align_inputs(inputs, warnings, done);
}

}  // namespace tessera
