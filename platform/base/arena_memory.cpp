// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/arena_memory.hpp"

#include <fmt/core.h>
#include <sys/mman.h>

#include <new>
#include <string>

#include "tessera/base/arena.hpp"

namespace tessera {

namespace {

/// Of the smallest ones that are large, on most machines.
constexpr std::size_t kLargePage = std::size_t{2} << 20U;

std::size_t alignment_of(std::size_t bytes) {
  return bytes >= 2 * kLargePage ? kLargePage : kArenaAlignment;
}

/// A wish: a system without large pages, or short of them, gives others.
void ask_for_large_pages([[maybe_unused]] std::byte* bytes, [[maybe_unused]] std::size_t size) {
#if defined(MADV_HUGEPAGE)
  const std::size_t whole = size / kLargePage * kLargePage;
  if (alignment_of(size) == kLargePage) static_cast<void>(::madvise(bytes, whole, MADV_HUGEPAGE));
#endif
}

}  // namespace

ArenaMemory::ArenaMemory(std::size_t bytes) : size_(align_up(bytes, kArenaAlignment)) {
  const std::size_t alignment = alignment_of(size_);
  bytes_ = {static_cast<std::byte*>(::operator new (size_, std::align_val_t{alignment})),
            Free{alignment}};
  ask_for_large_pages(bytes_.get(), size_);
}

Outcome<ArenaMemory> ArenaMemory::allocate(std::size_t bytes, const Message& remedy) {
  ArenaMemory memory;
  memory.size_ = align_up(bytes, kArenaAlignment);
  const std::size_t alignment = alignment_of(memory.size_);
  memory.bytes_ = {static_cast<std::byte*>(
                       ::operator new (memory.size_, std::align_val_t{alignment}, std::nothrow)),
                   Free{alignment}};
  if (memory.bytes_ == nullptr) {
    return Failure{fmt::format("the system does not give {} bytes of memory; ", bytes) + remedy,
                   FailureKind::kFailure};
  }
  ask_for_large_pages(memory.bytes_.get(), memory.size_);
  return memory;
}

void ArenaMemory::Free::operator()(std::byte* bytes) const {
  ::operator delete (bytes, std::align_val_t{alignment});
}

}  // namespace tessera
