// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One who has the fleet's key, or needs none, and says what it likes.
#pragma once

#include <vector>

#include "support/mapper.hpp"
#include "tessera/exchange/wire.hpp"

namespace tessera::network {

/// What Network's robots must have alike.
[[nodiscard]] ConfigurationDetails details_of_network();

class Forger {
 public:
  /// sequence: that it said last.
  explicit Forger(std::uint32_t robot, std::uint64_t session = std::uint64_t{1} << 32U,
                  std::uint64_t sequence = 0)
      : robot_(robot), session_(session), sequence_(sequence) {}
  /// A well tagged datagram of that kind with what write gives as its body.
  template <class Write>
  [[nodiscard]] std::vector<std::byte> datagram(DatagramKind kind, const Write& write) {
    std::vector<std::byte> bytes(kMostDatagramBytes);
    ByteWriter to(bytes);
    write_header(to, {.kind = kind,
                      .configuration = details_of_network().checksum(),
                      .sender = robot_,
                      .session = session_,
                      .sequence = ++sequence_});
    write(to);
    bytes.resize(to.size() + kTagBytes);
    seal(bytes);
    return bytes;
  }
  [[nodiscard]] std::vector<std::byte> announcement(
      std::initializer_list<AnnouncedContribution> all);
  [[nodiscard]] std::vector<std::byte> frame(const ContributionId& id, std::uint32_t revision);
  /// Of one record, which holds nothing.
  [[nodiscard]] std::vector<std::byte> chunk(const ContributionId& id, VersionRange range,
                                             BlockCoord block, std::uint32_t version);
  /// What a relay says of a range that it has no record of.
  [[nodiscard]] std::vector<std::byte> empty_chunk(const ContributionId& id, VersionRange range);
  /// What a member signs that asks for all of a contribution.
  [[nodiscard]] static std::vector<std::byte> request_for_all(std::uint32_t member,
                                                              std::uint64_t session,
                                                              std::uint64_t sequence,
                                                              const ContributionId& of);
  /// The same of its frame and its statement alone.
  [[nodiscard]] static std::vector<std::byte> request_for_statement(std::uint32_t member,
                                                                    std::uint64_t session,
                                                                    std::uint64_t sequence,
                                                                    const ContributionId& of);
  /// Tags what it holds anew.
  static void seal(std::vector<std::byte>& datagram);

 private:
  [[nodiscard]] static std::vector<std::byte> signed_request(
      std::uint32_t member, std::uint64_t session, std::uint64_t sequence,
      const RequestedContribution& requested);

  std::uint32_t robot_;
  std::uint64_t session_;
  std::uint64_t sequence_;
};

}  // namespace tessera::network
