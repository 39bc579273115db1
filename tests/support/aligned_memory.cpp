// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "support/aligned_memory.hpp"

#include <bit>
#include <map>
#include <new>

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define TESSERA_ADDRESS_SANITIZER 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(TESSERA_ADDRESS_SANITIZER)
#include <sanitizer/asan_interface.h>
#endif

namespace tessera {

namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(TESSERA_ADDRESS_SANITIZER)
// The sanitizer takes longer to give out some megabytes than a test of a small map takes, so memory
// that was given back is used again. What is not in use is poisoned: its end, and all of it while
// nobody has it.
constexpr std::size_t kMostKept = 8;
std::size_t taken_for(std::size_t bytes) { return std::bit_ceil(bytes + 1); }
void close(std::byte* from, std::size_t bytes) { __asan_poison_memory_region(from, bytes); }
void open(std::byte* from, std::size_t bytes) { __asan_unpoison_memory_region(from, bytes); }
#else
constexpr std::size_t kMostKept = 0;
std::size_t taken_for(std::size_t bytes) { return bytes; }
void close(std::byte* /*from*/, std::size_t /*bytes*/) {}
void open(std::byte* /*from*/, std::size_t /*bytes*/) {}
#endif

/// Memory that was given back, by the bytes that were asked of the system.
std::multimap<std::size_t, std::byte*>& given_back() {
  // Never destroyed, as objects of static duration may give memory back after it.
  static auto& memory = *new std::multimap<std::size_t, std::byte*>;
  return memory;
}

}  // namespace

AlignedMemory::AlignedMemory(std::size_t bytes) : bytes_(nullptr, Free{}), size_(bytes) {
  const std::size_t taken = taken_for(bytes);
  const auto earlier = given_back().extract(taken);
  bytes_ = {
      earlier ? earlier.mapped()
              : static_cast<std::byte*>(::operator new (taken, std::align_val_t{kArenaAlignment})),
      Free{taken}};
  open(bytes_.get(), bytes);
  close(bytes_.get() + bytes, taken - bytes);
}

void AlignedMemory::Free::operator()(std::byte* bytes) const {
  if (given_back().size() < kMostKept) {
    close(bytes, taken);
    given_back().emplace(taken, bytes);
  } else {
    open(bytes, taken);
    ::operator delete (bytes, std::align_val_t{kArenaAlignment});
  }
}

}  // namespace tessera
