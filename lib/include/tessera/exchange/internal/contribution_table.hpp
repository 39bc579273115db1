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
#include "tessera/exchange/internal/far_contributions.hpp"
#include "tessera/exchange/internal/places_of_robots.hpp"
#include "tessera/replica/replica_store.hpp"

namespace tessera {

class ContributionTable {
 public:
  /// Who wants a place: nothing but a name, a frame, a frame that its robot itself sent, or this
  /// robot.
  enum class Claim : std::uint8_t { kName, kFrame, kPresent, kOwn };

  [[nodiscard]] static constexpr std::size_t required_bytes(const ExchangeConfig& config) noexcept {
    return arena_bytes<HeldContribution>(config.contributions) +
           PartPool<VersionBuckets>::required_bytes(VersionIndex::kParts * large(config)) +
           PartPool<Coverage::Part>::required_bytes(large(config)) +
           arena_bytes<Name>(config.contributions) +
           arena_bytes<std::uint32_t>(config.contributions) +
           FarContributions::required_bytes(config.far_contributions) +
           PlacesOfRobots::required_bytes(config.contributions);
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
  /// Gives it a frame, and a slot of the store if it has none. session: as with this frame, if it
  /// is one. Fails with kInvalidArgument iff it is no frame; as ReplicaStore::open, and nothing was
  /// changed. O(contributions).
  [[nodiscard]] Status set_frame(HeldContribution& contribution, const Matrix34d& T_global_map,
                                 std::uint32_t revision,
                                 const MapSession& session = {}) const noexcept;
  /// Empties a place and the contribution's slot. O(the place's index).
  void drop(HeldContribution& contribution) noexcept;
  /// Drops those of which is(contribution) is true, and returns how many.
  template <class Is>
  std::uint32_t drop_if(Is&& is) noexcept {
    std::uint32_t dropped = 0;
    for (HeldContribution& contribution : places()) {
      if (!contribution.used || !is(contribution)) continue;
      drop(contribution);
      ++dropped;
    }
    return dropped;
  }
  /// The same by names, and of those that are far too. O(contributions + far ones).
  template <class Is>
  std::uint32_t drop_named_if(Is&& is) noexcept {
    return drop_if([&](const HeldContribution& one) { return is(one.id); }) +
           far_.remove_if([&](const FarContribution& one) { return is(one.id()); });
  }
  /// Drops names for which nothing came.
  void drop_empty_names(Instant now) noexcept;
  /// As Ledger::drop_unlisted. Returns how many.
  std::uint32_t drop_unlisted(std::uint32_t robot, std::uint32_t epoch, Instant now) noexcept;

  // --- Far ones ----------------------------------------------------------------------------------

  [[nodiscard]] FarContributions& far() noexcept { return far_; }
  [[nodiscard]] const FarContributions& far() const noexcept { return far_; }
  /// All blocks that it has, as far as is known; those that its origin published lately may not be.
  [[nodiscard]] BlockExtent extent_of(const HeldContribution& contribution) const noexcept;
  /// Drops all records of one and gives its place back: it is a far one from now on. Where there is
  /// no room for it, another one of the robot that has most is forgotten: counted. False iff it is
  /// of this robot, or its frame, extent or statement is not known. O(its index + far ones).
  [[nodiscard]] bool put_far(HeldContribution& contribution, ExchangeReport& counted) noexcept;
  /// Its robot has fewer contributions here than it may have. O(1).
  [[nodiscard]] bool has_place_for(const FarContribution& one) const noexcept;
  /// Gives a far one a place, with no records yet. Null iff its robot may have no more, or there is
  /// no free place, or slot in the store; nothing was changed then. O(contributions).
  [[nodiscard]] HeldContribution* recall(FarContribution& one, Instant now) noexcept;
  /// Places that others' contributions may take, and that are free. O(1).
  [[nodiscard]] std::uint32_t free_places() const noexcept;
  /// Nothing of it is missing that one should wait for. Objections of an epoch that a robot has
  /// left, and what it stated about frames then, do not count: only the process that is gone may
  /// have had all. O(contributions).
  [[nodiscard]] bool lacks_nothing(const HeldContribution& contribution) const noexcept;
  /// Contributions that have slots in the store and are none here: they are being removed. O(the
  /// same).
  [[nodiscard]] bool is_removing() const noexcept;

  /// Up to the last one that is used; some before it may not be.
  [[nodiscard]] std::span<HeldContribution> places() noexcept { return places_.first(top_); }
  [[nodiscard]] std::span<const HeldContribution> places() const noexcept {
    return places_.first(top_);
  }
  /// By its number, of whatever was there once: see its generation. O(1).
  [[nodiscard]] HeldContribution& place(std::uint32_t number) noexcept { return places_[number]; }
  [[nodiscard]] const HeldContribution& place(std::uint32_t number) const noexcept {
    return places_[number];
  }
  /// O(1).
  [[nodiscard]] std::uint32_t number_of(const HeldContribution& contribution) const noexcept {
    return static_cast<std::uint32_t>(&contribution - places_.data());
  }
  [[nodiscard]] bool has_any_of(std::uint32_t robot) const noexcept;

  /// This robot publishes it from now on. O(1).
  void publish_as(HeldContribution& contribution) noexcept {
    own_as(contribution);
    publishing_ = number_of(contribution);
  }
  /// The same beside the one that it publishes. No place is kept for what is no submap. O(1).
  void own_as(HeldContribution& contribution) noexcept {
    const bool was_counted = is_counted(contribution);
    contribution.own = true;
    if (was_counted && !is_counted(contribution)) of_robots_.remove(contribution.id);
    opened_ += is_map(contribution.id) ? 1U : 0U;
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
  /// Contributions that may have thousands of records, or hundreds of gaps, at once and with no
  /// wider buckets for that. Submaps that are settled have neither.
  static constexpr std::uint32_t large(const ExchangeConfig& config) noexcept {
    return config.contributions < 64 ? config.contributions : 64;
  }
  static constexpr std::uint32_t kNobody = ~std::uint32_t{0};
  /// Of a place: it is looked for among these, which are near each other in memory.
  struct Name {
    ContributionId id;
    bool used = false;
  };
  /// Places that others' contributions of a robot may have of this one's kind.
  [[nodiscard]] std::uint32_t most_of_robot(const ContributionId& id) const noexcept {
    switch (kind_of(id)) {
      case ContributionKind::kSession:
        return MapSession::kPlacesOfRobot;
      case ContributionKind::kObjections:
        return Objection::kPlacesOfRobot;
      case ContributionKind::kFrames:
        return FrameStatements::kPlacesOfRobot;
      case ContributionKind::kMap:
        break;
    }
    return per_robot_;
  }
  /// This robot has as many as it wants of its own maps and sessions. Of its objections, and of
  /// what it states about frames, it has those that others have, of its newest epochs.
  [[nodiscard]] static bool is_counted(const HeldContribution& one) noexcept {
    return one.used && (!one.own || !has_blocks(one.id));
  }
  void take_place(HeldContribution& place, const ContributionId& id, Instant now) noexcept;
  [[nodiscard]] HeldContribution* free_place(bool own) noexcept;
  [[nodiscard]] HeldContribution* place_of_silent(Instant now) noexcept;
  [[nodiscard]] HeldContribution* place_of_name() noexcept;
  void disown_earlier(const ContributionId& id) noexcept;
  struct Replaced {
    HeldContribution* lowest = nullptr;
    bool is_it = false;
  };
  [[nodiscard]] Replaced find_replaced(const ContributionId& id) noexcept;
  [[nodiscard]] HeldContribution* displaced_of_robot(const ContributionId& id, bool proven,
                                                     bool& refused) noexcept;

  ReplicaStore store_{};
  double resolution_m_ = 0.0;
  std::uint32_t per_robot_ = 0;  ///< Of maps.
  std::uint32_t own_places_ = 0;
  std::span<HeldContribution> places_;
  std::span<Name> names_;
  std::span<std::uint32_t> of_robot_;  ///< Scratch: numbers of places.
  std::size_t top_ = 0;                ///< One above the last place that is used.
  std::uint32_t used_ = 0;             ///< Places.
  FarContributions far_{};
  PlacesOfRobots of_robots_{};  ///< Of those that is_counted().
  std::uint32_t publishing_ = kNobody;
  std::uint32_t opened_ = 0;
  std::uint64_t held_bytes_ = 0;
};

}  // namespace tessera
