// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The graph that TeamFrames solves. Its nodes are the members in the order of their numbers, and
// after them the world, which states the priors. Statements are its edges, with a direction: who
// states one is its from.
#pragma once

#include <span>

#include "six_by_six.hpp"
#include "tessera/base/internal/radix_sort.hpp"
#include "tessera/frames/team_frames.hpp"

namespace tessera {

using NodeIndex = std::uint8_t;
inline constexpr std::uint32_t kMostNodes = TeamFrames::kMostRobots + 1;
/// No loop of a spanning forest has more legs.
inline constexpr std::uint32_t kMostLegs = kMostNodes;
inline constexpr std::uint16_t kNoStatement = 0xffff;

struct FrameStatement {
  Matrix34d T_from_to = Matrix34d::Identity();
  Point3d about = Point3d::Zero();  ///< In the frame of from.
  SixBySix covariance{};            ///< With the floor, but for exact priors.
  SixBySix information{};           ///< Its inverse; not for exact priors.
  double spread = 0.0;              ///< Its trace, a floor of shift as much as one of rotation.
  std::uint32_t source = 0;         ///< Which link; which prior if given.
  NodeIndex from = 0;               ///< The author.
  NodeIndex to = 0;
  LinkVerdict verdict = LinkVerdict::kUsed;
  LinkVerdict sentence = LinkVerdict::kUsed;  ///< The verdict to come, when a round is over.
  bool given = false;                         ///< A prior.
  bool exact = false;                         ///< An exact prior.
  bool tight = false;                         ///< It may confirm others.
  bool turns = false;  ///< Its turn is no small motion: loops with it cannot be tested.
  bool confirmed = false;
  /// Bit i: it is confirmed without what the i-th robot states.
  std::uint64_t confirmed_without = 0;
  bool agrees = false;     ///< With the one in the other direction.
  bool in_forest = false;  ///< It is an edge of the spanning forest.
  [[nodiscard]] bool active() const noexcept { return verdict == LinkVerdict::kUsed; }
  /// It may be held against a robot: that one did not confirm it.
  [[nodiscard]] bool is_evidence_against(NodeIndex robot) const noexcept {
    return given || (confirmed_without >> robot & 1U) != 0;
  }
  /// authors: of what confirms it.
  void confirm(std::uint64_t authors) noexcept {
    confirmed = true;
    confirmed_without |= ~authors;
  }
};

/// Three nodes that are joined by pairs, ascending. Bit d of consistent: the loop closes over these
/// statements: of edge e, which joins node e and the next one, that of the next one if bit e of d
/// is set, else that of node e.
struct FrameTriangle {
  static constexpr unsigned kCombinations = 8;
  std::array<NodeIndex, 3> nodes{};
  std::uint8_t consistent = 0;
};

/// One step along a statement.
struct LoopLeg {
  std::uint16_t statement = kNoStatement;
  bool forward = true;  ///< From its from to its to.
};
using LoopLegs = std::array<LoopLeg, kMostLegs + 1>;

/// A node of the spanning forest.
struct ForestNode {
  std::uint16_t up = kNoStatement;  ///< That joins it to its parent; none: a root.
  NodeIndex parent = 0;
  NodeIndex depth = 0;
};

/// How often a pair of nodes is part of triangles.
struct PairVotes {
  std::uint16_t broken = 0;
  std::uint16_t good = 0;
  bool against_priors = false;
};

struct TeamGraph {
  std::uint32_t most_robots = 0;
  std::uint32_t most_links = 0;
  std::span<FrameStatement> storage;
  std::span<std::uint16_t> slots;  ///< The statement from - to, for each pair of nodes.
  std::span<PairVotes> votes;      ///< As slots; of lower - higher.
  std::span<FrameTriangle> triangle_storage;
  std::span<KeyedIndex> keys;
  std::span<KeyedIndex> scratch;
  std::span<RobotFrame> frames;
  std::span<FrameLinkReport> reports;
  std::span<double> matrix;   ///< Of the solver: 6 n times 6 n.
  std::span<double> vectors;  ///< Two of 6 n.

  std::uint32_t robots = 0;  ///< The world's node, too.
  std::uint32_t statement_count = 0;
  std::uint32_t triangle_count = 0;
  std::uint64_t suspected = 0;
  std::uint64_t withdrawn = 0;
  std::array<ForestNode, kMostNodes> forest{};
  std::array<NodeIndex, kMostNodes> order{};  ///< The forest's nodes, parents first.
  std::array<NodeIndex, kMostNodes> group{};  ///< The lowest node of its group.

