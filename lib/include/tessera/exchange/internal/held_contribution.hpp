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

/// What is held of one contribution, and what is known of it.
struct HeldContribution {
  ContributionId id;
  bool used = false;    ///< The place is taken.
  bool own = false;     ///< Started by open(): nobody else has more of it.
  bool open = false;    ///< There is a frame, hence a slot.
  bool stated = false;  ///< There is a statement.
  bool full = false;    ///< What came last was refused for lack of room.
  std::uint8_t proof_bytes = 0;
  Replicas::Slot slot = 0;
  std::uint32_t generation = 0;  ///< Of the place: higher with each contribution that has it.
  std::uint32_t latest = 0;      ///< The highest version that was heard of.
  std::uint32_t frame_revision = 0;
  /// Without signatures: its origin announced a lower revision. The frame is asked for anew.
  bool frame_doubted = false;
  /// The revision to ask for: one more than is held if somebody says that there is a later one.
  /// A hint, as coverage is.
  std::uint32_t announced_frame = 0;
  std::uint32_t records = 0;
  std::uint64_t record_bytes = 0;  ///< Codes and proofs of these records.
  Fingerprint held{};
  Statement statement{};
  std::array<std::byte, kMostProofBytes> proof{};  ///< Of the statement.
  Matrix34d T_global_map = Matrix34d::Identity();
  Signature frame_signature{};
  Instant frame_at;   ///< When the revision was taken.
  Instant since;      ///< When its name was first heard.
  Instant origin_at;  ///< When the process that publishes it was last heard of it.
  Instant listed;     ///< When its robot last announced it.
  Instant denied;     ///< When its robot first left it out, since it last announced it.
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
  [[nodiscard]] bool has(const FrameBody& frame) const noexcept {
    return frame.revision == frame_revision && frame.T_global_map == T_global_map;
  }
  /// True iff the frame is a later one. Where robots sign and one signs two frames as one revision,
  /// whoever hears both keeps the one of the lower bits.
  [[nodiscard]] bool gives_way_to(const FrameBody& frame, bool signs) const noexcept {
    if (frame.revision != frame_revision || !open || !signs) return frame.revision > sure_frame();
    for (Eigen::Index i = 0; i < T_global_map.size(); ++i) {
      const auto theirs = std::bit_cast<std::uint64_t>(frame.T_global_map.data()[i]);
      const auto ours = std::bit_cast<std::uint64_t>(T_global_map.data()[i]);
      if (theirs != ours) return theirs < ours;
    }
    return false;
  }
};

}  // namespace tessera
