// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is sent next: announcements, frames, requests, new blocks and answers, under a budget.
#include <algorithm>

#include "tessera/exchange/exchange.hpp"

namespace tessera {

namespace {

constexpr std::size_t kFreshBatch = 0;
constexpr std::size_t kAnswerBatch = 1;
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

  const std::size_t end = kTagBytes + (signatures_.on() ? kSignatureBytes : 0);
  ByteWriter to(into.first(kMostDatagramBytes - end));
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
  kind = DatagramKind::kFrame;
  if (write_due_frame(to, now_us)) return true;
  kind = DatagramKind::kAnnounce;
  if (write_announcement(to, now_us)) return true;
  kind = DatagramKind::kRequest;
  if (write_request(to, now_us)) return true;
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
      signatures_.sign(signatures_.context, frame_message(frame), signature_);
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
    if (!write_requested(to, requested)) return any;
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

/// The batch of what was published and has not gone out.
bool Exchange::next_fresh() noexcept {
  Batch& batch = batches_[kFreshBatch];
  if (!batch.empty()) return true;
  if (publishing_ == kNobody) return false;
  const Contribution& own = contributions_[publishing_];
  if (sent_ >= own.latest) return false;
  batch.contribution = publishing_;
  batch.range = {sent_ + 1, own.latest};
  collect_fresh(batch);
  sent_ = batch.range.last;
  return true;
}

/// The batch of the answer that is due first.
bool Exchange::next_answer(std::int64_t now_us) noexcept {
  Batch& batch = batches_[kAnswerBatch];
  if (!batch.empty()) return true;
  std::size_t first = waiting_answers_;
  for (std::size_t i = 0; i < waiting_answers_; ++i) {
    if (answers_[i].due_us > now_us) continue;
    if (first == waiting_answers_ || answers_[i].due_us < answers_[first].due_us) first = i;
  }
  if (first == waiting_answers_) return false;
  Answer& answer = answers_[first];
  batch.contribution = answer.contribution;
  batch.range = answer.range;
  batch.all = answer.all;
  collect(batch);
  if (batch.range.last == answer.range.last) {
    answer = answers_[--waiting_answers_];
  } else {
    answer.range.first = batch.range.last + 1;
  }
  return true;
}

/// The parts of the lowest versions in the batch's range; if there are more than it holds, the
/// range ends with the last of them. Versions are all different, but for what one who has the key
/// makes up: so many of one version that they do not fit are cut short. O(parts of the contribution
/// * log kMostParts).
void Exchange::collect(Batch& batch) noexcept {
  batch.count = batch.next = 0;
  const Contribution& contribution = contributions_[batch.contribution];
  const Replicas& replicas = *store_.replicas;
  const auto later = [](const Batch::Part& a, const Batch::Part& b) {
    return a.version < b.version;
  };
  // The first count parts, a heap with the latest on top.
  const auto heap = [&batch] { return std::span(batch.parts).subspan(0, batch.count); };
  std::uint32_t at = replicas.contribution(contribution.slot).first_block;
  for (; at != 0; at = replicas.record(at).next) {
    const Replicas::Replica& part = replicas.record(at);
    const bool within = batch.range.first <= part.version && part.version <= batch.range.last;
    if (part.live == 0 || !(part.latest() || batch.all) || !within) continue;
    if (batch.count == Batch::kMostParts) {
      std::pop_heap(heap().begin(), heap().end(), later);
      --batch.count;
      // Whatever is beyond the last that stays is left for the next batch.
      batch.range.last = batch.parts[batch.count].version - 1;
      if (part.version > batch.range.last) continue;
    }
    batch.parts[batch.count++] = {at, part.version};
    std::push_heap(heap().begin(), heap().end(), later);
  }
  std::sort_heap(heap().begin(), heap().end(), later);
  batch.range.last = std::max(batch.range.last, batch.range.first);
  while (batch.count != 0 && batch.parts[batch.count - 1].version > batch.range.last) --batch.count;
}

bool Exchange::write_chunk(ByteWriter& to, std::int64_t now_us) noexcept {
  const bool fresh = next_fresh();
  const bool answer = next_answer(now_us);
  if (!fresh && !answer) return false;
  answered_ = answer && (answer_next_ || !fresh);
  answer_next_ = !answered_;
  ++(answered_ ? counted_.answer_chunks : counted_.fresh_chunks);
  write_batch(to, batches_[answered_ ? kAnswerBatch : kFreshBatch]);
  return true;
}

/// As much of the batch as fits.
void Exchange::write_batch(ByteWriter& to, Batch& batch) noexcept {
  const Contribution& contribution = contributions_[batch.contribution];
  // The range's end is known only when it is written.
  ByteWriter again = to;
  ChunkHeader header{.id = contribution.id,
                     .range = batch.range,
                     .all = batch.all,
                     .digest = contribution.digest,
                     .proofs = signatures_.on() && !contribution.own};
  const bool grows_tree = signatures_.on() && contribution.own;
  write_chunk_header(to, header);
  RecordWriter writer(to, batch.range);
  std::uint32_t said = 0;
  tree_.clear();
  for (; batch.next < batch.count; ++batch.next) {
    const Batch::Part& next = batch.parts[batch.next];
    const Replicas::Replica& part = store_.replicas->record(next.record);
    // Superseded since: what superseded it will be said.
    if (part.version != next.version || part.live == 0 || part.version == said) continue;
    ChunkRecord record{.block = unpack(BlockKey{part.key}),
                       .version = {.number = part.version,
                                   .first = part.version - part.part,
                                   .layers = part.layers},
                       .coded = store_.replicas->read_wire(part, kept_),
                       .proof = {}};
    if (signatures_.on()) {
      const auto proof_bytes = std::to_integer<std::size_t>(record.coded[0]);
      record.proof = record.coded.subspan(1, proof_bytes);
      record.coded = record.coded.subspan(1 + proof_bytes);
    }
    if (tree_.full() || !writer.write(record)) {
      header.range.last = next.version - 1;
      break;
    }
    if (grows_tree) tree_.add(leaf_of(signatures_, contribution.id, record));
    said = part.version;
  }
  write_chunk_header(again, header);
  proofs_ = header.proofs;
  if (grows_tree) {
    const Hash root = tree_.count() == 0 ? Hash{} : tree_.root(signatures_);
    const auto message = root_message(contribution.id, tree_.count(), root);
    signatures_.sign(signatures_.context, message, signature_);
  }
  batch.range.first = header.range.last + 1;
}

}  // namespace tessera
