// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where each robot's world lies in the team's frame: now, once the move that is under way is made,
// and once what waits is made too. A robot without a place is left out of the map;
// or, where robots state frames in the global one, lies as it states unless it is left out.
#pragma once

#include <optional>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/replica/contribution_kind.hpp"

namespace tessera {

class RobotPlaces {
 public:
  static constexpr std::uint32_t kMost = Replicas::kMostRobots;

  /// Where one robot's world lies.
  struct World {
    std::optional<Matrix34d> T_team_world;
    std::uint32_t number = 0;  ///< Of this place, from 1; 0: none.
  };
  /// A robot, and where its world lies.
  struct Place {
    std::uint32_t robot = 0;
    bool used = false;
    World now{};
    World to{};  ///< As now, unless a move is under way.
    std::optional<Matrix34d> next;
    /// Whether the move that is under way gives it another place.
    [[nodiscard]] bool moves() const noexcept { return now.number != to.number; }
  };
  /// Where a contribution lies.
  struct Placed {
    GridTransform T_global_local;
    bool hidden = false;  ///< Nowhere.
    std::uint32_t place = 0;
  };

  [[nodiscard]] static constexpr std::size_t required_bytes() noexcept {
    return arena_bytes<Place>(kMost);
  }
  /// as_stated: robots lie where they state, and can only be left out. Fails with
  /// kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<RobotPlaces> make(Arena& arena, double resolution_m,
                                                bool as_stated) noexcept;
  /// Not used: all contributions lie where their robots state.
  RobotPlaces() noexcept = default;

  [[nodiscard]] bool used() const noexcept { return !places_.empty(); }
  /// Whether a place waits to be taken.
  [[nodiscard]] bool waits() const noexcept { return waits_; }

  /// Has a robot's world lie elsewhere, or nowhere. Fails with kInvalidArgument iff places are not
  /// used, the transform is not rigid (check_rigid), or robots lie as they state and it is not the
  /// identity; kResourceExhausted iff kMost other robots have a place, or will have one. kStale: as
  /// it was asked for before. O(kMost).
  [[nodiscard]] Result<Replicas::Change> set(std::uint32_t robot,
                                             const std::optional<Matrix34d>& T_team_world) noexcept;
  /// All that wait go together from now on; none is under way. O(kMost).
  void begin() noexcept;
  /// What was under way is so now. O(kMost).
  void settle() noexcept;

  /// Whether it was asked that a robot lies nowhere, of those that lie as they state. O(kMost).
  [[nodiscard]] bool is_left_out(std::uint32_t robot) const noexcept;
  /// The first of these from this number on; nothing: there is none. O(kMost).
  [[nodiscard]] std::optional<std::uint32_t> next_left_out(std::uint32_t robot) const noexcept;

  /// Where the world of a robot lies, if find() gives this of it. O(1).
  [[nodiscard]] World now(const Place* place) const noexcept {
    return place != nullptr ? place->now : where_unasked();
  }
  /// The same once the move that is under way is made.
  [[nodiscard]] World to(const Place* place) const noexcept {
    return place != nullptr ? place->to : where_unasked();
  }
  /// Null: it was never asked for. O(kMost).
  [[nodiscard]] const Place* find(std::uint32_t robot) const noexcept;
  /// Where a contribution that its robot states to be at T_world_local lies, if its world lies
  /// there. Where it would be out of the grid it lies nowhere; what is no map lies anywhere. O(1).
  [[nodiscard]] Placed placed(const World& world, const ContributionId& id,
                              const GridTransform& T_world_local) const noexcept;

 private:
  [[nodiscard]] World where_unasked() const noexcept {
    World world;
    if (as_stated_) world.T_team_world = Matrix34d::Identity();
    return world;
  }

  std::span<Place> places_;
  bool as_stated_ = false;
  double resolution_m_ = 0.0;
  std::uint32_t numbers_ = 0;  ///< Places that were ever begun.
  bool waits_ = false;
};

}  // namespace tessera
