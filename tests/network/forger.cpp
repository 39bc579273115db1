// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "network/forger.hpp"

#include <stdexcept>

#include "network/simulated_network.hpp"
#include "tessera/exchange/internal/frames.hpp"

namespace tessera::network {

ConfigurationDetails details_of_network() {
  const ExchangeConfig config;
  const ClassTable classes = oracle::numbered_classes(kClasses);
  return {.resolution_m = config.resolution_m,
          .prior = config.prior,
          .free_weight = config.free_weight,
          .classes = kClasses,
          .class_table = class_table_checksum(classes),
          .max_evidence = config.max_evidence};
}

std::vector<std::byte> Forger::announcement(std::initializer_list<AnnouncedContribution> all) {
  return datagram(DatagramKind::kAnnounce, [&](ByteWriter& to) {
    write_announcement_header(to, {.details = details_of_network()});
    for (const AnnouncedContribution& announced : all) write_announced(to, announced);
  });
}

std::vector<std::byte> Forger::frame(const ContributionId& id, std::uint32_t revision) {
  return datagram(DatagramKind::kFrame, [&](ByteWriter& to) {
    write_frames_header(to, {.robot = id.robot, .relayed = id.robot != robot_});
    if (!FrameWriter(to).write({.id = id, .revision = revision})) throw std::runtime_error("frame");
  });
}

std::vector<std::byte> Forger::chunk(const ContributionId& id, VersionRange range, BlockCoord block,
                                     std::uint32_t version) {
  return datagram(DatagramKind::kChunk, [&](ByteWriter& to) {
    write_chunk_header(to, {.id = id,
                            .range = range,
                            .statement = {.id = id,
                                          .range = range,
                                          .latest = range.last,
                                          .records = 1,
                                          .frame_revision = 1,
                                          .session = session_}});
    RecordWriter records(to, range);
    records.write({.block = block, .version = {.number = version, .first = version}, .coded = {}});
  });
}

std::vector<std::byte> Forger::empty_chunk(const ContributionId& id, VersionRange range) {
  return datagram(DatagramKind::kChunk, [&](ByteWriter& to) {
    write_chunk_header(to, {.id = id, .range = range, .relayed = true});
  });
}

std::vector<std::byte> Forger::request_for_all(std::uint32_t member, std::uint64_t session,
                                               std::uint64_t sequence, const ContributionId& of) {
  RequestedContribution requested{.id = of};
  requested.count = 1;
  requested.gap[0] = {1, kLastVersion};
  return signed_request(member, session, sequence, requested);
}

std::vector<std::byte> Forger::request_for_statement(std::uint32_t member, std::uint64_t session,
                                                     std::uint64_t sequence,
                                                     const ContributionId& of) {
  return signed_request(member, session, sequence, {.id = of});
}

std::vector<std::byte> Forger::signed_request(std::uint32_t member, std::uint64_t session,
                                              std::uint64_t sequence,
                                              const RequestedContribution& requested) {
  std::vector<std::byte> datagram(kMostDatagramBytes);
  ByteWriter to(datagram);
  write_header(to, {.kind = DatagramKind::kRequest,
                    .configuration = details_of_network().checksum(),
                    .sender = member,
                    .session = session,
                    .sequence = sequence,
                    .is_signed = true});
  if (!write_requested(to, requested)) throw std::runtime_error("request");
  const std::size_t size = to.size();
  ToySignatures key(member);
  const Signatures signatures = key.signatures();
  signatures.sign(signatures.context, std::span(datagram).first(size),
                  std::span(datagram).subspan(size).first<kSignatureBytes>());
  datagram.resize(size + kSignatureBytes + kTagBytes);
  seal(datagram);
  return datagram;
}

void Forger::seal(std::vector<std::byte>& datagram) {
  const Authenticator crc = crc_authenticator();
  const std::span<std::byte> all(datagram);
  crc.tag(nullptr, all.first(all.size() - kTagBytes), all.last<kTagBytes>());
}

}  // namespace tessera::network
