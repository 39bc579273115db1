// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The maps of earlier days that a robot has loaded and shares beside its own map (MapSession). Each
// is published in pieces, from a map that the caller holds meanwhile, and can be removed.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "tessera/exchange/exchange.hpp"
#include "tessera/fusion/global_map.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

class MapSessions {
 public:
  static constexpr std::uint32_t kMost = MapSession::kMostOfRobot;

  /// How far the publication of one is.
  enum class State : std::uint8_t {
    kPublishing,  ///< Not all of its blocks are published yet.
    kShared,
    kLeaving,  ///< It was removed: it counts nothing, and its blocks are published empty.
  };
  /// One that was opened.
  struct Session {
    std::uint32_t submap = 0;  ///< Its number.
    State state = State::kPublishing;
    MapSession session{};
    std::uint32_t blocks = 0;          ///< That are published.
    std::uint32_t refused_blocks = 0;  ///< For lack of room.
    /// Of those that are still to be published empty: a record of the replicas, 0: none.
    std::uint32_t next_record = 0;
  };

  [[nodiscard]] static constexpr std::size_t required_bytes(int num_components) noexcept {
    return BlockContent::required_bytes(num_components);
  }
  /// exchange and global must outlive it. keep_earlier: sessions of this robot's epochs before
  /// count until end_earlier(); else they end now. has_frame: knows_own_frame; without, no session
  /// is opened. Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<MapSessions> make(Arena& arena, Exchange& exchange,
                                                const GlobalMap& global, int num_components,
                                                bool keep_earlier, bool has_frame) noexcept;
  /// Unusable until one from make() is assigned.
  MapSessions() noexcept = default;

  /// Shares a map from now on. map: all of it, with its digest in session; T_global_map: where it
  /// lies. Returns its number. Fails with kMismatch iff its resolution, classes or the weight of
  /// its free passes are not the robot's; kUnsupported iff the robot does not know its own frame
  /// (knows_own_frame); kInvalidArgument iff it is no frame, the weight is 0 or above
  /// MapSession::kFullWeight, or there is one with this digest; kResourceExhausted iff there are
  /// kMost, MapSession::kPlacesOfRobot were opened in this epoch, or there is no place for another
  /// contribution. O(contributions).
  [[nodiscard]] Result<std::uint32_t> open(const LocalMap& map, const MapSession& session,
                                           const Matrix34d& T_global_map) noexcept;
  /// Publishes blocks of it, from the one at `first` on, at most `count`. blocks: all of the map,
  /// the same in each call. Returns how many were published or refused; 0 iff there are no more,
  /// and then the map is not needed any more. Fails with kInvalidArgument iff there is no such
  /// session that is being published. O(count (512 components + bytes)).
  [[nodiscard]] Result<std::size_t> publish(std::uint32_t submap, const LocalMap& map,
                                            std::span<const KeyedIndex> blocks, std::size_t first,
                                            std::size_t count) noexcept;
  /// It counts no more, from the next work on the global map on; ticks free its memory, here and
  /// with the others. Fails with kInvalidArgument iff there is none, or it was removed before.
  /// O(1).
  [[nodiscard]] Status remove(std::uint32_t submap) noexcept;
  /// Sessions of this robot's earlier epochs end: what was to be kept of them is published again.
  void end_earlier() noexcept;
  /// What is open, by ascending numbers.
  [[nodiscard]] std::span<const Session> all() const noexcept {
    return std::span(sessions_).first(count_);
  }
  /// Blocks that were refused for lack of room, of all that were ever opened.
  [[nodiscard]] std::uint64_t refused_blocks() const noexcept { return refused_blocks_; }
  /// Whether a session that was removed has blocks left.
  [[nodiscard]] bool is_withdrawing() const noexcept;

  /// Goes on with what was removed, at most kBlocksOfTick blocks. For the sharer's tick.
  void tick() noexcept;
  /// A new epoch was begun: nothing is open in it yet. Those of the epoch before count until
  /// end_earlier(), if they were to be kept at the start; they cannot be removed alone any more.
  void begin_epoch() noexcept;

 private:
  static constexpr std::size_t kBlocksOfTick = 64;
  [[nodiscard]] Session* find(std::uint32_t submap) noexcept;
  [[nodiscard]] bool withdraw(Session& session, std::size_t& left) noexcept;

  Exchange* exchange_ = nullptr;
  const GlobalMap* global_ = nullptr;
  BlockContent content_{};  ///< Scratch.
  std::array<Session, kMost> sessions_{};
  std::size_t count_ = 0;
  std::uint32_t opened_ = 0;  ///< In this epoch.
  std::uint64_t refused_blocks_ = 0;
  bool keep_earlier_ = false;
  bool has_frame_ = true;
};

}  // namespace tessera
