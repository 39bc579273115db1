// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The frames of a team: a pure function of the set of latest links and priors. Robots that hold the
// same set get the same bits, in whatever order they received it; nobody leads and nothing is
// remembered from call to call.
//
// Which links count. A link is *confirmed* if another author measured the same: the robot at its
// other end, or two others whose links make the same way. What nobody confirms is one member's
// word: it may join groups that nothing else joins, but it is never averaged with other links, and
// it does not move robots to each other that confirmed links join.
// Cycles must close within kMostSquaredSigmas. Where one does not,
// 1. who states links that do not close over what others confirm without him is suspected, by name,
//    and whatever he states is refused, unless it closes once that of one of the others is left
//    out;
// 2. of confirmed links, the pairs in the most open triangles are refused, those that only one end
//    states first, and all of them where several are as bad; three or more with one robot in common
//    name it, as its map is bent;
// 3. of words, those that contradict what is confirmed are refused and their author is suspected;
//    of those that contradict each other all are refused, and nobody is named.
// Two robots that contradict each other alone have no common frame. One lying member moves honest
// robots that are joined by links that both ends state only by what is within these limits. It can
// keep a robot apart that only one member's word joins. Lies of several that agree are not noticed.
// Priors are trusted: links that contradict them are refused, and nobody is named.
//
// Which frame a group has. A group is what used links and exact priors join. A group with exact
// priors is in the team frame that they define, and these frames hold to the bit; one with vague
// priors is where these and the links together put it; in one without priors, the robot with the
// lowest number keeps the identity. So where groups meet, the frame of the one with an exact prior
// survives, then of one with a vague prior, then of the one with the lowest robot; and when a group
// splits, the part with the prior or else the lowest robot keeps its frame, and the other one takes
// that of its own lowest robot. A function without memory cannot keep the frame that a group had
// before its reference left: who uses the frames ends the old ones first and begins with the new
// ones at once, as all of the group move together.
#pragma once

#include <cstdint>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/status.hpp"
#include "tessera/frames/frame_link.hpp"

namespace tessera {

/// A robot of the team, and the epoch of its contribution that counts.
struct FrameMember {
  std::uint32_t robot = 0;
  std::uint32_t epoch = 0;
};

/// Why a robot's frame is what it is.
enum class FrameState : std::uint8_t {
  kGiven,         ///< By an exact prior.
  kPlaced,        ///< By a vague prior alone: no link is used.
  kLinked,        ///< By links; more than one member's word joins it to its anchor.
  kOnlyByOne,     ///< By links, but without one member it would not be joined (joined_by).
  kAlone,         ///< No link and no prior: the identity, in a group of its own.
  kWithdrawn,     ///< As kAlone, and links of it were withdrawn.
  kContradicted,  ///< As kAlone, because the links about it contradict each other or priors.
};

/// What a group's frame is held by.
enum class FrameAnchor : std::uint8_t {
  kExactPrior,   ///< Frames that users gave exactly.
  kVaguePrior,   ///< Frames that users gave with a covariance.
  kLowestRobot,  ///< The robot with the lowest number has the identity.
};

/// What became of a link.
enum class LinkVerdict : std::uint8_t {
  kUsed,           ///< Its measurement is part of the solution.
  kNotNeeded,      ///< One member's word between robots that are joined without it.
  kReplaced,       ///< There is a later one of the same pair, or the same again.
  kWithdrawn,      ///< By its author.
  kNotMember,      ///< One of its robots is not a member.
  kOtherEpoch,     ///< It is about another epoch of one of them than the one that counts.
  kInvalid,        ///< encode_link would refuse it: it is as if it were not there.
  kTwoContents,    ///< Its author stated two contents of one revision.
  kContradicted,   ///< A cycle does not close, and nobody can be named.
  kAuthorRefused,  ///< A cycle does not close, and its author is named for it; or the author is
                   ///< suspected of another link, and nobody else confirms this one.
  kAgainstPriors,  ///< A cycle through priors does not close.
};

/// A robot's frame.
struct RobotFrame {
  std::uint32_t robot = 0;
  std::uint32_t group = 0;   ///< The lowest robot of the group. Frames of one group fit together.
  std::uint32_t anchor = 0;  ///< The lowest robot that holds the group's frame.
  FrameAnchor anchored_by = FrameAnchor::kLowestRobot;
  FrameState state = FrameState::kAlone;
  bool suspected = false;  ///< Its own links contradict what others confirm.
  /// Bit i: without the i-th member in the order of their numbers, it would not be joined. Without
  /// another member: without it and all links to it. Without itself or its anchor: without the
  /// links that these stated.
  std::uint64_t joined_by = 0;
  /// p_team = T_team_robot p_map of the robot. "Team" is the frame of the group.
  Matrix34d T_team_robot = Matrix34d::Identity();
  /// To the group's anchor; about_a is the robot's origin in the team frame. Exact: all zero.
  FrameCovariance covariance{};
};

/// What became of a link, and how far it is from the solution.
struct FrameLinkReport {
  LinkVerdict verdict = LinkVerdict::kReplaced;
  bool confirmed = false;  ///< Another author measured the same.
  bool compared = false;   ///< Both robots are in one group: sigmas has a meaning.
  double sigmas = 0.0;     ///< Mahalanobis distance of the frames from this link, 6 degrees.
};

/// Views into the workspace, valid until the next solve().
struct TeamSolution {
  std::span<const RobotFrame> frames;      ///< In the order of the robots' numbers.
  std::span<const FrameLinkReport> links;  ///< In the order of the links given.
  std::uint32_t groups = 0;
  std::uint64_t digest = 0;  ///< Of all frames, groups and states.
};

struct TeamGraph;

/// The workspace of the function.
class TeamFrames {
 public:
  static constexpr std::uint32_t kMostRobots = 64;
  static constexpr std::uint32_t kMostLinks = 512;
  /// What a cycle may be off: the 1e-5 quantile of chi-square with six degrees of freedom.
  static constexpr double kMostSquaredSigmas = 33.1;
  /// A link's standard deviations count as at least these along and about each axis: what maps of
  /// voxels can tell, whatever an author claims.
  static constexpr double kFloor_m = 0.015625;
  static constexpr double kFloor_rad = 0.0009765625;
  /// A vaguer measurement (FrameCovariance::sigma_m, sigma_rad) confirms nothing.
  static constexpr double kMostConfirming_m = 0.5;
  static constexpr double kMostConfirming_rad = 0.035;
  static constexpr int kMostIterations = 12;

