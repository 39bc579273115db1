// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots with known frames, and what they measure of each other.
#pragma once

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "support/aligned_memory.hpp"
#include "support/random.hpp"
#include "tessera/base/internal/quaternion.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/frames/team_frames.hpp"

namespace tessera {

inline double normal(oracle::Random& random) {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) sum += random.uniform();
  return sum;
}

/// A turn by a small rotation vector about a point, and a shift.
inline Matrix34d motion_about(const Point3d& about, const Point3d& shift, const Point3d& turn) {
  Quaternion q{1.0, 0.5 * turn.x(), 0.5 * turn.y(), 0.5 * turn.z()};
  normalise(q);
  Matrix34d T = transform_of(q, Point3d::Zero());
  const Point3d moved = apply(T, about);
  for (int i = 0; i < 3; ++i) T(i, 3) = about(i) + shift(i) - moved(i);
  return T;
}

inline double angle_between(const Matrix34d& a, const Matrix34d& b) {
  const Eigen::Matrix3d R = a.leftCols<3>().transpose() * b.leftCols<3>();
  return Eigen::AngleAxisd(R).angle();
}
inline double distance_between(const Matrix34d& a, const Matrix34d& b) {
  return (a.col(3) - b.col(3)).norm();
}

struct TeamScene {
  static constexpr double kSigma_m = 0.02;
  static constexpr double kSigma_rad = 0.002;

  /// Robots 10, 20, 30 ... within 20 m, level but for a degree.
  TeamScene(std::uint64_t seed, int robots) : random(seed) {
    for (int i = 0; i < robots; ++i) {
      members.push_back({static_cast<std::uint32_t>(10 * (i + 1)), 1});
      Quaternion q{random.uniform(-1, 1), random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01),
                   random.uniform(-1, 1)};
      normalise(q);
      T_world_robot.push_back(transform_of(
          q, {random.uniform(-20, 20), random.uniform(-20, 20), random.uniform(-1, 1)}));
    }
  }

  [[nodiscard]] Matrix34d truth(std::size_t from, std::size_t to) const {
    return product(inverse(T_world_robot[from]), T_world_robot[to]);
  }
  /// A measurement with this noise, by its indices.
  FrameLink measure(std::size_t from, std::size_t to, double sigma_m = kSigma_m,
                    double sigma_rad = kSigma_rad) {
    // In braces: drawn in this order by every compiler.
    const Point3d about{random.uniform(-10, 10), random.uniform(-10, 10), random.uniform(-1, 1)};
    const auto draw = [&](double sigma) {
      return Point3d{sigma * normal(random), sigma * normal(random), sigma * normal(random)};
    };
    const Point3d shift = draw(sigma_m);
    FrameLink link = exactly(from, to);
    link.T_from_to = product(motion_about(about, shift, draw(sigma_rad)), link.T_from_to);
    link.covariance = FrameCovariance::isotropic(about, sigma_m, sigma_rad);
    return *round_link(link);
  }
  [[nodiscard]] FrameLink exactly(std::size_t from, std::size_t to) const {
    FrameLink link;
    link.from = members[from].robot;
    link.to = members[to].robot;
    link.from_epoch = members[from].epoch;
    link.to_epoch = members[to].epoch;
    link.revision = 1;
    link.T_from_to = truth(from, to);
    link.covariance = FrameCovariance::isotropic(Point3d::Zero(), kSigma_m, kSigma_rad);
    return link;
  }
  void state(std::size_t from, std::size_t to) { links.push_back(measure(from, to)); }
  void state_both(std::size_t one, std::size_t other) {
    state(one, other);
    state(other, one);
  }
  /// A link that is off by this.
  void state_falsely(std::size_t from, std::size_t to, const Point3d& shift,
                     const Point3d& turn = Point3d::Zero()) {
    FrameLink link = measure(from, to);
    link.T_from_to = product(motion_about(link.covariance.about_a, shift, turn), link.T_from_to);
    links.push_back(*round_link(link));
  }
  template <class T>
  void shuffle(std::vector<T>& list) {
    for (std::size_t i = list.size(); i > 1; --i)
      std::swap(list[i - 1], list[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
  }

  oracle::Random random;
  std::vector<FrameMember> members;
  std::vector<Matrix34d> T_world_robot;
  std::vector<FrameLink> links;
  std::vector<FramePrior> priors;
};

/// A solver with its memory, which is full of rubbish at first.
struct TeamSolver {
  explicit TeamSolver(std::uint32_t robots = TeamFrames::kMostRobots,
                      std::uint32_t links = TeamFrames::kMostLinks)
      : memory(TeamFrames::required_bytes(robots, links)) {
    memory.fill(std::byte{0xa5});
    Arena arena = memory.arena();
    frames = *TeamFrames::make(arena, robots, links);
  }
  TeamSolution solve(const TeamScene& scene) {
    const auto solution = frames.solve(scene.links, scene.priors, scene.members);
    REQUIRE(solution.ok());
    return *solution;
  }
  AlignedMemory memory;
  TeamFrames frames;
};

}  // namespace tessera
