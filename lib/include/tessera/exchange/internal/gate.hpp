// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Who is listened to: the size, the format, the mission and the tag of what arrives, its sender's
// session and signature. What passes the gate was sent by a robot of the fleet, and control
// messages were sent by the robot that they name, in its session at work, and once.
//
// Invariants: without signatures a tag is enough to speak for any robot
// (docs/design/threat-model.md). With them, no datagram changes a Peer but one that its robot
// signed.
#pragma once

#include <optional>

#include "tessera/exchange/exchange_config.hpp"
#include "tessera/exchange/peer_table.hpp"
#include "tessera/exchange/presence.hpp"
#include "tessera/exchange/signatures.hpp"

namespace tessera {

/// A datagram that was accepted.
struct Heard {
  /// Given: whose descriptions are waited for, if anybody's. Of others no signature is checked.
  std::optional<std::uint32_t> describing;
  DatagramHeader header{};
  Peer* peer = nullptr;  ///< May be null for what can be relayed.
  bool is_new = true;    ///< It is no repeat.
  bool is_last = false;  ///< Nothing that its sender sent later was heard before.
  /// Of an announcement.
  AnnouncementHeader announcement{};
  /// Where its sender says that it is, alone or before an announcement: then the header's kind is
  /// that of the announcement.
  std::optional<Presence> presence{};
  std::span<const std::byte> body;  ///< What comes after that.
  Instant now;
};

class Gate {
 public:
  /// Signatures of one sender's requests that are checked in a second, at most.
  static constexpr std::int64_t kChecksPerSecond = 50;
  /// The same of datagrams that say where it is, and nothing else: ten are sent.
  static constexpr std::int64_t kPresencesPerSecond = 20;
  /// Signatures of descriptions that are checked in a second, at most: 2 % of a core where one
  /// takes 60 us. After a pause so many more at once as tell apart 100,000 records of which half
  /// differ.
  static constexpr std::int64_t kDescriptionsPerSecond = 300;
  static constexpr Duration kDescriptionsAtOnce{20'000'000};
  /// Each robot that is banned takes three proofs of those that a robot keeps (conflicts.hpp).
  static constexpr std::size_t kMostBanned = 32;

  [[nodiscard]] static constexpr std::size_t required_bytes(const ExchangeConfig& config) noexcept {
    return PeerTable::required_bytes(config.peers) + arena_bytes<std::uint32_t>(kMostBanned);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<Gate> make(Arena& arena, const ExchangeConfig& config,
                                         const ConfigurationDetails& details,
                                         const Authenticator& authenticator,
                                         const Signatures& signatures) noexcept;
  Gate() noexcept = default;

  /// True iff the datagram is to be heard; each refusal is counted. Cost: a tag's check, and for
  /// control messages a signature's.
  [[nodiscard]] bool accept(std::span<const std::byte> datagram, Instant now, Heard& heard,
                            ExchangeReport& counted) noexcept;
  /// What the next announcement asks of others and answers to them. random: fresh bits.
  void write_challenges(AnnouncementHeader& header, Instant now, std::uint64_t random) noexcept;
  /// True if write_challenges() has something to write that should not wait.
  [[nodiscard]] bool wants_to_announce(Instant now) const noexcept;

  /// Fails with kResourceExhausted iff ExchangeConfig::kMostExcluded are excluded already.
  [[nodiscard]] Status exclude(std::uint32_t robot) noexcept;
  void include(std::uint32_t robot) noexcept;
  /// Excludes a robot for what it has done itself: include() does not take it back.
  void ban(std::uint32_t robot) noexcept;
  [[nodiscard]] bool is_banned(std::uint32_t robot) const noexcept;
  /// True if it is excluded or banned.
  [[nodiscard]] bool is_excluded(std::uint32_t robot) const noexcept;
  /// Robots that exclude() was called with, ascending.
  [[nodiscard]] std::span<const std::uint32_t> excluded() const noexcept {
    return std::span(excluded_).first(excluded_count_);
  }
  [[nodiscard]] std::span<const std::uint32_t> banned() const noexcept {
    return banned_.first(banned_count_);
  }
  [[nodiscard]] PeerTable& peers() noexcept { return peers_; }
  [[nodiscard]] const PeerTable& peers() const noexcept { return peers_; }
  [[nodiscard]] const ConfigurationDetails& details() const noexcept { return details_; }
  [[nodiscard]] std::uint32_t configuration() const noexcept { return configuration_; }
  [[nodiscard]] const Signatures& signatures() const noexcept { return signatures_; }
  [[nodiscard]] const Authenticator& authenticator() const noexcept { return authenticator_; }

 private:
  static bool refuse(std::uint64_t& counter) noexcept {
    ++counter;
    return false;
  }
  [[nodiscard]] bool check_outside(std::span<const std::byte> datagram, Heard& heard,
                                   ExchangeReport& counted) const noexcept;
  [[nodiscard]] bool check_number(std::span<const std::byte> message, const Heard& heard,
                                  ExchangeReport& counted) noexcept;
  [[nodiscard]] bool is_for_others(const Heard& heard) const noexcept;
  [[nodiscard]] bool split_presence(Heard& heard) const noexcept;
  [[nodiscard]] bool check_rate(const Heard& heard, Instant now) noexcept;
  [[nodiscard]] bool is_signed(std::span<const std::byte> message,
                               const DatagramHeader& header) const noexcept;
  [[nodiscard]] bool read_control(std::span<const std::byte> message, Heard& heard,
                                  ExchangeReport& counted) noexcept;
  [[nodiscard]] bool check_session(Heard& heard, Instant now, ExchangeReport& counted) noexcept;
  [[nodiscard]] bool proves_itself(const Heard& heard) const noexcept;
  void note_challenges(const Heard& heard) const noexcept;
  static void note_data_sequence(const Heard& heard) noexcept;
  [[nodiscard]] bool note_control(Heard& heard, Instant now, ExchangeReport& counted) noexcept;
  void note_data(Heard& heard, Instant now) noexcept;
  [[nodiscard]] bool check_configuration(Heard& heard, ExchangeReport& counted) const noexcept;

  std::uint32_t robot_ = 0;
  std::uint64_t session_ = 0;
  std::uint32_t mission_ = 0;
  ConfigurationDetails details_{};
  std::uint32_t configuration_ = 0;
  Authenticator authenticator_{};
  Signatures signatures_{};
  PeerTable peers_{};
  RateLimit strangers_{};  ///< Announcements of robots that are no peers yet.
  RateLimit twins_{};
  RateLimit descriptions_{};
  std::array<std::uint32_t, ExchangeConfig::kMostExcluded> excluded_{};
  std::size_t excluded_count_ = 0;
  std::span<std::uint32_t> banned_;
  std::size_t banned_count_ = 0;
};

}  // namespace tessera
