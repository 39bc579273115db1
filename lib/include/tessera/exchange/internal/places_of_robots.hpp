// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How many places the contributions of each robot have, those of sessions apart.
#pragma once

#include "tessera/base/assert.hpp"
#include "tessera/grid/internal/key_index.hpp"
#include "tessera/replica/map_session.hpp"
#include "tessera/replica/replicas.hpp"

namespace tessera {

class PlacesOfRobots {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(std::uint32_t places) noexcept {
    return KeyIndex::required_bytes(places);
  }
  /// places: how many there are in all. Fails with kResourceExhausted iff the arena is too small.
  /// O(places).
  [[nodiscard]] static Result<PlacesOfRobots> make(Arena& arena, std::uint32_t places,
                                                   std::uint64_t hash_seed) noexcept {
    const Result<KeyIndex> index = KeyIndex::make(arena, places, hash_seed);
    if (!index.ok()) return index.status();
    PlacesOfRobots made;
    made.counts_ = *index;
    return made;
  }
  PlacesOfRobots() noexcept = default;

  /// Those of the robot of id: of its sessions if id is one, of all else if it is none. O(1).
  [[nodiscard]] std::uint32_t count(const ContributionId& id) const noexcept {
    return counts_.find(key_of(id)).value_or(0);
  }
  /// Counts one more. False iff the robot is a new one for whose number there is no room in the
  /// index; nothing was changed then. O(1).
  [[nodiscard]] bool add(const ContributionId& id) noexcept {
    const std::uint32_t before = count(id);
    if (before == 0) return counts_.insert(key_of(id), 1) == Status::kOk;
    counts_.assign(key_of(id), before + 1);
    return true;
  }
  /// Counts one less of those that were added. O(1).
  void remove(const ContributionId& id) noexcept {
    const std::uint32_t before = count(id);
    TESSERA_ASSERT(before != 0);
    if (before == 1) {
      static_cast<void>(counts_.erase(key_of(id)));
    } else {
      counts_.assign(key_of(id), before - 1);
    }
  }

 private:
  [[nodiscard]] static BlockKey key_of(const ContributionId& id) noexcept {
    return {std::uint64_t{id.robot} << 1U | (MapSession::is(id.submap) ? 1U : 0U)};
  }

  KeyIndex counts_{};  ///< Robots that have none are not in it.
};

}  // namespace tessera
