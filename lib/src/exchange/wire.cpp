// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Headers and announcements.
#include "tessera/exchange/wire.hpp"

#include "tessera/base/internal/crc32.hpp"
#include "tessera/exchange/internal/record_proof.hpp"
#include "wire_numbers.hpp"

namespace tessera {

using namespace wire;

namespace {

constexpr std::uint8_t kFormat = 2;
/// Flags of a contribution that is announced.
constexpr std::uint8_t kIsComplete = 1;
constexpr std::uint8_t kIsOrigin = 2;
constexpr std::uint8_t kIsStated = 4;
constexpr std::uint8_t kIsDisputed = 8;
/// Flag beside the kind.
constexpr std::uint8_t kIsSigned = 0x80;

}  // namespace

void write_id(ByteWriter& to, const ContributionId& id) noexcept {
  to.u32(id.robot);
  to.u32(id.epoch);
  to.u32(id.submap);
}

Hash plain_hash(std::span<const std::byte> message) noexcept {
  Digest low;
  Digest high;
  high.add(1);
  const auto add = [&](std::uint64_t word) {
    low.add(word);
    high.add(word);
  };
  add(message.size());
  ByteReader words(message);
  while (words.remaining() >= 8) add(words.u64());
  std::uint64_t rest = 0;
  while (words.remaining() != 0) rest = rest << 8U | words.u8();
  add(rest);
  Hash hash{};
  ByteWriter to(hash);
  to.u64(low.value());
  to.u64(high.value());
  return hash;
}

std::uint32_t ConfigurationDetails::checksum() const noexcept {
  std::array<std::byte, kBytes> bytes{};
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
  to.u32(header.mission);
  to.u32(header.configuration);
  to.u32(header.sender);
  to.u64(header.session);
  to.u64(header.sequence);
}

bool read_header(ByteReader& from, DatagramHeader& header) noexcept {
  const bool known = from.u8() == 'T' && from.u8() == 'S' && from.u8() == kFormat;
  const std::uint8_t flags = from.u8();
  const auto kind = static_cast<std::uint8_t>(flags & ~kIsSigned);
  header.is_signed = (flags & kIsSigned) != 0;
  header.kind = static_cast<DatagramKind>(kind);
  header.mission = from.u32();
  header.configuration = from.u32();
  header.sender = from.u32();
  header.session = from.u64();
  header.sequence = from.u64();
  return known && from.ok() && kind >= 1 && kind <= 9;
}

void write_details(ByteWriter& to, const ConfigurationDetails& details) noexcept {
  to.f64(details.resolution_m);
  to.f64(details.prior);
  to.f32(details.free_weight);
  to.u16(details.classes);
  to.u32(details.class_table);
  to.f32(details.max_evidence);
  to.u8(static_cast<std::uint8_t>(details.conflicts));
}

bool read_details(ByteReader& from, ConfigurationDetails& details) noexcept {
  details.resolution_m = from.f64();
  details.prior = from.f64();
  details.free_weight = from.f32();
  details.classes = from.u16();
  details.class_table = from.u32();
  details.max_evidence = from.f32();
  const std::uint8_t conflicts = from.u8();
  details.conflicts = static_cast<ConflictPolicy>(conflicts);
  return from.ok() && conflicts <= static_cast<std::uint8_t>(ConflictPolicy::kExclude);
}

void write_announcement_header(ByteWriter& to, const AnnouncementHeader& header) noexcept {
  write_details(to, header.details);
  to.u32(header.floor);
  to.u64(header.data_sequence);
  to.u8(header.challenges);
  for (const Challenge& challenge : std::span(header.challenge).first(header.challenges)) {
    to.u8(challenge.is_answer ? 1 : 0);
    to.u32(challenge.robot);
    to.u64(challenge.nonce);
  }
}

bool read_announcement_header(ByteReader& from, AnnouncementHeader& header) noexcept {
  if (!read_details(from, header.details)) return false;
  header.floor = from.u32();
  header.data_sequence = from.u64();
  header.challenges = from.u8();
  if (header.challenges > AnnouncementHeader::kMostChallenges) return false;
  for (Challenge& challenge : std::span(header.challenge).first(header.challenges)) {
    const std::uint8_t is_answer = from.u8();
    if (is_answer > 1) return false;
    challenge.is_answer = is_answer == 1;
    challenge.robot = from.u32();
    challenge.nonce = from.u64();
  }
  return from.ok();
}

bool write_announced(ByteWriter& to, const AnnouncedContribution& announced) noexcept {
  if (to.room() < AnnouncedContribution::kBytes) return false;
  write_id(to, announced.id);
  to.u32(announced.latest);
  to.u32(announced.frame_revision);
  to.u8(static_cast<std::uint8_t>(
      (announced.complete ? kIsComplete : 0) | (announced.origin ? kIsOrigin : 0) |
      (announced.stated ? kIsStated : 0) | (announced.disputed ? kIsDisputed : 0)));
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
  announced.stated = (flags & kIsStated) != 0;
  announced.disputed = (flags & kIsDisputed) != 0;
  announced.digest = from.u64();
  return from.ok() && flags <= (kIsComplete | kIsOrigin | kIsStated | kIsDisputed) &&
         announced.latest <= kLastVersion;
}

bool Statement::is_newer_than(const Statement& other) const noexcept {
  if (latest != other.latest) return latest > other.latest;
  if (frame_revision != other.frame_revision) return frame_revision > other.frame_revision;
  if (floor != other.floor) return floor > other.floor;
  if (session_floor != other.session_floor) return session_floor > other.session_floor;
  return session > other.session;
}

}  // namespace tessera
