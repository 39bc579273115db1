// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// From what was given, in any order, to one list of statements in one order.
#include "team_graph.hpp"
#include "tessera/base/rigid_code.hpp"

namespace tessera {

namespace {

constexpr double kFloorShiftSquared = TeamFrames::kFloor_m * TeamFrames::kFloor_m;
/// A point is half a percent of its distance off where such a turn is taken for a small one.
constexpr double kMostSmallTurn_rad = 0.1;
constexpr double kFloorTurnSquared = TeamFrames::kFloor_rad * TeamFrames::kFloor_rad;

/// The member with this number; the number of members iff there is none. O(log n).
std::uint32_t member_of(const TeamGraph& graph, std::uint32_t robot) noexcept {
  std::uint32_t low = 0;
  std::uint32_t high = graph.robots;
  while (low < high) {
    const std::uint32_t middle = (low + high) / 2;
    if (graph.frames[middle].robot < robot) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low < graph.robots && graph.frames[low].robot == robot ? low : graph.robots;
}

bool plausible(const Matrix34d& T) noexcept {
  if (check_rigid(T) != Status::kOk) return false;
  for (int row = 0; row < 3; ++row) {
    if (!(std::abs(T(row, 3)) <= RigidCode::kMostMetres)) return false;
  }
  return true;
}

/// Sets covariance, information and spread. False: the covariance is implausible.
bool set_uncertainty(const FrameCovariance& covariance, FrameStatement& statement) noexcept {
  constexpr auto at = FrameCovariance::index;
  constexpr double kMostVariance = 1e12;
  SixBySix L{};
  if (!covariance.about_a.allFinite() || !factor_six(covariance.values, L)) return false;
  statement.about = covariance.about_a;
  statement.covariance = covariance.values;
  double shift_m2 = 0.0;
  double turn_rad2 = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(std::abs(covariance.about_a(static_cast<int>(i))) <= RigidCode::kMostMetres))
      return false;
    statement.covariance[at(i, i)] += kFloorShiftSquared;
    statement.covariance[at(i + 3, i + 3)] += kFloorTurnSquared;
    shift_m2 += statement.covariance[at(i, i)];
    turn_rad2 += statement.covariance[at(i + 3, i + 3)];
  }
  if (!(shift_m2 < kMostVariance && turn_rad2 < kMostVariance)) return false;
  if (!factor_six(statement.covariance, L)) return false;
  invert_six(L, statement.information);
  statement.spread = shift_m2 / kFloorShiftSquared + turn_rad2 / kFloorTurnSquared;
  statement.turns = turn_rad2 > kMostSmallTurn_rad * kMostSmallTurn_rad;
  statement.tight = shift_m2 <= TeamFrames::kMostConfirming_m * TeamFrames::kMostConfirming_m &&
                    turn_rad2 <= TeamFrames::kMostConfirming_rad * TeamFrames::kMostConfirming_rad;
  return true;
}

Status read_members(TeamGraph& graph, std::span<const FrameMember> members) noexcept {
  const auto count = static_cast<std::uint32_t>(members.size());
  for (std::uint32_t i = 0; i < count; ++i) graph.keys[i] = {members[i].robot, i};
  radix_sort(graph.keys.first(count), graph.scratch);
  graph.robots = count;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t robot = members[graph.keys[i].index].robot;
    if (i != 0 && graph.frames[i - 1].robot == robot) return Status::kInvalidArgument;
    graph.frames[i] = {};
    graph.frames[i].robot = robot;
    // Where its epoch waits until the links are read.
    graph.frames[i].group = members[graph.keys[i].index].epoch;
  }
  return Status::kOk;
}

/// kUsed: it is one that may count. What nobody can decode states nothing, so that it replaces no
/// link, and contradicts none.
LinkVerdict first_look(const TeamGraph& graph, const FrameLink& link) noexcept {
  const std::uint32_t from = member_of(graph, link.from);
  const std::uint32_t to = member_of(graph, link.to);
  if (from == graph.robots || to == graph.robots) return LinkVerdict::kNotMember;
  FrameStatement statement;
  if (from == to || link.revision == 0 || !plausible(link.T_from_to) ||
      !set_uncertainty(link.covariance, statement))
    return LinkVerdict::kInvalid;
  // Revisions of another epoch say nothing: a robot that starts anew counts anew.
  if (graph.frames[from].group != link.from_epoch || graph.frames[to].group != link.to_epoch)
    return LinkVerdict::kOtherEpoch;
  return LinkVerdict::kUsed;
}

bool same_content(const FrameLink& a, const FrameLink& b) noexcept {
  const auto same = [](const auto& one, const auto& other) {
    for (int i = 0; i < one.size(); ++i) {
      if (!(one.data()[i] == other.data()[i])) return false;
    }
    return true;
  };
  return a.from_epoch == b.from_epoch && a.to_epoch == b.to_epoch &&
         a.from_version == b.from_version && a.to_version == b.to_version &&
         a.withdrawn == b.withdrawn && same(a.T_from_to, b.T_from_to) &&
         same(a.covariance.about_a, b.covariance.about_a) &&
         a.covariance.values == b.covariance.values;
}

