// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "fuzz/forged_datagram.hpp"

#include <algorithm>

#include "fuzz/block_content_memory.hpp"
#include "fuzz/forged_signature.hpp"
#include "network/simulated_network.hpp"
#include "tessera/exchange/conflicts.hpp"
#include "tessera/exchange/internal/block_codec.hpp"
#include "tessera/exchange/internal/frames.hpp"

namespace tessera::fuzz {

namespace {

ContributionId drawn_id(Input& input) {
  constexpr std::array<std::uint32_t, 4> kEpochs{1, 5, 2, 0};
  const unsigned which = input.u8();
  // Some are map sessions.
  const bool is_session = (which & 7U) == 7U;
  return {is_session ? 6U : which & 7U, kEpochs[(which >> 3U) & 3U],
          (is_session ? MapSession::kFirst : 0U) + (which >> 7U)};
}

/// Mostly small, at times the highest.
std::uint32_t drawn_version(Input& input) {
  const std::uint32_t small = input.u8();
  return small < 0xf0U ? small : ~std::uint32_t{0} - 1 - (small & 3U);
}

VersionRange drawn_range(Input& input) {
  const std::uint32_t first = std::max(drawn_version(input), std::uint32_t{1});
  const std::uint32_t more = input.u8();
  return {first, more < ~std::uint32_t{0} - 1 - first ? first + more : first};
}

void draw_announcement(Input& input, ByteWriter& to) {
  AnnouncementHeader header;
  header.floor = input.u8() & 7U;
  header.challenges = static_cast<std::uint8_t>(input.below(3));
  for (Challenge& challenge : std::span(header.challenge).first(header.challenges)) {
    const unsigned how = input.u8();
    challenge = {(how & 1U) != 0, (how >> 1U) & 7U, how};
  }
  write_announcement_header(to, header);
  for (int n = input.below(8); n > 0; --n) {
    const ContributionId id = drawn_id(input);
    const std::uint32_t latest = drawn_version(input);
    const std::uint32_t how = input.u8();
    static_cast<void>(write_announced(to, {.id = id,
                                           .latest = latest,
                                           .frame_revision = how >> 4U,
                                           .stated = (how & 4U) != 0,
                                           .complete = (how & 1U) != 0,
                                           .origin = (how & 8U) != 0,
                                           .digest = how & 2U}));
  }
}

void draw_gaps(Input& input, RequestedContribution& requested, unsigned how) {
  std::uint32_t last = 0;
  for (VersionRange& gap : std::span(requested.gap).first(requested.count)) {
    gap = drawn_range(input);
    // Mostly ascending, as they have to be.
    if ((how & 8U) != 0) gap.first = last + 1 + gap.first % 64;
    if ((how & 8U) != 0) gap.last = gap.first + gap.last % 64;
    last = gap.last;
  }
}

void draw_request(Input& input, ByteWriter& to) {
  for (int n = input.below(8); n > 0; --n) {
    RequestedContribution requested{.id = drawn_id(input)};
    const unsigned how = input.u8();
    requested.frame_revision = how >> 5U;
    requested.type = static_cast<RequestType>((how >> 3U) % 3U);
    requested.stated = (how & 0x10U) != 0;
    requested.latest = how & 0xfU;
    requested.count = static_cast<std::uint8_t>(how & 7U);
    requested.target = input.u8() & 7U;
    requested.width = static_cast<std::uint8_t>(input.below(33));
    if (requested.type == RequestType::kGaps) draw_gaps(input, requested, how);
    for (std::uint32_t i = 0; i < requested.count; ++i) {
      requested.version[i] = 1 + i + (i == 0 ? 0U : requested.version[i - 1]) + input.u8() % 8U;
      requested.span[i] = 1 + i + (i == 0 ? 0U : requested.span[i - 1]);
    }
    static_cast<void>(write_requested(to, requested));
  }
}

Statement drawn_statement(Input& input, const ContributionId& id, VersionRange range) {
  const unsigned how = input.u8();
  return {.id = id,
          .range = range,
          .latest = range.last + (how & 3U),
          .records = how >> 4U,
          .fingerprint = {how & 4U, how & 8U},
          .frame_revision = 1U + (how >> 6U),
          .floor = std::min(id.epoch, how & 3U),
          .session_floor = std::min(id.epoch, how >> 2U & 3U),
          .session = std::uint64_t{input.u8() & 1U} << 32U};
}

/// A proof without its signature; which: of what leaf of how many.
Datagram unsigned_proof(unsigned which) {
  const unsigned leaves = 1U + (which & 15U);
  const unsigned leaf = (which >> 4U) % leaves;
  Datagram proof(1 + HashTree::path_length(leaf, leaves) * kHashBytes + kSignatureBytes);
  proof[0] = static_cast<std::byte>(leaf | (leaves - 1) << 4U);
  return proof;
}

/// True iff the body ends with a signature.
bool draw_frames(Input& input, ByteWriter& to, bool is_signed) {
  const unsigned flags = input.u8();
  FramesHeader header{.robot = drawn_id(input).robot, .relayed = (flags & 1U) != 0};
  const bool at_end = is_signed && !header.relayed;
  if (at_end) to.keep_free(kSignatureBytes);
  write_frames_header(to, header);
  FrameWriter writer(to);
  Datagram proof;
  for (int n = 1 + input.below(18); n > 0; --n) {
    FrameBody frame{.id = drawn_id(input), .revision = 1U + input.u8()};
    const unsigned how = input.u8();
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double shift = static_cast<std::int16_t>(input.u16());
      // Of those in steps of 2^-12 there is a short code.
      frame.T_global_map(axis, 3) =
          (how & 1U) != 0 ? shift * 10.0 : shift / ((how & 2U) != 0 ? 128.0 : 100.0);
    }
    if ((how & 4U) != 0) frame.extent.include(BlockCoord{static_cast<std::int32_t>(how), -3, 2});
    frame.session = {how & 3U, 0, static_cast<std::uint16_t>((how & 0xe0U) << 7U)};
    if (is_signed && header.relayed) proof = unsigned_proof(how);
    if (!writer.write(frame, proof)) break;
  }
  return at_end;
}

void draw_statement(Input& input, ByteWriter& to, bool is_signed) {
  const ContributionId id = drawn_id(input);
  static_cast<void>(write_statement(to, drawn_statement(input, id, drawn_range(input))));
  if (is_signed) to.bytes(unsigned_proof(input.u8()));
}

/// Two records, mostly of one version, or two statements of one moment.
void draw_conflict(Input& input, ByteWriter& to) {
  const unsigned how = input.u8();
  ConflictBody conflict{.id = drawn_id(input), .of_statements = (how & 1U) != 0};
  std::array<Datagram, 2> proofs;
  for (std::size_t i = 0; i < proofs.size(); ++i) {
    ConflictBody::Side& side = conflict.side[i];
    const unsigned what = input.u8();
    side.record = {.version = 1U + (what & 1U),
                   .first = 1,
                   .layers = kAllLayers,
                   .block = {static_cast<std::int32_t>(what >> 6U), 0, 0},
                   .code = {}};
    if (conflict.of_statements) side.statement = drawn_statement(input, conflict.id, {1, 1});
    proofs[i] = unsigned_proof(what);
    side.proof = proofs[i];
  }
  static_cast<void>(write_conflict(to, conflict));
}

void draw_description(Input& input, ByteWriter& to) {
  write_description_header(to, {drawn_id(input), input.u8() & 7U});
  Description description;
  for (int n = input.below(4); n > 0; --n) {
    const unsigned how = input.u8();
    description.span = {static_cast<std::uint8_t>(how & 31U), input.u8() & 3U};
    description.is_list = (how & 0x80U) != 0;
    description.part_width = 0;
    if (description.is_list) {
      description.count = static_cast<std::uint8_t>(input.below(8));
      auto version = static_cast<std::uint32_t>(description.span.first());
      for (auto& record : std::span(description.record).first(description.count))
        record = {version++, input.u32()};
      description.last = version;
    } else {
      const unsigned bits = std::min<unsigned>(6, description.span.width);
      description.part_width = static_cast<std::uint8_t>(description.span.width - bits);
      description.count = static_cast<std::uint8_t>(1U << bits);
      for (std::uint64_t& sum : description.sum) sum = how & 0x40U;
    }
    static_cast<void>(write_description(to, description));
  }
}

/// True iff the body ends with a signature.
bool draw_chunk(Input& input, ByteWriter& to, bool is_signed) {
  static OwnContent own(network::kClasses + 2);
  static std::array<std::byte, most_coded_bytes(kBlockLayers)> code;
  ChunkHeader header{.id = drawn_id(input), .range = drawn_range(input)};
  const unsigned flags = input.u8();
  header.relayed = (flags & 1U) != 0;
  header.partial = (flags & 2U) != 0;
  header.statement = drawn_statement(input, header.id, header.range);
  const bool at_end = is_signed && !header.relayed;
  if (at_end) to.keep_free(kSignatureBytes);
  write_chunk_header(to, header);
  RecordWriter writer(to, header.range);
  Datagram proof;
  std::uint32_t version = header.range.first - 1;
  for (int n = input.below(12); n > 0; --n) {
    const unsigned how = input.u8();
    if (header.range.last - version < 1U + (how & 3U)) break;
    version += 1U + (how & 3U);
    const std::uint32_t part = std::min((how >> 2U) & 3U, version - 1);
    const auto layers = static_cast<std::uint8_t>(1U + (how >> 4U) % kAllLayers);
    const unsigned what = input.u8();
    oracle::Random random(what);
    BlockContent& content = own.cleared();
    network::add_random_voxels(content, random, static_cast<int>(what & 7U));
    const std::size_t size = encode_block(content, layers, code);
    const auto at = [what](unsigned bit) {
      return static_cast<std::int32_t>((what >> bit) & 1U) - 1;
    };
    if (is_signed && header.relayed) proof = unsigned_proof(what);
    if (!writer.write({.block = {at(3), at(4), at(5)},
                       .version = {.number = version, .first = version - part, .layers = layers},
                       .coded = std::span(code).first(size),
                       .proof = proof}))
      break;
  }
  return at_end;
}

/// True iff the body ends with a signature, which there is room for.
bool draw(Input& input, DatagramKind kind, bool is_signed, ByteWriter& to) {
  if (kind == DatagramKind::kChunk) return draw_chunk(input, to, is_signed);
  if (kind == DatagramKind::kFrame) return draw_frames(input, to, is_signed);
  const bool at_end = is_signed && is_control(kind);
  if (at_end) to.keep_free(kSignatureBytes);
  if (kind == DatagramKind::kPresence) to.bytes(input.bytes(Presence::kBytes));
  if (kind == DatagramKind::kAnnounce || (kind == DatagramKind::kPresence && input.below(2) == 1))
    draw_announcement(input, to);
  if (kind == DatagramKind::kRequest) draw_request(input, to);
  if (kind == DatagramKind::kStatement) draw_statement(input, to, is_signed);
  if (kind == DatagramKind::kDescription) draw_description(input, to);
  if (kind == DatagramKind::kConflict) draw_conflict(input, to);
  return at_end;
}

}  // namespace

