// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// glibc exports its allocator a second time under names with __libc_ in front, so the usual names
// can be defined here, count, and pass on. Nothing here may allocate, throw or depend on
// initialisation: malloc is called before any constructor has run.
#include "base/allocation_counter.hpp"

#include <stdlib.h>

#include <atomic>
#include <cerrno>
#include <cstddef>

#ifdef __has_feature
#define TESSERA_HAS_FEATURE(feature) __has_feature(feature)
#else
#define TESSERA_HAS_FEATURE(feature) 0
#endif

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) ||                   \
    TESSERA_HAS_FEATURE(address_sanitizer) || TESSERA_HAS_FEATURE(thread_sanitizer) || \
    TESSERA_HAS_FEATURE(memory_sanitizer) || TESSERA_HAS_FEATURE(leak_sanitizer) ||    \
    !defined(__GLIBC__)
#define TESSERA_COUNTS_ALLOCATIONS 0
#else
#define TESSERA_COUNTS_ALLOCATIONS 1
#endif

#if !TESSERA_COUNTS_ALLOCATIONS

namespace tessera {
std::optional<std::uint64_t> heap_allocations() noexcept { return std::nullopt; }
std::optional<std::uint64_t> thread_heap_allocations() noexcept { return std::nullopt; }
}  // namespace tessera

#else

namespace tessera {
namespace {

constinit std::atomic<std::uint64_t> allocations{0};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free);
// Exists from the thread's start: another model could allocate it at the first use.
[[gnu::tls_model("initial-exec")]] constinit thread_local std::uint64_t thread_allocations = 0;

void count_one() noexcept {
  allocations.fetch_add(1, std::memory_order_relaxed);
  ++thread_allocations;
}

}  // namespace

std::optional<std::uint64_t> heap_allocations() noexcept {
  return allocations.load(std::memory_order_relaxed);
}

std::optional<std::uint64_t> thread_heap_allocations() noexcept { return thread_allocations; }

}  // namespace tessera

extern "C" {

// NOLINTBEGIN(bugprone-reserved-identifier): the names are glibc's.
void* __libc_malloc(std::size_t bytes) noexcept;
void* __libc_calloc(std::size_t count, std::size_t bytes) noexcept;
void* __libc_realloc(void* block, std::size_t bytes) noexcept;
void* __libc_memalign(std::size_t alignment, std::size_t bytes) noexcept;
void* __libc_valloc(std::size_t bytes) noexcept;
void* __libc_pvalloc(std::size_t bytes) noexcept;
void __libc_free(void* block) noexcept;
// NOLINTEND(bugprone-reserved-identifier)

void* malloc(std::size_t bytes) noexcept {
  tessera::count_one();
  return __libc_malloc(bytes);
}

void* calloc(std::size_t count, std::size_t bytes) noexcept {
  tessera::count_one();
  return __libc_calloc(count, bytes);
}

// Growing in place counts too: a caller of realloc depends on the heap.
void* realloc(void* block, std::size_t bytes) noexcept {
  tessera::count_one();
  return __libc_realloc(block, bytes);
}

void* memalign(std::size_t alignment, std::size_t bytes) noexcept {
  tessera::count_one();
  return __libc_memalign(alignment, bytes);
}

void* aligned_alloc(std::size_t alignment, std::size_t bytes) noexcept {
  tessera::count_one();
  return __libc_memalign(alignment, bytes);
}

int posix_memalign(void** block, std::size_t alignment, std::size_t bytes) noexcept {
  const bool is_power_of_two = alignment != 0 && (alignment & (alignment - 1)) == 0;
  if (!is_power_of_two || alignment % sizeof(void*) != 0) return EINVAL;
  tessera::count_one();
  const int errno_before = errno;  // POSIX: the error is returned, errno is left alone.
  void* const result = __libc_memalign(alignment, bytes);
  errno = errno_before;
  if (result == nullptr) return ENOMEM;
  *block = result;
  return 0;
}

void* valloc(std::size_t bytes) noexcept {
  tessera::count_one();
  return __libc_valloc(bytes);
}

void* pvalloc(std::size_t bytes) noexcept {
  tessera::count_one();
  return __libc_pvalloc(bytes);
}

void free(void* block) noexcept { __libc_free(block); }

}  // extern "C"

#endif
