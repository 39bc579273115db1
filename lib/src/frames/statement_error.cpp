// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "statement_error.hpp"

#include "tessera/base/internal/quaternion.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

constexpr double kMostBend = 0.9;

/// Multiplies the rows of the rotation by what a turn does to twice the vector part of q: w r + r x
/// v, and all by a sign.
void turn_rows(SquareOfSix& J, double w, const Point3d& v, double sign) noexcept {
  for (std::size_t column = 0; column < kSix; ++column) {
    const double x = J[3 * kSix + column];
    const double y = J[4 * kSix + column];
    const double z = J[5 * kSix + column];
    J[3 * kSix + column] = w * x + (y * v.z() - z * v.y());
    J[4 * kSix + column] = w * y + (z * v.x() - x * v.z());
    J[5 * kSix + column] = w * z + (x * v.y() - y * v.x());
  }
  for (double& entry : J) entry *= sign;
}

}  // namespace

RobustWeight::RobustWeight(double squared_sigmas, double scale, bool bent) noexcept {
  const double root = scale / (scale + squared_sigmas);
  weight = root * root;
  if (!bent) return;
  bend = 4.0 / (scale + squared_sigmas);
  if (bend * squared_sigmas > kMostBend) bend = kMostBend / squared_sigmas;
}

StatementError::StatementError(const FrameStatement& statement, const Matrix34d& T_team_from,
                               const Matrix34d& T_team_to) noexcept
    : statement_(statement) {
  const Matrix34d T_from_to = product(inverse(T_team_from), T_team_to);
  const Matrix34d E = product(T_from_to, inverse(statement.T_from_to));
  const Six e = motion_at(E, statement.about);
  for (std::size_t row = 0; row < kSix; ++row) {
    for (std::size_t k = 0; k < kSix; ++k)
      weighed_[row] += statement.information[FrameCovariance::index(row, k)] * e[k];
  }
  for (std::size_t k = 0; k < kSix; ++k) squared_sigmas_ += e[k] * weighed_[k];
  const Quaternion q = rotation_of(E);
  const double flip = q[0] < 0.0 ? -1.0 : 1.0;
  const Point3d v(flip * q[1], flip * q[2], flip * q[3]);
  const Point3d moved = apply(E, statement.about);
  motion_seen_from(Matrix34d::Identity(), Point3d::Zero(), moved, jacobians_[0]);
  turn_rows(jacobians_[0], flip * q[0], v, -1.0);
  motion_seen_from(T_from_to, Point3d::Zero(), moved, jacobians_[1]);
  turn_rows(jacobians_[1], flip * q[0], v, 1.0);
}

void StatementError::weigh(const RobustWeight& weight, std::size_t which,
                           SquareOfSix& product) const noexcept {
  const SquareOfSix& J = jacobians_[which];
  for (std::size_t row = 0; row < kSix; ++row) {
    for (std::size_t column = 0; column < kSix; ++column) {
      double sum = 0.0;
      for (std::size_t k = 0; k < kSix; ++k) {
        const double entry = statement_.information[FrameCovariance::index(row, k)] -
                             weight.bend * weighed_[row] * weighed_[k];
        sum += entry * J[k * kSix + column];
      }
      product[row * kSix + column] = weight.weight * sum;
    }
  }
}

}  // namespace tessera
