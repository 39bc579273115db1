// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/record_batch.hpp"

#include <algorithm>

namespace tessera {

std::size_t RecordBatch::collect(const Ledger& ledger) noexcept {
  count = next = 0;
  const HeldContribution& place = ledger.place(contribution);
  const auto later = [](const Part& a, const Part& b) { return a.version < b.version; };
  // The first count parts, a heap with the latest on top.
  const auto heap = [this] { return std::span(parts).subspan(0, count); };
  const std::size_t visited = place.index.visit(
      ledger.records().links(), range,
      [&](std::uint32_t number) {
        const Replicas::Replica& part = ledger.replicas().record(number);
        const bool within = range.first <= part.version && part.version <= range.last;
        if (!part.latest() || !within) return;
        if (count == kMostParts) {
          std::pop_heap(heap().begin(), heap().end(), later);
          --count;
          // Whatever is beyond the last that stays is left for the next batch.
          range.last = parts[count].version - 1;
          if (part.version > range.last) return;
        }
        parts[count++] = {number, part.version};
        std::push_heap(heap().begin(), heap().end(), later);
      },
      [&](std::uint32_t last) { return last < range.last; });
  std::sort_heap(heap().begin(), heap().end(), later);
  range.last = std::max(range.last, range.first);
  while (count != 0 && parts[count - 1].version > range.last) --count;
  return visited;
}

void FreshRecords::note(BlockKey key, VersionRange versions) noexcept {
  for (std::uint32_t version = versions.first; version <= versions.last; ++version) {
    if (count_ == fresh_.size()) drop_first();
    fresh_[(first_ + count_++) % fresh_.size()] = {key, version};
  }
}

void FreshRecords::collect(const Ledger& ledger, RecordBatch& batch) noexcept {
  if (count_ == 0 || fresh_[first_].version != batch.range.first) {
    if (count_ != 0) batch.range.last = fresh_[first_].version - 1;
    static_cast<void>(batch.collect(ledger));
    return;
  }
  batch.count = batch.next = 0;
  const Replicas& replicas = ledger.replicas();
  const Replicas::Slot slot = ledger.place(batch.contribution).slot;
  while (count_ != 0 && batch.count < RecordBatch::kMostParts) {
    const Fresh& fresh = fresh_[first_];
    const Replicas::Replica* part = replicas.find(slot, fresh.key);
    while (part != nullptr && (part->version != fresh.version || part->live == 0))
      part = replicas.next_part(*part);
    // Else it is superseded already.
    if (part != nullptr && part->latest())
      batch.parts[batch.count++] = {replicas.number_of(*part), fresh.version};
    batch.range.last = fresh.version;
    drop_first();
  }
}

}  // namespace tessera
