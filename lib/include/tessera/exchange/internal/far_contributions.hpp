// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Contributions of which nothing is held, as they are far from all places that matter to this
// robot: what their origins say of them, and where they lie. Each takes the same few hundred bytes,
// however many records it has.
#pragma once

#include "tessera/base/arena.hpp"
#include "tessera/exchange/internal/held_contribution.hpp"
#include "tessera/exchange/internal/places_of_interest.hpp"
#include "tessera/grid/internal/key_index.hpp"

namespace tessera {

/// One of them.
struct FarContribution : KnownContribution {
  bool used = false;
  std::uint32_t segments = 0;  ///< That its records took when it was held, or may take.
  BlockExtent extent;          ///< Of the frame's message, and of all that was held of it.
  WorldBox box;                ///< Of the extent, in the global frame.

  [[nodiscard]] const ContributionId& id() const noexcept { return statement.id; }
  /// Somebody announces more than is known of it.
  [[nodiscard]] bool is_behind(const AnnouncedContribution& announced) const noexcept {
    return (announced.stated && announced.latest > statement.latest) ||
           announced.frame_revision > frame_revision;
  }
};

class FarContributions {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(std::uint32_t places) noexcept {
    return places == 0 ? 0
                       : arena_bytes<FarContribution>(places) + arena_bytes<std::uint32_t>(places) +
                             KeyIndex::required_bytes(places);
  }
  /// places: how many there may be; 0: none. Fails with kResourceExhausted iff the arena is too
  /// small. O(places).
  [[nodiscard]] static Result<FarContributions> make(Arena& arena, std::uint32_t places,
                                                     std::uint64_t hash_seed) noexcept;
  FarContributions() noexcept = default;

  /// O(1).
  [[nodiscard]] FarContribution* find(const ContributionId& id) noexcept;
  /// A place with this name, which has none yet; null where all are taken. O(1).
  [[nodiscard]] FarContribution* add(const ContributionId& id) noexcept;
  void remove(FarContribution& one) noexcept;  ///< O(1).
  /// Removes those of which is(one) is true, and returns how many. O(places).
  template <class Is>
  std::uint32_t remove_if(Is&& is) noexcept {
    std::uint32_t removed = 0;
    for (FarContribution& one : places_) {
      if (!one.used || !is(one)) continue;
      remove(one);
      ++removed;
    }
    return removed;
  }
  [[nodiscard]] std::span<FarContribution> places() noexcept { return places_; }
  [[nodiscard]] std::span<const FarContribution> places() const noexcept { return places_; }
  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }
  [[nodiscard]] bool has_room() const noexcept { return size_ < places_.size(); }

 private:
  [[nodiscard]] BlockKey key_of(const ContributionId& id) const noexcept;

  std::span<FarContribution> places_;
  std::span<std::uint32_t> free_;  ///< The last of them is taken next.
  KeyIndex index_{};
  std::uint64_t salt_ = 0;
  std::uint32_t size_ = 0;
};

}  // namespace tessera
