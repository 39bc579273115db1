// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which contributions of others are held: all that have blocks near places that matter, and of the
// rest the nearest, as far as there is room. What is far is dropped whole when room is short, and
// asked for again when it matters: its robot, or others who hold it, send it.
#pragma once

#include "tessera/exchange/internal/places_of_interest.hpp"
#include "tessera/exchange/internal/repair.hpp"

namespace tessera {

class Reach {
 public:
  Reach() noexcept = default;
  explicit Reach(const ExchangeConfig& config) noexcept
      : is_on_(config.far_contributions != 0),
        resolution_m_(config.resolution_m),
        places_(config.contributions - config.own_contributions) {}

  /// Without places all matters alike. From the next tick() on.
  void set(std::span<const Point3d> p_global, double radius_m) noexcept {
    interest_.set(p_global, radius_m);
  }
  /// Decides again, if it is time to: at most kMostChanges contributions are dropped, kMostEmpty of
  /// which nothing is held give their places back, and kMostChanges are wanted again. Cost: for
  /// each contribution a distance to each place, and kMostChanges walks over the contributions.
  /// Returns at how many far ones it looked, each for a distance to each place and one look-up: at
  /// most kMostWalks times all there are.
  std::uint64_t tick(Ledger& ledger, Repair& repair, Instant now, ExchangeReport& counted) noexcept;
  static constexpr std::uint32_t kMostWalks = 9;  ///< kMostChanges, and one where nothing is near.

 private:
  static constexpr Duration kTurn{100'000};
  static constexpr std::uint32_t kMostChanges = 8;
  static_assert(kMostWalks == kMostChanges + 1);
  static constexpr std::uint32_t kMostEmpty = 64;
  /// Contributions of one robot that are asked for at once, so that what is nearest is there first.
  static constexpr std::uint32_t kAtOnce = 2;
  /// What nobody has all of keeps nothing else waiting for longer.
  static constexpr Duration kPatience{5'000'000};
  /// In 1024 of the storage that is fullest (ReplicaStore::fullness). Under the first what is far
  /// is asked for, once all within reach is there; over the second what is farthest is dropped.
  static constexpr std::uint32_t kSome = 768;
  static constexpr std::uint32_t kShort = 896;
  /// A far one is given a place again, though nothing near needs it, where less is in use.
  static constexpr std::uint32_t kPlenty = 512;
  /// Another robot that announced within this time that it has all of one is there still.
  static constexpr Duration kElsewhereTime{120'000'000};

  using CountByRobot = std::array<std::uint32_t, Replicas::kMostRobots>;

  /// Finds how far all are. True iff something within reach found no room; whose that is.
  [[nodiscard]] bool measure(Ledger& ledger, std::uint32_t& starved_robot) const noexcept;
  void want(Ledger& ledger, Repair& repair, std::uint32_t fullness, Instant now) const noexcept;
  static void set_far(Ledger& ledger, Repair& repair, HeldContribution& one, bool far,
                      Instant now) noexcept;
  [[nodiscard]] static bool is_awaited(const HeldContribution& one, Instant now) noexcept {
    return !one.far && !one.whole && !one.full && now - one.wanted_at < kPatience;
  }
  /// Something within reach is not there yet.
  [[nodiscard]] static bool is_waiting(Ledger& ledger, Instant now) noexcept;
  [[nodiscard]] static HeldContribution* next_to_want(Ledger& ledger, const CountByRobot& awaited,
                                                      double most_m) noexcept;
  /// What may be dropped, farthest first; of one robot alone, if it is given.
  [[nodiscard]] static HeldContribution* farthest(Ledger& ledger, bool is_needed,
                                                  const std::uint32_t* robot, Instant now) noexcept;
  /// Places that are to be free, for what is new.
  [[nodiscard]] std::uint32_t spare_places() const noexcept { return places_ / 16 + 1; }
  /// starved: the robot of something within reach that found no room, or null.
  void drop(Ledger& ledger, std::uint32_t fullness, const std::uint32_t* starved, Instant now,
            ExchangeReport& counted) noexcept;
  void drop_empty(Ledger& ledger, ExchangeReport& counted) const noexcept;
  void ask_again(Ledger& ledger, Repair& repair, Instant now) noexcept;
  /// Returns at how many far ones it looked.
  std::uint64_t recall(Ledger& ledger, std::uint32_t fullness, Instant now,
                       ExchangeReport& counted) const noexcept;
  /// O(far ones).
  [[nodiscard]] FarContribution* nearest(Ledger& ledger, std::uint32_t most_segments,
                                         double most_m) const noexcept;

  bool is_on_ = false;
  double resolution_m_ = 0.0;
  std::uint32_t places_ = 0;
  PlacesOfInterest interest_{};
  Instant due_ = Instant::long_ago();
  bool has_dropped_ = false;  ///< What found no room was not asked for since.
};

}  // namespace tessera
