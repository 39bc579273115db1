// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Chunks, their records, and statements.
#include "tessera/exchange/internal/record_proof.hpp"
#include "tessera/exchange/wire.hpp"
#include "wire_numbers.hpp"

namespace tessera {

using namespace wire;

namespace {

/// Flags of a chunk.
constexpr std::uint8_t kIsRelayed = 1;
constexpr std::uint8_t kIsPartial = 2;
constexpr std::size_t kStatementBytes = 12 + 8 + 36 + 8;

/// Differences of block coordinates stay far from the limits of 32 bits.
constexpr bool in_grid(std::int64_t coordinate) noexcept {
  return coordinate >= -kBlockLimit && coordinate < kBlockLimit;
}
/// What is stated, but for the contribution, the range and the session.
void write_stated(ByteWriter& to, const Statement& statement) noexcept {
  to.u32(statement.latest);
  to.u32(statement.records);
  to.u64(statement.fingerprint.low);
  to.u64(statement.fingerprint.high);
  to.u32(statement.frame_revision);
  to.u32(statement.floor);
  to.u32(statement.session_floor);
}
bool read_stated(ByteReader& from, Statement& statement) noexcept {
  statement.latest = from.u32();
  statement.records = from.u32();
  statement.fingerprint.low = from.u64();
  statement.fingerprint.high = from.u64();
  statement.frame_revision = from.u32();
  statement.floor = from.u32();
  statement.session_floor = from.u32();
  return from.ok() && statement.latest <= kLastVersion && statement.frame_revision >= 1 &&
         statement.floor <= statement.id.epoch && statement.session_floor <= statement.id.epoch;
}

}  // namespace

void write_chunk_header(ByteWriter& to, const ChunkHeader& header) noexcept {
  write_id(to, header.id);
  to.u32(header.range.first);
  to.u32(header.range.last);
  to.u8(static_cast<std::uint8_t>((header.relayed ? kIsRelayed : 0) |
                                  (header.partial ? kIsPartial : 0)));
  if (!header.relayed) write_stated(to, header.statement);
}

bool read_chunk_header(ByteReader& from, std::uint64_t session, ChunkHeader& header) noexcept {
  read_id(from, header.id);
  header.range.first = from.u32();
  header.range.last = from.u32();
  const std::uint8_t flags = from.u8();
  header.relayed = (flags & kIsRelayed) != 0;
  header.partial = (flags & kIsPartial) != 0;
  header.statement = {.id = header.id, .range = header.range, .session = session};
  if (!from.ok() || flags > (kIsRelayed | kIsPartial) || !is_range(header.range)) return false;
  return header.relayed ||
         (read_stated(from, header.statement) && header.range.last <= header.statement.latest);
}

bool write_statement(ByteWriter& to, const Statement& statement) noexcept {
  if (to.room() < kStatementBytes) return false;
  write_id(to, statement.id);
  to.u32(statement.range.first);
  to.u32(statement.range.last);
  write_stated(to, statement);
  to.u64(statement.session);
  return true;
}

bool read_statement(ByteReader& from, Statement& statement) noexcept {
  read_id(from, statement.id);
  statement.range.first = from.u32();
  statement.range.last = from.u32();
  if (!read_stated(from, statement) || !is_range(statement.range)) return false;
  statement.session = from.u64();
  return from.ok();
}

bool RecordWriter::write(const ChunkRecord& record) noexcept {
  TESSERA_ASSERT(record.version.number > version_);
  const std::uint32_t step = record.version.number - version_ - 1;
  const std::array<std::uint32_t, 3> moved{zigzag(record.block.x - block_.x),
                                           zigzag(record.block.y - block_.y),
                                           zigzag(record.block.z - block_.z)};
  const auto length = static_cast<std::uint32_t>(record.coded.size());
  const std::size_t bytes = 1 + varint_bytes(step) + varint_bytes(moved[0]) +
                            varint_bytes(moved[1]) + varint_bytes(moved[2]) + varint_bytes(length) +
                            length + record.proof.size();
  if (to_.room() < bytes) return false;
  const std::uint32_t part = record.version.number - record.version.first;
  to_.u8(static_cast<std::uint8_t>(record.version.layers | part << 4U));
  write_varint(to_, step);
  for (const std::uint32_t coordinate : moved) write_varint(to_, coordinate);
  write_varint(to_, length);
  to_.bytes(record.coded);
  to_.bytes(record.proof);
  version_ = record.version.number;
  block_ = record.block;
  return true;
}

bool RecordReader::read(ChunkRecord& record) noexcept {
  const std::uint8_t flags = from_.u8();
  const std::uint32_t part = (flags >> 4U) & 3U;
  std::uint32_t step = 0;
  std::uint32_t length = 0;
  std::array<std::uint32_t, 3> moved{};
  bool read = read_varint(from_, step);
  for (std::uint32_t& coordinate : moved) read = read && read_varint(from_, coordinate);
  read = read && read_varint(from_, length);
  record.version.layers = flags & kAllLayers;
  if (!read || flags >> 6U != 0 || record.version.layers == 0 || version_ >= range_.last ||
      step > range_.last - version_ - 1)
    return false;
  version_ += step + 1;
  if (version_ <= part) return false;
  record.version.number = version_;
  record.version.first = version_ - part;
  const std::array<std::int64_t, 3> place{std::int64_t{block_.x} + unzigzag(moved[0]),
                                          std::int64_t{block_.y} + unzigzag(moved[1]),
                                          std::int64_t{block_.z} + unzigzag(moved[2])};
  if (!in_grid(place[0]) || !in_grid(place[1]) || !in_grid(place[2])) return false;
  block_ = {static_cast<std::int32_t>(place[0]), static_cast<std::int32_t>(place[1]),
            static_cast<std::int32_t>(place[2])};
  record.block = block_;
  // A longer one could not be passed on.
  if (length > kMostCodedBytes) return false;
  record.coded = from_.bytes(length);
  record.proof = proofs_ ? read_proof(from_) : std::span<const std::byte>{};
  return from_.ok();
}

}  // namespace tessera
