// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>

#include "tessera/base/geometry.hpp"
#include "tessera/base/instant.hpp"
#include "tessera/exchange/internal/coverage.hpp"
#include "tessera/exchange/internal/record_proof.hpp"
#include "tessera/exchange/internal/version_index.hpp"

namespace tessera {

/// Of two frames that one robot signed as one revision, all keep the one of the lower bits.
[[nodiscard]] inline bool has_lower_bits(const Matrix34d& a, const Matrix34d& b) noexcept {
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    const auto of_a = std::bit_cast<std::uint64_t>(a.data()[i]);
    const auto of_b = std::bit_cast<std::uint64_t>(b.data()[i]);
    if (of_a != of_b) return of_a < of_b;
  }
  return false;
}

/// What is known of a contribution of which records may be held or not. All but the moments was
/// signed by its origin, in a fleet that signs.
struct KnownContribution {
  std::uint32_t frame_revision = 0;
  Statement statement{};
  KeptProof proof{};  ///< Of the statement.
  Matrix34d T_global_map = Matrix34d::Identity();
  MapSession session{};  ///< As with this frame, if it is one.
  KeptProof frame_proof{};
  BlockExtent signed_extent;  ///< As with this frame; of an own one, of the last that was sent.
  Instant frame_at;           ///< When the revision was taken.
  Instant origin_at;          ///< When the process that publishes it was last heard of it.
  Instant listed;             ///< When its robot last announced it.
  Instant denied;             ///< When its robot first left it out, since it last announced it.

  [[nodiscard]] KnownContribution& known() noexcept { return *this; }
  [[nodiscard]] const KnownContribution& known() const noexcept { return *this; }
};

/// What is held of one contribution, and what is known of it.
struct HeldContribution : KnownContribution {
  ContributionId id;
  bool used = false;    ///< The place is taken.
  bool own = false;     ///< Started by open(): nobody else has more of it.
  bool open = false;    ///< There is a frame, hence a slot.
  bool stated = false;  ///< There is a statement.
  bool moved = false;   ///< Of an earlier epoch of this robot's: this process has given its frame.
  bool full = false;    ///< What came last was refused for lack of room.
  bool whole = false;   ///< It was complete once: what is missing is new.
  bool far = false;     ///< Its records are not asked for, nor taken: not yet, or as it is far.
  Replicas::Slot slot = 0;
  std::uint32_t generation = 0;  ///< Of the place: higher with each contribution that has it.
  std::uint32_t latest = 0;      ///< The highest version that was heard of.
  /// Without signatures: its origin announced a lower revision. The frame is asked for anew.
  bool frame_doubted = false;
  /// The revision to ask for: one more than is held if somebody says that there is a later one.
  /// A hint, as coverage is.
  std::uint32_t announced_frame = 0;
  std::uint32_t records = 0;
  std::uint64_t record_bytes = 0;  ///< Codes and proofs of these records.
  Fingerprint held{};
  double away_m = 0.0;  ///< From places that matter, as Reach found it; 0 or less: near.
  Instant wanted_at;    ///< When far changed last.
  Instant elsewhere;    ///< When another robot last announced that it has all of it.
  Instant since;        ///< When its name was first heard.
  /// Versions that need not be asked for: it has them, or a robot that sent others of the range
  /// said that there are no more. A hint: nothing is complete by it.
  Coverage coverage;
  VersionIndex index;

  /// The revision that needs no asking for.
  [[nodiscard]] std::uint32_t sure_frame() const noexcept {
    return frame_doubted ? 0 : frame_revision;
  }
  /// What is held is what its origin stated last.
  [[nodiscard]] bool complete() const noexcept {
    return own || (open && stated && records == statement.records &&
                   held == statement.fingerprint && sure_frame() >= statement.frame_revision);
  }
  /// Nothing of it is wanted where the robot is.
  [[nodiscard]] bool is_far() const noexcept { return far && open && away_m > 0.0; }
  /// What is held, or of a far one what its origin states.
  [[nodiscard]] const Fingerprint& said() const noexcept {
    return is_far() && stated ? statement.fingerprint : held;
  }
  [[nodiscard]] bool has(const FrameBody& frame) const noexcept {
    return is_where(frame) && signed_extent.contains(frame.extent);
  }
  /// The same transform in the same revision.
  [[nodiscard]] bool is_where(const FrameBody& frame) const noexcept {
    return frame.revision == frame_revision && frame.T_global_map == T_global_map &&
           frame.session == session;
  }
  /// The same, and the origin has published beyond what its last frame said.
  [[nodiscard]] bool has_grown(const FrameBody& frame) const noexcept {
    return open && is_where(frame) && signed_extent != frame.extent &&
           frame.extent.contains(signed_extent);
  }
  /// True iff the frame is a later one, or where robots sign the one of two of one revision that
  /// counts.
  [[nodiscard]] bool gives_way_to(const FrameBody& frame, bool signs) const noexcept {
    if (frame.revision != frame_revision || !open || !signs) return frame.revision > sure_frame();
    if (frame.T_global_map != T_global_map) return has_lower_bits(frame.T_global_map, T_global_map);
    return frame.session < session;
  }
};

}  // namespace tessera
