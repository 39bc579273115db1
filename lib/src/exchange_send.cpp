// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is sent next, under a budget: announcements, frames, requests, chunks.
#include <algorithm>

#include "tessera/exchange/exchange.hpp"

namespace tessera {

namespace {

/// Frames are few and nothing goes without them: they are said unasked with one announcement of so
/// many.
constexpr std::uint64_t kAnnouncementsOfFrame = 8;
/// Announcements for which one who was heard to have something else is expected to be there still:
/// of a hundred, one may arrive.
constexpr std::int64_t kAwaited = 300;

}  // namespace

std::size_t Exchange::send(std::int64_t now_us, std::span<std::byte> into) noexcept {
  TESSERA_ASSERT(into.size() >= kMostDatagramBytes);
  const std::int64_t most = config_.burst_bytes;
  // A pause of a day fills it as one of some minutes does, and nothing overflows.
  const std::int64_t elapsed_us =
      started_ ? std::clamp<std::int64_t>(now_us - budget_us_, 0, 1'000'000'000) : 0;
  const std::int64_t earned = elapsed_us * config_.bytes_per_s / 1'000'000;
  if (!started_) budget_bytes_ = most;
  if (!started_ || earned > 0) budget_us_ = now_us;
  started_ = true;
  budget_bytes_ = std::min(most, budget_bytes_ + earned);
  if (budget_bytes_ < static_cast<std::int64_t>(kMostDatagramBytes)) return 0;

  ByteWriter to(into.first(kMostDatagramBytes - kTagBytes));
  DatagramHeader header{.kind = DatagramKind::kAnnounce,
                        .configuration = configuration_,
                        .sender = config_.robot,
                        .session = config_.session,
                        .sequence = 0,
                        .is_signed = signatures_.on()};
  write_header(to, header);
  if (!write_body(header.kind, to, now_us)) return 0;
  TESSERA_ASSERT(to.ok());
  header.sequence = is_control(header.kind) ? ++control_sequence_ : ++data_sequence_;
  ByteWriter again(into.first(kHeaderBytes));
  write_header(again, header);
  const std::size_t tagged = sign(header.kind, into, to.size());
  const std::size_t size = tagged + kTagBytes;
  authenticator_.tag(authenticator_.context, into.first(tagged),
                     into.subspan(tagged).first<kTagBytes>());
  budget_bytes_ -= static_cast<std::int64_t>(size);
  ++counted_.sent;
  counted_.sent_bytes += size;
  if (header.kind == DatagramKind::kChunk && answered_) counted_.answer_bytes += size;
  return size;
}

bool Exchange::write_body(DatagramKind& kind, ByteWriter& to, std::int64_t now_us) noexcept {
  if (leave_due_) {
    leave_due_ = false;
    kind = DatagramKind::kLeave;
    return true;
  }
  if (announce_soon_) {
    announce_due_us_ = std::min(announce_due_us_, now_us + config_.announce_soon_us);
    announce_soon_ = false;
  }
  ByteWriter before_signature = to;
  if (signatures_.on()) before_signature.keep_free(kSignatureBytes);
  kind = DatagramKind::kFrame;
  bool any = write_due_frame(before_signature, now_us);
  if (!any) {
    kind = DatagramKind::kAnnounce;
    any = write_announcement(before_signature, now_us);
  }
  if (!any) {
    kind = DatagramKind::kRequest;
    any = write_request(before_signature, now_us);
  }
  if (any) {
    to = before_signature;
    return true;
  }
  kind = DatagramKind::kChunk;
  return write_chunk(to, now_us);
}

/// As many contributions as fit, this robot's first, the others in turn.
bool Exchange::write_announcement(ByteWriter& to, std::int64_t now_us) noexcept {
  if (now_us < announce_due_us_) return false;
  announce_due_us_ =
      now_us + config_.announce_us - config_.announce_us / 10 + random_us(config_.announce_us / 5);
  write_details(to, details_);
  const auto announce = [&](const Contribution& contribution) {
    return write_announced(to, {.id = contribution.id,
                                .latest = contribution.latest,
                                .frame_revision = contribution.frame_revision,
                                .complete = contribution.complete(),
                                .origin = contribution.own,
                                .digest = contribution.digest});
  };
  const bool with_frames = counted_.announcements % kAnnouncementsOfFrame == 0;
  for (Contribution& contribution : contributions_.first(known_)) {
    if (contribution.own && with_frames) contribution.frame_due_us = now_us;
    if (contribution.own && !announce(contribution)) break;
  }
  for (std::uint32_t i = 0; i < known_; ++i) {
    if (announced_next_ >= known_) announced_next_ = 0;
    const Contribution& contribution = contributions_[announced_next_];
    if (contribution.open && !contribution.own && !announce(contribution)) break;
    ++announced_next_;
  }
  ++counted_.announcements;
  return true;
}

bool Exchange::write_due_frame(ByteWriter& to, std::int64_t now_us) noexcept {
  for (Contribution& contribution : contributions_.first(known_)) {
    if (now_us < contribution.frame_due_us) continue;
    contribution.frame_due_us = kNever;
    ++counted_.frames;
    const FrameBody frame{.id = contribution.id,
                          .revision = contribution.frame_revision,
                          .T_global_map = contribution.T_global_map};
    signature_ = contribution.frame_signature;
    if (signatures_.on() && contribution.own)
      signatures_.sign(signatures_.context, frame_message(configuration_, frame), signature_);
    return write_frame(to, frame);
  }
  return false;
}

/// All that is due and fits; each is asked for less and less often while nothing comes.
bool Exchange::write_request(ByteWriter& to, std::int64_t now_us) noexcept {
  bool any = false;
  for (Contribution& contribution : contributions_.first(known_)) {
    if (now_us < contribution.request_due_us) continue;
    RequestedContribution requested{.id = contribution.id,
                                    .frame_revision = contribution.frame_revision,
                                    .all = contribution.all_due_us == kNever,
                                    .digest = contribution.digest};
    if (contribution.open && !requested.all) {
      requested.gaps =
          static_cast<std::uint8_t>(contribution.coverage.gaps(contribution.latest, requested.gap));
    }
    if (!write_requested(to, requested)) break;
    any = true;
    if (requested.all) {
      contribution.all_pause_us =
          std::clamp(2 * contribution.all_pause_us, 2 * config_.request_most_us,
                     std::max(2 * config_.request_most_us, config_.request_idle_us));
      contribution.all_due_us = now_us + contribution.all_pause_us;
    }
    const bool awaited = now_us - contribution.different_us <= kAwaited * config_.announce_us;
    const bool soon = !contribution.full && (++contribution.requests <= kPatience || awaited);
    contribution.request_pause_us =
        std::min(2 * contribution.request_pause_us,
                 soon ? config_.request_most_us : config_.request_idle_us);
    contribution.request_due_us =
        now_us + contribution.request_pause_us + random_us(contribution.request_pause_us);
    note_lack(contribution, now_us);
  }
  counted_.requests += any ? 1U : 0U;
  return any;
}

}  // namespace tessera
