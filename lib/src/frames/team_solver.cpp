// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The frames of each group: from those along used statements, Gauss-Newton steps over all of them.
#include "dense_factor.hpp"
#include "statement_error.hpp"
#include "team_graph.hpp"
#include "tessera/base/internal/quaternion.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

constexpr double kRobustScale = 2.0 * TeamFrames::kMostSquaredSigmas;
/// The scale begins at four times that, and is halved after each two iterations.
constexpr int kLoweredAt = 4;
constexpr double kConverged = 1e-10;
constexpr NodeIndex kFixed = 0xff;

double column_product(const SquareOfSix& a, std::size_t i, const SquareOfSix& b,
                      std::size_t j) noexcept {
  double sum = 0.0;
  for (std::size_t k = 0; k < kSix; ++k) sum += a[k * kSix + i] * b[k * kSix + j];
  return sum;
}

class GroupSolver {
 public:
  GroupSolver(TeamGraph& graph, NodeIndex group) noexcept : graph_(graph), group_(group) {}
  void solve() noexcept;

 private:
  [[nodiscard]] bool is_member(std::uint32_t node) const noexcept {
    return node < graph_.robots && graph_.group[node] == group_;
  }
  /// It says something about a frame that is not fixed.
  [[nodiscard]] bool counts(const FrameStatement& statement) const noexcept {
    return statement.active() && is_member(statement.to) && !statement.exact &&
           (!is_fixed(statement.to) || !is_fixed(statement.from));
  }
  [[nodiscard]] bool is_fixed(NodeIndex node) const noexcept {
    return node == graph_.world() || unknown_[node] == kFixed;
  }
  [[nodiscard]] Matrix34d frame(NodeIndex node) const noexcept {
    if (node == graph_.world()) return Matrix34d::Identity();
    return graph_.frames[node].T_team_robot;
  }
  void choose_anchor() noexcept;
  void number_unknowns() noexcept;
  void follow_links() noexcept;
  void add(const FrameStatement& statement, double scale, bool bent) noexcept;
  void add_all(double scale, bool bent) noexcept;
  [[nodiscard]] double step() noexcept;
  void set_covariances() noexcept;

  TeamGraph& graph_;
  NodeIndex group_;
  FrameAnchor anchored_by_ = FrameAnchor::kLowestRobot;
  NodeIndex anchor_ = 0;
  std::array<NodeIndex, kMostNodes> unknown_{};  ///< Which six unknowns, or kFixed.
  std::size_t unknowns_ = 0;                     ///< Frames that are not fixed.
  DenseFactor factor_{{}, {}, 0};
  std::span<double> gradient_{};
};

/// The lowest robot with an exact prior, else with a vague one, else the lowest.
void GroupSolver::choose_anchor() noexcept {
  anchor_ = group_;
  anchored_by_ = FrameAnchor::kLowestRobot;
  for (std::uint32_t node = graph_.robots; node-- > 0;) {
    const FrameStatement* const prior = graph_.find(graph_.world(), node);
    if (!is_member(node) || prior == nullptr) continue;
    if (!prior->exact && anchored_by_ == FrameAnchor::kExactPrior) continue;
    anchored_by_ = prior->exact ? FrameAnchor::kExactPrior : FrameAnchor::kVaguePrior;
    anchor_ = static_cast<NodeIndex>(node);
  }
}

/// Fixes what is fixed.
void GroupSolver::number_unknowns() noexcept {
  unknowns_ = 0;
  for (std::uint32_t node = 0; node < graph_.robots; ++node) {
    if (!is_member(node)) continue;
    const FrameStatement* const prior = graph_.find(graph_.world(), node);
    const bool exact = prior != nullptr && prior->exact;
    const bool fixed = exact || (node == anchor_ && anchored_by_ == FrameAnchor::kLowestRobot);
    unknown_[node] = fixed ? kFixed : static_cast<NodeIndex>(unknowns_++);
    graph_.frames[node].T_team_robot = Matrix34d::Identity();
    if (prior != nullptr) graph_.frames[node].T_team_robot = prior->T_from_to;
  }
}

/// A used link between two robots, as T_node_other. False: there is none.
bool used_between(const TeamGraph& graph, NodeIndex node, std::uint32_t other,
                  Matrix34d& T_node_other) noexcept {
  const FrameStatement* const there = graph.find(node, other);
  const FrameStatement* const back = graph.find(other, node);
  if (there != nullptr && there->active()) {
    T_node_other = there->T_from_to;
    return true;
  }
  if (back == nullptr || !back->active()) return false;
  T_node_other = inverse(back->T_from_to);
  return true;
}

/// Sets the frames that are not fixed along used links, breadth first.
void GroupSolver::follow_links() noexcept {
  std::array<NodeIndex, kMostNodes> order{};
  std::array<bool, kMostNodes> seen{};
  std::uint32_t count = 0;
  for (std::uint32_t node = 0; node < graph_.robots; ++node) {
    if (!is_member(node) || (unknown_[node] != kFixed && node != anchor_)) continue;
    seen[node] = true;
    order[count++] = static_cast<NodeIndex>(node);
  }
  for (std::uint32_t next = 0; next < count; ++next) {
    const NodeIndex node = order[next];
    for (std::uint32_t other = 0; other < graph_.robots; ++other) {
      Matrix34d T_node_other;
      if (seen[other] || !is_member(other) || !used_between(graph_, node, other, T_node_other))
        continue;
      graph_.frames[other].T_team_robot = product(graph_.frames[node].T_team_robot, T_node_other);
      seen[other] = true;
      order[count++] = static_cast<NodeIndex>(other);
    }
  }
}

