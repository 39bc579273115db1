// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Epochs of robots: below which floor they count no more, and what was published in this robot's
// name that this process did not publish.
#pragma once

#include <optional>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/exchange/internal/contribution_table.hpp"

namespace tessera {

class EpochFloors {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(const ExchangeConfig& config) noexcept {
    return arena_bytes<RobotFloor>(config.peers + 1) + arena_bytes<std::uint32_t>(config.peers + 1);
  }
  /// signs: of the fleet. Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<EpochFloors> make(Arena& arena, const ExchangeConfig& config,
                                                bool signs) noexcept;
  EpochFloors() noexcept = default;

  // --- Of all robots -----------------------------------------------------------------------------

  /// O(robots).
  [[nodiscard]] std::uint32_t of(std::uint32_t robot) const noexcept;
  /// The lowest epoch of its robot in which this contribution would count. O(robots).
  [[nodiscard]] std::uint32_t of(const ContributionId& id) const noexcept;
  /// The same of a robot's sessions, beside of(robot). O(robots).
  [[nodiscard]] std::uint32_t of_sessions(std::uint32_t robot) const noexcept;
  /// Takes the floor of another robot. may_fall: it may also be lower than before. False iff
  /// nothing has changed. O(robots contributions).
  bool note(std::uint32_t robot, std::uint32_t floor, bool may_fall,
            const ContributionTable& held) noexcept;
  /// The same for that of its sessions.
  bool note_sessions(std::uint32_t robot, std::uint32_t floor, bool may_fall,
                     const ContributionTable& held) noexcept;
  [[nodiscard]] std::span<const RobotFloor> all() const noexcept { return floors_.first(count_); }

  // --- Of this robot -----------------------------------------------------------------------------

  [[nodiscard]] std::uint32_t own() const noexcept { return own_floor_; }
  [[nodiscard]] std::uint32_t own_sessions() const noexcept { return own_session_floor_; }
  void set_own_sessions(std::uint32_t floor) noexcept { own_session_floor_ = floor; }
  /// True if only this process publishes this contribution.
  [[nodiscard]] bool is_of_this_process(const ContributionId& id) const noexcept {
    return id.robot == robot_ && id.epoch >= first_epoch_;
  }
  /// This process says what this epoch is, and later ones.
  void claim(std::uint32_t epoch) noexcept {
    if (epoch < first_epoch_) first_epoch_ = epoch;
  }
  /// An epoch was begun: what it is above is overtaken no more.
  void begin(std::uint32_t epoch) noexcept {
    if (overtaken_ && epoch > *overtaken_) overtaken_.reset();
  }
  /// Ends what this process published: a new epoch is at the floor or above.
  void end_own(std::uint32_t floor) noexcept {
    own_floor_ = floor;
    first_epoch_ = ~std::uint32_t{0};
  }
  /// Something else was published in this epoch of this robot.
  void overtake(std::uint32_t epoch) noexcept {
    overtaken_ = !overtaken_ || *overtaken_ < epoch ? epoch : *overtaken_;
  }
  /// What was stated in this robot's name. published: what this process publishes, or null. False
  /// iff it is of this process, or nothing comes of it.
  bool note_statement(const Statement& statement, std::uint64_t session,
                      const HeldContribution* stated, const HeldContribution* published) noexcept;
  /// Another robot knows of a floor of this one that is above its epoch: the counter of its epochs
  /// was lost. Nobody signed it: after three that were followed, one each 20 s is.
  void note_claim(std::uint32_t floor, const HeldContribution* published, Instant now) noexcept;
  /// The epoch that was heard in this robot's name and is not this process's, if there is one: a
  /// new epoch must be above it.
  [[nodiscard]] std::optional<std::uint32_t> overtaken() const noexcept { return overtaken_; }
  [[nodiscard]] std::uint64_t highest_session() const noexcept { return highest_session_; }

 private:
  [[nodiscard]] RobotFloor* place_of(std::uint32_t robot, const ContributionTable& held) noexcept;
  [[nodiscard]] bool may_rise_to(std::uint32_t epoch,
                                 const HeldContribution* published) const noexcept;

  std::uint32_t robot_ = 0;
  bool signs_ = false;
  std::span<RobotFloor> floors_;
  std::span<std::uint32_t> session_floors_;  ///< Of the same robots.
  std::size_t count_ = 0;
  std::uint32_t first_epoch_ = ~std::uint32_t{0};  ///< The lowest that claim() was called with.
  std::uint32_t own_floor_ = 0;
  std::uint32_t own_session_floor_ = 0;
  std::optional<std::uint32_t> overtaken_;  ///< Until an epoch above it is begun.
  std::uint32_t claims_ = 0;                ///< That were followed.
  Instant claimed_;                         ///< When the last of them was.
  std::uint64_t highest_session_ = 0;       ///< Heard in this robot's name.
};

}  // namespace tessera
