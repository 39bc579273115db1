// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/gate.hpp"

#include <algorithm>

namespace tessera {

namespace {

/// Between two challenges of one robot, and within which its answer counts.
constexpr Duration kBetweenChallenges{1'000'000};
constexpr Duration kProofTime{5'000'000};
/// A number whose process is proved to be another one again within this is used by two.
constexpr Duration kTwinTime{20'000'000};

/// In place of a nonce that is drawn when it is sent.
constexpr std::uint64_t kUndrawn = 2;

bool refuse(std::uint64_t& counter) noexcept {
  ++counter;
  return false;
}

constexpr std::uint32_t start_of(std::uint64_t session) noexcept {
  return static_cast<std::uint32_t>(session >> 32U);
}

}  // namespace

Result<Gate> Gate::make(Arena& arena, const ExchangeConfig& config,
                        const ConfigurationDetails& details, const Authenticator& authenticator,
                        const Signatures& signatures) noexcept {
  Gate gate;
  gate.robot_ = config.robot;
  gate.session_ = config.session;
  gate.mission_ = config.mission;
  gate.details_ = details;
  gate.configuration_ = details.checksum();
  gate.authenticator_ = authenticator;
  gate.signatures_ = signatures;
  Result<PeerTable> peers = PeerTable::make(arena, config.peers);
  if (!peers.ok()) return peers.status();
  gate.peers_ = *peers;
  return gate;
}

Status Gate::exclude(std::uint32_t robot) noexcept {
  if (is_excluded(robot)) return Status::kOk;
  if (excluded_count_ == excluded_.size()) return Status::kResourceExhausted;
  std::size_t place = excluded_count_++;
  for (; place > 0 && robot < excluded_[place - 1]; --place)
    excluded_[place] = excluded_[place - 1];
  excluded_[place] = robot;
  return Status::kOk;
}

void Gate::include(std::uint32_t robot) noexcept {
  const auto all = std::span(excluded_).first(excluded_count_);
  const auto kept = std::remove(all.begin(), all.end(), robot);
  excluded_count_ = static_cast<std::size_t>(kept - all.begin());
}

bool Gate::is_excluded(std::uint32_t robot) const noexcept {
  const std::span<const std::uint32_t> all = excluded();
  return std::binary_search(all.begin(), all.end(), robot);
}

bool Gate::accept(std::span<const std::byte> datagram, Instant now, Heard& heard,
                  ExchangeReport& counted) noexcept {
  ++counted.received;
  counted.received_bytes += datagram.size();
  heard.now = now;
  if (!check_outside(datagram, heard, counted)) return false;
  const std::span<const std::byte> message = datagram.first(datagram.size() - kTagBytes);
  if (!check_number(message, heard, counted)) return false;
  heard.body = message.subspan(kHeaderBytes);
  if (heard.header.is_signed != signatures_.on()) return refuse(counted.refused_signature);
  if (is_control(heard.header.kind)) {
    if (!read_control(message, heard, counted) || !note_control(heard, now, counted)) return false;
  } else {
    note_data(heard, now);
  }
  return check_configuration(heard, counted);
}

bool Gate::check_outside(std::span<const std::byte> datagram, Heard& heard,
                         ExchangeReport& counted) const noexcept {
  if (datagram.size() < kHeaderBytes + kTagBytes || datagram.size() > kMostDatagramBytes)
    return refuse(counted.refused_size);
  ByteReader reader(datagram.first(kHeaderBytes));
  if (!read_header(reader, heard.header)) return refuse(counted.refused_format);
  if (heard.header.mission != mission_) return refuse(counted.refused_mission);
  const std::span<const std::byte> message = datagram.first(datagram.size() - kTagBytes);
  if (!authenticator_.check(authenticator_.context, message, datagram.last<kTagBytes>()))
    return refuse(counted.refused_tag);
  return true;
}

/// Another process of this robot's number is one only if it can sign as this robot.
bool Gate::check_number(std::span<const std::byte> message, const Heard& heard,
                        ExchangeReport& counted) noexcept {
  const DatagramHeader& header = heard.header;
  if (is_excluded(header.sender)) return refuse(counted.refused_excluded);
  if (header.sender != robot_) return true;
  if (header.session == session_) return refuse(counted.own_echoes);
  if (!signatures_.on()) return refuse(counted.refused_robot);
  const bool twin = header.is_signed && is_control(header.kind) &&
                    twins_.pass(kChecksPerSecond, heard.now) && is_signed(message, header);
  return refuse(twin ? counted.refused_robot : counted.refused_replay);
}

/// Requests and descriptions are what a robot can be made to work by; announcements have a limit of
/// their own, so that the two do not keep each other out.
bool Gate::check_rate(const Heard& heard, Instant now) noexcept {
  if (!signatures_.on()) return true;
  if (heard.peer == nullptr) return strangers_.pass(kChecksPerSecond, now);
  const bool is_announcement =
      heard.header.kind == DatagramKind::kAnnounce || heard.header.kind == DatagramKind::kLeave;
  return (is_announcement ? heard.peer->announcements : heard.peer->checks)
      .pass(kChecksPerSecond, now);
}

bool Gate::is_signed(std::span<const std::byte> message,
                     const DatagramHeader& header) const noexcept {
  if (!signatures_.on()) return true;
  if (message.size() < kHeaderBytes + kSignatureBytes) return false;
  return signatures_.check(signatures_.context, header.sender,
                           message.first(message.size() - kSignatureBytes),
                           message.last<kSignatureBytes>());
}

/// A repeat is not worth the check of a signature.
bool Gate::read_control(std::span<const std::byte> message, Heard& heard,
                        ExchangeReport& counted) noexcept {
  const DatagramHeader& header = heard.header;
  heard.peer = peers_.find(header.sender);
  if (heard.peer != nullptr && !heard.peer->control.is_of_another(header.session) &&
      !heard.peer->control.is_new(header.sequence))
    return refuse(counted.refused_replay);
  if (!check_rate(heard, heard.now)) return refuse(counted.refused_rate);
  if (!is_signed(message, header)) return refuse(counted.refused_signature);
  if (signatures_.on()) heard.body = heard.body.first(heard.body.size() - kSignatureBytes);
  if (header.kind != DatagramKind::kAnnounce) return true;
  ByteReader reader(heard.body);
  if (!read_announcement_header(reader, heard.announcement)) return refuse(counted.refused_body);
  heard.body = heard.body.last(reader.remaining());
  return true;
}

bool Gate::proves_itself(const Heard& heard) const noexcept {
  const Peer& peer = *heard.peer;
  if (heard.header.kind != DatagramKind::kAnnounce || peer.nonce == 0 ||
      heard.now - peer.challenged > kProofTime)
    return false;
  const auto& header = heard.announcement;
  const auto all = std::span(header.challenge).first(header.challenges);
  return std::any_of(all.begin(), all.end(), [&](const Challenge& one) {
    return one.is_answer && one.robot == robot_ && one.nonce == peer.nonce;
  });
}

/// A later start is taken as it is. Any other session than the one at work may be a recording, or
/// of a robot whose counter was lost, or whose number somebody forged a later session for: who
/// answers a nonce is there now.
bool Gate::check_session(Heard& heard, Instant now, ExchangeReport& counted) noexcept {
  Peer& peer = *heard.peer;
  if (!peer.control.is_of_another(heard.header.session)) return true;
  if (start_of(heard.header.session) > start_of(peer.control.session)) return true;
  if (proves_itself(heard)) {
    counted.twins += now - peer.session_changed < kTwinTime ? 1U : 0U;
    peer.session_changed = now;
    peer.nonce = 0;
    return true;
  }
  if (peer.nonce == 0) peer.nonce = kUndrawn;
  return refuse(counted.refused_replay);
}

bool Gate::note_control(Heard& heard, Instant now, ExchangeReport& counted) noexcept {
  const DatagramHeader& header = heard.header;
  heard.peer = peers_.find_or_add(header.sender, now);
  if (heard.peer == nullptr) return refuse(counted.refused_peers);
  if (!check_session(heard, now, counted)) return false;
  Peer& peer = *heard.peer;
  peer.control.note(header.session, header.sequence);
  heard.is_last = peer.control.sequence == header.sequence;
  peer.heard = now;
  ++peer.datagrams;
  if (header.kind == DatagramKind::kAnnounce) note_challenges(heard);
  return true;
}

void Gate::note_challenges(const Heard& heard) const noexcept {
  const auto& header = heard.announcement;
  for (const Challenge& one : std::span(header.challenge).first(header.challenges)) {
    if (!one.is_answer && one.robot == robot_) heard.peer->answer = one.nonce;
  }
}

/// What can be relayed is checked when it is news. In a fleet that signs it is no sign of life.
void Gate::note_data(Heard& heard, Instant now) noexcept {
  const DatagramHeader& header = heard.header;
  heard.peer = peers_.find(header.sender);
  if (heard.peer == nullptr) return;
  SequenceWindow& window = heard.peer->data;
  heard.is_new = window.is_of_another(header.session) || window.is_new(header.sequence);
  if (!heard.is_new) return;
  ++heard.peer->datagrams;
  if (header.session != heard.peer->control.session && signatures_.on()) return;
  window.note(header.session, header.sequence);
  heard.is_last = window.sequence == header.sequence;
  if (!signatures_.on()) heard.peer->heard = now;
}

bool Gate::check_configuration(Heard& heard, ExchangeReport& counted) const noexcept {
  const bool same = heard.header.configuration == configuration_;
  if (heard.header.kind == DatagramKind::kAnnounce) {
    heard.peer->mismatch.reset();
    if (!same) heard.peer->mismatch = heard.announcement.details;
  }
  return same || refuse(counted.refused_configuration);
}

bool Gate::wants_to_announce(Instant now) const noexcept {
  const auto all = peers_.all();
  return std::any_of(all.begin(), all.end(), [now](const Peer& peer) {
    return peer.answer != 0 || (peer.nonce != 0 && now - peer.challenged > kBetweenChallenges);
  });
}

void Gate::write_challenges(AnnouncementHeader& header, Instant now,
                            std::uint64_t random) noexcept {
  for (Peer& peer : peers_.all()) {
    const auto add = [&](bool is_answer, std::uint64_t nonce) {
      if (header.challenges == AnnouncementHeader::kMostChallenges) return false;
      header.challenge[header.challenges++] = {is_answer, peer.robot, nonce};
      return true;
    };
    if (peer.answer != 0 && add(true, peer.answer)) peer.answer = 0;
    if (peer.nonce == 0 || now - peer.challenged <= kBetweenChallenges) continue;
    // The same until it is answered: the answer may be on its way.
    const std::uint64_t nonce =
        peer.nonce == kUndrawn ? mix64(random + peer.robot) | 1U : peer.nonce;
    if (!add(false, nonce)) continue;
    peer.nonce = nonce;
    peer.challenged = now;
  }
}

}  // namespace tessera
