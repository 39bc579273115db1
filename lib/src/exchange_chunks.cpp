// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What arrives of contributions: their blocks and their frames.
#include <algorithm>

#include "tessera/exchange/block_codec.hpp"
#include "tessera/exchange/exchange.hpp"

namespace tessera {

/// is_new: it is no repeat, which whoever asked may never have heard.
bool Exchange::hear_chunk(ByteReader& body, bool is_new, std::int64_t now_us) noexcept {
  ChunkHeader header;
  if (!read_chunk_header(body, header) || (header.proofs && !signatures_.on())) return false;
  if (is_own_to_come(header.id)) {
    ++counted_.impostors;
    return true;
  }
  Contribution* const contribution = find_or_add(header.id);
  if (contribution == nullptr || contribution->excluded) return true;
  const bool same = header.all && header.digest == contribution->digest;
  if (contribution->own) {
    counted_.impostors += !header.all && header.range.last > contribution->latest ? 1U : 0U;
    if (is_new) drop_answers(number_of(*contribution), header.range, same);
    return true;
  }
  if (!contribution->open) {
    contribution->latest = std::max(contribution->latest, header.range.last);
    ++counted_.records_early;
    note_lack(*contribution, now_us);
    return true;
  }
  const Taken taken = take_chunk(*contribution, header, body);
  if (taken.forged) ++counted_.refused_signature;
  if (taken.forged || !taken.well_formed) return taken.well_formed;
  const bool fills = header.range.first <= contribution->latest;
  if (!header.all) contribution->latest = std::max(contribution->latest, header.range.last);
  if (is_new) drop_answers(number_of(*contribution), header.range, same);
  if (taken.grew || taken.refused) contribution->full = taken.refused;
  // While gaps are filled, others may be too. What is new says nothing of them.
  if (fills && taken.grew && !taken.refused && contribution->request_due_us != kNever) {
    contribution->requests = 0;
    contribution->request_pause_us = config_.request_us;
    contribution->request_due_us = now_us + config_.request_us + random_us(config_.request_us);
  }
  note_lack(*contribution, now_us);
  return true;
}

Exchange::Taken Exchange::take_chunk(Contribution& contribution, const ChunkHeader& header,
                                     ByteReader& body) noexcept {
  if (!signatures_.on() || header.proofs)
    return take_records(contribution, header, ByteReader(body.bytes(body.remaining())));
  if (body.remaining() < kSignatureBytes) return {.well_formed = false};
  const ByteReader records(body.bytes(body.remaining() - kSignatureBytes));
  const std::span<const std::byte> signature = body.bytes(kSignatureBytes);
  std::copy(signature.begin(), signature.end(), signature_.begin());
  const Taken checked = check_chunk(contribution, header, records);
  if (checked.forged || !checked.well_formed) return checked;
  return take_records(contribution, header, records);
}

/// What is refused stays a gap. Where a record is none, or not its origin's, what came before it is
/// taken, and nothing is known of the rest.
Exchange::Taken Exchange::take_records(Contribution& contribution, const ChunkHeader& header,
                                       ByteReader records) noexcept {
  Taken taken;
  RecordReader reader(records, header);
  ChunkRecord record;
  std::uint32_t first = header.range.first;
  std::array<std::byte, kMostProofBytes> made{};
  // All that its sender holds may be less than there is.
  const auto cover = [&](VersionRange range) {
    return !header.all && range.first <= range.last && contribution.coverage.add(range);
  };
  for (std::uint32_t leaf = 0; records.remaining() != 0; ++leaf) {
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
    if (header.proofs && !proof_check_.check(signatures_, configuration_, contribution.id, record))
      return {.forged = true};
    if (signatures_.on() && !header.proofs)
      record.proof = std::span(made).first(write_proof(tree_, leaf, signature_, made));
    const std::span<const std::byte> kept = to_keep(record.coded, record.proof);
    if (put(contribution, *key, record.version, content_, kept).ok()) {
      ++counted_.records_taken;
      continue;
    }
    ++counted_.records_refused;
    taken.refused = true;
    taken.grew |= cover({first, record.version.number - 1});
    first = record.version.number + 1;
  }
  taken.grew |= cover({first, header.range.last});
  return taken;
}

bool Exchange::hear_frame(ByteReader& body, bool is_new) noexcept {
  FrameBody frame;
  if (!read_frame(body, frame)) return false;
  const std::span<const std::byte> signature = body.bytes(body.remaining());
  if (signature.size() != (signatures_.on() ? kSignatureBytes : 0)) return false;
  if (is_own_to_come(frame.id)) {
    ++counted_.impostors;
    return true;
  }
  Contribution* const contribution = find_or_add(frame.id);
  if (contribution == nullptr || contribution->excluded || contribution->own) return true;
  if (frame.revision < contribution->frame_revision) return true;
  if (frame.revision == contribution->frame_revision) {
    const bool same =
        frame.T_global_map == contribution->T_global_map &&
        std::equal(signature.begin(), signature.end(), contribution->frame_signature.begin());
    if (is_new && same) contribution->frame_due_us = kNever;
    return true;
  }
  if (signatures_.on() &&
      !signatures_.check(signatures_.context, frame.id.robot, frame_message(configuration_, frame),
                         signature.first<kSignatureBytes>())) {
    ++counted_.refused_signature;
    return true;
  }
  const Status status = set_frame(*contribution, frame.T_global_map, frame.revision);
  if (status == Status::kInvalidArgument) return false;
  // Without a place it is asked for as what finds no room is.
  contribution->full = status == Status::kResourceExhausted;
  if (contribution->full) {
    ++counted_.refused_contributions;
    return true;
  }
  contribution->frame_due_us = kNever;
  std::copy(signature.begin(), signature.end(), contribution->frame_signature.begin());
  return true;
}

}  // namespace tessera
