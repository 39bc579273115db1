// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Memory for the library's arenas.
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "base/outcome.hpp"

namespace tessera {

/// Memory for arenas, aligned to kArenaAlignment; pages count only once they are touched.
class ArenaMemory {
 public:
  ArenaMemory() noexcept = default;
  /// If the system refuses, the process ends as for any container.
  explicit ArenaMemory(std::size_t bytes);
  /// Fails with kFailure iff the system refuses: for sizes that users set. remedy: what they do.
  static Outcome<ArenaMemory> allocate(std::size_t bytes,
                                       const Message& remedy = "give less memory");
  [[nodiscard]] std::span<std::byte> span() const { return {bytes_.get(), size_}; }

 private:
  struct Free {
    void operator()(std::byte* bytes) const;
  };
  std::unique_ptr<std::byte, Free> bytes_;
  std::size_t size_ = 0;
};

}  // namespace tessera
