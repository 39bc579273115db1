// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Contributions that move to another frame or leave, on their own or with all of their robot's
// world (robot_places.hpp), and how far that is: first all blocks that a
// move touches are marked, then they are brought up to date beside the map (staged), then they are
// shown, all at once, and copied into the map (merged).
#pragma once

#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/fusion/internal/global_records.hpp"
#include "tessera/fusion/internal/robot_places.hpp"
#include "tessera/replica/objection.hpp"

namespace tessera {

class FrameMoves {
 public:
  using Slot = Replicas::Slot;
  /// Of what is under way; kSettled: nothing.
  enum class Phase : std::uint8_t { kSettled, kMarking, kStaging, kMerging };

  [[nodiscard]] static constexpr std::size_t required_bytes(std::uint32_t contributions) noexcept {
    return arena_bytes<Move>(contributions);
  }
  /// Without what places take. Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<FrameMoves> make(Arena& arena, std::uint32_t contributions,
                                               const RobotPlaces& places = {}) noexcept;
  FrameMoves() noexcept = default;

  [[nodiscard]] Phase phase() const noexcept { return phase_; }
  /// Whether a move is under way or waits.
  [[nodiscard]] bool busy() const noexcept {
    return phase_ != Phase::kSettled || waiting_ != 0 || places_.waits();
  }
  [[nodiscard]] bool leaving(Slot slot) const noexcept { return moves_[slot].leaves; }

  /// Gives a contribution that was opened its frame, and its part in the move of its robot's world
  /// if one is being marked. O(robots).
  void open(Replicas& replicas, Slot slot, const GridTransform& T_world_local) noexcept;
  /// RobotPlaces::set().
  [[nodiscard]] Result<Replicas::Change> place(
      std::uint32_t robot, const std::optional<Matrix34d>& T_team_world) noexcept {
    return places_.set(robot, T_team_world);
  }
  [[nodiscard]] const RobotPlaces& places() const noexcept { return places_; }
  /// Has a contribution move, if revision is later than that of the frame it has or waits for.
  /// session: as it is with this frame, if it is one. O(1).
  Replicas::Change set_frame(const Replicas& replicas, Slot slot,
                             const GridTransform& T_world_local, std::uint32_t revision,
                             const MapSession& session = {}) noexcept;
  /// Forgets moves that wait, of a slot that is to be closed. False iff one is under way. O(1).
  [[nodiscard]] bool forget(Slot slot) noexcept;
  /// Has a contribution leave. Nothing happens where the slot is empty. O(1).
  void remove(const Replicas& replicas, Slot slot) noexcept;
  /// Marks what a version of a block changes. False iff the global grid has no place for a block.
  /// O(27 blocks, 54 while its move is being marked).
  [[nodiscard]] bool mark_change(const Replicas& replicas, GlobalRecords& records, Slot slot,
                                 BlockKey key) const noexcept {
    return mark_change(replicas, records, slot, key, moves_[slot].under_way);
  }
  /// Marks what an objection of a contribution of them changes. O(27 blocks, 54 as above).
  void mark_change(const Replicas& replicas, GlobalRecords& records, Slot objections,
                   const Objection& objection) const noexcept;

  /// All that wait go together from now on, if nothing is under way. What is hidden and stays so
  /// needs no move. O(contributions) if any waits.
  void begin(Replicas& replicas) noexcept;
  /// kMarking: marks where each block of what moves is and will be; once that is done the frames
  /// are in force, and the phase is kStaging. Returns the work done.
  std::uint64_t mark(Replicas& replicas, GlobalRecords& records, std::uint64_t budget) noexcept;
  /// kStaging ends: what was staged is the map from now on.
  void begin_merging() noexcept;
  /// kMerging ends once the replicas of what leaves are dropped: a block of each at least. Returns
  /// the work done.
  std::uint64_t finish(Replicas& replicas, std::uint64_t budget) noexcept;
  /// Whether something has no place since the last move, so that there may be room.
  [[nodiscard]] bool has_hidden() const noexcept { return has_hidden_; }

 private:
  struct Move {
    RobotPlaces::Placed to;  ///< Of the move that is under way.
    GridTransform to_world;
    MapSession to_session{};
    std::uint32_t revision = 0;
    bool under_way = false;
    bool leaves = false;  ///< It is to be removed, or is being.
    bool waits = false;   ///< For the moves that are under way to end.
    GridTransform next;   ///< In its robot's world.
    MapSession next_session{};
    std::uint32_t next_revision = 0;
  };
  void wait(Move& move) noexcept {
    waiting_ += move.waits ? 0U : 1U;
    move.waits = true;
  }
  [[nodiscard]] bool begin(Replicas& replicas, Slot slot, const RobotPlaces::Place* place) noexcept;
  void put_in_force(Replicas& replicas, Slot slot) noexcept;
  void end_marking(Replicas& replicas) noexcept;
  [[nodiscard]] bool mark_change(const Replicas& replicas, GlobalRecords& records, Slot slot,
                                 BlockKey key, bool moves) const noexcept;
  void mark_objection(const Replicas& replicas, GlobalRecords& records,
                      const Replicas::Replica& record) const noexcept;
  std::uint64_t drop_replicas(Replicas& replicas, Slot slot, std::uint64_t budget) noexcept;

  std::span<Move> moves_;  ///< By slot.
  RobotPlaces places_{};
  Phase phase_ = Phase::kSettled;
  std::uint32_t waiting_ = 0;
  Slot marked_slot_ = 0;
  std::uint32_t marked_record_ = 0;  ///< The next to be marked.
  bool marking_slot_ = false;
  bool has_hidden_ = false;
};

}  // namespace tessera