  /// Bytes of arena that make takes: 1.7 MB for 64 robots and 512 links, 0.1 MB for 8 and 56.
  [[nodiscard]] static std::size_t required_bytes(std::uint32_t most_robots,
                                                  std::uint32_t most_links) noexcept;
  /// Fails with kInvalidArgument iff most_robots is 0 or over kMostRobots, or most_links over
  /// kMostLinks; kResourceExhausted iff the arena is too small. O(required_bytes).
  [[nodiscard]] static Result<TeamFrames> make(Arena& arena, std::uint32_t most_robots,
                                               std::uint32_t most_links) noexcept;
  /// Belongs to no arena; solve() fails with kResourceExhausted.
  TeamFrames() noexcept = default;

  /// The frames of all members: a function of the sets, whose order does not matter. links: of
  /// several of the members' epochs with one (from, to), those with the highest revision count;
  /// links and priors of robots that are not members are ignored. Each member's frame minimises,
  /// with those of its group, the sum over used links and vague priors of rho(r^2), r^2 being the
  /// Mahalanobis distance and rho(x) = s x / (s + x) with s = 2 kMostSquaredSigmas (Geman and
  /// McClure 1987), by iteratively reweighted Gauss-Newton steps (Barfoot, State Estimation for
  /// Robotics, 2017, 5.3) from the frames along a spanning tree, with s lowered in steps (Yang et
  /// al., Graduated Non-Convexity, RA-L 2020). Cycles as in Grisetti et al., A Tutorial on
  /// Graph-Based SLAM, 2010, covariances of small motions about a point carried along. Fails, with
  /// the workspace in an undefined state, with kResourceExhausted iff there are more members, links
  /// or priors than make() was given; kInvalidArgument iff a member is given twice, a member has
  /// two priors, or a member's prior is not rigid, over RigidCode::kMostMetres or neither exact nor
  /// positive definite. At worst, for n robots and m links: a test for each of at most 16,000 ways
  /// around triangles; 8 m tests of cycles of up to n + 1 links, each again up to 8 times where it
  /// is open and short; n^2 searches over pairs; and kMostIterations + 1 factorisations of 6 n rows
  /// with (6 n)^3 / 6 multiplications each, and one inverse. 9 kB of stack. 64 robots with 512
  /// links take 25 to 90 ms on one core, 8 robots with 56 links 1 ms.
  [[nodiscard]] Result<TeamSolution> solve(std::span<const FrameLink> links,
                                           std::span<const FramePrior> priors,
                                           std::span<const FrameMember> members) noexcept;

 private:
  TeamGraph* graph_ = nullptr;
};

}  // namespace tessera
