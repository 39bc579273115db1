// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/arena_memory.hpp"

#include <fmt/core.h>

#include <new>
#include <string>

#include "tessera/base/arena.hpp"

namespace tessera {

ArenaMemory::ArenaMemory(std::size_t bytes)
    : bytes_(static_cast<std::byte*>(
          ::operator new (align_up(bytes, kArenaAlignment), std::align_val_t{kArenaAlignment}))),
      size_(align_up(bytes, kArenaAlignment)) {}

Outcome<ArenaMemory> ArenaMemory::allocate(std::size_t bytes, const Message& remedy) {
  ArenaMemory memory;
  memory.size_ = align_up(bytes, kArenaAlignment);
  memory.bytes_.reset(static_cast<std::byte*>(
      ::operator new (memory.size_, std::align_val_t{kArenaAlignment}, std::nothrow)));
  if (memory.bytes_ == nullptr) {
    return Failure{fmt::format("the system does not give {} bytes of memory; ", bytes) + remedy,
                   FailureKind::kFailure};
  }
  return memory;
}

void ArenaMemory::Free::operator()(std::byte* bytes) const {
  ::operator delete (bytes, std::align_val_t{kArenaAlignment});
}

}  // namespace tessera