  [[nodiscard]] std::span<FrameStatement> statements() const noexcept {
    return storage.first(statement_count);
  }
  [[nodiscard]] std::span<FrameTriangle> triangles() const noexcept {
    return triangle_storage.first(triangle_count);
  }
  [[nodiscard]] NodeIndex world() const noexcept { return static_cast<NodeIndex>(robots); }
  [[nodiscard]] std::uint16_t& slot(std::uint32_t from, std::uint32_t to) const noexcept {
    return slots[from * kMostNodes + to];
  }
  [[nodiscard]] FrameStatement* find(std::uint32_t from, std::uint32_t to) const noexcept {
    const std::uint16_t at = slot(from, to);
    return at == kNoStatement ? nullptr : &storage[at];
  }
  /// The statement in the other direction, if it is used and confirmed, too.
  [[nodiscard]] FrameStatement* counterpart(const FrameStatement& statement) const noexcept {
    FrameStatement* const back = find(statement.to, statement.from);
    return back != nullptr && back->active() && back->confirmed ? back : nullptr;
  }
  void suspect(NodeIndex node) noexcept { suspected |= std::uint64_t{1} << node; }
};

/// Sets of nodes that are joined; the lowest one names the set.
class JoinedNodes {
 public:
  explicit JoinedNodes(std::uint32_t nodes) noexcept {
    for (std::uint32_t i = 0; i < nodes; ++i) lowest_[i] = static_cast<NodeIndex>(i);
  }
  [[nodiscard]] NodeIndex find(NodeIndex node) const noexcept {
    while (lowest_[node] != node) node = lowest_[node];
    return node;
  }
  /// False: they were joined before.
  bool join(NodeIndex a, NodeIndex b) noexcept {
    a = find(a);
    b = find(b);
    if (a == b) return false;
    (a < b ? lowest_[b] : lowest_[a]) = a < b ? a : b;
    return true;
  }

 private:
  std::array<NodeIndex, kMostNodes> lowest_{};
};

/// Whether a loop closes within the limit. Nobody can say where the covariance of a turn is too
/// large to be that of a small motion, as of a prior without a heading.
enum class Closing : std::uint8_t { kUnknown, kOpen, kClosed };

/// Follows statements from a point and back to it, and how uncertain the way is.
class LoopSum {
 public:
  /// at: in the frame of the node where the loop begins.
  explicit LoopSum(const Point3d& at) noexcept : at_(at) {}
  void add(const FrameStatement& statement, bool forward) noexcept;
  /// Of a loop that is closed.
  [[nodiscard]] Closing closing() const noexcept {
    return closing_within(TeamFrames::kMostSquaredSigmas);
  }
  [[nodiscard]] Closing closing_within(double most_squared_sigmas) const noexcept;

 private:
  bool vague_ = false;
  Matrix34d T_start_here_ = Matrix34d::Identity();
  Point3d at_;
  SixBySix covariance_{};
};

/// Fills the statements from what was given. Fails as TeamFrames::solve.
[[nodiscard]] Status read_statements(TeamGraph& graph, std::span<const FrameLink> links,
                                     std::span<const FramePrior> priors,
                                     std::span<const FrameMember> members) noexcept;
/// Chooses which statements are used, and names those who lie.
void judge_statements(TeamGraph& graph) noexcept;
/// A spanning forest over the statements with in_forest, breadth first.
void root_forest(TeamGraph& graph) noexcept;
/// The legs of the loop that a statement closes with the forest, which joins its nodes; the
/// statement itself is the last one. The number of legs.
[[nodiscard]] std::uint32_t loop_over_forest(TeamGraph& graph, std::uint16_t statement,
                                             LoopLegs& legs) noexcept;
/// The statements of a combination of a triangle; all none iff one of them is not there.
[[nodiscard]] std::array<FrameStatement*, 3> combination_of(TeamGraph& graph,
                                                            const FrameTriangle& triangle,
                                                            unsigned combination) noexcept;
/// Puts triangles into the graph, and which statements confirm which.
void find_triangles(TeamGraph& graph) noexcept;
/// Of each triangle of confirmed statements that does not close, refuses the pairs that are in the
/// most of them, until there is none. Pairs that both ends state are spared where others may be it.
void vote_by_triangles(TeamGraph& graph) noexcept;
/// Moves a group with vague priors alone, and turns it about the vertical, to where these are
/// nearest to its frames.
void turn_to_priors(TeamGraph& graph, NodeIndex group) noexcept;
/// Computes T_team_robot and covariance of the frames, and their groups and anchors.
void solve_groups(TeamGraph& graph) noexcept;

}  // namespace tessera
