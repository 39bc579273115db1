// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "network/forger.hpp"

#include "network/simulated_network.hpp"

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
  return datagram(DatagramKind::kFrame,
                  [&](ByteWriter& to) { write_frame(to, {.id = id, .revision = revision}); });
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

void Forger::seal(std::vector<std::byte>& datagram) {
  const Authenticator crc = crc_authenticator();
  const std::span<std::byte> all(datagram);
  crc.tag(nullptr, all.first(all.size() - kTagBytes), all.last<kTagBytes>());
}

}  // namespace tessera::network
