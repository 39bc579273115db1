// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/team_frames.hpp"

#include <algorithm>
#include <bit>

#include "statement_error.hpp"
#include "team_graph.hpp"
#include "tessera/base/internal/digest.hpp"

namespace tessera {

namespace {

constexpr std::size_t kPairs = std::size_t{kMostNodes} * kMostNodes;

constexpr std::size_t triples_of(std::size_t nodes) noexcept {
  return nodes * (nodes - 1) * (nodes - 2) / 6;
}
constexpr std::size_t unknowns_of(std::size_t robots) noexcept {
  return FrameCovariance::kSize * robots;
}
constexpr std::size_t keys_of(std::size_t robots, std::size_t links) noexcept {
  return robots + links;
}

/// The nodes that a group's anchors reach without what an author states, or without a node.
std::uint64_t reached_without(const TeamGraph& graph, NodeIndex author, bool node_too) noexcept {
  std::array<NodeIndex, kMostNodes> order{};
  std::uint32_t count = 0;
  std::uint64_t reached = 0;
  const auto reach = [&](std::uint32_t node) {
    reached |= std::uint64_t{1} << node;
    order[count++] = static_cast<NodeIndex>(node);
  };
  for (std::uint32_t node = 0; node < graph.robots; ++node) {
    const FrameStatement* const prior = graph.find(graph.world(), node);
    const bool given = prior != nullptr && prior->exact;
    if (given || graph.frames[node].anchor == graph.frames[node].robot) reach(node);
  }
  for (std::uint32_t next = 0; next < count; ++next) {
    const NodeIndex node = order[next];
    if (node_too && node == author) continue;
    for (std::uint32_t other = 0; other < graph.robots; ++other) {
      if ((reached >> other & 1U) != 0 || (node_too && other == author)) continue;
      for (const FrameStatement* const edge : {graph.find(node, other), graph.find(other, node)}) {
        if (edge == nullptr || !edge->active() || edge->from == author) continue;
        reach(other);
        break;
      }
    }
  }
  return reached;
}

/// Which members a robot's frame depends on.
void set_joined_by(TeamGraph& graph) noexcept {
  for (std::uint32_t author = 0; author < graph.robots; ++author) {
    const auto node = static_cast<NodeIndex>(author);
    const std::uint64_t bit = std::uint64_t{1} << author;
    const std::uint64_t without_word = reached_without(graph, node, false);
    // The anchors stay where they are, whoever else is there or not.
    const FrameStatement* const prior = graph.find(graph.world(), author);
    const bool anchors = (prior != nullptr && prior->exact) ||
                         graph.frames[author].anchor == graph.frames[author].robot;
    const std::uint64_t without_node = anchors ? without_word : reached_without(graph, node, true);
    for (std::uint32_t other = 0; other < graph.robots; ++other) {
      const std::uint64_t reached = other == author ? without_word : without_node;
      if ((reached >> other & 1U) == 0) graph.frames[other].joined_by |= bit;
    }
  }
}

/// True: a link about this robot was refused for what it says.
bool refused_about(const TeamGraph& graph, NodeIndex node) noexcept {
  const std::span<const FrameStatement> all = graph.statements();
  return std::any_of(all.begin(), all.end(), [node](const FrameStatement& one) {
    const bool about = one.from == node || one.to == node;
    return about && !one.active() && one.verdict != LinkVerdict::kNotNeeded;
  });
}

bool linked(const TeamGraph& graph, NodeIndex node) noexcept {
  const std::span<const FrameStatement> all = graph.statements();
  return std::any_of(all.begin(), all.end(), [node](const FrameStatement& one) {
    return (one.from == node || one.to == node) && one.active() && !one.given;
  });
}

FrameState state_of(const TeamGraph& graph, NodeIndex node) noexcept {
  const FrameStatement* const prior = graph.find(graph.world(), node);
  if (prior != nullptr && prior->exact) return FrameState::kGiven;
  if (graph.frames[node].joined_by != 0) return FrameState::kOnlyByOne;
  if (linked(graph, node)) return FrameState::kLinked;
  if (prior != nullptr) return FrameState::kPlaced;
  if (refused_about(graph, node)) return FrameState::kContradicted;
  return (graph.withdrawn >> node & 1U) != 0 ? FrameState::kWithdrawn : FrameState::kAlone;
}

void report_links(TeamGraph& graph) noexcept {
  for (const FrameStatement& statement : graph.statements()) {
    if (statement.given) continue;
    FrameLinkReport& report = graph.reports[statement.source];
    report.verdict = statement.verdict;
    report.confirmed = statement.confirmed;
    report.compared = graph.group[statement.from] == graph.group[statement.to];
    if (!report.compared) continue;
    const StatementError error(statement, graph.frames[statement.from].T_team_robot,
                               graph.frames[statement.to].T_team_robot);
    report.sigmas = std::sqrt(error.squared_sigmas());
  }
}

std::uint64_t digest_of(const TeamGraph& graph) noexcept {
  Digest digest;
  const auto add = [&](double value) { digest.add(std::bit_cast<std::uint64_t>(value + 0.0)); };
  for (const RobotFrame& frame : graph.frames.first(graph.robots)) {
    digest.add(std::uint64_t{frame.robot} << 32U | frame.group);
    digest.add(std::uint64_t{frame.anchor} << 32U |
               static_cast<std::uint64_t>(frame.anchored_by) << 16U |
               static_cast<std::uint64_t>(frame.state) << 8U | (frame.suspected ? 1U : 0U));
    digest.add(frame.joined_by);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) add(frame.T_team_robot(row, column));
    }
    for (const double value : frame.covariance.values) add(value);
  }
  return digest.value();
}

}  // namespace

