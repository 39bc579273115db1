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

/// Whether its sender is one to listen to; each refusal is counted.
bool Exchange::accept(std::span<const std::byte> datagram, Heard& heard,
                      std::int64_t now_us) noexcept {
  ++counted_.received;
  counted_.received_bytes += datagram.size();
  const auto refuse = [](std::uint64_t& counter) {
    ++counter;
    return false;
  };
  if (datagram.size() < kHeaderBytes + kTagBytes || datagram.size() > kMostDatagramBytes)
    return refuse(counted_.refused_size);
  ByteReader reader(datagram.first(kHeaderBytes));
  DatagramHeader& header = heard.header;
  if (!read_header(reader, header)) return refuse(counted_.refused_format);
  const std::span<const std::byte> message = datagram.first(datagram.size() - kTagBytes);
  if (!authenticator_.check(authenticator_.context, message, datagram.last<kTagBytes>()))
    return refuse(counted_.refused_tag);
  if (header.sender == config_.robot) {
    return refuse(header.session == config_.session ? counted_.own_echoes : counted_.refused_robot);
  }
  if (is_excluded(header.sender)) return refuse(counted_.refused_excluded);
  // A repeat is not worth the check of a signature.
  heard.peer = peers_.find(header.sender);
  if (is_control(header.kind) && heard.peer != nullptr &&
      !heard.peer->control.is_new(header.session, header.sequence))
    return refuse(counted_.refused_replay);
  if (header.is_signed != signatures_.on() || !is_signed_by_sender(header, message))
    return refuse(counted_.refused_signature);
  return note_peer(heard, now_us);
}

/// With signatures only what is signed makes a peer, or is a sign of its life.
bool Exchange::note_peer(Heard& heard, std::int64_t now_us) noexcept {
  const DatagramHeader& header = heard.header;
  const bool proven = !signatures_.on() || is_control(header.kind);
  if (proven) heard.peer = peers_.find_or_add(header.sender, now_us);
  if (proven && heard.peer == nullptr) {
    ++counted_.refused_peers;
    return false;
  }
  if (heard.peer != nullptr) {
    SequenceWindow& window = is_control(header.kind) ? heard.peer->control : heard.peer->data;
    heard.is_new = window.is_new(header.session, header.sequence);
    if (heard.is_new) window.note(header.session, header.sequence);
    if (heard.is_new && proven) heard.peer->heard_us = now_us;
  }
  if (heard.peer != nullptr) ++heard.peer->datagrams;
  if (header.configuration != configuration_ && header.kind != DatagramKind::kAnnounce) {
    ++counted_.refused_configuration;
    return false;
  }
  return true;
}

void Exchange::receive(std::span<const std::byte> datagram, std::int64_t now_us) noexcept {
  Heard heard;
  if (!accept(datagram, heard, now_us)) return;
  const bool ends_signed = heard.header.is_signed && is_control(heard.header.kind);
  const std::size_t end = kTagBytes + (ends_signed ? kSignatureBytes : 0);
  ByteReader body(datagram.subspan(kHeaderBytes, datagram.size() - kHeaderBytes - end));
  if (!hear(heard, body, now_us)) ++counted_.refused_body;
}

/// False iff the body is none of its kind.
bool Exchange::hear(const Heard& heard, ByteReader& body, std::int64_t now_us) noexcept {
  switch (heard.header.kind) {
    case DatagramKind::kAnnounce:
      return hear_announcement(heard, body, now_us);
    case DatagramKind::kRequest:
      return hear_request(body, now_us);
    case DatagramKind::kChunk:
      return hear_chunk(body, heard.is_new, now_us);
    case DatagramKind::kFrame:
      return hear_frame(body, heard.is_new);
    case DatagramKind::kLeave:
      if (body.remaining() != 0) return false;
      heard.peer->left = heard.peer->left || is_last(heard);
      return true;
  }
  return false;
}

/// Of control messages that overtook each other the last one counts.
bool Exchange::is_last(const Heard& heard) noexcept {
  return heard.header.session == heard.peer->control.session &&
         heard.header.sequence == heard.peer->control.sequence;
}

bool Exchange::hear_announcement(const Heard& heard, ByteReader& body,
                                 std::int64_t now_us) noexcept {
  ConfigurationDetails details;
  AnnouncedContribution announced;
  if (!read_details(body, details)) return false;
  for (ByteReader all = body; all.remaining() != 0;) {
    if (!read_announced(all, announced)) return false;
  }
  const bool last = is_last(heard);
  heard.peer->left = heard.peer->left && !last;
  heard.peer->mismatch.reset();
  if (heard.header.configuration != configuration_) {
    // Its own, so that it can be said what is different.
    heard.peer->mismatch = details;
    ++counted_.refused_configuration;
    return true;
  }
  // What an origin says of what it is publishing counts.
  while (body.remaining() != 0 && read_announced(body, announced)) {
    const bool of_origin = last && announced.origin && announced.id.robot == heard.header.sender;
    hear_announced(announced, of_origin, now_us);
  }
  return true;
}

/// Of this robot, in an epoch in which only it speaks, and not opened by it.
bool Exchange::is_own_to_come(const ContributionId& id) noexcept {
  if (id.robot != config_.robot || id.epoch < first_epoch_) return false;
  const Contribution* const known = find(id);
  return known == nullptr || !known->own;
}

void Exchange::hear_announced(const AnnouncedContribution& announced, bool of_origin,
                              std::int64_t now_us) noexcept {
  if (is_own_to_come(announced.id)) {
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
