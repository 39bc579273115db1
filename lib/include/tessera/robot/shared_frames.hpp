// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Frames that a team finds by itself: this robot compares its map with those that it holds, states
// the links that it accepts, and places all robots where the team's links have them.
// docs/frames.md.
#pragma once

#include <optional>
#include <span>

#include "tessera/exchange/exchange.hpp"
#include "tessera/fusion/global_map.hpp"
#include "tessera/robot/frames_config.hpp"
#include "tessera/robot/internal/link_maker.hpp"
#include "tessera/robot/internal/team_placement.hpp"

namespace tessera {

/// Of one robot, for the thread that has its exchange and its global map.
class SharedFrames {
 public:
  /// Bytes of arena that make takes: 17 MB with up to 16 robots, most of it for the pair at hand,
  /// 19 MB with 64; and kBlockBytes for each of replicas.blocks. 0 where frames are given: else it
  /// is not known at compile time.
  static constexpr std::size_t kBlockBytes = 32;
  [[nodiscard]] static constexpr std::size_t required_bytes(const FramesConfig& config,
                                                            const GlobalMapConfig& global,
                                                            int num_components) noexcept {
    if (config.mode == FrameMode::kGiven) return 0;
    return arena_bytes<SharedFrames>(1) +
           LinkMaker::required_bytes(config, global, num_components) +
           TeamPlacement::required_bytes(config);
  }
  /// Null where frames are given. origin_world: where the map's origin is in the world that it is
  /// published in. exchange and global must outlive it. Fails with kInvalidArgument
  /// iff a setting is out of its range (FramesConfig); kResourceExhausted iff the arena is too
  /// small.
  [[nodiscard]] static Result<SharedFrames*> make(Arena& arena, const FramesConfig& config,
                                                  const Point3d& origin_world, Exchange& exchange,
                                                  GlobalMap& global,
                                                  const ClassTable& classes) noexcept;
  SharedFrames() noexcept = default;
  SharedFrames(const SharedFrames&) = delete;
  SharedFrames& operator=(const SharedFrames&) = delete;
  SharedFrames(SharedFrames&&) = delete;
  SharedFrames& operator=(SharedFrames&&) = delete;
  ~SharedFrames() = default;

  /// Once a tick: states how this robot's frame is known; solves for the team's frames where links
  /// have changed, once a second at most (TeamFrames::solve); moves the frames in use a step; and
  /// does one piece of a search. p_world: where this robot is, in the world that its contributions
  /// are published in.
  void tick(const Point3d& p_world, Instant now) noexcept;
  /// One piece of a search that is under way, in spare time; false: nothing is under way. Cost: as
  /// FrameFinder::step.
  bool step(Instant now) noexcept { return links_.step(now); }

  /// T_team_world of this robot, where its world is in the frame of its global map: in use.
  [[nodiscard]] const Matrix34d& own_frame() const noexcept { return placement_.own(); }
  /// The same of any robot; null: it is not placed.
  [[nodiscard]] const Matrix34d* frame_of(std::uint32_t robot) const noexcept {
    return placement_.placed(robot);
  }
  /// Whether this robot's frame is more than its own: given, or others are in it. O(robots).
  [[nodiscard]] bool is_joined() const noexcept;
  /// Frames of all robots of the team, by ascending number.
  [[nodiscard]] std::span<const PlacedRobot> robots() const noexcept { return placement_.robots(); }
  /// The links that were judged last, and what became of each.
  [[nodiscard]] std::span<const FrameLink> links() const noexcept { return placement_.links(); }
  [[nodiscard]] std::span<const FrameLinkReport> verdicts() const noexcept {
    return placement_.verdicts();
  }
  /// What this robot has found, of each other one.
  [[nodiscard]] std::span<const PairState> pairs() const noexcept { return links_.pairs(); }
  [[nodiscard]] const FramesReport& report() const noexcept { return placement_.report(); }
  [[nodiscard]] const FramesConfig& config() const noexcept { return config_; }
  /// A search is under way, a link waits to be stated, or a frame in use is not where the links
  /// have it yet.
  [[nodiscard]] bool busy() const noexcept { return links_.busy() || placement_.busy(); }

 private:
  void state_prior(Instant now) noexcept;

  FramesConfig config_{};
  Point3d origin_world_ = Point3d::Zero();
  Exchange* exchange_ = nullptr;
  GlobalMap* global_ = nullptr;
  LinkMaker links_;
  TeamPlacement placement_;
  std::optional<std::uint32_t> stated_epoch_;
  Instant prior_due_ = Instant::long_ago();  ///< When it is tried again.
};

}  // namespace tessera
