// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/gate.hpp"

#include <algorithm>

namespace tessera {

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
  gate.banned_ = arena.take<std::uint32_t>(kMostBanned);
  if (!peers.ok() || gate.banned_.empty()) return Status::kResourceExhausted;
  gate.peers_ = *peers;
  return gate;
}

Status Gate::exclude(std::uint32_t robot) noexcept {
  if (std::binary_search(excluded().begin(), excluded().end(), robot)) return Status::kOk;
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
  return std::binary_search(all.begin(), all.end(), robot) || is_banned(robot);
}

bool Gate::is_banned(std::uint32_t robot) const noexcept {
  return std::find(banned().begin(), banned().end(), robot) != banned().end();
}

void Gate::ban(std::uint32_t robot) noexcept {
  if (!is_banned(robot) && banned_count_ < banned_.size()) banned_[banned_count_++] = robot;
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
  if (!split_presence(heard)) return refuse(counted.refused_body);
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

/// Of descriptions all robots hear those that one of them asked for.
bool Gate::is_for_others(const Heard& heard) const noexcept {
  if (!signatures_.on() || heard.header.kind != DatagramKind::kDescription) return false;
  DescriptionHeader description;
  ByteReader reader(heard.body);
  return heard.describing != heard.header.sender || !read_description_header(reader, description) ||
         description.target != robot_;
}

/// An announcement may follow, which is heard as any other. False: that is none.
bool Gate::split_presence(Heard& heard) const noexcept {
  if (heard.header.kind != DatagramKind::kPresence) return true;
  ByteReader reader(heard.body);
  Presence presence;
  if (!read_presence(reader, presence)) return false;
  heard.presence = presence;
  heard.body = heard.body.last(reader.remaining());
  if (heard.body.size() > (signatures_.on() ? kSignatureBytes : 0))
    heard.header.kind = DatagramKind::kAnnounce;
  return true;
}

/// Requests are what a robot can be made to work by; announcements and descriptions have limits of
/// their own, so that none keeps another out.
bool Gate::check_rate(const Heard& heard, Instant now) noexcept {
  if (!signatures_.on()) return true;
  if (heard.peer == nullptr) return strangers_.pass(kChecksPerSecond, now);
  // A new process, or a recording of an earlier one: that keeps nobody else out.
  if (heard.peer->control.is_of_another(heard.header.session))
    return heard.peer->other_sessions.pass(kChecksPerSecond, now);
  if (heard.header.kind == DatagramKind::kDescription)
    return descriptions_.pass(kDescriptionsPerSecond, now, kDescriptionsAtOnce);
  if (heard.header.kind == DatagramKind::kPresence)
    return heard.peer->presences.pass(kPresencesPerSecond, now);
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

/// A repeat is not worth the check of a signature. Without signatures somebody else may have used
/// the number: see check_session().
bool Gate::read_control(std::span<const std::byte> message, Heard& heard,
                        ExchangeReport& counted) noexcept {
  const DatagramHeader& header = heard.header;
  heard.peer = peers_.find(header.sender);
  const bool repeated = heard.peer != nullptr &&
                        !heard.peer->control.is_of_another(header.session) &&
                        !heard.peer->control.is_new(header.sequence);
  if (repeated && (signatures_.on() || header.kind != DatagramKind::kAnnounce))
    return refuse(counted.refused_replay);
  if (is_for_others(heard)) return false;
  if (!check_rate(heard, heard.now)) return refuse(counted.refused_rate);
  if (!is_signed(message, header)) return refuse(counted.refused_signature);
  if (signatures_.on()) heard.body = heard.body.first(heard.body.size() - kSignatureBytes);
  if (header.kind != DatagramKind::kAnnounce) return true;
  ByteReader reader(heard.body);
  if (!read_announcement_header(reader, heard.announcement)) return refuse(counted.refused_body);
  heard.body = heard.body.last(reader.remaining());
  return true;
}

bool Gate::note_control(Heard& heard, Instant now, ExchangeReport& counted) noexcept {
  const DatagramHeader& header = heard.header;
  const Duration silent = signatures_.on() ? PeerTable::kSilent : PeerTable::kSilentUnsigned;
  heard.peer = peers_.find_or_add(header.sender, now, silent);
  if (heard.peer == nullptr) return refuse(counted.refused_peers);
  if (!check_session(heard, now, counted)) return false;
  Peer& peer = *heard.peer;
  peer.control.note(header.session, header.sequence);
  heard.is_last = peer.control.sequence == header.sequence;
  if (heard.is_last) peer.advanced = now;
  peer.heard = now;
  ++peer.datagrams;
  if (header.kind != DatagramKind::kAnnounce) return true;
  note_challenges(heard);
  if (heard.is_last && !signatures_.on()) note_data_sequence(heard);
  return true;
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

}  // namespace tessera
