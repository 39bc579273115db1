// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/wire.hpp"

#include "tessera/base/crc32.hpp"
#include "tessera/exchange/record_proof.hpp"

namespace tessera {

namespace {

constexpr std::uint8_t kFormat = 1;
constexpr std::size_t kIdBytes = 12;
constexpr std::size_t kAnnouncedBytes = kIdBytes + 4 + 4 + 1 + 8;
/// In place of a number of gaps.
constexpr std::uint8_t kAll = 0xff;
/// Flags of a contribution that is announced.
constexpr std::uint8_t kIsComplete = 1;
constexpr std::uint8_t kIsOrigin = 2;
/// Flags of a chunk.
constexpr std::uint8_t kIsAll = 1;
constexpr std::uint8_t kHasProofs = 2;
/// Flag beside the kind.
constexpr std::uint8_t kIsSigned = 0x80;
constexpr std::size_t kFrameBytes = kIdBytes + 4 + 12 * sizeof(double);

void write_id(ByteWriter& to, const ContributionId& id) noexcept {
  to.u32(id.robot);
  to.u32(id.epoch);
  to.u32(id.submap);
}
void read_id(ByteReader& from, ContributionId& id) noexcept {
  id.robot = from.u32();
  id.epoch = from.u32();
  id.submap = from.u32();
}

/// Seven bits a byte, the lowest first; the eighth says that more follow.
void write_varint(ByteWriter& to, std::uint32_t value) noexcept {
  for (; value >= 0x80U; value >>= 7U) to.u8(static_cast<std::uint8_t>(value | 0x80U));
  to.u8(static_cast<std::uint8_t>(value));
}
/// False iff it is over 32 bits, or longer than it needs to be.
bool read_varint(ByteReader& from, std::uint32_t& value) noexcept {
  value = 0;
  for (unsigned shift = 0; shift < 35; shift += 7) {
    const std::uint32_t byte = from.u8();
    if (shift == 28 && byte > 0xfU) return false;
    value |= (byte & 0x7fU) << shift;
    if (byte < 0x80U) return from.ok() && (byte != 0 || shift == 0);
  }
  return false;
}
std::size_t varint_bytes(std::uint32_t value) noexcept {
  std::size_t bytes = 1;
  for (; value >= 0x80U; value >>= 7U) ++bytes;
  return bytes;
}
/// Small numbers of either sign to small ones.
std::uint32_t zigzag(std::int32_t value) noexcept {
  return (static_cast<std::uint32_t>(value) << 1U) ^ (value < 0 ? ~0U : 0U);
}
std::int32_t unzigzag(std::uint32_t value) noexcept {
  return static_cast<std::int32_t>((value >> 1U) ^ (0U - (value & 1U)));
}
/// Differences of block coordinates stay far from the limits of 32 bits.
constexpr bool in_grid(std::int64_t coordinate) noexcept {
  return coordinate >= -kBlockLimit && coordinate < kBlockLimit;
}

}  // namespace

std::uint32_t ConfigurationDetails::checksum() const noexcept {
  std::array<std::byte, 26> bytes{};
  ByteWriter to(bytes);
  write_details(to, *this);
  return crc32c(to.written());
}

std::uint32_t class_table_checksum(const ClassTable& classes) noexcept {
  std::uint32_t crc = 0;
  for (int c = 1; c <= classes.num_classes(); ++c) {
    const std::string_view name = classes[c].name_view();
    crc = crc32c(std::as_bytes(std::span(name)), crc);
    const std::byte end{0};
    crc = crc32c({&end, 1}, crc);
  }
  return crc;
}

void write_header(ByteWriter& to, const DatagramHeader& header) noexcept {
  to.u8('T');
  to.u8('S');
  to.u8(kFormat);
  to.u8(static_cast<std::uint8_t>(static_cast<std::uint8_t>(header.kind) |
                                  (header.is_signed ? kIsSigned : 0)));
  to.u32(header.configuration);
  to.u32(header.sender);
  to.u32(header.session);
  to.u32(header.sequence);
}

bool read_header(ByteReader& from, DatagramHeader& header) noexcept {
  const bool known = from.u8() == 'T' && from.u8() == 'S' && from.u8() == kFormat;
  const std::uint8_t flags = from.u8();
  const auto kind = static_cast<std::uint8_t>(flags & ~kIsSigned);
  header.is_signed = (flags & kIsSigned) != 0;
  header.kind = static_cast<DatagramKind>(kind);
  header.configuration = from.u32();
  header.sender = from.u32();
  header.session = from.u32();
  header.sequence = from.u32();
  return known && from.ok() && kind >= 1 && kind <= 5;
}

void write_details(ByteWriter& to, const ConfigurationDetails& details) noexcept {
  to.f64(details.resolution_m);
  to.f64(details.prior);
  to.f32(details.free_weight);
  to.u16(details.classes);
  to.u32(details.class_table);
}

bool read_details(ByteReader& from, ConfigurationDetails& details) noexcept {
  details.resolution_m = from.f64();
  details.prior = from.f64();
  details.free_weight = from.f32();
  details.classes = from.u16();
  details.class_table = from.u32();
  return from.ok();
}

bool write_announced(ByteWriter& to, const AnnouncedContribution& announced) noexcept {
  if (to.room() < kAnnouncedBytes) return false;
  write_id(to, announced.id);
  to.u32(announced.latest);
  to.u32(announced.frame_revision);
  to.u8(static_cast<std::uint8_t>((announced.complete ? kIsComplete : 0) |
                                  (announced.origin ? kIsOrigin : 0)));
  to.u64(announced.digest);
  return true;
}

bool read_announced(ByteReader& from, AnnouncedContribution& announced) noexcept {
  read_id(from, announced.id);
  announced.latest = from.u32();
  announced.frame_revision = from.u32();
  const std::uint8_t flags = from.u8();
  announced.complete = (flags & kIsComplete) != 0;
  announced.origin = (flags & kIsOrigin) != 0;
  announced.digest = from.u64();
  return from.ok() && flags <= (kIsComplete | kIsOrigin) && announced.latest <= kLastVersion;
}

bool write_requested(ByteWriter& to, const RequestedContribution& requested) noexcept {
  if (to.room() < kIdBytes + 5 + std::size_t{8} * (requested.all ? 1U : requested.gaps))
    return false;
  write_id(to, requested.id);
  to.u32(requested.frame_revision);
  to.u8(requested.all ? kAll : requested.gaps);
  if (requested.all) {
    to.u64(requested.digest);
    return true;
  }
  for (const VersionRange& gap : std::span(requested.gap).first(requested.gaps)) {
    to.u32(gap.first);
    to.u32(gap.last);
  }
  return true;
}

bool read_requested(ByteReader& from, RequestedContribution& requested) noexcept {
  read_id(from, requested.id);
  requested.frame_revision = from.u32();
  requested.gaps = from.u8();
  requested.all = requested.gaps == kAll;
  if (requested.all) {
    requested.gaps = 0;
    requested.digest = from.u64();
    return from.ok();
  }
  if (requested.gaps > RequestedContribution::kMostGaps) return false;
  std::uint32_t before = 0;
  for (VersionRange& gap : std::span(requested.gap).first(requested.gaps)) {
    gap.first = from.u32();
    gap.last = from.u32();
    if (gap.first <= before || gap.last < gap.first || gap.last > kLastVersion) return false;
    before = gap.last;
  }
  return from.ok();
}

void write_chunk_header(ByteWriter& to, const ChunkHeader& header) noexcept {
  write_id(to, header.id);
  to.u32(header.range.first);
  to.u32(header.range.last);
  to.u8(static_cast<std::uint8_t>((header.all ? kIsAll : 0) | (header.proofs ? kHasProofs : 0)));
  if (header.all) to.u64(header.digest);
}

bool read_chunk_header(ByteReader& from, ChunkHeader& header) noexcept {
  read_id(from, header.id);
  header.range.first = from.u32();
  header.range.last = from.u32();
  const std::uint8_t flags = from.u8();
  header.all = (flags & kIsAll) != 0;
  header.proofs = (flags & kHasProofs) != 0;
  header.digest = header.all ? from.u64() : 0;
  return from.ok() && flags <= (kIsAll | kHasProofs) && header.range.first >= 1 &&
         header.range.first <= header.range.last && header.range.last <= kLastVersion;
}

bool write_frame(ByteWriter& to, const FrameBody& frame) noexcept {
  if (to.room() < kFrameBytes) return false;
  write_id(to, frame.id);
  to.u32(frame.revision);
  for (Eigen::Index row = 0; row < 3; ++row) {
    for (Eigen::Index column = 0; column < 4; ++column) to.f64(frame.T_global_map(row, column));
  }
  return true;
}

bool read_frame(ByteReader& from, FrameBody& frame) noexcept {
  read_id(from, frame.id);
  frame.revision = from.u32();
  for (Eigen::Index row = 0; row < 3; ++row) {
    for (Eigen::Index column = 0; column < 4; ++column)
      frame.T_global_map(row, column) = from.f64();
  }
  return from.ok() && frame.revision >= 1;
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
