// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Storage for a map's parts of a few fixed sizes, cut from one region in pages of 4 KiB: a page
// serves one size, and which size is decided when it is first needed, so that no split between
// sizes has to be guessed in advance.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/status.hpp"

namespace tessera {

/// Names an allocated item: its place in the storage in units of 16 bytes, plus one. Zero is none.
using SlabHandle = std::uint32_t;

class SlabPool {
 public:
  static constexpr std::size_t kPageBytes = 4096;
  static constexpr std::size_t kUnitBytes = 16;
  static constexpr int kMaxSizes = 4;
  using Counts = std::array<std::uint32_t, kMaxSizes>;

  SlabPool() noexcept = default;
  /// storage: aligned to kArenaAlignment. item_bytes: each at most kPageBytes, a multiple of 16;
  /// zero for unused.
  SlabPool(std::span<std::byte> storage,
           const std::array<std::uint32_t, kMaxSizes>& item_bytes) noexcept;

  /// A zeroed item. Fails with kResourceExhausted iff neither a released item of this size nor a
  /// page is left; counted in refused(). O(item size).
  [[nodiscard]] Result<SlabHandle> allocate(int size) noexcept {
    return allocate(size, classes_[static_cast<std::size_t>(size)].item_bytes);
  }
  /// An item of which the first zeroed_bytes alone, a multiple of 16, are zeroed: the rest is what
  /// was there before. Fails as above. O(zeroed_bytes).
  [[nodiscard]] Result<SlabHandle> allocate(int size, std::uint32_t zeroed_bytes) noexcept;
  /// True iff an item of so many bytes with this handle would lie in the storage: for handles that
  /// were read while they may have been written.
  [[nodiscard]] bool reaches(SlabHandle handle, std::size_t bytes) const noexcept {
    const std::size_t end = std::size_t{handle} * kUnitBytes + bytes - kUnitBytes;
    return handle != 0 && end <= storage_.size();
  }
  /// Gives an item back for reuse at its size. O(1).
  void release(int size, SlabHandle handle) noexcept;
  /// True iff all of these items could be allocated now, together. O(kMaxSizes).
  [[nodiscard]] bool fits(const Counts& wanted) const noexcept;
  /// The same if nothing were in use.
  [[nodiscard]] bool fits_empty(const Counts& wanted) const noexcept;
  /// fits(), with a refusal counted where not.
  [[nodiscard]] bool fits_or_refuse(const Counts& wanted) noexcept {
    const bool fit = fits(wanted);
    refused_ += fit ? 0U : 1U;
    return fit;
  }
  /// Forgets everything, counters included. O(1).
  void clear() noexcept;

  [[nodiscard]] std::byte* at(SlabHandle handle) const noexcept {
    TESSERA_ASSERT(handle != 0);
    return storage_.data() + std::size_t{handle - 1} * kUnitBytes;
  }

  [[nodiscard]] std::size_t capacity_bytes() const noexcept { return storage_.size(); }
  /// Bytes of the pages in use, their slack included.
  [[nodiscard]] std::size_t used_bytes() const noexcept { return pages_used_ * kPageBytes; }
  [[nodiscard]] std::uint32_t items(int size) const noexcept {
    return classes_[static_cast<std::size_t>(size)].live;
  }
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }

 private:
  struct SizeClass {
    std::uint32_t item_bytes = 0;
    std::uint32_t per_page = 0;
    std::uint32_t released = 0;     ///< Items in the list that starts at first_released.
    SlabHandle first_released = 0;  ///< A released item's first eight bytes name the next.
    std::uint32_t fresh = 0;        ///< Items of the newest page that were never handed out.
    SlabHandle next_fresh = 0;
    std::uint32_t live = 0;
  };
  [[nodiscard]] std::uint64_t* link_of(SlabHandle handle) const noexcept {
    return reinterpret_cast<std::uint64_t*>(at(handle));
  }
  [[nodiscard]] std::size_t page_count() const noexcept { return storage_.size() / kPageBytes; }

  std::span<std::byte> storage_;
  std::array<SizeClass, kMaxSizes> classes_{};
  std::size_t pages_used_ = 0;
  std::uint64_t refused_ = 0;
};

}  // namespace tessera
