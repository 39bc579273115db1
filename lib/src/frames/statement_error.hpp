// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How far two frames are off a statement, and how that changes with them.
#pragma once

#include "team_graph.hpp"

namespace tessera {

inline constexpr std::size_t kSix = FrameCovariance::kSize;

/// The weight of a squared distance x under rho(x) = s x / (s + x).
struct RobustWeight {
  /// bent: with what the weight loses where the distance grows (Triggs et al., Bundle Adjustment,
  /// 2000, 4.3), which makes the last steps those of Newton's method.
  RobustWeight(double squared_sigmas, double scale, bool bent) noexcept;
  double weight = 1.0;  ///< rho'(x)
  double bend = 0.0;    ///< -2 rho''(x) / rho'(x), or less: no direction may lose more than it has.
};

/// E = T_from^-1 T_to T_from_to^-1 is the identity at best. Its motion at the statement's point is
/// the error, and the derivatives are by motions of both frames, each along its own axes.
class StatementError {
 public:
  /// T_team_from and T_team_to.
  StatementError(const FrameStatement& statement, const Matrix34d& T_team_from,
                 const Matrix34d& T_team_to) noexcept;
  [[nodiscard]] double squared_sigmas() const noexcept { return squared_sigmas_; }
  /// The information matrix times the error.
  [[nodiscard]] const Six& weighed() const noexcept { return weighed_; }
  /// By from (0) or to (1), row after row.
  [[nodiscard]] const SquareOfSix& jacobian(std::size_t which) const noexcept {
    return jacobians_[which];
  }
  /// The information matrix, as the weight has it, times a jacobian.
  void weigh(const RobustWeight& weight, std::size_t which, SquareOfSix& product) const noexcept;

 private:
  const FrameStatement& statement_;
  Six weighed_{};
  double squared_sigmas_ = 0.0;
  std::array<SquareOfSix, 2> jacobians_{};
};

}  // namespace tessera
