// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What arrives: who may speak, and what is done with each kind of datagram.
#include <algorithm>

#include "tessera/exchange/exchange.hpp"

namespace tessera {

namespace {

/// Announcements that an origin misses before others are believed of what it has.
constexpr std::int64_t kSilences = 3;

}  // namespace

/// The sender, if it is one to listen to; each refusal is counted.
Peer* Exchange::accept(std::span<const std::byte> datagram, DatagramHeader& header,
                       std::int64_t now_us) noexcept {
  ++counted_.received;
  counted_.received_bytes += datagram.size();
  const auto refuse = [](std::uint64_t& counter) -> Peer* {
    ++counter;
    return nullptr;
  };
  if (datagram.size() < kHeaderBytes + kTagBytes || datagram.size() > kMostDatagramBytes)
    return refuse(counted_.refused_size);
  ByteReader reader(datagram.first(kHeaderBytes));
  if (!read_header(reader, header)) return refuse(counted_.refused_format);
  const std::span<const std::byte> message = datagram.first(datagram.size() - kTagBytes);
  if (!authenticator_.check(authenticator_.context, message, datagram.last<kTagBytes>()))
    return refuse(counted_.refused_tag);
  if (header.sender == config_.robot) {
    return refuse(header.session == config_.session ? counted_.own_echoes : counted_.refused_robot);
  }
  if (is_excluded(header.sender)) return refuse(counted_.refused_excluded);
  // A repeat is not worth the check of a signature.
  const Peer* const known = peers_.find(header.sender);
  if (is_control(header.kind) && known != nullptr &&
      !PeerTable::is_new(*known, header.session, header.sequence))
    return refuse(counted_.refused_replay);
  if (header.is_signed != signatures_.on() || !is_signed_by_sender(header, message))
    return refuse(counted_.refused_signature);
  Peer* const peer = peers_.find_or_add(header.sender, now_us);
  if (peer == nullptr) return refuse(counted_.refused_peers);
  bool later = true;
  if (is_control(header.kind)) {
    PeerTable::note(*peer, header.session, header.sequence);
  } else {
    later = PeerTable::note_data(*peer, header.session, header.sequence);
  }
  if (later) peer->heard_us = now_us;
  ++peer->datagrams;
  if (header.configuration != configuration_ && header.kind != DatagramKind::kAnnounce)
    return refuse(counted_.refused_configuration);
  return peer;
}

void Exchange::receive(std::span<const std::byte> datagram, std::int64_t now_us) noexcept {
  DatagramHeader header;
  Peer* const peer = accept(datagram, header, now_us);
  if (peer == nullptr) return;
  const std::size_t end =
      kTagBytes + (header.is_signed && is_control(header.kind) ? kSignatureBytes : 0);
  ByteReader body(datagram.subspan(kHeaderBytes, datagram.size() - kHeaderBytes - end));
  if (!hear(*peer, header, body, now_us)) ++counted_.refused_body;
}

/// False iff the body is none of its kind.
bool Exchange::hear(Peer& peer, const DatagramHeader& header, ByteReader& body,
                    std::int64_t now_us) noexcept {
  // Of control messages that overtook each other the last one counts.
  const bool last = header.session == peer.session && header.sequence == peer.sequence;
  switch (header.kind) {
    case DatagramKind::kAnnounce: {
      ConfigurationDetails details;
      if (!read_details(body, details)) return false;
      peer.left = peer.left && !last;
      peer.mismatch.reset();
      if (header.configuration == configuration_)
        return hear_announcement(body, header, last, now_us);
      // Its own, so that it can be said what is different.
      peer.mismatch = details;
      ++counted_.refused_configuration;
      return true;
    }
    case DatagramKind::kRequest:
      return hear_request(body, now_us);
    case DatagramKind::kChunk:
      return hear_chunk(body, now_us);
    case DatagramKind::kFrame:
      return hear_frame(body);
    case DatagramKind::kLeave:
      peer.left = peer.left || last;
      return body.remaining() == 0;
  }
  return false;
}

/// last: its sender said nothing after it. What an origin says of what it is publishing counts.
bool Exchange::hear_announcement(ByteReader& body, const DatagramHeader& header, bool last,
                                 std::int64_t now_us) noexcept {
  AnnouncedContribution announced;
  for (ByteReader all = body; all.remaining() != 0;) {
    if (!read_announced(all, announced)) return false;
  }
  while (body.remaining() != 0 && read_announced(body, announced)) {
    const bool of_origin = last && announced.origin && announced.id.robot == header.sender;
    hear_announced(announced, of_origin, now_us);
  }
  return true;
}

/// A contribution of this robot's that it has not opened, in an epoch that nobody can have heard
/// of.
bool Exchange::is_own_to_come(const ContributionId& id) const noexcept {
  return id.robot == config_.robot && id.epoch >= first_epoch_;
}

void Exchange::hear_announced(const AnnouncedContribution& announced, bool of_origin,
                              std::int64_t now_us) noexcept {
  if (find(announced.id) == nullptr && is_own_to_come(announced.id)) {
    ++counted_.impostors;
    return;
  }
  Contribution* const contribution = find_or_add(announced.id);
  if (contribution == nullptr || contribution->excluded) return;
  if (contribution->own) {
    counted_.impostors += announced.latest > contribution->latest ? 1U : 0U;
    return;
  }
  note_latest(*contribution, announced, of_origin, now_us);
  note_lack(*contribution, now_us);
  note_digest(*contribution, announced, of_origin, now_us);
}

void Exchange::note_latest(Contribution& contribution, const AnnouncedContribution& announced,
                           bool of_origin, std::int64_t now_us) const noexcept {
  if (of_origin) {
    // What it said twice is no chunk's forerunner: whoever said more, made it up.
    if (announced.latest == contribution.origin_latest) {
      contribution.latest = announced.latest;
      contribution.announced_frame = announced.frame_revision;
    }
    contribution.origin_latest = announced.latest;
    contribution.origin_us = now_us;
  } else if (now_us - contribution.origin_us <= kSilences * config_.announce_us) {
    return;
  }
  contribution.latest = std::max(contribution.latest, announced.latest);
  contribution.announced_frame = std::max(contribution.announced_frame, announced.frame_revision);
}

/// Who knows of the same versions and holds something else has what this robot believes to be
/// superseded, or lacks it: what superseded it went down with its origin. Then all is asked for.
void Exchange::note_digest(Contribution& contribution, const AnnouncedContribution& announced,
                           bool of_origin, std::int64_t now_us) noexcept {
  if (contribution.open && contribution.digest == announced.digest) {
    contribution.different_us = kLongAgo;
    contribution.all_pause_us = 0;
    return;
  }
  contribution.different_us = now_us;
  if (contribution.request_due_us != kNever && !contribution.full) {
    contribution.request_pause_us =
        std::min(contribution.request_pause_us, config_.request_most_us);
    contribution.request_due_us =
        std::min(contribution.request_due_us, now_us + 2 * config_.request_most_us);
  }
  // Who has all that there is only has to be asked once more.
  const bool settled =
      announced.complete ? contribution.complete() : contribution.requests > kPatience;
  if (!settled || contribution.latest != announced.latest || now_us < contribution.all_due_us)
    return;
  ++counted_.diverged;
  // What is covered beyond is of one who claimed too much.
  if (of_origin) contribution.coverage.trim(announced.latest);
  contribution.all_due_us = kNever;  // until it is asked for
  if (contribution.request_due_us == kNever) {
    contribution.requests = 0;
    contribution.request_pause_us = config_.request_us;
  }
  contribution.request_due_us = std::min(
      contribution.request_due_us, now_us + config_.request_us + random_us(config_.request_us));
}

/// Sees to it that what is lacking is asked for, or no more.
void Exchange::note_lack(Contribution& contribution, std::int64_t now_us) noexcept {
  const bool wants_all = contribution.all_due_us == kNever;
  if (contribution.own || contribution.excluded || (contribution.complete() && !wants_all)) {
    contribution.request_due_us = kNever;
    return;
  }
  if (contribution.request_due_us != kNever) return;
  contribution.requests = 0;
  contribution.request_pause_us = config_.request_us;
  contribution.request_due_us = now_us + config_.request_us + random_us(config_.request_us);
}

}  // namespace tessera
