// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Memory for what tests make in an arena.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tessera/base/arena.hpp"

namespace tessera {

class AlignedMemory {
 public:
  explicit AlignedMemory(std::size_t bytes) : lines_((bytes + sizeof(Line) - 1) / sizeof(Line)) {}
  [[nodiscard]] Arena arena() { return Arena(std::as_writable_bytes(std::span<Line>(lines_))); }

 private:
  struct alignas(kArenaAlignment) Line {
    std::byte bytes[kArenaAlignment];
  };
  std::vector<Line> lines_;
};

}  // namespace tessera