void GroupSolver::add(const FrameStatement& statement, double scale, bool bent) noexcept {
  const StatementError error(statement, frame(statement.from), frame(statement.to));
  const RobustWeight weight(error.squared_sigmas(), scale, bent);
  const std::array<NodeIndex, 2> nodes{statement.from, statement.to};
  for (std::size_t one = 0; one < 2; ++one) {
    if (is_fixed(nodes[one])) continue;
    const std::size_t first = kSix * unknown_[nodes[one]];
    const SquareOfSix& J = error.jacobian(one);
    SquareOfSix weighed{};
    error.weigh(weight, one, weighed);
    for (std::size_t i = 0; i < kSix; ++i) {
      for (std::size_t k = 0; k < kSix; ++k)
        gradient_[first + i] += weight.weight * J[k * kSix + i] * error.weighed()[k];
      for (std::size_t j = 0; j <= i; ++j)
        factor_.at(first + i, first + j) += column_product(weighed, i, J, j);
    }
    const std::size_t other = 1 - one;
    if (is_fixed(nodes[other]) || unknown_[nodes[other]] > unknown_[nodes[one]]) continue;
    const std::size_t second = kSix * unknown_[nodes[other]];
    for (std::size_t i = 0; i < kSix; ++i) {
      for (std::size_t j = 0; j < kSix; ++j) {
        factor_.at(first + i, second + j) += column_product(weighed, i, error.jacobian(other), j);
      }
    }
  }
}

void GroupSolver::add_all(double scale, bool bent) noexcept {
  factor_.clear();
  for (double& entry : gradient_) entry = 0.0;
  for (const FrameStatement& statement : graph_.statements()) {
    if (counts(statement)) add(statement, scale, bent);
  }
}

/// Moves all frames by a step; the largest part of it, in metres or radians.
double GroupSolver::step() noexcept {
  factor_.factor();
  factor_.solve(gradient_);
  double largest = 0.0;
  for (std::uint32_t node = 0; node < graph_.robots; ++node) {
    if (!is_member(node) || unknown_[node] == kFixed) continue;
    const double* const part = &gradient_[kSix * unknown_[node]];
    for (std::size_t i = 0; i < kSix; ++i)
      largest = std::abs(part[i]) > largest ? std::abs(part[i]) : largest;
    Quaternion q{1.0, -0.5 * part[3], -0.5 * part[4], -0.5 * part[5]};
    normalise(q);
    const Matrix34d T =
        product(graph_.frames[node].T_team_robot, transform_of(q, {-part[0], -part[1], -part[2]}));
    graph_.frames[node].T_team_robot = transform_of(rotation_of(T), T.col(3));
  }
  return largest;
}

/// The unknowns are motions along each robot's own axes; the covariance is along those of the team.
void GroupSolver::set_covariances() noexcept {
  factor_.factor();
  factor_.invert_lower();
  for (std::uint32_t node = 0; node < graph_.robots; ++node) {
    if (!is_member(node) || unknown_[node] == kFixed) continue;
    const std::size_t first = kSix * unknown_[node];
    SixBySix own{};
    for (std::size_t i = 0; i < kSix; ++i) {
      for (std::size_t j = 0; j <= i; ++j)
        own[FrameCovariance::index(i, j)] = factor_.inverse_at(first + i, first + j);
    }
    RobotFrame& frame = graph_.frames[node];
    SquareOfSix J{};
    motion_seen_from(frame.T_team_robot, Point3d::Zero(), frame.T_team_robot.col(3), J);
    add_congruent(J, own, frame.covariance.values);
  }
}

void GroupSolver::solve() noexcept {
  choose_anchor();
  number_unknowns();
  follow_links();
  if (anchored_by_ == FrameAnchor::kVaguePrior) turn_to_priors(graph_, group_);
  const std::size_t size = kSix * unknowns_;
  factor_ = DenseFactor(graph_.matrix, graph_.vectors.subspan(size, size), size);
  gradient_ = graph_.vectors.first(size);
  if (unknowns_ != 0) {
    for (int i = 0; i < TeamFrames::kMostIterations; ++i) {
      const bool lowered = i >= kLoweredAt;
      add_all(kRobustScale * (i < 2 ? 4.0 : lowered ? 1.0 : 2.0), lowered);
      if (step() < kConverged && lowered) break;
    }
  }
  for (std::uint32_t node = 0; node < graph_.robots; ++node) {
    if (!is_member(node)) continue;
    RobotFrame& frame = graph_.frames[node];
    frame.group = graph_.frames[group_].robot;
    frame.anchor = graph_.frames[anchor_].robot;
    frame.anchored_by = anchored_by_;
    frame.covariance = {};
    frame.covariance.about_a = frame.T_team_robot.col(3);
  }
  if (unknowns_ == 0) return;
  add_all(kRobustScale, false);
  set_covariances();
}

}  // namespace

void solve_groups(TeamGraph& graph) noexcept {
  for (std::uint32_t node = 0; node < graph.robots; ++node) {
    if (graph.group[node] == node) GroupSolver(graph, static_cast<NodeIndex>(node)).solve();
  }
}

}  // namespace tessera