std::size_t TeamFrames::required_bytes(std::uint32_t most_robots,
                                       std::uint32_t most_links) noexcept {
  const std::size_t keys = keys_of(most_robots, most_links);
  const std::size_t unknowns = unknowns_of(most_robots);
  return arena_bytes<TeamGraph>(1) + arena_bytes<FrameStatement>(keys) +
         arena_bytes<std::uint16_t>(kPairs) + arena_bytes<PairVotes>(kPairs) +
         arena_bytes<FrameTriangle>(triples_of(std::size_t{most_robots} + 1)) +
         2 * arena_bytes<KeyedIndex>(keys) + arena_bytes<RobotFrame>(most_robots) +
         arena_bytes<FrameLinkReport>(most_links) + arena_bytes<double>(unknowns * unknowns) +
         arena_bytes<double>(2 * unknowns);
}

Result<TeamFrames> TeamFrames::make(Arena& arena, std::uint32_t most_robots,
                                    std::uint32_t most_links) noexcept {
  if (most_robots == 0 || most_robots > kMostRobots || most_links > kMostLinks)
    return Status::kInvalidArgument;
  if (!arena.aligned() || arena.remaining_bytes() < required_bytes(most_robots, most_links))
    return Status::kResourceExhausted;
  const std::size_t keys = keys_of(most_robots, most_links);
  const std::size_t unknowns = unknowns_of(most_robots);
  TeamGraph& graph = arena.take<TeamGraph>(1).front();
  graph.most_robots = most_robots;
  graph.most_links = most_links;
  graph.storage = arena.take<FrameStatement>(keys);
  graph.slots = arena.take<std::uint16_t>(kPairs);
  graph.votes = arena.take<PairVotes>(kPairs);
  graph.triangle_storage = arena.take<FrameTriangle>(triples_of(std::size_t{most_robots} + 1));
  graph.keys = arena.take<KeyedIndex>(keys);
  graph.scratch = arena.take<KeyedIndex>(keys);
  graph.frames = arena.take<RobotFrame>(most_robots);
  graph.reports = arena.take<FrameLinkReport>(most_links);
  graph.matrix = arena.take<double>(unknowns * unknowns);
  graph.vectors = arena.take<double>(2 * unknowns);
  TeamFrames made;
  made.graph_ = &graph;
  return made;
}

Result<TeamSolution> TeamFrames::solve(std::span<const FrameLink> links,
                                       std::span<const FramePrior> priors,
                                       std::span<const FrameMember> members) noexcept {
  if (graph_ == nullptr) return Status::kResourceExhausted;
  TeamGraph& graph = *graph_;
  const Status status = read_statements(graph, links, priors, members);
  if (status != Status::kOk) return status;
  judge_statements(graph);
  solve_groups(graph);
  set_joined_by(graph);
  TeamSolution solution;
  for (std::uint32_t node = 0; node < graph.robots; ++node) {
    RobotFrame& frame = graph.frames[node];
    frame.state = state_of(graph, static_cast<NodeIndex>(node));
    frame.suspected = (graph.suspected >> node & 1U) != 0;
    if (graph.group[node] == node) ++solution.groups;
  }
  report_links(graph);
  solution.frames = graph.frames.first(graph.robots);
  solution.links = graph.reports.first(links.size());
  solution.digest = digest_of(graph);
  return solution;
}

}  // namespace tessera
