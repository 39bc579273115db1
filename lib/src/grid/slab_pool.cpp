// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/grid/internal/slab_pool.hpp"

#include "tessera/base/internal/shared_words.hpp"

namespace tessera {

SlabPool::SlabPool(std::span<std::byte> storage,
                   const std::array<std::uint32_t, kMaxSizes>& item_bytes) noexcept
    : storage_(storage) {
  for (std::size_t i = 0; i < kMaxSizes; ++i) {
    TESSERA_ASSERT(item_bytes[i] <= kPageBytes && item_bytes[i] % kUnitBytes == 0);
    classes_[i].item_bytes = item_bytes[i];
    classes_[i].per_page =
        item_bytes[i] == 0 ? 0 : static_cast<std::uint32_t>(kPageBytes / item_bytes[i]);
  }
}

Result<SlabHandle> SlabPool::allocate(int size, std::uint32_t zeroed_bytes) noexcept {
  SizeClass& c = classes_[static_cast<std::size_t>(size)];
  TESSERA_ASSERT(c.item_bytes != 0 && zeroed_bytes <= c.item_bytes);
  SlabHandle handle = 0;
  if (c.released > 0) {
    handle = c.first_released;
    c.first_released = static_cast<SlabHandle>(*link_of(handle));
    --c.released;
  } else {
    if (c.fresh == 0) {
      if (pages_used_ == page_count()) {
        ++refused_;
        return Status::kResourceExhausted;
      }
      c.next_fresh = static_cast<SlabHandle>(pages_used_ * (kPageBytes / kUnitBytes)) + 1;
      c.fresh = c.per_page;
      ++pages_used_;
    }
    handle = c.next_fresh;
    c.next_fresh += static_cast<SlabHandle>(c.item_bytes / kUnitBytes);
    --c.fresh;
  }
  ++c.live;
  clear_shared_words(at(handle), zeroed_bytes);
  return handle;
}

void SlabPool::release(int size, SlabHandle handle) noexcept {
  SizeClass& c = classes_[static_cast<std::size_t>(size)];
  TESSERA_ASSERT(c.live > 0);
  store_shared(*link_of(handle), std::uint64_t{c.first_released});
  c.first_released = handle;
  ++c.released;
  --c.live;
}

bool SlabPool::fits(const Counts& wanted) const noexcept {
  std::size_t pages = 0;
  for (std::size_t i = 0; i < kMaxSizes; ++i) {
    const SizeClass& c = classes_[i];
    const std::uint32_t at_hand = c.released + c.fresh;
    if (wanted[i] <= at_hand) continue;
    if (c.per_page == 0) return false;
    pages += (std::size_t{wanted[i] - at_hand} + c.per_page - 1) / c.per_page;
  }
  return pages <= page_count() - pages_used_;
}

bool SlabPool::fits_empty(const Counts& wanted) const noexcept {
  std::size_t pages = 0;
  for (std::size_t i = 0; i < kMaxSizes; ++i) {
    const std::uint32_t per_page = classes_[i].per_page;
    if (wanted[i] == 0) continue;
    if (per_page == 0) return false;
    pages += (std::size_t{wanted[i]} + per_page - 1) / per_page;
  }
  return pages <= page_count();
}

void SlabPool::clear() noexcept {
  for (SizeClass& c : classes_) {
    c = SizeClass{.item_bytes = c.item_bytes, .per_page = c.per_page};
  }
  pages_used_ = 0;
  refused_ = 0;
}

}  // namespace tessera
