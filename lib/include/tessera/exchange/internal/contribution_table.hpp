// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Places of contributions: who gets one, who gives way, and which of them this robot publishes.
//
// Invariant: no contribution has a slot of the store that is not open, and each open one has its
// own.
#pragma once

#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/exchange/exchange_config.hpp"
#include "tessera/exchange/internal/held_contribution.hpp"
#include "tessera/replica/replica_store.hpp"

namespace tessera {

class ContributionTable {
 public:
  /// Who wants a place: nothing but a name, a frame, a frame that its robot itself sent, or this
  /// robot.
  enum class Claim : std::uint8_t { kName, kFrame, kPresent, kOwn };

  [[nodiscard]] static constexpr std::size_t required_bytes(const ExchangeConfig& config) noexcept {
    return arena_bytes<HeldContribution>(config.contributions);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<ContributionTable> make(Arena& arena, const ExchangeConfig& config,
                                                      const ReplicaStore& store) noexcept;
  ContributionTable() noexcept = default;

  // All are O(contributions) but where another cost is stated.

  [[nodiscard]] HeldContribution* find(const ContributionId& id) noexcept;
  /// A place for one that has none, or null: counted. Names take free places alone.
  [[nodiscard]] HeldContribution* add(const ContributionId& id, Claim claim, Instant now,
                                      ExchangeReport& counted) noexcept;
  /// True iff add() would give one that has none a place for its frame.
  [[nodiscard]] bool has_place_for_frame(const ContributionId& id) noexcept;
  /// True iff a frame of one that has no place would displace a name, or a lower one, of its robot.
  [[nodiscard]] bool would_displace(const ContributionId& id) noexcept;
  /// Gives it a frame, and a slot of the store if it has none. Fails with kInvalidArgument iff it
  /// is none; as ReplicaStore::open, and nothing was changed. O(contributions).
  [[nodiscard]] Status set_frame(HeldContribution& contribution, const Matrix34d& T_global_map,
                                 std::uint32_t revision) const noexcept;
  /// Empties a place and the contribution's slot. O(the place's index).
  void drop(HeldContribution& contribution) noexcept;
  /// Drops those of which is(contribution) is true, and returns how many.
  template <class Is>
  std::uint32_t drop_if(Is&& is) noexcept {
    std::uint32_t dropped = 0;
    for (HeldContribution& contribution : places_) {
      if (!contribution.used || !is(contribution)) continue;
      drop(contribution);
      ++dropped;
    }
    return dropped;
  }
  /// Drops names for which nothing came.
  void drop_empty_names(Instant now) noexcept;
  /// As Ledger::drop_unlisted. Returns how many.
  std::uint32_t drop_unlisted(std::uint32_t robot, std::uint32_t epoch, Instant now) noexcept;

  [[nodiscard]] std::span<HeldContribution> places() noexcept { return places_; }
  [[nodiscard]] std::span<const HeldContribution> places() const noexcept { return places_; }
  /// O(1).
  [[nodiscard]] std::uint32_t number_of(const HeldContribution& contribution) const noexcept {
    return static_cast<std::uint32_t>(&contribution - places_.data());
  }
  [[nodiscard]] bool has_any_of(std::uint32_t robot) const noexcept;

  /// This robot publishes it from now on. O(1).
  void publish_as(HeldContribution& contribution) noexcept {
    contribution.own = true;
    publishing_ = number_of(contribution);
    ++opened_;
  }
  /// The one that this robot publishes, or null. O(1).
  [[nodiscard]] HeldContribution* publishing() noexcept {
    return publishing_ == kNobody ? nullptr : &places_[publishing_];
  }
  [[nodiscard]] const HeldContribution* publishing() const noexcept {
    return publishing_ == kNobody ? nullptr : &places_[publishing_];
  }
  /// Places are kept for this robot's own as at the start. O(1).
  void end_own() noexcept { opened_ = 0; }

  /// Codes and proofs of a record that is held now, or no more. O(1).
  void add_bytes(HeldContribution& contribution, std::uint32_t bytes) noexcept {
    contribution.record_bytes += bytes;
    held_bytes_ += bytes;
  }
  void take_bytes(HeldContribution& contribution, std::uint32_t bytes) noexcept {
    contribution.record_bytes -= bytes;
    held_bytes_ -= bytes;
  }
  [[nodiscard]] std::uint64_t held_bytes() const noexcept { return held_bytes_; }
  /// Fingerprint::folded() over all contributions with their frames.
  [[nodiscard]] std::uint64_t digest() const noexcept;

 private:
  static constexpr std::uint32_t kNobody = ~std::uint32_t{0};
  [[nodiscard]] HeldContribution* free_place(bool own) noexcept;
  [[nodiscard]] HeldContribution* place_of_silent(Instant now) noexcept;
  [[nodiscard]] HeldContribution* displaced_of_robot(const ContributionId& id, bool proven,
                                                     bool& refused) noexcept;

  ReplicaStore store_{};
  double resolution_m_ = 0.0;
  std::uint32_t per_robot_ = 0;
  std::uint32_t own_places_ = 0;
  std::span<HeldContribution> places_;
  std::uint32_t publishing_ = kNobody;
  std::uint32_t opened_ = 0;
  std::uint64_t held_bytes_ = 0;
};

}  // namespace tessera
