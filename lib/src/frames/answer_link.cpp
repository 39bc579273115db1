// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/answer_link.hpp"

#include "six_by_six.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

FrameLink link_of(const FrameAnswer& answer, const Matrix34d& T_world_a,
                  const Matrix34d& T_world_b) noexcept {
  constexpr std::size_t n = FrameCovariance::kSize;
  constexpr auto at = FrameCovariance::index;
  FrameLink link;
  link.T_from_to = product(product(T_world_a, answer.T_a_b), inverse(T_world_b));
  link.covariance.about_a = apply(T_world_a, answer.middle_a);
  SixBySix of_a{};
  for (std::size_t row = 0; row < n; ++row) {
    for (std::size_t column = 0; column <= row; ++column)
      of_a[at(row, column)] = answer.covariance[n * row + column];
  }
  SquareOfSix turn{};
  motion_seen_from(T_world_a, answer.middle_a, link.covariance.about_a, turn);
  link.covariance.values = {};
  add_congruent(turn, of_a, link.covariance.values);
  return link;
}

}  // namespace tessera
