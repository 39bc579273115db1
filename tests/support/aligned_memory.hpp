// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Memory for what tests make in an arena: of exactly the size that is asked for, so that a
// sanitizer sees every byte beyond it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>

#include "tessera/base/arena.hpp"

namespace tessera {

/// Memory aligned as an arena must be. Not initialised. For one thread.
class AlignedMemory {
 public:
  explicit AlignedMemory(std::size_t bytes);
  void fill(std::byte value) { std::fill_n(bytes_.get(), size_, value); }
  [[nodiscard]] Arena arena() { return Arena(span()); }
  [[nodiscard]] std::span<std::byte> span() { return {bytes_.get(), size_}; }

 private:
  struct Free {
    void operator()(std::byte* bytes) const;
    std::size_t taken = 0;
  };
  std::unique_ptr<std::byte, Free> bytes_;
  std::size_t size_;
};

}  // namespace tessera
