// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/held_records.hpp"

namespace tessera {

Result<HeldRecords> HeldRecords::make(Arena& arena, const ExchangeConfig& config,
                                      const ReplicaStore& store, bool signs,
                                      int num_components) noexcept {
  HeldRecords made;
  made.store_ = store;
  made.signs_ = signs;
  made.links_ = arena.take<RecordLink>(config.records);
  made.packed_ = arena.take<std::byte>(most_packed_bytes(num_components));
  made.kept_ = arena.take<std::byte>(kMostKept);
  if (made.links_.empty() || made.packed_.empty() || made.kept_.empty())
    return Status::kResourceExhausted;
  return made;
}

/// Adds the live parts of a block to what the contribution holds, or takes them away.
void HeldRecords::list_block(ContributionTable& table, HeldContribution& contribution, BlockKey key,
                             bool add) noexcept {
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
      table.add_bytes(contribution, part->wire_bytes);
    } else {
      contribution.index.remove(links_, number, part->version, fingerprint.low);
      contribution.held -= fingerprint;
      --contribution.records;
      table.take_bytes(contribution, part->wire_bytes);
    }
  }
}

Result<Replicas::Change> HeldRecords::put(ContributionTable& table, HeldContribution& contribution,
                                          BlockKey key, const PartVersion& version,
                                          const BlockContent& content,
                                          std::span<const std::byte> coded,
                                          std::span<const std::byte> proof) noexcept {
  const std::size_t packed = pack_block(content, packed_);
  return put_packed(table, contribution, key, version, packed_.first(packed), coded, proof);
}

Result<Replicas::Change> HeldRecords::put_packed(ContributionTable& table,
                                                 HeldContribution& contribution, BlockKey key,
                                                 const PartVersion& version,
                                                 std::span<const std::byte> packed,
                                                 std::span<const std::byte> coded,
                                                 std::span<const std::byte> proof) noexcept {
  const std::span<const std::byte> kept = to_keep(coded, proof);
  list_block(table, contribution, key, false);
  const Result<Replicas::Change> change =
      store_.put(store_.context, contribution.slot, key, version, packed, kept);
  list_block(table, contribution, key, true);
  if (change.ok()) taken_bytes_ += kept.size();
  return change;
}

/// What is kept beside a record: its code, and with signatures its proof before it, none for what
/// this robot itself publishes: that is signed when it is sent.
std::span<const std::byte> HeldRecords::to_keep(std::span<const std::byte> coded,
                                                std::span<const std::byte> proof) const noexcept {
  if (!signs_) return coded;
  ByteWriter to(kept_);
  to.u8(static_cast<std::uint8_t>(proof.size()));
  to.bytes(proof);
  to.bytes(coded);
  TESSERA_ASSERT(to.ok());
  return to.written();
}

ChunkRecord HeldRecords::read(const Replicas::Replica& part) noexcept {
  ChunkRecord record{.block = unpack(BlockKey{part.key}),
                     .version = {.number = part.version,
                                 .first = part.version - part.part,
                                 .layers = part.layers,
                                 .hash = part.hash},
                     .coded = store_.replicas->read_wire(part, kept_),
                     .proof = {}};
  if (signs_ && !record.coded.empty()) {
    const auto proof_bytes = std::to_integer<std::size_t>(record.coded[0]);
    record.proof = record.coded.subspan(1, proof_bytes);
    record.coded = record.coded.subspan(1 + proof_bytes);
  }
  return record;
}

bool HeldRecords::read_block(const HeldContribution& contribution, BlockKey key,
                             BlockContent& content) const noexcept {
  const Replicas& replicas = *store_.replicas;
  return replicas.read_block(replicas.find(contribution.slot, key), packed_, content);
}

const Replicas::Replica* HeldRecords::find(const HeldContribution& contribution, BlockKey key,
                                           std::uint32_t version,
                                           const RecordHash& hash) const noexcept {
  const Replicas& replicas = *store_.replicas;
  const Replicas::Replica* part = replicas.find(contribution.slot, key);
  while (part != nullptr && (part->version != version || part->hash != hash))
    part = replicas.next_part(*part);
  return part == nullptr || part->live == 0 ? nullptr : part;
}

const Replicas::Replica* HeldRecords::contradicted(const HeldContribution& contribution,
                                                   BlockKey key,
                                                   const PartVersion& version) const noexcept {
  const Replicas& replicas = *store_.replicas;
  for (const Replicas::Replica* part = replicas.find(contribution.slot, key); part != nullptr;
       part = replicas.next_part(*part)) {
    if (part->live != 0 && part->version == version.number && part->hash != version.hash)
      return part;
  }
  return nullptr;
}

const Replicas::Replica* HeldRecords::of_other_block(const HeldContribution& contribution,
                                                     const PartVersion& version) const noexcept {
  constexpr std::uint32_t kMostWalk = 256;
  const std::uint32_t number =
      contribution.index.find(links_, version.number, kMostWalk, [&](std::uint32_t record) {
        const Replicas::Replica& part = store_.replicas->record(record);
        return part.version == version.number && part.hash != version.hash;
      });
  return number == 0 ? nullptr : &store_.replicas->record(number);
}

HeldRecords::OfVersion HeldRecords::find_version(const HeldContribution& contribution,
                                                 std::uint32_t version,
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

bool HeldRecords::is_all_of(const HeldContribution& contribution, const VersionRange& range,
                            std::uint32_t held) const noexcept {
  constexpr std::uint32_t kMostWalk = 1024;
  const std::optional<std::uint32_t> own =
      contribution.index.count(links_, range, kMostWalk, [&](std::uint32_t number) {
        const Replicas::Replica& part = store_.replicas->record(number);
        return part.latest() && range.first <= part.version && part.version <= range.last;
      });
  return own && *own <= held;
}

}  // namespace tessera
