// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/chunk_writer.hpp"

#include <algorithm>

namespace tessera {

namespace {

constexpr std::size_t kFreshBatch = 0;
constexpr std::size_t kAnswerBatch = 1;
/// New blocks, answers, single records and descriptions take turns.
constexpr std::uint32_t kTurns = 4;

}  // namespace

Result<ChunkWriter> ChunkWriter::make(Arena& arena, const ExchangeConfig& config) noexcept {
  ChunkWriter made;
  const Result<Answers> answers = Answers::make(arena, config);
  const Result<FreshRecords> fresh = FreshRecords::make(arena, config.fresh);
  made.batches_ = arena.take<RecordBatch>(kBatches);
  made.description_ = arena.take<Description>(1).data();
  if (!answers.ok() || !fresh.ok() || made.batches_.empty() || made.description_ == nullptr)
    return Status::kResourceExhausted;
  made.answers_ = *answers;
  made.fresh_ = *fresh;
  return made;
}

void ChunkWriter::begin_own() noexcept {
  sent_ = 0;
  fresh_.clear();
  for (RecordBatch& batch : batches_) batch.range = {};
}

/// The batch of what was published and has not gone out.
bool ChunkWriter::next_fresh(Outgoing& out) noexcept {
  RecordBatch& batch = batches_[kFreshBatch];
  const Ledger::Contribution* const own = out.ledger.publishing();
  if (own == nullptr) return false;
  if (!batch.empty() && batch.generation == own->generation &&
      batch.contribution == out.ledger.number_of(*own))
    return true;
  if (sent_ >= own->latest) return false;
  batch.contribution = out.ledger.number_of(*own);
  batch.generation = own->generation;
  batch.range = {sent_ + 1, own->latest};
  fresh_.collect(out.ledger, batch);
  sent_ = batch.range.last;
  return true;
}

bool ChunkWriter::may_answer(Outgoing& out, std::uint32_t asker) noexcept {
  Peer* const peer = out.gate.peers().find(asker);
  if (peer == nullptr) return false;
  const std::int64_t elapsed_us =
      std::clamp<std::int64_t>((out.now - peer->walk_at).us, 0, 10'000'000);
  if (const std::int64_t earned = elapsed_us * kWalkPerSecond / 1'000'000; earned != 0) {
    peer->walk = std::min(Peer::kMostWalk, peer->walk + earned);
    peer->walk_at = out.now;
  }
  if (peer->walk > 0 && answers_.may_ask(*peer, out.ledger, out.now)) return true;
  ++out.counted.refused_answers;
  return false;
}

/// What an even spread of versions takes is free, if it found something.
void ChunkWriter::note_walk(Outgoing& out, std::uint32_t asker, std::size_t visited,
                            bool found) noexcept {
  const std::size_t free = found ? kFreeWalk : 0;
  if (!found) visited = std::max(visited, kLeastInVain);
  Peer* const peer = out.gate.peers().find(asker);
  if (peer != nullptr && visited > free) peer->walk -= static_cast<std::int64_t>(visited - free);
}

/// The batch of the answer whose turn it is.
bool ChunkWriter::next_answer(Outgoing& out) noexcept {
  RecordBatch& batch = batches_[kAnswerBatch];
  const auto is_there = [&](std::uint32_t contribution, std::uint32_t generation) {
    const Ledger::Contribution& place = out.ledger.place(contribution);
    return place.used && place.open && place.generation == generation;
  };
  if (!batch.empty() && is_there(batch.contribution, batch.generation)) return true;
  batch.range = {};
  while (Answers::Range* const answer = answers_.next(out.gate.peers(), out.now)) {
    if (!is_there(answer->contribution, answer->generation) || !may_answer(out, answer->asker)) {
      answers_.remove(*answer);
      continue;
    }
    batch.contribution = answer->contribution;
    batch.generation = answer->generation;
    batch.asker = answer->asker;
    batch.range = answer->range;
    note_walk(out, batch.asker, batch.collect(out.ledger));
    // All hear it.
    static_cast<void>(answers_.drop(batch.contribution, batch.range));
    return true;
  }
  return false;
}

bool ChunkWriter::write(Outgoing& out, ByteWriter& to) noexcept {
  out.kind = DatagramKind::kChunk;
  const auto try_turn = [&](std::uint32_t turn) {
    switch (turn) {
      case 0:
        if (!next_fresh(out)) return false;
        ++out.counted.fresh_chunks;
        write_batch(out, to, batches_[kFreshBatch]);
        return true;
      case 1:
        if (!next_answer(out)) return false;
        ++out.counted.answer_chunks;
        out.for_asker = true;
        out.asker = batches_[kAnswerBatch].asker;
        write_batch(out, to, batches_[kAnswerBatch]);
        return true;
      case 2:
        if (!write_picks(out, to)) return false;
        ++out.counted.answer_chunks;
        return true;
      default:
        return write_descriptions(out, to);
    }
  };
  for (std::uint32_t i = 0; i < kTurns; ++i) {
    turn_ = (turn_ + 1) % kTurns;
    if (try_turn(turn_)) return true;
  }
  return false;
}

/// One leaf of the tree is the statement's. False: it does not fit any more.
bool ChunkWriter::write_record(Outgoing& out, RecordWriter& writer,
                               const Ledger::Contribution& contribution,
                               const Replicas::Replica& part) noexcept {
  const ChunkRecord record = out.ledger.records().read(part);
  if (contribution.own && out.tree.count() + 1 >= HashTree::kMostLeaves) return false;
  if (!writer.write(record)) return false;
  if (contribution.own && out.gate.signatures().on()) out.tree.add(leaf_of(record.version.hash));
  return true;
}

void ChunkWriter::finish_chunk(Outgoing& out, ByteWriter& again, ChunkHeader& header,
                               const Ledger::Contribution& contribution) noexcept {
  if (contribution.own) header.statement = out.ledger.statement_of(contribution, header.range);
  write_chunk_header(again, header);
  out.needs_signature = out.needs_signature && contribution.own;
  if (!out.needs_signature) return;
  out.tree.add(leaf_of(out.gate.signatures(), header.statement));
  out.sign_root(contribution.id);
}

/// As much of the batch as fits.
void ChunkWriter::write_batch(Outgoing& out, ByteWriter& to, RecordBatch& batch) noexcept {
  const Ledger::Contribution& contribution = out.ledger.place(batch.contribution);
  // The range's end is known only when it is written.
  ByteWriter again = to;
  ChunkHeader header{.id = contribution.id, .range = batch.range, .relayed = !contribution.own};
  if (out.needs_signature && contribution.own) to.keep_free(kSignatureBytes);
  write_chunk_header(to, header);
  RecordWriter writer(to, batch.range);
  std::uint32_t said = 0;
  out.tree.clear();
  for (; batch.next < batch.count; ++batch.next) {
    const RecordBatch::Part& next = batch.parts[batch.next];
    const Replicas::Replica& part = out.ledger.replicas().record(next.record);
    // Superseded since: what superseded it will be sent.
    if (part.version != next.version || part.live == 0 || part.slot != contribution.slot ||
        part.version == said)
      continue;
    if (!write_record(out, writer, contribution, part)) {
      // One record always fits.
      TESSERA_ASSERT(said != 0);
      header.range.last = std::max(header.range.first, next.version - 1);
      break;
    }
    said = part.version;
  }
  batch.range.first = header.range.last + 1;
  finish_chunk(out, again, header, contribution);
}

/// Single records of one contribution, as many as are next to each other in the ring and fit.
bool ChunkWriter::write_picks(Outgoing& out, ByteWriter& to) noexcept {
  auto& picks = answers_.picks();
  const auto records_of = [&](const Answers::Pick& pick) -> HeldRecords::OfVersion {
    const Ledger::Contribution& place = out.ledger.place(pick.contribution);
    // What was asked for may be more than it looked like: many blocks of one version.
    if (!place.used || !place.open || place.generation != pick.generation ||
        !may_answer(out, pick.asker))
      return {};
    const HeldRecords::OfVersion found =
        out.ledger.records().find_version(place, pick.version, pick.place);
    note_walk(out, pick.asker, found.visited, found.part != nullptr);
    return found;
  };
  HeldRecords::OfVersion found;
  std::size_t in_vain = 0;
  while (picks.count != 0 && in_vain < kMostInVain &&
         (found = records_of(picks.front())).part == nullptr) {
    picks.pop();
    in_vain += found.visited;
  }
  if (found.part == nullptr) return false;
  const Answers::Pick first = picks.front();
  const Ledger::Contribution& contribution = out.ledger.place(first.contribution);
  ByteWriter again = to;
  ChunkHeader header{.id = contribution.id,
                     .range = {first.version, first.version},
                     .relayed = !contribution.own,
                     .partial = true};
  if (out.needs_signature && contribution.own) to.keep_free(kSignatureBytes);
  write_chunk_header(to, header);
  RecordWriter writer(to, {first.version, kLastVersion});
  out.tree.clear();
  std::uint32_t last = 0;
  while (picks.count != 0) {
    Answers::Pick& next = picks.front();
    if (next.contribution != first.contribution || next.asker != first.asker ||
        next.version <= last)
      break;
    if (last != 0) found = records_of(next);
    if (found.part != nullptr) {
      if (!write_record(out, writer, contribution, *found.part)) break;
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
  out.for_asker = true;
  out.asker = first.asker;
  finish_chunk(out, again, header, contribution);
  return true;
}

/// Of one contribution and for one robot, as many as fit.
bool ChunkWriter::write_descriptions(Outgoing& out, ByteWriter& to) noexcept {
  ByteWriter trial = to;
  if (out.needs_signature) trial.keep_free(kSignatureBytes);
  auto& spans = answers_.spans();
  bool any = false;
  Answers::Span first{};
  while (spans.count != 0) {
    const Answers::Span next = spans.front();
    const Ledger::Contribution& contribution = out.ledger.place(next.contribution);
    if (!contribution.used || contribution.generation != next.generation ||
        !may_answer(out, next.asker)) {
      spans.pop();
      continue;
    }
    if (!any) {
      first = next;
      write_description_header(trial, {contribution.id, next.asker});
    } else if (next.contribution != first.contribution || next.asker != first.asker) {
      break;
    }
    note_walk(out, next.asker,
              Comparison::describe(out.ledger, contribution, next.span, *description_));
    if (!write_description(trial, *description_)) break;
    any = true;
    spans.pop();
  }
  if (!any) return false;
  to = trial;
  out.kind = DatagramKind::kDescription;
  out.asker = first.asker;
  out.for_asker = true;
  ++out.counted.descriptions;
  return true;
}

}  // namespace tessera
