// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What arrives: who may speak, and what is done with each kind of datagram.
#include <algorithm>

#include "tessera/exchange/block_codec.hpp"
#include "tessera/exchange/exchange.hpp"

namespace tessera {

namespace {

/// Announcements that an origin misses before others are believed of what it has.
constexpr std::int64_t kSilences = 3;

constexpr bool is_control(DatagramKind kind) noexcept {
  return kind == DatagramKind::kAnnounce || kind == DatagramKind::kRequest ||
         kind == DatagramKind::kLeave;
}

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
  Peer* const peer = peers_.find_or_add(header.sender, now_us);
  if (peer == nullptr) return refuse(counted_.refused_peers);
  bool later = true;
  if (!is_control(header.kind)) {
    later = PeerTable::note_data(*peer, header.session, header.sequence);
  } else if (PeerTable::is_new(*peer, header.session, header.sequence)) {
    PeerTable::note(*peer, header.session, header.sequence);
  } else {
    return refuse(counted_.refused_replay);
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
  ByteReader body(datagram.subspan(kHeaderBytes, datagram.size() - kHeaderBytes - kTagBytes));
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

bool Exchange::hear_chunk(ByteReader& body, std::int64_t now_us) noexcept {
  ChunkHeader header;
  if (!read_chunk_header(body, header)) return false;
  if (find(header.id) == nullptr && is_own_to_come(header.id)) {
    ++counted_.impostors;
    return true;
  }
  Contribution* const contribution = find_or_add(header.id);
  if (contribution == nullptr || contribution->excluded) return true;
  const bool same = header.all && header.digest == contribution->digest;
  if (contribution->own) {
    counted_.impostors += header.range.last > contribution->latest ? 1U : 0U;
    drop_answers(number_of(*contribution), header.range, same);
    return true;
  }
  contribution->latest = std::max(contribution->latest, header.range.last);
  if (!contribution->open) {
    ++counted_.records_early;
    note_lack(*contribution, now_us);
    return true;
  }
  const Taken taken = take_records(*contribution, body, header.range);
  if (taken.well_formed) drop_answers(number_of(*contribution), header.range, same);
  if (taken.grew || taken.refused) contribution->full = taken.refused;
  // While something comes, the rest may too.
  if (taken.grew && !taken.refused && contribution->request_due_us != kNever) {
    contribution->requests = 0;
    contribution->request_pause_us = config_.request_us;
    contribution->request_due_us = now_us + config_.request_us + random_us(config_.request_us);
  }
  note_lack(*contribution, now_us);
  return taken.well_formed;
}

/// What is refused stays a gap. Where a record is none, what came before it is taken, and nothing
/// is known of the rest.
Exchange::Taken Exchange::take_records(Contribution& contribution, ByteReader& body,
                                       VersionRange range) noexcept {
  Taken taken;
  RecordReader reader(body, range);
  ChunkRecord record;
  std::uint32_t first = range.first;
  while (body.remaining() != 0) {
    if (!reader.read(record)) return {.well_formed = false};
    const Result<BlockKey> key = pack(record.block);
    TESSERA_ASSERT(key.ok());
    if (store_.replicas->news(contribution.slot, *key, record.version) == 0) {
      ++counted_.records_stale;
      continue;
    }
    content_.clear();
    if (decode_block(record.coded, record.version.layers, num_components_, content_) != Status::kOk)
      return {.well_formed = false};
    if (put(contribution, *key, record.version, content_, record.coded).ok()) {
      ++counted_.records_taken;
      continue;
    }
    ++counted_.records_refused;
    taken.refused = true;
    if (first < record.version.number)
      taken.grew |= contribution.coverage.add({first, record.version.number - 1});
    first = record.version.number + 1;
  }
  if (first <= range.last) taken.grew |= contribution.coverage.add({first, range.last});
  return taken;
}

bool Exchange::hear_frame(ByteReader& body) noexcept {
  FrameBody frame;
  if (!read_frame(body, frame) || body.remaining() != 0) return false;
  if (find(frame.id) == nullptr && is_own_to_come(frame.id)) {
    ++counted_.impostors;
    return true;
  }
  Contribution* const contribution = find_or_add(frame.id);
  if (contribution == nullptr || contribution->excluded || contribution->own) return true;
  if (frame.revision >= contribution->frame_revision) contribution->frame_due_us = kNever;
  if (frame.revision <= contribution->frame_revision) return true;
  const Status status = set_frame(*contribution, frame.T_global_map, frame.revision);
  if (status == Status::kResourceExhausted) ++counted_.refused_contributions;
  return status != Status::kInvalidArgument;
}

}  // namespace tessera
