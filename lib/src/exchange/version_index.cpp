// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/version_index.hpp"

#include <algorithm>

namespace tessera {

namespace {

constexpr std::uint32_t kInPart = VersionBuckets::kCount;

/// Two lists as one. Returns the head.
std::uint32_t joined(std::span<RecordLink> links, std::uint32_t first,
                     std::uint32_t second) noexcept {
  if (first == 0) return second;
  if (second == 0) return first;
  std::uint32_t tail = first;
  while (links[tail - 1].next != 0) tail = links[tail - 1].next;
  links[tail - 1].next = second;
  links[second - 1].previous = tail;
  return first;
}

}  // namespace

/// With room for a bucket; null: the pool has none.
VersionBuckets* VersionIndex::taken_part_of(std::uint32_t bucket) noexcept {
  if (VersionBuckets* const part = part_of(bucket); part != nullptr) return part;
  const std::uint16_t number = pool_ == nullptr ? std::uint16_t{0} : pool_->take();
  if (number == 0) return nullptr;
  more_[bucket / kInPart - 1] = number;
  return &(pool_->at(number) = {});
}

/// part: from 0, the first one of the index.
void VersionIndex::give_back(std::uint32_t part) noexcept {
  if (part == 0) {
    first_ = {};
  } else if (more_[part - 1] != 0) {
    pool_->give(more_[part - 1]);
    more_[part - 1] = 0;
  }
}

void VersionIndex::clear() noexcept {
  for (std::uint32_t part = 0; part <= kParts; ++part) give_back(part);
  width_ = 0;
}

void VersionIndex::add(std::span<RecordLink> links, std::uint32_t record, std::uint32_t version,
                       std::uint64_t sum) noexcept {
  while (bucket_of(version) >= kBuckets) widen(links);
  VersionBuckets* part = taken_part_of(bucket_of(version));
  // Ends with the buckets of the index itself.
  for (; part == nullptr; part = taken_part_of(bucket_of(version))) widen(links);
  const std::uint32_t bucket = bucket_of(version) % kInPart;
  links[record - 1] = {part->heads[bucket], 0};
  if (part->heads[bucket] != 0) links[part->heads[bucket] - 1].previous = record;
  part->heads[bucket] = record;
  part->sums[bucket] += sum;
}

void VersionIndex::remove(std::span<RecordLink> links, std::uint32_t record, std::uint32_t version,
                          std::uint64_t sum) noexcept {
  VersionBuckets* const part = part_of(bucket_of(version));
  TESSERA_ASSERT(part != nullptr);
  const std::uint32_t bucket = bucket_of(version) % kInPart;
  const RecordLink link = links[record - 1];
  if (link.previous != 0) {
    links[link.previous - 1].next = link.next;
  } else {
    TESSERA_ASSERT(part->heads[bucket] == record);
    part->heads[bucket] = link.next;
  }
  if (link.next != 0) links[link.next - 1].previous = link.previous;
  links[record - 1] = {};
  part->sums[bucket] -= sum;
}

/// Each two buckets become one. What two parts have goes into one, so the pool has that.
void VersionIndex::widen(std::span<RecordLink> links) noexcept {
  for (std::uint32_t into = 0; into <= kParts / 2; ++into) {
    VersionBuckets both;
    bool is_any = false;
    for (std::uint32_t from = 2 * into; from <= 2 * into + 1; ++from) {
      const VersionBuckets* const part = part_of(from * kInPart);
      if (part == nullptr) continue;
      is_any = true;
      for (std::uint32_t i = 0; i < kInPart; i += 2) {
        const std::uint32_t at = (from % 2 * kInPart + i) / 2;
        both.heads[at] = joined(links, part->heads[i], part->heads[i + 1]);
        both.sums[at] = part->sums[i] + part->sums[i + 1];
      }
    }
    give_back(2 * into);
    give_back(2 * into + 1);
    if (is_any) *taken_part_of(into * kInPart) = both;
  }
  ++width_;
}

std::uint64_t VersionIndex::sum(const VersionSpan& span) const noexcept {
  const unsigned more = span.width > width_ ? span.width - width_ : 0;
  const std::uint32_t index =
      span.width < width_ ? span.index >> (width_ - span.width) : span.index;
  const std::uint64_t first = more < 32 ? std::uint64_t{index} << more : 0;
  const std::uint64_t last =
      std::min<std::uint64_t>(more < 32 ? first + (std::uint64_t{1} << more) : kBuckets, kBuckets);
  std::uint64_t sum = 0;
  for (std::uint64_t bucket = first; bucket < last;) {
    const std::uint64_t end = std::min(last, (bucket / kInPart + 1) * kInPart);
    const VersionBuckets* const part = part_of(static_cast<std::uint32_t>(bucket));
    for (; part != nullptr && bucket < end; ++bucket) sum += part->sums[bucket % kInPart];
    bucket = end;
  }
  return sum;
}

}  // namespace tessera
