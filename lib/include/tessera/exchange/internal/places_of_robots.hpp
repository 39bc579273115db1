// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How many places the contributions of each robot have, those of each kind apart.
#pragma once

#include <algorithm>

#include "tessera/base/arena.hpp"
#include "tessera/base/assert.hpp"
#include "tessera/base/status.hpp"
#include "tessera/replica/contribution_kind.hpp"

namespace tessera {

/// A sorted list and no hash table: whoever chooses the robots' numbers, there is room for each
/// that has a place.
class PlacesOfRobots {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(std::uint32_t places) noexcept {
    return arena_bytes<Count>(places);
  }
  /// places: how many there are in all. Fails with kResourceExhausted iff the arena is too small.
  /// O(places).
  [[nodiscard]] static Result<PlacesOfRobots> make(Arena& arena, std::uint32_t places) noexcept {
    if (arena.remaining_bytes() < required_bytes(places)) return Status::kResourceExhausted;
    PlacesOfRobots made;
    made.counts_ = arena.take<Count>(places);
    return made;
  }
  PlacesOfRobots() noexcept = default;

  /// Those of the robot of id that are of its kind. O(log places).
  [[nodiscard]] std::uint32_t count(const ContributionId& id) const noexcept {
    const std::size_t at = find(key_of(id));
    return at < size_ && counts_[at].key == key_of(id) ? counts_[at].places : 0;
  }
  /// Counts one more, of no more in all than there are places. O(robots).
  void add(const ContributionId& id) noexcept {
    const std::size_t at = find(key_of(id));
    if (at == size_ || counts_[at].key != key_of(id)) {
      TESSERA_ASSERT(size_ < counts_.size());
      const auto from = counts_.begin() + static_cast<std::ptrdiff_t>(at);
      const auto end = counts_.begin() + static_cast<std::ptrdiff_t>(size_);
      std::copy_backward(from, end, end + 1);
      counts_[at] = {key_of(id), 0};
      ++size_;
    }
    ++counts_[at].places;
  }
  /// Counts one less of those that were added. O(robots).
  void remove(const ContributionId& id) noexcept {
    const std::size_t at = find(key_of(id));
    TESSERA_ASSERT(at < size_ && counts_[at].key == key_of(id));
    if (--counts_[at].places != 0) return;
    const auto from = counts_.begin() + static_cast<std::ptrdiff_t>(at);
    std::copy(from + 1, counts_.begin() + static_cast<std::ptrdiff_t>(size_), from);
    --size_;
  }

 private:
  struct Count {
    std::uint64_t key = 0;
    std::uint32_t places = 0;
  };
  [[nodiscard]] static std::uint64_t key_of(const ContributionId& id) noexcept {
    return std::uint64_t{id.robot} << 2U | static_cast<std::uint64_t>(kind_of(id));
  }
  /// Where the key is, or would be.
  [[nodiscard]] std::size_t find(std::uint64_t key) const noexcept {
    const auto counts = counts_.first(size_);
    const auto found =
        std::lower_bound(counts.begin(), counts.end(), key,
                         [](const Count& one, std::uint64_t k) { return one.key < k; });
    return static_cast<std::size_t>(found - counts.begin());
  }

  std::span<Count> counts_;  ///< The first size_, by key; robots that have none are not in it.
  std::size_t size_ = 0;
};

}  // namespace tessera
