// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/version_index.hpp"

namespace tessera {

void VersionIndex::add(std::span<RecordLink> links, std::uint32_t record, std::uint32_t version,
                       std::uint64_t sum) noexcept {
  while (bucket_of(version) >= kBuckets) widen(links);
  const std::uint32_t bucket = bucket_of(version);
  links[record - 1] = {heads_[bucket], 0};
  if (heads_[bucket] != 0) links[heads_[bucket] - 1].previous = record;
  heads_[bucket] = record;
  sums_[bucket] += sum;
}

void VersionIndex::remove(std::span<RecordLink> links, std::uint32_t record, std::uint32_t version,
                          std::uint64_t sum) noexcept {
  const std::uint32_t bucket = bucket_of(version);
  const RecordLink link = links[record - 1];
  if (link.previous != 0) {
    links[link.previous - 1].next = link.next;
  } else {
    TESSERA_ASSERT(heads_[bucket] == record);
    heads_[bucket] = link.next;
  }
  if (link.next != 0) links[link.next - 1].previous = link.previous;
  links[record - 1] = {};
  sums_[bucket] -= sum;
}

/// Each two buckets become one.
void VersionIndex::widen(std::span<RecordLink> links) noexcept {
  for (std::size_t bucket = 0; bucket < kBuckets / 2; ++bucket) {
    const std::uint32_t first = heads_[2 * bucket];
    const std::uint32_t second = heads_[2 * bucket + 1];
    if (first != 0 && second != 0) {
      std::uint32_t tail = first;
      while (links[tail - 1].next != 0) tail = links[tail - 1].next;
      links[tail - 1].next = second;
      links[second - 1].previous = tail;
    }
    heads_[bucket] = first != 0 ? first : second;
    sums_[bucket] = sums_[2 * bucket] + sums_[2 * bucket + 1];
  }
  for (std::size_t bucket = kBuckets / 2; bucket < kBuckets; ++bucket) {
    heads_[bucket] = 0;
    sums_[bucket] = 0;
  }
  ++width_;
}

std::uint64_t VersionIndex::sum(const VersionSpan& span) const noexcept {
  const unsigned more = span.width > width_ ? span.width - width_ : 0;
  const std::uint32_t index =
      span.width < width_ ? span.index >> (width_ - span.width) : span.index;
  const std::uint64_t first = more < 32 ? std::uint64_t{index} << more : 0;
  const std::uint64_t last = more < 32 ? first + (std::uint64_t{1} << more) : kBuckets;
  std::uint64_t sum = 0;
  for (std::uint64_t bucket = first; bucket < last && bucket < kBuckets; ++bucket)
    sum += sums_[static_cast<std::size_t>(bucket)];
  return sum;
}

}  // namespace tessera
