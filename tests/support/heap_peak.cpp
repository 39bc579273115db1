// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Under a sanitizer its hooks are told of each block. Elsewhere glibc exports its allocator a
// second time under names with __libc_ in front, so the usual names are defined here, count, and
// pass on. Nothing here may allocate.
#include "support/heap_peak.hpp"

#include <atomic>

#ifdef __has_feature
#define TESSERA_HAS_FEATURE(feature) __has_feature(feature)
#else
#define TESSERA_HAS_FEATURE(feature) 0
#endif

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || \
    TESSERA_HAS_FEATURE(address_sanitizer) || TESSERA_HAS_FEATURE(thread_sanitizer)
#define TESSERA_HEAP_BY_HOOKS 1
#include <sanitizer/allocator_interface.h>
#elif defined(__GLIBC__)
#define TESSERA_HEAP_BY_NAMES 1
#include <malloc.h>
#include <stdlib.h>

#include <cerrno>
#endif

namespace tessera::test {
namespace {

constinit std::atomic<long long> held_bytes{0};
constinit std::atomic<long long> most_bytes{0};

[[maybe_unused]] void taken(std::size_t bytes) noexcept {
  const auto more = static_cast<long long>(bytes);
  const long long now = held_bytes.fetch_add(more, std::memory_order_relaxed) + more;
  long long most = most_bytes.load(std::memory_order_relaxed);
  while (now > most && !most_bytes.compare_exchange_weak(most, now, std::memory_order_relaxed)) {
  }
}

[[maybe_unused]] void given_back(std::size_t bytes) noexcept {
  held_bytes.fetch_sub(static_cast<long long>(bytes), std::memory_order_relaxed);
}

}  // namespace

#ifdef TESSERA_HEAP_BY_HOOKS
namespace {

void on_malloc(const volatile void*, std::size_t bytes) { taken(bytes); }
void on_free(const volatile void* block) {
  if (block != nullptr) given_back(__sanitizer_get_allocated_size(block));
}

}  // namespace
#endif

HeapPeak::HeapPeak() noexcept {
#ifdef TESSERA_HEAP_BY_HOOKS
  // What was taken before is given back later: only differences count.
  static const int installed = __sanitizer_install_malloc_and_free_hooks(on_malloc, on_free);
  static_cast<void>(installed);
#endif
  start_bytes_ = held_bytes.load(std::memory_order_relaxed);
  most_bytes.store(start_bytes_, std::memory_order_relaxed);
}

std::size_t HeapPeak::bytes() const noexcept {
  return static_cast<std::size_t>(most_bytes.load(std::memory_order_relaxed) - start_bytes_);
}

}  // namespace tessera::test

#ifdef TESSERA_HEAP_BY_NAMES

namespace {

void* counted(void* block) noexcept {
  if (block != nullptr) tessera::test::taken(::malloc_usable_size(block));
  return block;
}

}  // namespace

extern "C" {

// NOLINTBEGIN(bugprone-reserved-identifier): the names are glibc's.
void* __libc_malloc(std::size_t bytes) noexcept;
void* __libc_calloc(std::size_t count, std::size_t bytes) noexcept;
void* __libc_realloc(void* block, std::size_t bytes) noexcept;
void* __libc_memalign(std::size_t alignment, std::size_t bytes) noexcept;
void __libc_free(void* block) noexcept;
// NOLINTEND(bugprone-reserved-identifier)

void* malloc(std::size_t bytes) noexcept { return counted(__libc_malloc(bytes)); }

void* calloc(std::size_t count, std::size_t bytes) noexcept {
  return counted(__libc_calloc(count, bytes));
}

// While a block moves, both are held.
void* realloc(void* block, std::size_t bytes) noexcept {
  const std::size_t before = block == nullptr ? 0 : ::malloc_usable_size(block);
  void* const moved = __libc_realloc(block, bytes);
  if (moved == nullptr && bytes != 0) return nullptr;
  static_cast<void>(counted(moved));
  tessera::test::given_back(before);
  return moved;
}

void* memalign(std::size_t alignment, std::size_t bytes) noexcept {
  return counted(__libc_memalign(alignment, bytes));
}

void* aligned_alloc(std::size_t alignment, std::size_t bytes) noexcept {
  return counted(__libc_memalign(alignment, bytes));
}

int posix_memalign(void** block, std::size_t alignment, std::size_t bytes) noexcept {
  void* const result = counted(__libc_memalign(alignment, bytes));
  if (result == nullptr) return ENOMEM;
  *block = result;
  return 0;
}

void free(void* block) noexcept {
  if (block != nullptr) tessera::test::given_back(::malloc_usable_size(block));
  __libc_free(block);
}

}  // extern "C"

#endif
