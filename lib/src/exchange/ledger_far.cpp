// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What origins say of contributions that are far, and of the extents of those that are held.
#include <algorithm>

#include "tessera/exchange/internal/ledger.hpp"

namespace tessera {

FrameBody Ledger::frame_of(const Contribution& contribution) const noexcept {
  // Of others' what they signed: a relay cannot sign more.
  const bool ours = contribution.own || contribution.moved;
  return {.id = contribution.id,
          .revision = contribution.frame_revision,
          .T_global_map = contribution.T_global_map,
          .extent = ours ? table_.extent_of(contribution) : contribution.signed_extent,
          .session = contribution.session};
}

bool Ledger::take_far_statement(FarContribution& far, const Statement& statement,
                                std::span<const std::byte> proof, bool is_last,
                                ExchangeReport& counted) noexcept {
  const bool replaces = !signatures_.on() && is_last;
  const bool contradicts = !far.statement.agrees_with(statement);
  if (!replaces && !contradicts && !statement.is_newer_than(far.statement)) return true;
  if (signatures_.on() && !chunks_.proofs().check(signatures_, configuration_, statement.id,
                                                  leaf_of(signatures_, statement), proof))
    return false;
  if (contradicts) note_conflict(far.statement, far.proof.bytes(), statement, proof, counted);
  if (replaces || statement.is_newer_than(far.statement)) {
    far.statement = statement;
    far.proof.keep(proof);
  }
  // May remove it.
  note_floor(statement.id.robot, statement.floor, replaces, counted);
  note_session_floor(statement.id.robot, statement.session_floor, replaces, counted);
  return true;
}

bool Ledger::take_far_frame(FarContribution& far, const FrameBody& frame,
                            std::span<const std::byte> proof, bool is_last, Instant now,
                            ExchangeReport& counted) noexcept {
  const bool same = frame.revision == far.frame_revision;
  const bool is_where =
      same && frame.T_global_map == far.T_global_map && frame.session == far.session;
  const bool has_grown =
      is_where && frame.extent != far.signed_extent && frame.extent.contains(far.signed_extent);
  const bool lower = same && signatures_.on() &&
                     (frame.T_global_map == far.T_global_map
                          ? frame.session < far.session
                          : has_lower_bits(frame.T_global_map, far.T_global_map));
  const bool replaces = !signatures_.on() && is_last && !is_where;
  if (frame.revision <= far.frame_revision && !has_grown && !lower && !replaces) return true;
  if (now - far.frame_at < frame_pause_) {
    counted.frames_early += has_grown ? 0U : 1U;
    return true;
  }
  if (!is_signed(frame, proof)) return false;
  far.frame_revision = frame.revision;
  far.T_global_map = frame.T_global_map;
  far.session = frame.session;
  far.frame_at = now;
  far.signed_extent = frame.extent;
  far.extent.include(frame.extent);
  far.box = world_box(far.extent, far.T_global_map, resolution_m_);
  far.frame_proof.keep(proof);
  return true;
}

}  // namespace tessera
