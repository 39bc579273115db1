// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/submap/frame_fit.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "support/random.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {
namespace {

Matrix34d turned(double w, double x, double y, double z, const Point3d& at) {
  Quaternion q{w, x, y, z};
  normalise(q);
  return transform_of(q, at);
}

struct Poses {
  explicit Poses(int count) {
    for (int i = 0; i < count; ++i)
      mapped.push_back(turned(1.0, random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1),
                              random.uniform(-1.0, 1.0), {1.0 * i, random.uniform(-1, 1), 0.2}));
  }
  /// The mean square of the distances from the corrected places.
  [[nodiscard]] double error(const Matrix34d& T) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < mapped.size(); ++i)
      sum += squared_norm(apply(T, mapped[i].col(3)) - Point3d(corrected[i].col(3)));
    return sum / static_cast<double>(mapped.size());
  }
  oracle::Random random{71};
  std::vector<Matrix34d> mapped;
  std::vector<Matrix34d> corrected;
};

TEST_CASE("FrameFit: poses that were moved as one give that motion") {
  Poses poses(30);
  const Matrix34d T = turned(0.9, 0.01, -0.02, 0.3, {100.0, -20.0, 3.0});
  FrameFit fit;
  for (const Matrix34d& pose : poses.mapped) fit.add(pose, product(T, pose));
  CHECK(fit.count() == 30);
  CHECK((*fit.fit() - T).cwiseAbs().maxCoeff() < 1e-12);
}

TEST_CASE("FrameFit: one pose alone is met") {
  Poses poses(1);
  const Matrix34d T = turned(-0.1, 0.0, 0.0, 1.0, {5.0, 6.0, 7.0});
  FrameFit fit;
  fit.add(poses.mapped[0], product(T, poses.mapped[0]));
  CHECK((*fit.fit() - T).cwiseAbs().maxCoeff() < 1e-12);
}

TEST_CASE("FrameFit: of poses that drift it is between them, and no small shift is nearer") {
  Poses poses(40);
  for (std::size_t i = 0; i < poses.mapped.size(); ++i) {
    const double drift = 1e-3 * static_cast<double>(i);
    const Matrix34d T = turned(1.0, 0.0, 0.0, 0.2 * drift, {10.0 + drift, 0.5 * drift, 0.0});
    poses.corrected.push_back(product(T, poses.mapped[i]));
  }
  FrameFit fit;
  for (std::size_t i = 0; i < poses.mapped.size(); ++i)
    fit.add(poses.mapped[i], poses.corrected[i]);
  const Matrix34d T = *fit.fit();
  CHECK(poses.error(T) < 0.15 * 0.15);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double step_m : {-1e-3, 1e-3}) {
      Matrix34d other = T;
      other(axis, 3) += step_m;
      CHECK(poses.error(other) > poses.error(T));
    }
  }
}

TEST_CASE("FrameFit: without poses, or with such as contradict each other, there is no frame") {
  CHECK(FrameFit().fit().status() == Status::kInvalidArgument);
  // Each is half a turn from the others: four of them have a mean of half their length.
  FrameFit fit;
  fit.add(Matrix34d::Identity(), turned(1.0, 0.0, 0.0, 0.0, {0, 0, 0}));
  CHECK(fit.fit().ok());
  fit.add(Matrix34d::Identity(), turned(0.0, 1.0, 0.0, 0.0, {0, 0, 0}));
  fit.add(Matrix34d::Identity(), turned(0.0, 0.0, 1.0, 0.0, {0, 0, 0}));
  fit.add(Matrix34d::Identity(), turned(0.0, 0.0, 0.0, 1.0, {0, 0, 0}));
  CHECK(fit.fit().status() == Status::kInvalidArgument);
}

}  // namespace
}  // namespace tessera
