// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/ledger.hpp"

#include <algorithm>

#include "tessera/base/internal/put_in_place.hpp"

namespace tessera {

Result<Ledger> Ledger::make(Arena& arena, const ExchangeConfig& config, const ReplicaStore& store,
                            const Gate& gate, int num_components) noexcept {
  Ledger ledger;
  ledger.robot_ = config.robot;
  ledger.session_ = config.session;
  ledger.resolution_m_ = config.resolution_m;
  ledger.frame_pause_ = {config.frame_us};
  ledger.policy_ = config.conflicts;
  ledger.signatures_ = gate.signatures();
  ledger.configuration_ = gate.configuration();
  const bool signs = gate.signatures().on();
  Status status =
      put_in_place(ledger.table_, [&] { return ContributionTable::make(arena, config, store); });
  if (status == Status::kOk)
    status = put_in_place(ledger.floors_, [&] { return EpochFloors::make(arena, config, signs); });
  if (status == Status::kOk)
    status = put_in_place(ledger.records_, [&] {
      return HeldRecords::make(arena, config, store, signs, num_components);
    });
  if (status == Status::kOk)
    status = put_in_place(ledger.chunks_, [&] {
      return ChunkTaker::make(arena, gate.signatures(), gate.configuration(), num_components);
    });
  if (status == Status::kOk)
    status = put_in_place(
        ledger.maker_, [&] { return RecordMaker::make(arena, gate.signatures(), num_components); });
  if (status == Status::kOk)
    status = put_in_place(ledger.conflicts_, [&] { return Conflicts::make(arena); });
  if (status == Status::kOk)
    status =
        put_in_place(ledger.content_, [&] { return BlockContent::make(arena, num_components); });
  if (status != Status::kOk) return status;
  return ledger;
}

// --- Names and epochs ----------------------------------------------------------------------------

Ledger::Contribution* Ledger::note_name(const ContributionId& id, Instant now,
                                        ExchangeReport& counted) noexcept {
  if (Contribution* const known = find(id); known != nullptr) return known;
  if (id.epoch < floors_.of(id)) {
    ++counted.refused_epochs;
    return nullptr;
  }
  if (is_ended(id)) {
    ++counted.refused_disputed;
    return nullptr;
  }
  return table_.add(id, ContributionTable::Claim::kName, now, counted);
}

void Ledger::note_floor(std::uint32_t robot, std::uint32_t floor, bool may_fall,
                        ExchangeReport& counted) noexcept {
  if (floors_.note(robot, floor, may_fall, table_)) drop_below(robot, floor, counted);
}

void Ledger::drop_below(std::uint32_t robot, std::uint32_t floor,
                        ExchangeReport& counted) noexcept {
  counted.ended_contributions += table_.drop_named_if(
      [&](const ContributionId& id) { return id.robot == robot && id.epoch < floor; });
}

void Ledger::note_session_floor(std::uint32_t robot, std::uint32_t floor, bool may_fall,
                                ExchangeReport& counted) noexcept {
  if (floors_.note_sessions(robot, floor, may_fall, table_))
    drop_sessions_below(robot, floor, counted);
}

void Ledger::drop_sessions_below(std::uint32_t robot, std::uint32_t floor,
                                 ExchangeReport& counted) noexcept {
  counted.ended_contributions += table_.drop_named_if([&](const ContributionId& id) {
    return id.robot == robot && id.epoch < floor && MapSession::is(id.submap);
  });
}

void Ledger::drop_unlisted(std::uint32_t robot, std::uint32_t epoch, Instant now,
                           ExchangeReport& counted) noexcept {
  counted.ended_contributions += table_.drop_unlisted(robot, epoch, now);
}

// --- Chunks --------------------------------------------------------------------------------------

Ledger::Taken Ledger::take_chunk(Contribution& contribution, const ChunkHeader& header,
                                 std::span<const std::byte> body, bool awaited,
                                 ExchangeReport& counted) noexcept {
  return chunks_.take({table_, records_, conflicts_, content_, counted}, contribution,
                      {floors_.of(header.id.robot), floors_.of_sessions(header.id.robot)}, header,
                      body, awaited);
}

/// Its leaf is the last of the tree of the chunk that was taken last.
void Ledger::take_chunk_statement(Contribution& contribution, const Statement& statement,
                                  bool is_last, ExchangeReport& counted) noexcept {
  const std::span<const std::byte> proof = chunks_.statement_proof();
  note_floor(statement.id.robot, statement.floor, false, counted);
  note_session_floor(statement.id.robot, statement.session_floor, false, counted);
  if (!contribution.used) return;
  keep_statement(contribution, statement, !signatures_.on() && is_last, proof, counted);
}

std::optional<std::uint32_t> Ledger::check_own_chunk(const Contribution& own,
                                                     const ChunkHeader& header,
                                                     std::span<const std::byte> body,
                                                     bool awaited) noexcept {
  if (!header.relayed && header.statement.session == session_) return 0;
  const std::optional<std::uint32_t> held = chunks_.check_own(records_, own, header, body, awaited);
  if (!held) floors_.overtake(own.id.epoch);
  return held;
}

// --- Statements and frames -----------------------------------------------------------------------

bool Ledger::take_statement(const Statement& statement, std::span<const std::byte> proof,
                            bool is_last, Instant now, ExchangeReport& counted) noexcept {
  if (FarContribution* const far = table_.far().find(statement.id); far != nullptr)
    return take_far_statement(*far, statement, proof, is_last, counted);
  Contribution* known = find(statement.id);
  // What is held already is not worth the check of a signature.
  const bool replaces = !signatures_.on() && is_last;
  if (known != nullptr && known->stated && !replaces && known->statement.agrees_with(statement) &&
      !statement.is_newer_than(known->statement))
    return true;
  // Nor is what was recorded before its robot ended the epoch.
  if (!replaces && statement.id.robot != robot_ && statement.id.epoch < floors_.of(statement.id)) {
    ++counted.refused_epochs;
    return true;
  }
  if (signatures_.on() && !chunks_.proofs().check(signatures_, configuration_, statement.id,
                                                  leaf_of(signatures_, statement), proof))
    return false;
  if (statement.id.robot == robot_ &&
      floors_.note_statement(statement, session_, known, table_.publishing()))
    ++counted.impostors;
  if (is_of_this_process(statement.id)) return true;
  note_floor(statement.id.robot, statement.floor, replaces, counted);
  note_session_floor(statement.id.robot, statement.session_floor, replaces, counted);
  if (known == nullptr) known = note_name(statement.id, now, counted);
  if (known == nullptr || known->own) return true;
  keep_statement(*known, statement, replaces, proof, counted);
  return true;
}

void Ledger::keep_statement(Contribution& contribution, const Statement& statement, bool replaces,
                            std::span<const std::byte> proof, ExchangeReport& counted) noexcept {
  const bool contradicts = contribution.stated && !contribution.statement.agrees_with(statement);
  if (contradicts)
    note_conflict(contribution.statement, contribution.proof.bytes(), statement, proof, counted);
  if (contribution.stated && !replaces && !statement.is_newer_than(contribution.statement)) return;
  if (contradicts && !signatures_.on()) ++counted.conflicts;
  contribution.stated = true;
  contribution.statement = statement;
  // Nobody signed what ranges of relayed chunks are beyond.
  if (!contribution.own) contribution.coverage.trim(statement.latest);
  contribution.latest =
      replaces ? statement.latest : std::max(contribution.latest, statement.latest);
  contribution.proof.keep(proof);
}

void Ledger::note_conflict(const Statement& before, std::span<const std::byte> proof_before,
                           const Statement& statement, std::span<const std::byte> proof,
                           ExchangeReport& counted) noexcept {
  if (!signatures_.on() || proof_before.empty() || proof.empty()) return;
  ConflictBody conflict{.id = statement.id, .of_statements = true};
  conflict.side[0] = {.record = {}, .statement = before, .proof = proof_before};
  conflict.side[1] = {.record = {}, .statement = statement, .proof = proof};
  conflicts_.note(conflict, Instant::long_ago(), counted);
}

bool Ledger::is_signed(const FrameBody& frame, std::span<const std::byte> proof) noexcept {
  return !signatures_.on() ||
         chunks_.proofs().check(signatures_, configuration_, TreeOf::frames(frame.id.robot),
                                leaf_of(signatures_, frame), proof);
}

namespace {

/// Too soon after the last one. That an extent has grown is said again.
bool is_early(HeldContribution& known, const FrameBody& frame, Instant now, Duration pause,
              ExchangeReport& counted) noexcept {
  if (!known.open || now - known.frame_at >= pause) return false;
  if (known.has_grown(frame)) return true;
  ++counted.frames_early;
  known.announced_frame =
      std::max(known.announced_frame, std::min(frame.revision, known.frame_revision + 1));
  return true;
}

}  // namespace

/// At most one revision a frame_pause_: each moves all of the contribution in the global map.
bool Ledger::take_frame(const FrameBody& frame, std::span<const std::byte> proof, bool is_last,
                        Instant now, ExchangeReport& counted) noexcept {
  if (FarContribution* const far = table_.far().find(frame.id); far != nullptr)
    return take_far_frame(*far, frame, proof, is_last, now, counted);
  Contribution* known = find(frame.id);
  if (frame.id.epoch < floors_.of(frame.id)) {
    ++counted.refused_epochs;
    return true;
  }
  if (known == nullptr && is_ended(frame.id)) {
    ++counted.refused_disputed;
    return true;
  }
  const bool present = !signatures_.on() && is_last;
  const bool replaces = present && known != nullptr && known->open && !known->has(frame);
  const bool gives_way =
      known == nullptr || known->gives_way_to(frame, signatures_.on()) || known->has_grown(frame);
  if ((!gives_way && !replaces) || (known != nullptr && known->own)) return true;
  if (known != nullptr && is_early(*known, frame, now, frame_pause_, counted)) return true;
  // What would find no place is not worth the check of a signature.
  if (signatures_.on() && known == nullptr && !table_.has_place_for_frame(frame.id)) {
    ++counted.refused_contributions;
    return true;
  }
  if (!is_signed(frame, proof)) return false;
  using Claim = ContributionTable::Claim;
  if (known == nullptr)
    known = table_.add(frame.id, present ? Claim::kPresent : Claim::kFrame, now, counted);
  if (known == nullptr) return true;
  known->signed_extent = frame.extent;
  // Without a slot it is asked for as what finds no room is.
  known->full =
      table_.set_frame(*known, frame.T_global_map, frame.revision, frame.session) != Status::kOk;
  if (known->full) {
    ++counted.refused_contributions;
    return true;
  }
  known->frame_at = now;
  if (replaces) known->announced_frame = frame.revision;
  known->frame_proof.keep(proof);
  return true;
}

// --- Conflicts -----------------------------------------------------------------------------------

bool Ledger::take_conflict(const ConflictBody& conflict, ExchangeReport& counted) noexcept {
  if (!Conflicts::is_proof(signatures_, configuration_, conflict, chunks_.proofs())) return false;
  conflicts_.note(conflict, Instant::never(), counted);
  return true;
}

void Ledger::end_disputed(ExchangeReport& counted) noexcept {
  if (policy_ != ConflictPolicy::kExclude) return;
  for (const Conflicts::Known& known : conflicts_.all()) {
    if (floors_.is_of_this_process(known.id)) floors_.overtake(known.id.epoch);
    const Contribution* const publishing = table_.publishing();
    counted.ended_contributions += table_.drop_named_if([&](const ContributionId& id) {
      return id.robot == known.id.robot && id.epoch == known.id.epoch &&
             (publishing == nullptr || publishing->id != id);
    });
  }
}

}  // namespace tessera
