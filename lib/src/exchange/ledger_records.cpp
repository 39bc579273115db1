// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Records that arrive, and their places in the store and the index.
#include <algorithm>

#include "tessera/exchange/internal/ledger.hpp"

namespace tessera {

/// Adds the live parts of a block to what the contribution holds, or takes them away.
void Ledger::list_block(Contribution& contribution, BlockKey key, bool add) noexcept {
  const Replicas& replicas = *store_.replicas;
  for (const Replicas::Replica* part = replicas.find(contribution.slot, key); part != nullptr;
       part = replicas.next_part(*part)) {
    if (part->live == 0) continue;
    const Fingerprint fingerprint = fingerprint_of(part->hash, part->live);
    const std::uint32_t number = replicas.number_of(*part);
    if (add) {
      contribution.index.add(links_, number, part->version, fingerprint.low);
      contribution.held += fingerprint;
      ++contribution.records;
      contribution.record_bytes += part->wire_bytes;
      held_bytes_ += part->wire_bytes;
    } else {
      contribution.index.remove(links_, number, part->version, fingerprint.low);
      contribution.held -= fingerprint;
      --contribution.records;
      contribution.record_bytes -= part->wire_bytes;
      held_bytes_ -= part->wire_bytes;
    }
  }
}

Result<Replicas::Change> Ledger::put(Contribution& contribution, BlockKey key,
                                     const PartVersion& version, const BlockContent& content,
                                     std::span<const std::byte> coded) noexcept {
  const std::size_t packed = pack_block(content, packed_);
  list_block(contribution, key, false);
  const Result<Replicas::Change> change =
      store_.put(store_.context, contribution.slot, key, version, packed_.first(packed), coded);
  list_block(contribution, key, true);
  if (change.ok()) taken_bytes_ += coded.size();
  return change;
}

/// Those that are the latest of their blocks, and that their origin signed: none of a chunk with
/// one that it did not.
std::uint32_t Ledger::count_held(const Contribution& contribution, const ChunkHeader& header,
                                 std::span<const std::byte> records) noexcept {
  const bool proofs = header.relayed && signatures_.on();
  const Replicas& replicas = *store_.replicas;
  ByteReader from(records);
  RecordReader reader(from, header.range, proofs);
  ChunkRecord record;
  std::uint32_t held = 0;
  while (from.remaining() != 0 && reader.read(record)) {
    const Result<BlockKey> key = pack(record.block);
    if (!key.ok()) return 0;
    const Hash leaf = leaf_of(signatures_, contribution.id, record);
    const RecordHash hash = record_hash(leaf);
    const Replicas::Replica* part = replicas.find(contribution.slot, *key);
    while (part != nullptr && (part->version != record.version.number || part->hash != hash))
      part = replicas.next_part(*part);
    if (part == nullptr || part->live == 0 || !part->latest()) continue;
    if (proofs &&
        !proof_check_.check(signatures_, configuration_, contribution.id, leaf, record.proof))
      return 0;
    ++held;
  }
  return held;
}

bool Ledger::is_all_of(const Contribution& contribution, const VersionRange& range,
                       std::uint32_t held) const noexcept {
  constexpr std::uint32_t kMostWalk = 1024;
  const std::optional<std::uint32_t> own =
      contribution.index.count(links_, range, kMostWalk, [&](std::uint32_t number) {
        const Replicas::Replica& part = store_.replicas->record(number);
        return part.latest() && range.first <= part.version && part.version <= range.last;
      });
  return own && *own <= held;
}

/// A live part of the block that has the same version and other content: its origin made both.
const Replicas::Replica* Ledger::contradicted(const Contribution& contribution, BlockKey key,
                                              const PartVersion& version) const noexcept {
  const Replicas& replicas = *store_.replicas;
  for (const Replicas::Replica* part = replicas.find(contribution.slot, key); part != nullptr;
       part = replicas.next_part(*part)) {
    if (part->live != 0 && part->version == version.number && part->hash != version.hash)
      return part;
  }
  return nullptr;
}

/// The same in another block, among the records that an even spread of versions has in a bucket.
/// Not searched for where nothing would come of it.
const Replicas::Replica* Ledger::of_other_block(const Contribution& contribution,
                                                const PartVersion& version) const noexcept {
  constexpr std::uint32_t kMostWalk = 256;
  const auto [robot, epoch, submap] = contribution.id;
  if (!signatures_.on() || !conflicts_.has_room_for(robot, epoch)) return nullptr;
  const std::uint32_t number =
      contribution.index.find(links_, version.number, kMostWalk, [&](std::uint32_t record) {
        const Replicas::Replica& part = store_.replicas->record(record);
        return part.version == version.number && part.hash != version.hash;
      });
  return number == 0 ? nullptr : &store_.replicas->record(number);
}

/// What is kept beside a record: its code, and with signatures its proof before it, none for what
/// this robot itself publishes: that is signed when it is sent.
std::span<const std::byte> Ledger::to_keep(std::span<const std::byte> coded,
                                           std::span<const std::byte> proof) const noexcept {
  if (!signatures_.on()) return coded;
  ByteWriter to(kept_);
  to.u8(static_cast<std::uint8_t>(proof.size()));
  to.bytes(proof);
  to.bytes(coded);
  TESSERA_ASSERT(to.ok());
  return to.written();
}

ChunkRecord Ledger::record_of(const Replicas::Replica& part) noexcept {
  ChunkRecord record{.block = unpack(BlockKey{part.key}),
                     .version = {.number = part.version,
                                 .first = part.version - part.part,
                                 .layers = part.layers,
                                 .hash = part.hash},
                     .coded = store_.replicas->read_wire(part, kept_),
                     .proof = {}};
  if (signatures_.on() && !record.coded.empty()) {
    const auto proof_bytes = std::to_integer<std::size_t>(record.coded[0]);
    record.proof = record.coded.subspan(1, proof_bytes);
    record.coded = record.coded.subspan(1 + proof_bytes);
  }
  return record;
}

Ledger::OfVersion Ledger::find_version(const Contribution& contribution, std::uint32_t version,
                                       std::uint32_t place) const noexcept {
  OfVersion found;
  found.visited = contribution.index.visit(
      links_, {version, version},
      [&](std::uint32_t number) {
        const Replicas::Replica& part = store_.replicas->record(number);
        if (part.version != version) return;
        if (found.count == place) found.part = &part;
        ++found.count;
      },
      [](std::uint32_t) { return true; });
  return found;
}

/// Grows the tree of a chunk's records and its statement, and checks the signature of its root if
/// one of them is news.
Ledger::Taken Ledger::check_signed(const Contribution& contribution, const ChunkHeader& header,
                                   std::span<const std::byte> records, bool awaited) noexcept {
  ByteReader from(records);
  RecordReader reader(from, header.range, false);
  ChunkRecord record;
  bool news = awaited || !contribution.stated ||
              header.statement.is_newer_than(contribution.statement) ||
              !header.statement.agrees_with(contribution.statement) ||
              header.statement.floor > floor_of(header.id.robot) ||
              (!header.partial && !contribution.coverage.contains(header.range));
  tree_->clear();
  while (from.remaining() != 0) {
    if (tree_->count() + 1 >= HashTree::kMostLeaves || !reader.read(record))
      return {.well_formed = false};
    const Hash leaf = leaf_of(signatures_, header.id, record);
    record.version.hash = record_hash(leaf);
    const Result<BlockKey> key = pack(record.block);
    news = news || !key.ok() ||
           store_.replicas->news(contribution.slot, *key, record.version) != 0 ||
           contradicted(contribution, *key, record.version) != nullptr;
    tree_->add(leaf);
  }
  tree_->add(leaf_of(signatures_, header.statement));
  if (!news) return {};
  const auto message =
      root_message(configuration_, header.id, tree_->count(), tree_->root(signatures_));
  return {.forged = !signatures_.check(signatures_.context, header.id.robot, message, signature_)};
}

Ledger::Taken Ledger::take_chunk(Contribution& contribution, const ChunkHeader& header,
                                 std::span<const std::byte> body, bool awaited,
                                 ExchangeReport& counted) noexcept {
  std::span<const std::byte> records = body;
  if (signatures_.on() && !header.relayed) {
    if (body.size() < kSignatureBytes) return {.well_formed = false};
    records = body.first(body.size() - kSignatureBytes);
    const auto signature = body.last(kSignatureBytes);
    std::copy(signature.begin(), signature.end(), signature_.begin());
    const Taken checked = check_signed(contribution, header, records, awaited);
    if (checked.forged || !checked.well_formed) return checked;
  }
  Taken taken = take_records(contribution, header, records, counted);
  if (awaited) taken.held = count_held(contribution, header, records);
  return taken;
}

Ledger::Fate Ledger::take_record(Contribution& contribution, const ChunkHeader& header,
                                 std::uint32_t leaf_number, ChunkRecord& record,
                                 ExchangeReport& counted) noexcept {
  const Result<BlockKey> key = pack(record.block);
  if (!key.ok()) return Fate::kMalformed;
  const Hash leaf = leaf_of(signatures_, contribution.id, record);
  record.version.hash = record_hash(leaf);
  const Replicas::Replica* other = contradicted(contribution, *key, record.version);
  const bool news = store_.replicas->news(contribution.slot, *key, record.version) != 0;
  if (!news && other == nullptr) return Fate::kStale;
  content_.clear();
  if (decode_block(record.coded, record.version.layers, num_components_, content_) != Status::kOk)
    return Fate::kMalformed;
  if (signatures_.on() && header.relayed &&
      !proof_check_.check(signatures_, configuration_, contribution.id, leaf, record.proof))
    return Fate::kForged;
  std::array<std::byte, kMostProofBytes> made{};
  if (signatures_.on() && !header.relayed)
    record.proof = std::span(made).first(write_proof(*tree_, leaf_number, signature_, made));
  // Once for each proof, or each content that another one replaces: a repeat is none.
  if (other != nullptr && news && !signatures_.on()) ++counted.conflicts;
  if (other == nullptr) other = of_other_block(contribution, record.version);
  if (other != nullptr) note_conflict(contribution, record, *other, counted);
  if (!news) return Fate::kStale;
  const std::span<const std::byte> kept = to_keep(record.coded, record.proof);
  return put(contribution, *key, record.version, content_, kept).ok() ? Fate::kTaken
                                                                      : Fate::kNoRoom;
}

/// Where a record is none, or not its origin's, what came before it is taken, and nothing is known
/// of the rest. What is refused stays a gap. Nobody signed the range of a relayed chunk: it says
/// nothing of versions beyond the statement.
Ledger::Taken Ledger::take_records(Contribution& contribution, const ChunkHeader& header,
                                   std::span<const std::byte> records,
                                   ExchangeReport& counted) noexcept {
  Taken taken;
  ByteReader from(records);
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
    const Fate fate = reader.read(record) ? take_record(contribution, header, leaf, record, counted)
                                          : Fate::kMalformed;
    counted.records_taken += fate == Fate::kTaken ? 1U : 0U;
    counted.records_stale += fate == Fate::kStale ? 1U : 0U;
    taken.grew = taken.grew || fate == Fate::kTaken;
    taken.records += fate == Fate::kTaken ? 1U : 0U;
    if (fate == Fate::kMalformed || fate == Fate::kForged) {
      taken.well_formed = fate != Fate::kMalformed;
      taken.forged = fate == Fate::kForged;
      return taken;
    }
    if (fate != Fate::kNoRoom) continue;
    ++counted.records_refused;
    taken.refused = true;
    cover(record.version.number - 1);
    first = record.version.number + 1;
  }
  cover(header.range.last);
  return taken;
}

std::optional<std::uint32_t> Ledger::check_own_chunk(const Contribution& own,
                                                     const ChunkHeader& header,
                                                     std::span<const std::byte> body,
                                                     bool awaited) noexcept {
  if (!header.relayed && header.statement.session == session_) return 0;
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
    if (store_.replicas->news(own.slot, *key, record.version) == 0) continue;
    // In a fleet that signs it must be proved; a chunk of another process shows in its statement.
    if (signatures_.on() && (!header.relayed || !proof_check_.check(signatures_, configuration_,
                                                                    own.id, leaf, record.proof)))
      return 0;
    overtaken_ = std::max(overtaken_.value_or(0), own.id.epoch);
    return std::nullopt;
  }
  // Of one that is not relayed the signature was not checked.
  return header.relayed && awaited ? count_held(own, header, body) : 0;
}

}  // namespace tessera
