// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "fuzz/forged_datagram.hpp"

#include <algorithm>

#include "fuzz/block_content_memory.hpp"
#include "network/simulated_network.hpp"
#include "tessera/exchange/block_codec.hpp"

namespace tessera::fuzz {

namespace {

ContributionId drawn_id(Input& input) {
  constexpr std::array<std::uint32_t, 4> kEpochs{1, 5, 2, 0};
  const unsigned which = input.u8();
  return {which & 7U, kEpochs[(which >> 3U) & 3U], which >> 7U};
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

void draw_frame(Input& input, ByteWriter& to) {
  FrameBody frame{.id = drawn_id(input), .revision = 1U + input.u8()};
  const unsigned how = input.u8();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double shift = static_cast<std::int16_t>(input.u16());
    frame.T_global_map(axis, 3) = (how & 1U) != 0 ? shift * 10.0 : shift / 100.0;
  }
  static_cast<void>(write_frame(to, frame));
}

void draw_announcement(Input& input, ByteWriter& to) {
  write_details(to, {});
  for (int n = input.below(8); n > 0; --n) {
    const ContributionId id = drawn_id(input);
    const std::uint32_t latest = drawn_version(input);
    const std::uint32_t how = input.u8();
    static_cast<void>(write_announced(to, {.id = id,
                                           .latest = latest,
                                           .frame_revision = how >> 4U,
                                           .complete = (how & 1U) != 0,
                                           .digest = how & 2U}));
  }
}

void draw_request(Input& input, ByteWriter& to) {
  for (int n = input.below(8); n > 0; --n) {
    RequestedContribution requested{.id = drawn_id(input)};
    const unsigned how = input.u8();
    requested.frame_revision = how >> 5U;
    requested.all = (how & 0x10U) != 0;
    requested.gaps = requested.all ? 0 : static_cast<std::uint8_t>(how & 7U);
    std::uint32_t last = 0;
    for (VersionRange& gap : std::span(requested.gap).first(requested.gaps)) {
      gap = drawn_range(input);
      // Mostly ascending, as they have to be.
      if ((how & 8U) != 0) gap.first = last + 1 + gap.first % 64;
      if ((how & 8U) != 0) gap.last = gap.first + gap.last % 64;
      last = gap.last;
    }
    static_cast<void>(write_requested(to, requested));
  }
}

void draw_chunk(Input& input, ByteWriter& to) {
  static OwnContent own(network::kClasses + 2);
  static std::array<std::byte, most_coded_bytes(kBlockLayers)> code;
  const ChunkHeader header{drawn_id(input), drawn_range(input)};
  write_chunk_header(to, header);
  RecordWriter writer(to, header.range);
  std::uint32_t version = header.range.first - 1;
  for (int n = input.below(12); n > 0; --n) {
    const unsigned how = input.u8();
    if (header.range.last - version < 1U + (how & 3U)) return;
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
    if (!writer.write({.block = {at(3), at(4), at(5)},
                       .version = {.number = version, .first = version - part, .layers = layers},
                       .coded = std::span(code).first(size)}))
      return;
  }
}

}  // namespace

Datagram drawn_body(Input& input, DatagramKind kind) {
  Datagram body(kMostBodyBytes);
  ByteWriter to(body);
  if (kind == DatagramKind::kAnnounce) draw_announcement(input, to);
  if (kind == DatagramKind::kRequest) draw_request(input, to);
  if (kind == DatagramKind::kChunk) draw_chunk(input, to);
  if (kind == DatagramKind::kFrame) draw_frame(input, to);
  body.resize(to.size());
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

Datagram forged(DatagramHeader header, Bytes body) {
  Datagram datagram(kHeaderBytes + body.size() + kTagBytes);
  ByteWriter to(datagram);
  write_header(to, header);
  to.bytes(body);
  seal(datagram);
  return datagram;
}

std::uint64_t refusals(const ExchangeReport& report) {
  return report.refused_size + report.refused_format + report.refused_tag +
         report.refused_signature + report.refused_configuration + report.refused_replay +
         report.refused_robot + report.refused_excluded + report.refused_peers +
         report.refused_body + report.own_echoes;
}

}  // namespace tessera::fuzz
