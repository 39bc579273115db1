// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "team_graph.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

/// A group with vague priors alone is moved, and turned about the vertical, to where these are
/// nearest to the frames: a prior may know no heading, and steps from a wrong one may end anywhere.
/// The turn maximises the sum of weighted cosines, in closed form (Horn 1987 for one angle).
void turn_to_priors(TeamGraph& graph, NodeIndex group) noexcept {
  double weights = 0.0;
  Point3d mean_prior = Point3d::Zero();
  Point3d mean_frame = Point3d::Zero();
  constexpr auto at = FrameCovariance::index;
  const auto each = [&](const auto& use) {
    for (std::uint32_t node = 0; node < graph.robots; ++node) {
      const FrameStatement* const prior = graph.find(graph.world(), node);
      if (graph.group[node] != group || prior == nullptr) continue;
      const Matrix34d& T = graph.frames[node].T_team_robot;
      // What the prior is about, where the prior and where the frame has it.
      const Point3d p_prior = prior->about;
      const Point3d p_frame = apply(T, apply(inverse(prior->T_from_to), p_prior));
      use(*prior, T, p_prior, p_frame);
    }
  };
  each([&](const FrameStatement& prior, const Matrix34d&, const Point3d& p_prior,
           const Point3d& p_frame) {
    const double weight = 1.0 / (prior.covariance[at(0, 0)] + prior.covariance[at(1, 1)]);
    weights += weight;
    for (int axis = 0; axis < 3; ++axis) {
      mean_prior(axis) += weight * p_prior(axis);
      mean_frame(axis) += weight * p_frame(axis);
    }
  });
  for (int axis = 0; axis < 3; ++axis) {
    mean_prior(axis) /= weights;
    mean_frame(axis) /= weights;
  }
  double cosine = 0.0;
  double sine = 0.0;
  each([&](const FrameStatement& prior, const Matrix34d& T, const Point3d& p_prior,
           const Point3d& p_frame) {
    const double weight = 2.0 / (prior.covariance[at(0, 0)] + prior.covariance[at(1, 1)]);
    const double x = p_frame.x() - mean_frame.x();
    const double y = p_frame.y() - mean_frame.y();
    const double to_x = p_prior.x() - mean_prior.x();
    const double to_y = p_prior.y() - mean_prior.y();
    cosine += weight * (x * to_x + y * to_y);
    sine += weight * (x * to_y - y * to_x);
    const Matrix34d turn = product(prior.T_from_to, inverse(T));
    const double turn_weight = 0.5 / prior.covariance[at(5, 5)];
    cosine += turn_weight * (turn(0, 0) + turn(1, 1));
    sine += turn_weight * (turn(1, 0) - turn(0, 1));
  });
  const double length = std::sqrt(cosine * cosine + sine * sine);
  if (!(length > 0.0)) return;
  Matrix34d T_new_old = Matrix34d::Identity();
  T_new_old(0, 0) = T_new_old(1, 1) = cosine / length;
  T_new_old(1, 0) = sine / length;
  T_new_old(0, 1) = -T_new_old(1, 0);
  const Point3d turned = apply(T_new_old, mean_frame);
  for (int axis = 0; axis < 3; ++axis) T_new_old(axis, 3) = mean_prior(axis) - turned(axis);
  for (std::uint32_t node = 0; node < graph.robots; ++node) {
    Matrix34d& T = graph.frames[node].T_team_robot;
    if (graph.group[node] == group) T = product(T_new_old, T);
  }
}

}  // namespace tessera
