// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which blocks are said next, new ones and those that others wait for, and the chunks of them.
#include <algorithm>

#include "tessera/exchange/exchange.hpp"

namespace tessera {

namespace {

constexpr std::size_t kFreshBatch = 0;
constexpr std::size_t kAnswerBatch = 1;

/// A record of this robot's own fits beside the chunk's signature; one that is passed on has its
/// proof, and the chunk none.
static_assert(kMostChunkHeaderBytes + kMostRecordHeaderBytes + kMostCodedBytes +
                  std::max(kMostProofBytes, kSignatureBytes) <=
              kMostBodyBytes);

}  // namespace

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
  if (grows_tree) to.keep_free(kSignatureBytes);
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
      // One record always fits.
      TESSERA_ASSERT(said != 0);
      header.range.last = std::max(header.range.first, next.version - 1);
      break;
    }
    if (grows_tree) tree_.add(leaf_of(signatures_, contribution.id, record));
    said = part.version;
  }
  write_chunk_header(again, header);
  proofs_ = header.proofs;
  if (grows_tree) {
    const Hash root = tree_.count() == 0 ? Hash{} : tree_.root(signatures_);
    const auto message = root_message(configuration_, contribution.id, tree_.count(), root);
    signatures_.sign(signatures_.context, message, signature_);
  }
  batch.range.first = header.range.last + 1;
}

}  // namespace tessera
