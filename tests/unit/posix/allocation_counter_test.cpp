// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// That no way to the heap escapes the count, and that the wrapped allocator still works.
#include "base/allocation_counter.hpp"

#include <malloc.h>
#include <stdlib.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace tessera {
namespace {

void* volatile sink = nullptr;  // Keeps the compiler from leaving allocations out.

void free_seen(void* block) {
  sink = block;
  ::free(block);
}

/// Allocations while work runs; -1 if this build cannot count.
template <class Work>
std::int64_t allocations_of(Work work) {
  const auto before = heap_allocations();
  work();
  const auto after = heap_allocations();
  return before && after ? static_cast<std::int64_t>(*after - *before) : -1;
}

bool can_count() {
  if (heap_allocations()) return true;
  WARN("this build cannot count heap allocations (sanitizer or another C library)");
  return false;
}

TEST_CASE("heap_allocations: work without the heap counts nothing") {
  if (!can_count()) return;
  CHECK(allocations_of([] { sink = nullptr; }) == 0);
}

TEST_CASE("heap_allocations: each C function counts once, free does not") {
  if (!can_count()) return;
  CHECK(allocations_of([] { free_seen(::malloc(100)); }) == 1);
  CHECK(allocations_of([] { free_seen(::calloc(10, 10)); }) == 1);
  CHECK(allocations_of([] { free_seen(::realloc(nullptr, 100)); }) == 1);
  CHECK(allocations_of([] { free_seen(::aligned_alloc(64, 128)); }) == 1);
  CHECK(allocations_of([] { free_seen(::memalign(64, 100)); }) == 1);
  CHECK(allocations_of([] {
          void* block = nullptr;
          if (::posix_memalign(&block, 64, 100) == 0) free_seen(block);
        }) == 1);
}

TEST_CASE("heap_allocations: new, new[] and aligned new count") {
  if (!can_count()) return;
  struct alignas(64) Aligned {
    char bytes[64];
  };
  CHECK(allocations_of([] {
          auto* one = new int(1);
          sink = one;
          delete one;
        }) == 1);
  CHECK(allocations_of([] {
          auto* many = new char[1000];
          sink = many;
          delete[] many;
        }) == 1);
  CHECK(allocations_of([] {
          auto* aligned = new Aligned;
          sink = aligned;
          delete aligned;
        }) == 1);
}

TEST_CASE("heap_allocations: containers count") {
  if (!can_count()) return;
  CHECK(allocations_of([] {
          std::vector<int> numbers(100);
          sink = numbers.data();
        }) == 1);
  CHECK(allocations_of([] {
          const auto shared = std::make_shared<int>(1);
          sink = shared.get();
        }) == 1);
}

TEST_CASE("heap_allocations: allocations inside libstdc++ and libc count") {
  if (!can_count()) return;
  // Both happen in the shared libraries, not in code that was compiled here.
  CHECK(allocations_of([] { std::ostringstream() << std::string(1000, 'x'); }) >= 2);
  CHECK(allocations_of([] { free_seen(::strdup("text")); }) == 1);
}

TEST_CASE("heap_allocations: other threads count") {
  if (!can_count()) return;
  constexpr int kBlocks = 1000;
  const auto work = [] {
    for (int i = 0; i < kBlocks; ++i) free_seen(::malloc(10));
  };
  CHECK(allocations_of([&] {
          std::thread first(work);
          std::thread second(work);
          first.join();
          second.join();
        }) >= 2 * kBlocks);
}

TEST_CASE("The counting allocator still does what the C library promises") {
  if (!can_count()) return;
  auto* zeros = static_cast<unsigned char*>(::calloc(1000, 1));
  CHECK(std::all_of(zeros, zeros + 1000, [](unsigned char byte) { return byte == 0; }));
  zeros[999] = 7;
  auto* larger = static_cast<unsigned char*>(::realloc(zeros, 100000));
  CHECK(larger[999] == 7);
  ::free(larger);
  void* block = nullptr;
  REQUIRE(::posix_memalign(&block, 4096, 10) == 0);
  CHECK(reinterpret_cast<std::uintptr_t>(block) % 4096 == 0);
  ::free(block);
  CHECK(::posix_memalign(&block, 3, 10) == EINVAL);
}

}  // namespace
TEST_CASE("thread_heap_allocations: counts this thread's and no other's") {
  if (!can_count()) return;
  const auto before = thread_heap_allocations();
  free_seen(::malloc(100));
  CHECK(*thread_heap_allocations() - *before == 1);
  std::uint64_t of_other = 0;
  std::thread other([&of_other] {
    const auto begin = thread_heap_allocations();
    for (int i = 0; i < 3; ++i) free_seen(::malloc(100));
    of_other = *thread_heap_allocations() - *begin;
  });
  const auto started = thread_heap_allocations();  // Starting one allocates.
  other.join();
  CHECK(of_other == 3);
  CHECK(*thread_heap_allocations() == *started);
}

}  // namespace tessera
