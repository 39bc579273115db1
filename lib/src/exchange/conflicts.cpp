// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/conflicts.hpp"

#include <algorithm>

#include "wire_numbers.hpp"

namespace tessera {

bool write_conflict(ByteWriter& to, const ConflictBody& conflict) noexcept {
  write_id(to, conflict.id);
  to.u8(conflict.of_statements ? 1 : 0);
  bool written = true;
  for (const ConflictBody::Side& side : conflict.side) {
    if (conflict.of_statements) {
      written = written && write_statement(to, side.statement);
    } else {
      write_facts(to, side.record);
    }
    to.bytes(side.proof);
  }
  return written && to.ok();
}

bool read_conflict(ByteReader& from, ConflictBody& conflict) noexcept {
  wire::read_id(from, conflict.id);
  const std::uint8_t type = from.u8();
  conflict.of_statements = type == 1;
  for (ConflictBody::Side& side : conflict.side) {
    const bool read = conflict.of_statements
                          ? read_statement(from, side.statement) && side.statement.id == conflict.id
                          : read_facts(from, side.record);
    if (!read) return false;
    side.proof = read_proof(from);
  }
  return type <= 1 && from.ok();
}

Result<Conflicts> Conflicts::make(Arena& arena) noexcept {
  Conflicts conflicts;
  conflicts.known_ = arena.take<Known>(kMost);
  if (conflicts.known_.empty()) return Status::kResourceExhausted;
  return conflicts;
}

Conflicts::Known* Conflicts::find(std::uint32_t robot, std::uint32_t epoch) noexcept {
  for (Known& known : known_.first(count_)) {
    if (known.id.robot == robot && known.id.epoch == epoch) return &known;
  }
  return nullptr;
}

std::uint32_t Conflicts::count_of(std::uint32_t robot) const noexcept {
  const auto is_of_robot = [robot](const Known& known) { return known.id.robot == robot; };
  return static_cast<std::uint32_t>(std::count_if(all().begin(), all().end(), is_of_robot));
}

bool Conflicts::has_room_for(std::uint32_t robot, std::uint32_t epoch) const noexcept {
  const auto is_of_epoch = [&](const Known& known) {
    return known.id.robot == robot && known.id.epoch == epoch;
  };
  return count_ < known_.size() && count_of(robot) < kMostOfRobot &&
         std::none_of(all().begin(), all().end(), is_of_epoch);
}

bool Conflicts::is_proof(const Signatures& signatures, std::uint32_t configuration,
                         const ConflictBody& conflict, ProofCheck& check) noexcept {
  const auto& [a, b] = conflict.side;
  const bool contradicts = conflict.of_statements
                               ? !a.statement.agrees_with(b.statement)
                               : a.record.version == b.record.version && !(a.record == b.record);
  return contradicts &&
         std::all_of(conflict.side.begin(), conflict.side.end(),
                     [&](const ConflictBody::Side& side) {
                       const Hash leaf = conflict.of_statements
                                             ? leaf_of(signatures, side.statement)
                                             : leaf_of(signatures, conflict.id, side.record);
                       return check.check(signatures, configuration, conflict.id, leaf, side.proof);
                     });
}

bool Conflicts::add(const ConflictBody& conflict, Instant due) noexcept {
  if (!has_room_for(conflict.id.robot, conflict.id.epoch)) return false;
  Known& known = known_[count_];
  ByteWriter to(known.body);
  if (!write_conflict(to, conflict)) return false;
  known.id = conflict.id;
  known.bytes = static_cast<std::uint16_t>(to.size());
  known.due = due;
  known.sent = Instant::long_ago();
  ++count_;
  return true;
}

void Conflicts::note(const ConflictBody& conflict, Instant due, ExchangeReport& counted) noexcept {
  if (!add(conflict, due)) return;
  ++counted.conflict_proofs;
  ++counted.conflicts;
}

void Conflicts::owe(Known& known, Instant at, Duration pause) noexcept {
  known.due = std::min(known.due, std::max(at, known.sent + pause));
}

bool Conflicts::write_due(ByteWriter& to, Instant now) noexcept {
  for (Known& known : known_.first(count_)) {
    if (now < known.due || to.room() < known.bytes) continue;
    to.bytes(std::span(known.body).first(known.bytes));
    known.due = Instant::never();
    known.sent = now;
    return true;
  }
  return false;
}

}  // namespace tessera
