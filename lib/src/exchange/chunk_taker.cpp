// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/chunk_taker.hpp"

#include <algorithm>

#include "tessera/frames/frame_statements.hpp"

namespace tessera {

Result<ChunkTaker> ChunkTaker::make(Arena& arena, const Signatures& signatures,
                                    std::uint32_t configuration, int num_components) noexcept {
  ChunkTaker made;
  made.signatures_ = signatures;
  made.configuration_ = configuration;
  made.num_components_ = num_components;
  made.tree_ = arena.take<HashTree>(1).data();
  if (made.tree_ == nullptr) return Status::kResourceExhausted;
  return made;
}

/// Grows the tree of a chunk's records and its statement, and checks the signature of its root if
/// one of them is news.
ChunkTaker::Taken ChunkTaker::check_signed(const HeldRecords& records,
                                           const HeldContribution& contribution,
                                           const Floors& floors, const ChunkHeader& header,
                                           std::span<const std::byte> bytes,
                                           bool awaited) noexcept {
  ByteReader from(bytes);
  RecordReader reader(from, header.range, false);
  ChunkRecord record;
  bool news =
      awaited || !contribution.stated || header.statement.is_newer_than(contribution.statement) ||
      !header.statement.agrees_with(contribution.statement) ||
      header.statement.floor > floors.all || header.statement.session_floor > floors.sessions ||
      (!header.partial && !contribution.coverage.contains(header.range));
  tree_->clear();
  while (from.remaining() != 0) {
    if (tree_->count() + 1 >= HashTree::kMostLeaves || !reader.read(record))
      return {.well_formed = false};
    const Hash leaf = leaf_of(signatures_, header.id, record);
    record.version.hash = record_hash(leaf);
    const Result<BlockKey> key = pack(record.block);
    news = news || !key.ok() || records.is_news(contribution, *key, record.version) ||
           records.contradicted(contribution, *key, record.version) != nullptr;
    tree_->add(leaf);
  }
  tree_->add(leaf_of(signatures_, header.statement));
  if (!news) return {};
  const auto message =
      root_message(configuration_, header.id, tree_->count(), tree_->root(signatures_));
  return {.forged = !signatures_.check(signatures_.context, header.id.robot, message, signature_)};
}

ChunkTaker::Taken ChunkTaker::take(const Into& into, HeldContribution& contribution,
                                   const Floors& floors, const ChunkHeader& header,
                                   std::span<const std::byte> body, bool awaited) noexcept {
  std::span<const std::byte> bytes = body;
  if (signatures_.on() && !header.relayed) {
    if (body.size() < kSignatureBytes) return {.well_formed = false};
    bytes = body.first(body.size() - kSignatureBytes);
    const auto signature = body.last(kSignatureBytes);
    std::copy(signature.begin(), signature.end(), signature_.begin());
    const Taken checked = check_signed(into.records, contribution, floors, header, bytes, awaited);
    if (checked.forged || !checked.well_formed) return checked;
  }
  Taken taken = take_records(into, contribution, header, bytes);
  if (awaited) taken.held = count_held(into.records, contribution, header, bytes);
  return taken;
}

/// Its leaf is the last of the tree that check_signed() grew.
std::span<const std::byte> ChunkTaker::statement_proof() noexcept {
  if (!signatures_.on()) return {};
  return std::span(proof_).first(write_proof(*tree_, tree_->count() - 1, signature_, proof_));
}

/// Of a contribution without blocks, whose records come as they are, and whole.
bool ChunkTaker::is_statement(const ContributionId& id, BlockKey place,
                              const ChunkRecord& record) noexcept {
  if (record.version.layers != kAllLayers || record.version.first != record.version.number)
    return false;
  if (FrameStatements::is(id.submap)) return is_frame_statement(id, place, record.coded);
  Objection objection;
  return objection.read(record.coded) &&
         Objection::place_of(objection.against, objection.key) == place;
}

ChunkTaker::Fate ChunkTaker::take_record(const Into& into, HeldContribution& contribution,
                                         const ChunkHeader& header, std::uint32_t leaf_number,
                                         ChunkRecord& record) noexcept {
  const Result<BlockKey> key = pack(record.block);
  if (!key.ok()) return Fate::kMalformed;
  const Hash leaf = leaf_of(signatures_, contribution.id, record);
  record.version.hash = record_hash(leaf);
  const Replicas::Replica* other = into.records.contradicted(contribution, *key, record.version);
  const bool news = into.records.is_news(contribution, *key, record.version);
  if (!news && other == nullptr) return Fate::kStale;
  const bool is_block = has_blocks(contribution.id);
  into.scratch.clear();
  const bool is_good = is_block ? decode_block(record.coded, record.version.layers, num_components_,
                                               into.scratch) == Status::kOk
                                : is_statement(contribution.id, *key, record);
  if (!is_good) return Fate::kMalformed;
  if (signatures_.on() && header.relayed &&
      !proof_check_.check(signatures_, configuration_, contribution.id, leaf, record.proof))
    return Fate::kForged;
  std::array<std::byte, kMostProofBytes> made{};
  if (signatures_.on() && !header.relayed)
    record.proof = std::span(made).first(write_proof(*tree_, leaf_number, signature_, made));
  // Once for each proof, or each content that another one replaces: a repeat is none.
  if (other != nullptr && news && !signatures_.on()) ++into.counted.conflicts;
  note_conflict(into, contribution, record, other);
  if (!news) return Fate::kStale;
  const Result<Replicas::Change> put =
      is_block ? into.records.put(into.table, contribution, *key, record.version, into.scratch,
                                  record.coded, record.proof)
               : into.records.put_packed(into.table, contribution, *key, record.version,
                                         record.coded, record.coded, record.proof);
  return put.ok() ? Fate::kTaken : Fate::kNoRoom;
}

/// other: a record that contradicts this one, if it is of the same block: one of another block is
/// looked for only where something comes of it. It was taken before, so its proof was checked then,
/// as that of the record is by now.
void ChunkTaker::note_conflict(const Into& into, const HeldContribution& contribution,
                               const ChunkRecord& record,
                               const Replicas::Replica* other) const noexcept {
  const auto [robot, epoch, submap] = contribution.id;
  if (!signatures_.on() || into.conflicts.find(robot, epoch) != nullptr) return;
  if (other == nullptr && into.conflicts.has_room_for(robot, epoch))
    other = into.records.of_other_block(contribution, record.version);
  if (other == nullptr) return;
  const ChunkRecord before = into.records.read(*other);
  if (before.proof.empty() || record.proof.empty()) return;
  ConflictBody conflict{.id = contribution.id};
  conflict.side[0] = {
      .record = facts_of(signatures_, before), .statement = {}, .proof = before.proof};
  conflict.side[1] = {
      .record = facts_of(signatures_, record), .statement = {}, .proof = record.proof};
  into.conflicts.note(conflict, Instant::long_ago(), into.counted);
}

/// Where a record is none, or not its origin's, what came before it is taken, and nothing is known
/// of the rest. What is refused stays a gap. Nobody signed the range of a relayed chunk: it says
/// nothing of versions beyond the statement.
ChunkTaker::Taken ChunkTaker::take_records(const Into& into, HeldContribution& contribution,
                                           const ChunkHeader& header,
                                           std::span<const std::byte> bytes) noexcept {
  Taken taken;
  ByteReader from(bytes);
  RecordReader reader(from, header.range, header.relayed && signatures_.on());
  ChunkRecord record;
  std::uint32_t first = header.range.first;
  const std::uint32_t most =
      header.relayed && contribution.stated ? contribution.statement.latest : kLastVersion;
  const auto cover = [&](std::uint32_t last) {
    last = std::min(last, most);
    if (header.partial || last < first) return;
    taken.grew = contribution.coverage.add({first, last}) || taken.grew;
  };
  for (std::uint32_t leaf = 0; from.remaining() != 0; ++leaf) {
    const Fate fate = reader.read(record) ? take_record(into, contribution, header, leaf, record)
                                          : Fate::kMalformed;
    into.counted.records_taken += fate == Fate::kTaken ? 1U : 0U;
    into.counted.records_stale += fate == Fate::kStale ? 1U : 0U;
    taken.grew = taken.grew || fate == Fate::kTaken;
    taken.records += fate == Fate::kTaken ? 1U : 0U;
    if (fate == Fate::kMalformed || fate == Fate::kForged) {
      taken.well_formed = fate != Fate::kMalformed;
      taken.forged = fate == Fate::kForged;
      return taken;
    }
    if (fate != Fate::kNoRoom) continue;
    ++into.counted.records_refused;
    taken.refused = true;
    cover(record.version.number - 1);
    first = record.version.number + 1;
  }
  cover(header.range.last);
  return taken;
}

/// Those that are the latest of their blocks, and that their origin signed: none of a chunk with
/// one that it did not.
std::uint32_t ChunkTaker::count_held(const HeldRecords& records,
                                     const HeldContribution& contribution,
                                     const ChunkHeader& header,
                                     std::span<const std::byte> bytes) noexcept {
  const bool proofs = header.relayed && signatures_.on();
  ByteReader from(bytes);
  RecordReader reader(from, header.range, proofs);
  ChunkRecord record;
  std::uint32_t held = 0;
  while (from.remaining() != 0 && reader.read(record)) {
    const Result<BlockKey> key = pack(record.block);
    if (!key.ok()) return 0;
    const Hash leaf = leaf_of(signatures_, contribution.id, record);
    const Replicas::Replica* const part =
        records.find(contribution, *key, record.version.number, record_hash(leaf));
    if (part == nullptr || !part->latest()) continue;
    if (proofs &&
        !proof_check_.check(signatures_, configuration_, contribution.id, leaf, record.proof))
      return 0;
    ++held;
  }
  return held;
}

std::optional<std::uint32_t> ChunkTaker::check_own(const HeldRecords& records,
                                                   const HeldContribution& own,
                                                   const ChunkHeader& header,
                                                   std::span<const std::byte> body,
                                                   bool awaited) noexcept {
  const std::size_t end = signatures_.on() && !header.relayed ? kSignatureBytes : 0;
  if (body.size() < end) return 0;
  ByteReader from(body.first(body.size() - end));
  RecordReader reader(from, header.range, header.relayed && signatures_.on());
  ChunkRecord record;
  while (from.remaining() != 0 && reader.read(record)) {
    const Result<BlockKey> key = pack(record.block);
    if (!key.ok()) return 0;
    const Hash leaf = leaf_of(signatures_, own.id, record);
    record.version.hash = record_hash(leaf);
    if (!records.is_news(own, *key, record.version)) continue;
    // In a fleet that signs it must be proved; a chunk of another process shows in its statement.
    if (signatures_.on() && (!header.relayed || !proof_check_.check(signatures_, configuration_,
                                                                    own.id, leaf, record.proof)))
      return 0;
    return std::nullopt;
  }
  // Of one that is not relayed the signature was not checked.
  return header.relayed && awaited ? count_held(records, own, header, body) : 0;
}

}  // namespace tessera