void add_statement(TeamGraph& graph, const FrameStatement& statement) noexcept {
  graph.slot(statement.from, statement.to) = static_cast<std::uint16_t>(graph.statement_count);
  graph.storage[graph.statement_count++] = statement;
}

/// The latest link of a pair, which nothing is against so far.
LinkVerdict read_link(TeamGraph& graph, const FrameLink& link, std::uint32_t source) noexcept {
  FrameStatement statement;
  statement.source = source;
  statement.from = static_cast<NodeIndex>(member_of(graph, link.from));
  statement.to = static_cast<NodeIndex>(member_of(graph, link.to));
  if (link.withdrawn) {
    graph.withdrawn |= std::uint64_t{1} << statement.from | std::uint64_t{1} << statement.to;
    return LinkVerdict::kWithdrawn;
  }
  const bool is_valid = set_uncertainty(link.covariance, statement);
  TESSERA_ASSERT(is_valid);
  static_cast<void>(is_valid);
  statement.T_from_to = link.T_from_to;
  add_statement(graph, statement);
  return LinkVerdict::kUsed;
}

void read_links(TeamGraph& graph, std::span<const FrameLink> links) noexcept {
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < links.size(); ++i) {
    const LinkVerdict verdict = first_look(graph, links[i]);
    graph.reports[i] = {};
    graph.reports[i].verdict = verdict;
    if (verdict != LinkVerdict::kUsed) continue;
    const std::uint64_t from = member_of(graph, links[i].from);
    const std::uint64_t to = member_of(graph, links[i].to);
    graph.keys[count++] = {from << 40U | to << 32U | links[i].revision, i};
  }
  radix_sort(graph.keys.first(count), graph.scratch);
  for (std::size_t first = 0; first < count;) {
    std::size_t end = first + 1;
    while (end < count && graph.keys[end].key >> 32U == graph.keys[first].key >> 32U) ++end;
    const std::uint32_t latest = graph.keys[end - 1].index;
    bool equal = true;
    for (std::size_t i = first; i < end; ++i) {
      const std::uint32_t index = graph.keys[i].index;
      const bool rival = graph.keys[i].key == graph.keys[end - 1].key;
      if (rival && index != latest && !same_content(links[index], links[latest])) equal = false;
      graph.reports[index].verdict = LinkVerdict::kReplaced;
    }
    if (equal) {
      graph.reports[latest].verdict = read_link(graph, links[latest], latest);
    } else {
      graph.suspect(static_cast<NodeIndex>(graph.keys[first].key >> 40U));
      for (std::size_t i = first; i < end; ++i) {
        if (graph.keys[i].key == graph.keys[end - 1].key)
          graph.reports[graph.keys[i].index].verdict = LinkVerdict::kTwoContents;
      }
    }
    first = end;
  }
}

Status read_priors(TeamGraph& graph, std::span<const FramePrior> priors) noexcept {
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < priors.size(); ++i) {
    const std::uint32_t member = member_of(graph, priors[i].robot);
    if (member != graph.robots) graph.keys[count++] = {member, i};
  }
  radix_sort(graph.keys.first(count), graph.scratch);
  for (std::size_t i = 0; i < count; ++i) {
    if (i != 0 && graph.keys[i].key == graph.keys[i - 1].key) return Status::kInvalidArgument;
    const FramePrior& prior = priors[graph.keys[i].index];
    FrameStatement statement;
    statement.T_from_to = prior.T_team_robot;
    statement.source = graph.keys[i].index;
    statement.from = graph.world();
    statement.to = static_cast<NodeIndex>(graph.keys[i].key);
    statement.given = true;
    statement.exact = prior.exact;
    statement.confirmed = true;
    statement.tight = prior.exact;
    if (!plausible(prior.T_team_robot)) return Status::kInvalidArgument;
    if (!prior.exact && !set_uncertainty(prior.covariance, statement))
      return Status::kInvalidArgument;
    add_statement(graph, statement);
  }
  return Status::kOk;
}

}  // namespace

Status read_statements(TeamGraph& graph, std::span<const FrameLink> links,
                       std::span<const FramePrior> priors,
                       std::span<const FrameMember> members) noexcept {
  if (members.size() > graph.most_robots || links.size() > graph.most_links ||
      priors.size() > graph.most_robots)
    return Status::kResourceExhausted;
  graph.statement_count = 0;
  graph.triangle_count = 0;
  graph.suspected = 0;
  graph.withdrawn = 0;
  for (std::uint16_t& slot : graph.slots) slot = kNoStatement;
  Status status = read_members(graph, members);
  if (status != Status::kOk) return status;
  // Priors first: a spanning forest that takes statements in this order is rooted in them.
  status = read_priors(graph, priors);
  if (status != Status::kOk) return status;
  read_links(graph, links);
  return Status::kOk;
}

}  // namespace tessera
