// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Links and covariances as aligning maps may give them, drawn at random; links and priors as bytes.
#pragma once

#include "team_scene.hpp"
#include "tessera/frames/frame_statements.hpp"

namespace tessera {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// With correlations, and standard deviations from millimetres to tens of metres.
inline FrameCovariance drawn_covariance(oracle::Random& random) {
  FrameCovariance covariance;
  Matrix6d L = Matrix6d::Zero();
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < i; ++j) L(i, j) = random.uniform(-0.1, 0.1);
    L(i, i) = i < 3 ? (i == 0 ? random.uniform(0.001, 40.0) : random.uniform(0.001, 0.1))
                    : random.uniform(1e-4, 0.1);
  }
  const Matrix6d C = L * L.transpose();
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j <= i; ++j)
      covariance.values[FrameCovariance::index(i, j)] = C(static_cast<int>(i), static_cast<int>(j));
  }
  covariance.about_a = {random.uniform(-5e4, 5e4), random.uniform(-5e4, 5e4), 3.0};
  return covariance;
}

inline FrameLink drawn_link(oracle::Random& random) {
  FrameLink link;
  link.from = static_cast<std::uint32_t>(random.bits());
  link.to = link.from + 1 + static_cast<std::uint32_t>(random.below(1000));
  link.from_epoch = static_cast<std::uint32_t>(random.bits());
  link.to_epoch = static_cast<std::uint32_t>(random.bits());
  link.from_version = static_cast<std::uint32_t>(random.bits());
  link.to_version = static_cast<std::uint32_t>(random.bits());
  link.revision = 1 + static_cast<std::uint32_t>(random.below(1 << 30));
  link.withdrawn = random.below(2) == 1;
  Quaternion q{normal(random), normal(random), normal(random), normal(random)};
  normalise(q);
  link.T_from_to = transform_of(
      q, {random.uniform(-5e4, 5e4), random.uniform(-5e4, 5e4), random.uniform(-100, 100)});
  link.covariance = drawn_covariance(random);
  return link;
}

using LinkBytes = std::array<std::byte, FrameLink::kBytes>;
using PriorBytes = std::array<std::byte, StatedPrior::kBytes>;

inline LinkBytes bytes_of(const FrameLink& link) {
  LinkBytes bytes{};
  REQUIRE(encode_link(link, bytes) == Status::kOk);
  return bytes;
}
inline PriorBytes bytes_of(const StatedPrior& prior) {
  PriorBytes bytes{};
  REQUIRE(encode_prior(prior, bytes) == Status::kOk);
  return bytes;
}

}  // namespace tessera
