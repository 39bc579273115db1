// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Parts of one size that many owners take and give back.
#pragma once

#include <cstdint>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/status.hpp"

namespace tessera {

/// A part is found by its number, from 1 up to 2^16 - 1; 0 is none.
template <class Part>
class PartPool {
 public:
  /// Bytes of arena that make takes.
  [[nodiscard]] static constexpr std::size_t required_bytes(std::uint32_t parts) noexcept {
    return arena_bytes<PartPool>(1) + arena_bytes<Part>(parts) + arena_bytes<std::uint16_t>(parts);
  }
  /// One in the arena, as owners point to it. parts: at most 2^16 - 1. Fails with
  /// kResourceExhausted iff the arena is too small. O(parts).
  [[nodiscard]] static Result<PartPool*> make(Arena& arena, std::uint32_t parts) noexcept {
    const std::span<PartPool> made = arena.take<PartPool>(1);
    if (made.empty()) return Status::kResourceExhausted;
    PartPool& pool = made.front();
    pool.parts_ = arena.take<Part>(parts);
    pool.free_ = arena.take<std::uint16_t>(parts);
    if (parts != 0 && (pool.parts_.empty() || pool.free_.empty()))
      return Status::kResourceExhausted;
    for (std::uint32_t i = 0; i < parts; ++i) pool.free_[i] = static_cast<std::uint16_t>(parts - i);
    pool.count_ = parts;
    return &pool;
  }
  /// Has none.
  PartPool() noexcept = default;

  [[nodiscard]] Part& at(std::uint16_t number) noexcept { return parts_[number - 1U]; }
  [[nodiscard]] const Part& at(std::uint16_t number) const noexcept { return parts_[number - 1U]; }
  /// A part as whoever had it left it; 0 iff there is none. O(1).
  [[nodiscard]] std::uint16_t take() noexcept { return count_ == 0 ? 0 : free_[--count_]; }
  /// Gives one back that was taken. O(1).
  void give(std::uint16_t number) noexcept { free_[count_++] = number; }
  [[nodiscard]] std::uint32_t free() const noexcept { return count_; }

 private:
  std::span<Part> parts_{};
  std::span<std::uint16_t> free_{};
  std::uint32_t count_ = 0;  ///< That are free.
};

}  // namespace tessera
