// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What each robot states about frames, as records of a contribution of its own (FrameStatements):
// one link for each robot whose map it aligned to its own, and one prior. So statements are signed,
// versioned, repaired and passed on as blocks are, and robots that hold the same contributions
// collect the same statements.
#pragma once

#include <optional>
#include <span>

#include "tessera/frames/frame_link.hpp"
#include "tessera/replica/contribution_kind.hpp"

namespace tessera {

/// How well a robot knows the frame in which it publishes its contributions.
enum class PriorKind : std::uint8_t {
  kUnknown,  ///< It is the robot's own; links have to find it.
  kVague,    ///< It is the team's, with an error that has a covariance.
  kExact,    ///< It is the team's, to the bit.
};

/// What a robot states of the frame in which its contributions are published. The latest of each
/// epoch counts.
struct StatedPrior {
  static constexpr std::size_t kBytes = 81;

  std::uint32_t robot = 0;
  std::uint32_t epoch = 0;  ///< Of the contributions: a robot that starts anew states it anew.
  PriorKind kind = PriorKind::kUnknown;
  /// Of kVague: of the published frame seen from the team's, about_a in the published frame. Of
  /// the others it has no meaning, and is not sent.
  FrameCovariance covariance{};
};

/// The bytes of a stated prior, little-endian: robot and epoch, 4 each; the kind, 1; about_a and
/// the lower triangular L of the covariance as encode_link has them, 72, zeros unless kVague.
/// Fails with kInvalidArgument iff there is no such kind, or the covariance of kVague is none that
/// encode_link takes. O(1).
[[nodiscard]] Status encode_prior(const StatedPrior& prior,
                                  std::span<std::byte, StatedPrior::kBytes> bytes) noexcept;
/// The prior of these bytes; encode_prior gives the same bytes for it. Fails with kTruncated iff
/// there are fewer than StatedPrior::kBytes; kCorrupt iff there are more, or encode_prior gives no
/// such bytes. O(1).
[[nodiscard]] Result<StatedPrior> decode_prior(std::span<const std::byte> bytes) noexcept;
/// The prior as TeamFrames takes it: the robot's published frame is the team's, with the error that
/// it states. Nothing: it is kUnknown. O(1).
[[nodiscard]] std::optional<FramePrior> prior_of(const StatedPrior& stated) noexcept;

/// Where a link to this robot stands among the statements of its author: each in a place of its
/// own. O(1).
[[nodiscard]] constexpr BlockKey place_of_link(std::uint32_t to) noexcept {
  return pack_in_grid(
      {static_cast<std::int32_t>(to & 0xffffU), static_cast<std::int32_t>(to >> 16U), 0});
}
/// And the prior.
inline constexpr BlockKey kPlaceOfPrior = pack_in_grid({0, 0, 1});

/// True iff these bytes are a link or a prior that a contribution of statements may have in this
/// place: decode_link or decode_prior takes them, they are of the robot and the epoch of id, and
/// stand where they belong. O(1).
[[nodiscard]] bool is_frame_statement(const ContributionId& id, BlockKey place,
                                      std::span<const std::byte> bytes) noexcept;

/// The prior that a contribution of statements has. Fails with kCorrupt iff it has none, or bytes
/// that are none. A look-up and a decoding.
[[nodiscard]] Result<StatedPrior> read_prior(const Replicas& replicas,
                                             Replicas::Slot slot) noexcept;

/// What collect() found.
struct CollectedStatements {
  std::uint32_t links = 0;   ///< The first ones of the span.
  std::uint32_t priors = 0;  ///< The same.
  std::uint32_t links_left_out = 0;
  std::uint32_t priors_left_out = 0;
};

/// All statements held, of this robot too, in the order of the contributions' ids; links of one in
/// the order of FrameLink::to. Where links do not fit, each contribution has room for as many as
/// any other, as far as it needs it, and those to the highest robots are left out: who states many
/// crowds out no others. Of one contribution at most FrameStatements::kMostLinks are collected.
/// Contributions that are leaving are skipped. A pure function of what is held; changes only with
/// Replicas::frame_changes(). O(kMostLinks (contributions + statements held)), and a decoding for
/// each that is collected: 56 links take 0.04 ms on one core, 512 links 0.4 ms, and 0.6 ms beside a
/// robot that states 60,000.
[[nodiscard]] CollectedStatements collect(const Replicas& replicas, std::span<FrameLink> links,
                                          std::span<StatedPrior> priors) noexcept;

}  // namespace tessera
