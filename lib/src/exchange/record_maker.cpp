// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/record_maker.hpp"

namespace tessera {

namespace {

/// A record that takes more is published in parts, of which any fits.
static_assert(most_coded_bytes(1) <= kMostCodedBytes);

/// The layers of one of so many parts.
constexpr std::uint8_t layers_of(unsigned part, unsigned parts) noexcept {
  const unsigned layers = static_cast<unsigned>(kBlockLayers) / parts;
  return static_cast<std::uint8_t>(((1U << layers) - 1U) << (part * layers));
}

}  // namespace

Result<RecordMaker> RecordMaker::make(Arena& arena, const Signatures& signatures,
                                      int num_components) noexcept {
  RecordMaker made;
  made.signatures_ = signatures;
  made.num_components_ = num_components;
  made.coded_ = arena.take<std::byte>(kMostCoded);
  if (made.coded_.empty()) return Status::kResourceExhausted;
  return made;
}

Status RecordMaker::publish_parts(const Into& into, HeldContribution& own, BlockKey key,
                                  const BlockContent& content, unsigned parts,
                                  std::size_t whole_bytes, std::uint32_t& bytes) noexcept {
  const std::uint32_t first = own.latest + 1;
  if (first > kLastVersion - parts) return Status::kResourceExhausted;
  for (unsigned part = 0; part < parts; ++part) {
    const std::uint8_t layers = layers_of(part, parts);
    // Of a whole block it is there already.
    const std::size_t coded = parts == 1 ? whole_bytes : encode_block(content, layers, coded_);
    into.scratch.clear();
    if (const Status status =
            decode_block(coded_.first(coded), layers, num_components_, into.scratch);
        status != Status::kOk)
      return status;
    ChunkRecord record{.block = unpack(key),
                       .version = {.number = first + part, .first = first, .layers = layers},
                       .coded = coded_.first(coded)};
    record.version.hash = record_hash(leaf_of(signatures_, own.id, record));
    const Result<Replicas::Change> change =
        into.records.put(into.table, own, key, record.version, into.scratch, record.coded, {});
    if (!change.ok()) {
      ++into.counted.refused_parts;
      return change.status();
    }
    own.latest = record.version.number;
    own.coverage.add({1, own.latest});
    bytes += static_cast<std::uint32_t>(coded) + 8;
    ++into.counted.published_parts;
  }
  return Status::kOk;
}

/// As few as fit a datagram each.
unsigned RecordMaker::parts_of(const BlockContent& content, std::size_t whole_bytes) noexcept {
  if (whole_bytes <= kMostCodedBytes) return 1;
  const auto fits = [&](unsigned parts) {
    for (unsigned part = 0; part < parts; ++part) {
      if (encode_block(content, layers_of(part, parts), coded_) > kMostCodedBytes) return false;
    }
    return true;
  };
  unsigned parts = 2;
  while (parts < static_cast<unsigned>(kBlockLayers) && !fits(parts)) parts *= 2;
  return parts;
}

Result<std::uint32_t> RecordMaker::publish_bytes(const Into& into, HeldContribution& own,
                                                 BlockKey place,
                                                 std::span<const std::byte> bytes) noexcept {
  if (own.latest >= kLastVersion) return Status::kResourceExhausted;
  const std::uint32_t number = own.latest + 1;
  ChunkRecord record{
      .block = unpack(place), .version = {.number = number, .first = number}, .coded = bytes};
  record.version.hash = record_hash(leaf_of(signatures_, own.id, record));
  const Result<Replicas::Change> change = into.records.put_packed(
      into.table, own, place, record.version, record.coded, record.coded, {});
  if (!change.ok()) {
    ++into.counted.refused_parts;
    return change.status();
  }
  own.latest = number;
  own.coverage.add({1, own.latest});
  ++into.counted.published_parts;
  return static_cast<std::uint32_t>(bytes.size()) + 8;
}

Result<std::uint32_t> RecordMaker::publish(const Into& into, HeldContribution& own, BlockKey key,
                                           const BlockContent& content,
                                           VersionRange& published) noexcept {
  const std::size_t whole = encode_block(content, kAllLayers, coded_);
  std::uint32_t bytes = 0;
  published.first = own.latest + 1;
  const Status status =
      publish_parts(into, own, key, content, parts_of(content, whole), whole, bytes);
  published.last = own.latest;
  if (status != Status::kOk) return status;
  return bytes;
}

}  // namespace tessera
