// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which records are sent next, new ones and those that others wait for, and the chunks of them.
#include <algorithm>

#include "tessera/exchange/internal/sender.hpp"

namespace tessera {

namespace {

constexpr std::size_t kFreshBatch = 0;
constexpr std::size_t kAnswerBatch = 1;
/// New blocks, answers, single records and descriptions take turns.
constexpr std::uint32_t kTurns = 4;

}  // namespace

void Sender::note_fresh(BlockKey key, VersionRange versions) noexcept {
  for (std::uint32_t version = versions.first; version <= versions.last; ++version) {
    if (fresh_count_ == fresh_.size()) {
      fresh_first_ = (fresh_first_ + 1) % fresh_.size();
      --fresh_count_;
    }
    fresh_[(fresh_first_ + fresh_count_++) % fresh_.size()] = {key, version};
  }
}

/// As collect(), of what was published last: O(kMostParts), or what collect() takes where more
/// waits than is noted.
void Sender::collect_fresh(const Ledger& ledger, Batch& batch) noexcept {
  if (fresh_count_ == 0 || fresh_[fresh_first_].version != batch.range.first) {
    if (fresh_count_ != 0) batch.range.last = fresh_[fresh_first_].version - 1;
    static_cast<void>(collect(ledger, batch));
    return;
  }
  batch.count = batch.next = 0;
  const Replicas& replicas = ledger.replicas();
  const Replicas::Slot slot = ledger.places()[batch.contribution].slot;
  while (fresh_count_ != 0 && batch.count < Batch::kMostParts) {
    const Fresh& fresh = fresh_[fresh_first_];
    const Replicas::Replica* part = replicas.find(slot, fresh.key);
    while (part != nullptr && (part->version != fresh.version || part->live == 0))
      part = replicas.next_part(*part);
    // Else it is superseded already.
    if (part != nullptr && part->latest())
      batch.parts[batch.count++] = {replicas.number_of(*part), fresh.version};
    batch.range.last = fresh.version;
    fresh_first_ = (fresh_first_ + 1) % fresh_.size();
    --fresh_count_;
  }
}

/// The batch of what was published and has not gone out.
bool Sender::next_fresh(Making& make) noexcept {
  Batch& batch = batches_[kFreshBatch];
  const Ledger::Contribution* const own = make.ledger.publishing();
  if (own == nullptr) return false;
  if (!batch.empty() && batch.generation == own->generation &&
      batch.contribution == make.ledger.number_of(*own))
    return true;
  if (sent_ >= own->latest) return false;
  batch.contribution = make.ledger.number_of(*own);
  batch.generation = own->generation;
  batch.range = {sent_ + 1, own->latest};
  collect_fresh(make.ledger, batch);
  sent_ = batch.range.last;
  return true;
}

bool Sender::may_answer(Making& make, std::uint32_t asker) noexcept {
  Peer* const peer = make.gate.peers().find(asker);
  if (peer == nullptr) return false;
  const std::int64_t elapsed_us =
      std::clamp<std::int64_t>((make.now - peer->walk_at).us, 0, 10'000'000);
  if (const std::int64_t earned = elapsed_us * kWalkPerSecond / 1'000'000; earned != 0) {
    peer->walk = std::min(Peer::kMostWalk, peer->walk + earned);
    peer->walk_at = make.now;
  }
  if (peer->walk > 0 && answers_.may_ask(*peer, make.ledger, make.now)) return true;
  ++make.counted.refused_answers;
  return false;
}

/// What an even spread of versions takes is free, if it found something.
void Sender::note_walk(Making& make, std::uint32_t asker, std::size_t visited,
                       bool found) noexcept {
  const std::size_t free = found ? kFreeWalk : 0;
  if (!found) visited = std::max(visited, kLeastInVain);
  Peer* const peer = make.gate.peers().find(asker);
  if (peer != nullptr && visited > free) peer->walk -= static_cast<std::int64_t>(visited - free);
}

/// The batch of the answer whose turn it is.
bool Sender::next_answer(Making& make) noexcept {
  Batch& batch = batches_[kAnswerBatch];
  const auto is_there = [&](std::uint32_t contribution, std::uint32_t generation) {
    const Ledger::Contribution& place = make.ledger.places()[contribution];
    return place.used && place.open && place.generation == generation;
  };
  if (!batch.empty() && is_there(batch.contribution, batch.generation)) return true;
  batch.range = {};
  while (Answers::Range* const answer = answers_.next(make.gate.peers(), make.now)) {
    if (!is_there(answer->contribution, answer->generation) || !may_answer(make, answer->asker)) {
      answers_.remove(*answer);
      continue;
    }
    batch.contribution = answer->contribution;
    batch.generation = answer->generation;
    batch.asker = answer->asker;
    batch.range = answer->range;
    note_walk(make, batch.asker, collect(make.ledger, batch));
    // All hear it.
    static_cast<void>(answers_.drop(batch.contribution, batch.range));
    return true;
  }
  return false;
}

/// The parts of the lowest versions in the batch's range; if there are more than it holds, the
/// range ends with the last of them. Versions are all different, but for what one who has the key
/// makes up: so many of one version that they do not fit are cut short. O(records in the range,
/// and kMostParts more).
std::size_t Sender::collect(const Ledger& ledger, Batch& batch) noexcept {
  batch.count = batch.next = 0;
  const Ledger::Contribution& contribution = ledger.places()[batch.contribution];
  const auto later = [](const Batch::Part& a, const Batch::Part& b) {
    return a.version < b.version;
  };
  // The first count parts, a heap with the latest on top.
  const auto heap = [&batch] { return std::span(batch.parts).subspan(0, batch.count); };
  const std::size_t visited = contribution.index.visit(
      ledger.links(), batch.range,
      [&](std::uint32_t number) {
        const Replicas::Replica& part = ledger.replicas().record(number);
        const bool within = batch.range.first <= part.version && part.version <= batch.range.last;
        if (!part.latest() || !within) return;
        if (batch.count == Batch::kMostParts) {
          std::pop_heap(heap().begin(), heap().end(), later);
          --batch.count;
          // Whatever is beyond the last that stays is left for the next batch.
          batch.range.last = batch.parts[batch.count].version - 1;
          if (part.version > batch.range.last) return;
        }
        batch.parts[batch.count++] = {number, part.version};
        std::push_heap(heap().begin(), heap().end(), later);
      },
      [&](std::uint32_t last) { return last < batch.range.last; });
  std::sort_heap(heap().begin(), heap().end(), later);
  batch.range.last = std::max(batch.range.last, batch.range.first);
  while (batch.count != 0 && batch.parts[batch.count - 1].version > batch.range.last) --batch.count;
  return visited;
}

bool Sender::write_chunk(Making& make, ByteWriter& to) noexcept {
  make.kind = DatagramKind::kChunk;
  const auto try_turn = [&](std::uint32_t turn) {
    switch (turn) {
      case 0:
        if (!next_fresh(make)) return false;
        ++make.counted.fresh_chunks;
        write_batch(make, to, batches_[kFreshBatch]);
        return true;
      case 1:
        if (!next_answer(make)) return false;
        ++make.counted.answer_chunks;
        make.for_asker = true;
        make.asker = batches_[kAnswerBatch].asker;
        write_batch(make, to, batches_[kAnswerBatch]);
        return true;
      case 2:
        if (!write_picks(make, to)) return false;
        ++make.counted.answer_chunks;
        return true;
      default:
        return write_descriptions(make, to);
    }
  };
  for (std::uint32_t i = 0; i < kTurns; ++i) {
    turn_ = (turn_ + 1) % kTurns;
    if (try_turn(turn_)) return true;
  }
  return false;
}

/// One leaf of the tree is the statement's. False: it does not fit any more.
bool Sender::write_record(Making& make, RecordWriter& writer,
                          const Ledger::Contribution& contribution,
                          const Replicas::Replica& part) noexcept {
  const ChunkRecord record = make.ledger.record_of(part);
  if (contribution.own && tree_->count() + 1 >= HashTree::kMostLeaves) return false;
  if (!writer.write(record)) return false;
  if (contribution.own && make.gate.signatures().on()) tree_->add(leaf_of(record.version.hash));
  return true;
}

void Sender::finish_chunk(Making& make, ByteWriter& again, ChunkHeader& header,
                          const Ledger::Contribution& contribution) noexcept {
  if (contribution.own) header.statement = make.ledger.statement_of(contribution, header.range);
  write_chunk_header(again, header);
  needs_signature_ = needs_signature_ && contribution.own;
  if (!needs_signature_) return;
  tree_->add(leaf_of(make.gate.signatures(), header.statement));
  sign_root(make, contribution.id);
}

/// As much of the batch as fits.
void Sender::write_batch(Making& make, ByteWriter& to, Batch& batch) noexcept {
  const Ledger::Contribution& contribution = make.ledger.places()[batch.contribution];
  // The range's end is known only when it is written.
  ByteWriter again = to;
  ChunkHeader header{.id = contribution.id, .range = batch.range, .relayed = !contribution.own};
  if (needs_signature_ && contribution.own) to.keep_free(kSignatureBytes);
  write_chunk_header(to, header);
  RecordWriter writer(to, batch.range);
  std::uint32_t said = 0;
  tree_->clear();
  for (; batch.next < batch.count; ++batch.next) {
    const Batch::Part& next = batch.parts[batch.next];
    const Replicas::Replica& part = make.ledger.replicas().record(next.record);
    // Superseded since: what superseded it will be sent.
    if (part.version != next.version || part.live == 0 || part.slot != contribution.slot ||
        part.version == said)
      continue;
    if (!write_record(make, writer, contribution, part)) {
      // One record always fits.
      TESSERA_ASSERT(said != 0);
      header.range.last = std::max(header.range.first, next.version - 1);
      break;
    }
    said = part.version;
  }
  batch.range.first = header.range.last + 1;
  finish_chunk(make, again, header, contribution);
}

/// Single records of one contribution, as many as are next to each other in the ring and fit.
bool Sender::write_picks(Making& make, ByteWriter& to) noexcept {
  auto& picks = answers_.picks();
  const auto records_of = [&](const Answers::Pick& pick) -> Ledger::OfVersion {
    const Ledger::Contribution& place = make.ledger.places()[pick.contribution];
    // What was asked for may be more than it looked like: many blocks of one version.
    if (!place.used || !place.open || place.generation != pick.generation ||
        !may_answer(make, pick.asker))
      return {};
    const Ledger::OfVersion found = make.ledger.find_version(place, pick.version, pick.place);
    note_walk(make, pick.asker, found.visited, found.part != nullptr);
    return found;
  };
  Ledger::OfVersion found;
  std::size_t in_vain = 0;
  while (picks.count != 0 && in_vain < kMostInVain &&
         (found = records_of(picks.front())).part == nullptr) {
    picks.pop();
    in_vain += found.visited;
  }
  if (found.part == nullptr) return false;
  const Answers::Pick first = picks.front();
  const Ledger::Contribution& contribution = make.ledger.places()[first.contribution];
  ByteWriter again = to;
  ChunkHeader header{.id = contribution.id,
                     .range = {first.version, first.version},
                     .relayed = !contribution.own,
                     .partial = true};
  if (needs_signature_ && contribution.own) to.keep_free(kSignatureBytes);
  write_chunk_header(to, header);
  RecordWriter writer(to, {first.version, kLastVersion});
  tree_->clear();
  std::uint32_t last = 0;
  while (picks.count != 0) {
    Answers::Pick& next = picks.front();
    if (next.contribution != first.contribution || next.asker != first.asker ||
        next.version <= last)
      break;
    if (last != 0) found = records_of(next);
    if (found.part != nullptr) {
      if (!write_record(make, writer, contribution, *found.part)) break;
      last = next.version;
      // A chunk has a version once.
      if (++next.place < found.count) break;
    } else if ((in_vain += found.visited) > kMostInVain) {
      break;
    }
    picks.pop();
  }
  TESSERA_ASSERT(last != 0);
  header.range.last = last;
  make.for_asker = true;
  make.asker = first.asker;
  finish_chunk(make, again, header, contribution);
  return true;
}

}  // namespace tessera
