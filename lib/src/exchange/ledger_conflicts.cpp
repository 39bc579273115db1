// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Contents that contradict each other: proofs of them, and what follows.
#include <algorithm>

#include "tessera/exchange/internal/ledger.hpp"

namespace tessera {

/// By the policy alarm nothing ends.
bool Ledger::is_ended(const ContributionId& id) noexcept {
  return policy_ == ConflictPolicy::kExclude && conflicts_.find(id.robot, id.epoch) != nullptr;
}

bool Ledger::add_conflict(const ConflictBody& conflict, Instant due,
                          ExchangeReport& counted) noexcept {
  const bool added = conflicts_.add(conflict, due);
  counted.conflict_proofs += added ? 1U : 0U;
  counted.conflicts += added ? 1U : 0U;
  return added;
}

/// other: taken before, so its proof was checked then, as that of the record is by now.
void Ledger::note_conflict(const Contribution& contribution, const ChunkRecord& record,
                           const Replicas::Replica& other, ExchangeReport& counted) noexcept {
  if (!signatures_.on() || conflicts_.find(contribution.id.robot, contribution.id.epoch) != nullptr)
    return;
  const ChunkRecord before = record_of(other);
  if (before.proof.empty() || record.proof.empty()) return;
  ConflictBody conflict{.id = contribution.id};
  conflict.side[0] = {
      .record = facts_of(signatures_, before), .statement = {}, .proof = before.proof};
  conflict.side[1] = {
      .record = facts_of(signatures_, record), .statement = {}, .proof = record.proof};
  add_conflict(conflict, Instant::long_ago(), counted);
}

void Ledger::note_conflict(const Contribution& contribution, const Statement& statement,
                           std::span<const std::byte> proof, ExchangeReport& counted) noexcept {
  if (!signatures_.on() || contribution.proof_bytes == 0 || proof.empty()) return;
  ConflictBody conflict{.id = contribution.id, .of_statements = true};
  conflict.side[0] = {.record = {},
                      .statement = contribution.statement,
                      .proof = std::span(contribution.proof).first(contribution.proof_bytes)};
  conflict.side[1] = {.record = {}, .statement = statement, .proof = proof};
  add_conflict(conflict, Instant::long_ago(), counted);
}

bool Ledger::take_conflict(const ConflictBody& conflict, ExchangeReport& counted) noexcept {
  if (!Conflicts::is_proof(signatures_, configuration_, conflict, proof_check_)) return false;
  add_conflict(conflict, Instant::never(), counted);
  return true;
}

void Ledger::end_disputed(ExchangeReport& counted) noexcept {
  if (policy_ != ConflictPolicy::kExclude) return;
  for (const Conflicts::Known& known : conflicts_.all()) {
    const auto [robot, epoch, submap] = known.id;
    if (robot == robot_ && epoch >= first_epoch_)
      overtaken_ = std::max(overtaken_.value_or(0), epoch);
    for (Contribution& contribution : contributions_) {
      const bool is_published = contribution.own && number_of(contribution) == publishing_;
      if (!contribution.used || is_published || contribution.id.robot != robot ||
          contribution.id.epoch != epoch)
        continue;
      drop(contribution);
      ++counted.ended_contributions;
    }
  }
}

}  // namespace tessera