Datagram relayed_frame(Bytes body, bool is_signed) {
  ByteReader from(body);
  ContributionId id;
  id.robot = from.u32();
  id.epoch = from.u32();
  id.submap = from.u32();
  Datagram frame(kMostBodyBytes);
  ByteWriter to(frame);
  write_frames_header(to, {.robot = id.robot, .relayed = true});
  const Datagram proof = is_signed ? unsigned_proof(0) : Datagram{};
  static_cast<void>(FrameWriter(to).write({.id = id, .revision = 1}, proof));
  frame.resize(to.size());
  return frame;
}

Datagram drawn_body(Input& input, DatagramKind kind, bool is_signed) {
  Datagram body(kMostBodyBytes);
  ByteWriter to(body);
  const bool at_end = draw(input, kind, is_signed, to);
  body.resize(to.size() + (at_end ? kSignatureBytes : 0));
  return body;
}

void seal(Datagram& datagram) {
  if (datagram.size() < kTagBytes) return;
  const std::span<std::byte> all(datagram);
  crc_authenticator().tag(nullptr, all.first(all.size() - kTagBytes), all.last<kTagBytes>());
}

bool is_sealed(Bytes datagram) {
  return datagram.size() >= kTagBytes &&
         crc_authenticator().check(nullptr, datagram.first(datagram.size() - kTagBytes),
                                   datagram.last<kTagBytes>());
}

Datagram forged(const DatagramHeader& header, Bytes body) {
  Datagram datagram(kHeaderBytes + body.size() + kTagBytes);
  ByteWriter to(datagram);
  write_header(to, header);
  to.bytes(body);
  if (header.is_signed) static_cast<void>(sign(datagram));
  seal(datagram);
  return datagram;
}

std::uint64_t refusals(const ExchangeReport& report) {
  return report.refused_size + report.refused_format + report.refused_mission + report.refused_tag +
         report.refused_rate + report.refused_signature + report.refused_configuration +
         report.refused_replay + report.refused_robot + report.refused_excluded +
         report.refused_peers + report.refused_body + report.own_echoes;
}

}  // namespace tessera::fuzz
