// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The records of a contribution by their versions: which there are in a range, and a sum over each
// range that tells whether two robots hold the same. Versions go into kBuckets buckets of equal
// width, a power of two that doubles when a version is beyond the last bucket.
//
// Invariants: a bucket's list holds each record of its versions once; its sum is that of
// fingerprint_of() over the list. Lists go through links that all contributions share.
//
// The first buckets are in the index, the others in parts of a pool that all contributions share:
// an index has those in which there was anything. Where the pool has none, buckets become wider
// earlier, and all else holds.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "tessera/base/internal/part_pool.hpp"
#include "tessera/exchange/wire.hpp"

namespace tessera {

/// A list through records, by their numbers; 0: none.
struct RecordLink {
  std::uint32_t next = 0;
  std::uint32_t previous = 0;
};

/// Buckets that follow each other.
struct VersionBuckets {
  static constexpr std::uint32_t kCount = 64;
  std::array<std::uint64_t, kCount> sums{};
  std::array<std::uint32_t, kCount> heads{};
};

class VersionIndex {
 public:
  static constexpr std::uint32_t kBuckets = 2048;
  /// That an index has of the pool, at most.
  static constexpr std::uint32_t kParts = kBuckets / VersionBuckets::kCount - 1;

  /// The pool, before anything is added. It must outlive the index.
  void use(PartPool<VersionBuckets>& pool) noexcept { pool_ = &pool; }
  /// Adds a record. version: from 1. O(1); where the width doubles O(records), which happens at
  /// most 21 times in the life of a contribution.
  void add(std::span<RecordLink> links, std::uint32_t record, std::uint32_t version,
           std::uint64_t sum) noexcept;
  /// Takes a record out that was added with the same version and sum. O(1).
  void remove(std::span<RecordLink> links, std::uint32_t record, std::uint32_t version,
              std::uint64_t sum) noexcept;
  void clear() noexcept;

  /// A bucket holds 2^width() versions.
  [[nodiscard]] std::uint8_t width() const noexcept { return width_; }
  /// The sum over a span; of one narrower than a bucket, over the bucket. O(buckets in it).
  [[nodiscard]] std::uint64_t sum(const VersionSpan& span) const noexcept;
  /// Calls visit(record) for the records of the buckets from that of first on, in ascending order
  /// of buckets and in no order within one, until after a bucket bucket_end(last version of the
  /// bucket) returns false or the range ends. Returns how many records it visited.
  template <class Visit, class End>
  std::size_t visit(std::span<const RecordLink> links, const VersionRange& range, Visit&& visit,
                    End&& bucket_end) const noexcept {
    std::size_t visited = 0;
    const std::uint32_t last =
        bucket_of(range.last) < kBuckets ? bucket_of(range.last) : kBuckets - 1;
    for (std::uint32_t bucket = bucket_of(range.first); bucket <= last; ++bucket) {
      for (std::uint32_t at = head(bucket); at != 0; at = links[at - 1].next, ++visited) visit(at);
      const std::uint64_t end = (std::uint64_t{bucket} + 1) << width_;
      if (!bucket_end(end < kLastVersion ? static_cast<std::uint32_t>(end) : kLastVersion)) break;
    }
    return visited;
  }

  /// Of the records in the buckets of a range, for how many is(record) is true; nothing if there
  /// are more than most of them.
  template <class Is>
  [[nodiscard]] std::optional<std::uint32_t> count(std::span<const RecordLink> links,
                                                   const VersionRange& range, std::uint32_t most,
                                                   Is&& is) const noexcept {
    std::uint32_t counted = 0;
    const std::uint32_t last =
        bucket_of(range.last) < kBuckets ? bucket_of(range.last) : kBuckets - 1;
    for (std::uint32_t bucket = bucket_of(range.first); bucket <= last; ++bucket) {
      for (std::uint32_t at = head(bucket); at != 0; at = links[at - 1].next) {
        if (most-- == 0) return std::nullopt;
        counted += is(at) ? 1U : 0U;
      }
    }
    return counted;
  }

  /// The first record of a version's bucket, of its first most ones, for which is(record) is true;
  /// 0: none.
  template <class Is>
  std::uint32_t find(std::span<const RecordLink> links, std::uint32_t version, std::uint32_t most,
                     Is&& is) const noexcept {
    const std::uint32_t bucket = bucket_of(version);
    if (bucket >= kBuckets) return 0;
    for (std::uint32_t at = head(bucket); at != 0 && most > 0; at = links[at - 1].next, --most) {
      if (is(at)) return at;
    }
    return 0;
  }

 private:
  [[nodiscard]] std::uint32_t bucket_of(std::uint32_t version) const noexcept {
    return (version - 1) >> width_;
  }
  /// Those that a bucket is among; null: there is none in any of them.
  [[nodiscard]] const VersionBuckets* part_of(std::uint32_t bucket) const noexcept {
    if (bucket < VersionBuckets::kCount) return &first_;
    const std::uint16_t number = more_[bucket / VersionBuckets::kCount - 1];
    return number == 0 ? nullptr : &pool_->at(number);
  }
  [[nodiscard]] VersionBuckets* part_of(std::uint32_t bucket) noexcept {
    if (bucket < VersionBuckets::kCount) return &first_;
    const std::uint16_t number = more_[bucket / VersionBuckets::kCount - 1];
    return number == 0 ? nullptr : &pool_->at(number);
  }
  [[nodiscard]] std::uint32_t head(std::uint32_t bucket) const noexcept {
    const VersionBuckets* const part = part_of(bucket);
    return part == nullptr ? 0 : part->heads[bucket % VersionBuckets::kCount];
  }
  [[nodiscard]] VersionBuckets* taken_part_of(std::uint32_t bucket) noexcept;
  void give_back(std::uint32_t part) noexcept;
  void widen(std::span<RecordLink> links) noexcept;

  VersionBuckets first_{};
  std::array<std::uint16_t, kParts> more_{};  ///< Numbers in the pool; 0: none.
  std::uint8_t width_ = 0;
  PartPool<VersionBuckets>* pool_ = nullptr;
};

}  // namespace tessera
