// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What robots and users state about frames: a link is one robot's measurement of where another
// robot's map is in its own, a prior is a frame that a user gives. A link has 123 bytes; everybody
// computes with the link that the bytes stand for, and so with the same bits.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "tessera/base/geometry.hpp"

namespace tessera {

/// How uncertain a transform T_a_b is: the covariance of a small motion of b seen from a. The true
/// transform takes p_b to R (T_a_b p_b - about) + about + t, where t in metres and the rotation
/// vector of R in radians are small and have this covariance, both along the axes of a.
struct FrameCovariance {
  static constexpr std::size_t kSize = 6;
  static constexpr std::size_t kValues = kSize * (kSize + 1) / 2;

  /// In frame a, metres: the centroid of the overlap, where t and R are nearly independent.
  Point3d about_a = Point3d::Zero();
  /// The lower triangle, row after row, in the order t_x t_y t_z r_x r_y r_z: m^2, m rad, rad^2.
  /// All zero: exact.
  std::array<double, kValues> values{};

  /// The place of a row and a column in values; the matrix is symmetric. O(1).
  [[nodiscard]] static constexpr std::size_t index(std::size_t row, std::size_t column) noexcept {
    return row >= column ? row * (row + 1) / 2 + column : column * (column + 1) / 2 + row;
  }
  /// Uncorrelated: the same standard deviation along each axis, and about each.
  [[nodiscard]] static FrameCovariance isotropic(const Point3d& about_a, double sigma_m,
                                                 double sigma_rad) noexcept;
  /// The root of the sum of the three variances of the shift at about_a, metres.
  [[nodiscard]] double sigma_m() const noexcept;
  /// The root of the sum of the three variances of the rotation, radians.
  [[nodiscard]] double sigma_rad() const noexcept;
};

/// One robot's statement of where another robot's map is in its own map. The latest of each pair
/// (from, to) counts.
struct FrameLink {
  static constexpr std::size_t kBytes = 123;

  std::uint32_t from = 0;        ///< The robot that states it, and in whose map frame it measured.
  std::uint32_t to = 0;          ///< The robot whose map it aligned.
  std::uint32_t from_epoch = 0;  ///< Of the contributions: a robot that starts anew has a new map.
  std::uint32_t to_epoch = 0;
  std::uint32_t from_version = 0;  ///< The latest versions of the contributions compared.
  std::uint32_t to_version = 0;
  std::uint32_t revision = 0;  ///< Of the author's links from - to: a higher one replaces a lower.
  bool withdrawn = false;      ///< The author takes its link back; the transform has no meaning.
  Matrix34d T_from_to = Matrix34d::Identity();  ///< p_from = T_from_to p_to.
  FrameCovariance covariance = FrameCovariance::isotropic(Point3d::Zero(), 1.0, 1.0);
};

/// A frame that a user gives, as a survey or a GNSS receiver has it. Priors are trusted: where
/// links contradict them, the links are refused.
struct FramePrior {
  std::uint32_t robot = 0;
  Matrix34d T_team_robot = Matrix34d::Identity();  ///< p_team = T_team_robot p_map of the robot.
  bool exact = true;                               ///< The frame holds to the bit.
  FrameCovariance covariance{};                    ///< If not exact; about_a is in the team frame.
};

/// The bytes of a link, little-endian: from, to, their epochs, their versions and the revision, 4
/// each; flags, 1 (bit 0: withdrawn); the transform as a RigidCode, 22; about_a, three times 3 in
/// steps of 2^-4 m; the lower triangular L with covariance = L L^T, 21 times 3, row after row, the
/// first three rows in steps of 2^-14 m and the others in steps of 2^-20 rad.
/// Rounding changes the standard deviation in any direction by at most 4 steps; none becomes zero.
/// Fails with kInvalidArgument iff from == to, revision is 0, the transform is not rigid or over
/// RigidCode::kMostMetres, a coordinate of about_a is over 524,287 m, or the covariance is not
/// positive definite or has a standard deviation of 512 m or 8 rad or more. O(1).
[[nodiscard]] Status encode_link(const FrameLink& link,
                                 std::span<std::byte, FrameLink::kBytes> bytes) noexcept;
/// The link of these bytes; encode_link gives the same bytes for it. Fails with kTruncated iff
/// there are fewer than FrameLink::kBytes; kCorrupt iff there are more, or encode_link gives no
/// such bytes: a link to itself, revision 0, unknown flags, no rotation, a covariance that is not
/// positive definite. O(1).
[[nodiscard]] Result<FrameLink> decode_link(std::span<const std::byte> bytes) noexcept;
/// The link that the bytes of this one stand for: what its author, too, has to use. Fails as
/// encode_link.
[[nodiscard]] Result<FrameLink> round_link(const FrameLink& link) noexcept;

/// How far one link is from another.
struct LinkMotion {
  double shift_m = 0.0;    ///< At the middle of what the second was measured from.
  double chord_rad = 0.0;  ///< 2 sin(angle / 2).
};
[[nodiscard]] LinkMotion motion_between(const FrameLink& before, const FrameLink& after) noexcept;

}  // namespace tessera
