// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot has to do with others: what it publishes of its map, what it exchanges, and the map
// of all. For the thread that has the network.
#pragma once

#include <array>
#include <optional>

#include "tessera/map/local_maps.hpp"
#include "tessera/robot/internal/eviction_queue.hpp"
#include "tessera/robot/map_sessions.hpp"
#include "tessera/robot/objections.hpp"
#include "tessera/robot/robot_config.hpp"
#include "tessera/robot/shared_frames.hpp"
#include "tessera/submap/submap_frames.hpp"

namespace tessera {

/// For one thread; others read the global map through a GlobalReader each.
class Sharer {
 public:
  /// Bytes of arena that make takes.
  [[nodiscard]] static constexpr std::size_t required_bytes(const RobotSettings& config,
                                                            int num_components) noexcept {
    return arena_bytes<Sharer>(1) + Publisher::required_bytes(config.publisher, num_components) +
           GlobalMap::required_bytes(global_of(config), num_components) +
           Exchange::required_bytes(config.exchange, num_components) +
           SubmapFrames::required_bytes(most_frames(config)) +
           MapSessions::required_bytes(num_components) +
           Objections::required_bytes(config.objections, num_components) +
           SharedFrames::required_bytes(config.frames, config.global, num_components) +
           (config.submaps_before != 0 ? BlockContent::required_bytes(num_components) : 0);
  }
  /// A sharer in the arena, of use as long as its memory is, with the robot's first contribution
  /// opened. What keys name must outlive it. Fails with kInvalidArgument iff submap_ticks is 0, or
  /// reach_m negative, without far_contributions or where frames are not given, or
  /// teammate_margin_m or objections out of range; as Publisher::make, GlobalMap::make,
  /// Exchange::make, Exchange::open and SharedFrames::make.
  [[nodiscard]] static Result<Sharer*> make(Arena& arena, const RobotConfig& config,
                                            const ClassTable& classes,
                                            const RobotKeys& keys) noexcept;
  /// Unusable until one from make() is move-assigned.
  Sharer() noexcept = default;
  Sharer(const Sharer&) = delete;
  Sharer& operator=(const Sharer&) = delete;
  Sharer(Sharer&&) = delete;
  Sharer& operator=(Sharer&&) = delete;
  ~Sharer() = default;

  /// The scan that was integrated last, or one of the last: what is new near it is published first,
  /// and its pose is kept for corrections. maps: the same always. submap: that it was mapped into.
  /// stamp_us: of the clock that corrections are in. A place out of the grid is of no account.
  /// O(1).
  void note_scan(const LocalMaps& maps, std::uint32_t submap, std::int64_t stamp_us,
                 const Matrix34d& T_map_sensor) noexcept;
  /// Where the robot's body was at now_us, which the others receive with its size: the hull of
  /// InferenceConfig::body. Of no account where there is none, or tells_place() is false.
  /// stamp_us: the same on the clock of scans. As Exchange::note_place.
  void note_place(std::uint32_t submap, std::int64_t stamp_us, const Matrix34d& T_map_body,
                  std::int64_t now_us) noexcept;
  /// False: there is no body, or it is larger than others take (Presence::is_sendable).
  [[nodiscard]] bool tells_place() const noexcept { return tells_place_; }
  /// What arrived, from anybody, as Exchange::receive.
  void receive(std::span<const std::byte> datagram, std::int64_t now_us) noexcept {
    exchange_.receive(datagram, now_us);
  }
  /// Publishes what has changed in the local map, and goes on with the global map. maps: the same
  /// always; another thread may map into it meanwhile. To be called at an even pace. Cost: as
  /// Publisher::tick, and work_per_tick of GlobalMap::step; where a submap is opened, O(index) too.
  PublisherReport tick(LocalMaps& maps, std::int64_t now_us) noexcept;

  // --- Submaps and their frames ------------------------------------------------------------------
  //
  // A submap that has ended (LocalMaps::begin) is published whole first: ticks hold nothing off,
  // until nothing of it waits, or for RobotSettings::submap_ticks, after which what waits counts as
  // lost. Then the next one is opened. It lies in the frame of the one before it; if the poses
  // jumped, in the world as it is mapped; or as was asked for.

  /// Frame of the next submap, whenever that begins. Fails with kInvalidArgument iff it is no frame
  /// (GridTransform::make, encode_rigid).
  [[nodiscard]] Status set_next_frame(const LocalMaps& maps,
                                      const Matrix34d& T_global_map) noexcept;
  /// Moves a submap of this start to another frame, nothing being sent anew but that. Fails with
  /// kInvalidArgument iff there is no such submap or it is no frame, as above.
  [[nodiscard]] Status set_frame(std::uint32_t submap, const Matrix34d& T_global_map) noexcept;
  /// Moves the submaps to where a corrected trajectory has them, in the world that
  /// RobotConfig::T_global_map places, as SubmapFrames::correct; others receive the frames alone.
  /// The global map follows with fuse(), in pieces. Cost: as SubmapFrames::correct.
  CorrectionReport correct(const CorrectedTrajectory& trajectory, std::uint32_t revision) noexcept;
  /// The same by frames of submaps.
  CorrectionReport correct(const CorrectedFrames& frames, std::uint32_t revision) noexcept;
  /// Frames in the robot's world, and in which revision they are.
  [[nodiscard]] const SubmapFrames& frames() const noexcept { return frames_; }
  /// The frames of the submaps of an earlier start, which the map continues; the last of them is
  /// one that is in the local maps. are_known: what others have of earlier starts is moved to them.
  /// Before the first tick. Fails as SubmapFrames::restore, and with kInvalidArgument iff they are
  /// not of config.submaps_before and what follows, or the first that follows is out of the grid.
  [[nodiscard]] Status restore_frames(std::span<const SubmapFrame> frames, std::uint32_t revision,
                                      bool are_known) noexcept;
  /// Whether nobody who was heard has all of a submap of an earlier start. O(contributions).
  [[nodiscard]] bool is_missing(std::uint32_t submap) const noexcept;
  /// Publishes such a submap again, from where it was kept: its blocks from the one at `first` on,
  /// at most `count`. blocks: of that map, the same in each call. Returns how many were published,
  /// or left out for lack of room; 0 iff there are no more. Fails as Exchange::open_earlier.
  [[nodiscard]] Result<std::size_t> publish_earlier(std::uint32_t submap, const LocalMap& map,
                                                    std::span<const KeyedIndex> blocks,
                                                    std::size_t first, std::size_t count) noexcept;
  /// The maps of earlier days that this robot has loaded.
  [[nodiscard]] MapSessions& sessions() noexcept { return sessions_; }
  [[nodiscard]] const MapSessions& sessions() const noexcept { return sessions_; }
  /// Leaves the epoch, as Exchange::overtaken() asks for: publishes the whole map anew in an epoch
  /// above it; of a map with a window, what is in memory: blocks that are archived follow when they
  /// are back in the map, as reading all of an archive would take too long; of submaps, the one at
  /// hand. Map sessions are no longer open, as MapSessions::begin_epoch says. floor:
  /// RobotSettings::floor from now on. Fails as Exchange::open, and then nothing is
  /// published until it succeeds.
  [[nodiscard]] Status reopen(std::uint32_t epoch, std::uint32_t floor) noexcept;
  [[nodiscard]] const SubmapReport& submap() const noexcept { return submap_; }
  /// T_global_map of a submap that frames() has.
  [[nodiscard]] Matrix34d frame_of(std::uint32_t submap) const noexcept;
  /// T_global_map of the submap that is published into.
  [[nodiscard]] const Matrix34d& frame() const noexcept { return frame_; }

  // --- Frames that the team finds ----------------------------------------------------------------
  //
  // Where RobotSettings::frames are not given, frames of submaps above are in a world of this
  // robot's own, which the team places in the frame of the global map: frame_of() and the others
  // are T_world_map then, and what has "global" in its name is in the team's frame.

  /// Whether frame() and the others are in a frame that others know: given, or found by now.
  /// O(robots).
  [[nodiscard]] bool is_placed() const noexcept {
    return shared_ == nullptr || shared_->is_joined();
  }
  /// Null: frames are given.
  [[nodiscard]] const SharedFrames* shared_frames() const noexcept { return shared_; }
  /// Where this robot's world is in the frame of the global map; the identity where frames are
  /// given.
  [[nodiscard]] Matrix34d world_frame() const noexcept {
    return shared_ != nullptr ? shared_->own_frame() : Matrix34d(Matrix34d::Identity());
  }

  // --- What others have published ----------------------------------------------------------------

  /// Places to which the robot is going, the first kMostRoute of them, in the global frame: what
  /// others have published within RobotSettings::reach_m of them is wanted as what is near the
  /// robot is. From the next send() on; the route of before is forgotten. O(1).
  static constexpr std::size_t kMostRoute = PlacesOfInterest::kMost - 1;
  void set_route(std::span<const Point3d> p_global) noexcept;

  // --- Other robots ------------------------------------------------------------------------------

  /// Robots that said lately where they are, and whose frame is known.
  /// O(ExchangeConfig::teammates).
  [[nodiscard]] std::size_t teammates(std::int64_t now_us) const noexcept;
  /// The one at this place of them, by ascending numbers: where it is now in the global frame. It
  /// is no obstacle to be mapped, but one for whoever plans a way. Fails with kOutOfRange iff there
  /// are not so many. O(ExchangeConfig::teammates).
  [[nodiscard]] Result<TeammatePlace> teammate_at(std::size_t index,
                                                  std::int64_t now_us) const noexcept;
  /// Coordinates of the global frame to those of a submap, or of the one that is published.
  [[nodiscard]] Matrix34d map_from_global(std::uint32_t submap) const noexcept;
  /// Their boxes in a submap for a scan of that time, as far as into goes: for
  /// ScanView::teammates. Returns how many. O(ExchangeConfig::teammates^2).
  [[nodiscard]] std::size_t place_teammates(std::uint32_t submap, std::int64_t now_us,
                                            std::span<PlacedBox> into) const noexcept;

  // --- What others have, and this robot sees through --------------------------------------------

  /// Places of which the next scan should tell whether it sees through them, in a submap's frame:
  /// for ScanView::watched. Returns how many. moment: now, by whatever clock or count the scans
  /// have. O(into).
  [[nodiscard]] std::size_t place_watched(std::uint32_t submap, std::int64_t moment,
                                          std::span<WatchedPoint> into) noexcept {
    return objections_.place(map_from_global(submap), moment, into);
  }
  /// What that scan told of them, if it was mapped into that submap. taken: its moment; of a block
  /// it counts if that is after the block was first asked about. O(points).
  void note_watched(std::span<const WatchedPoint> watched, std::int64_t taken) noexcept {
    objections_.note(watched, taken);
  }
  [[nodiscard]] const ObjectionsReport& objections() const noexcept { return objections_.report(); }

  // --- The global map ----------------------------------------------------------------------------

  /// Goes on with the global map, as far as this tick's work is not spent: what has arrived is seen
  /// before the next tick then.
  void fuse() noexcept;
  /// The same beside what a tick may do, in a small piece: some milliseconds. False: nothing waits.
  bool fuse_in_spare_time() noexcept;
  /// The same with so much work of GlobalMap::step. Returns the work done.
  std::uint64_t fuse(std::uint64_t work) noexcept;
  /// Brings the global map up to date with all that has arrived, however long it takes.
  void finish() noexcept {
    while (fuse_in_spare_time()) {
    }
  }
  /// The next datagram to send, as Exchange::send.
  [[nodiscard]] std::size_t send(std::int64_t now_us, std::span<std::byte> into) noexcept {
    return exchange_.send(now_us, into);
  }
  /// Nothing waits to be published or fused, and there were ticks since the last scan to find out.
  [[nodiscard]] bool idle() const noexcept {
    return publisher_.waiting() == 0 && !global_.busy() && ticks_since_scan_ > 2 &&
           !submap_.ending && !sessions_.is_withdrawing() &&
           (shared_ == nullptr || !shared_->busy()) &&
           (evictions_ == nullptr || !evictions_->is_withdrawing());
  }

  [[nodiscard]] Exchange& exchange() noexcept { return exchange_; }
  [[nodiscard]] const Exchange& exchange() const noexcept { return exchange_; }
  [[nodiscard]] const GlobalMap& global() const noexcept { return global_; }
  [[nodiscard]] const Publisher& publisher() const noexcept { return publisher_; }
  /// Work that was done on the global map.
  [[nodiscard]] std::uint64_t fusion_work() const noexcept { return fusion_work_; }
  /// Of its memory, what holds something, and what is scratch.
  [[nodiscard]] std::size_t used_bytes() const noexcept;

  /// Blocks leave the local map by way of this queue; nullptr: none do.
  void set_eviction_queue(EvictionQueue* evictions) noexcept { evictions_ = evictions; }

 private:
  static constexpr std::uint64_t kSpareWork = 50'000;
  /// Between two looks at what others have of earlier epochs.
  static constexpr std::uint32_t kTicksOfEarlier = 16;

  static constexpr GlobalMapConfig global_of(const RobotSettings& config) noexcept {
    GlobalMapConfig global = config.global;
    global.place_robots = config.frames.mode != FrameMode::kGiven;
    return global;
  }
  static constexpr std::uint32_t most_frames(const RobotSettings& config) noexcept {
    return config.most_submaps == 0 ? 1 : config.most_submaps;
  }
  PublisherReport publish(const LocalMap& map, std::int64_t now_us) noexcept;
  void follow(const LocalMaps& maps) noexcept;
  void object(LocalMaps& maps) noexcept;
  /// Where frames are given: whose frames are not, publishes in a world of its own.
  void leave_out_other_worlds() noexcept;
  /// Whether one knows where the world of a robot lies.
  [[nodiscard]] bool is_placed(std::uint32_t robot) const noexcept;
  [[nodiscard]] bool is_published(const LocalMap& map) noexcept;
  void set_reach() noexcept;
  void open_next(LocalMaps& maps) noexcept;
  void move_earlier() noexcept;
  void take(const CorrectionReport& report) noexcept;
  [[nodiscard]] Status set_up(Arena& arena, const RobotConfig& config, const ClassTable& classes,
                              const RobotKeys& keys) noexcept;

  EvictionQueue* evictions_ = nullptr;
  Publisher publisher_;
  GlobalMap global_;
  Exchange exchange_;
  PublisherBudget budget_{};
  Matrix34d T_global_world_ = Matrix34d::Identity();
  Matrix34d frame_ = Matrix34d::Identity();
  SubmapFrames frames_{};
  MapSessions sessions_{};
  Objections objections_{};
  BlockContent earlier_{};  ///< Scratch: a block of a submap of an earlier start.
  std::optional<Matrix34d> T_world_map_next_{};  ///< That was asked for.
  SubmapReport submap_{};
  std::uint32_t ticks_left_ = 0;  ///< For the submap that has ended.
  std::uint32_t first_in_epoch_ = 0;
  std::uint32_t first_of_start_ = 0;  ///< Submaps below it are of earlier starts.
  std::uint32_t submaps_before_ = 0;
  std::uint32_t ticks_ = 0;
  bool continues_ = false;  ///< Submaps of an earlier start, which others have of earlier epochs.
  double resolution_m_ = 0.0;  ///< Of the local map.
  std::uint64_t work_per_tick_ = 0;
  std::uint32_t submap_ticks_ = 1;
  std::size_t scratch_bytes_ = 0;
  std::uint64_t work_left_ = 0;
  std::uint64_t fusion_work_ = 0;
  std::uint32_t ticks_since_scan_ = 0;
  bool near_first_ = false;
  double reach_m_ = 0.0;
  double teammate_margin_m_ = 0.0;
  bool tells_place_ = false;
  /// The robot's own place, if it is known, then those of its route.
  std::array<Point3d, PlacesOfInterest::kMost> places_{};
  std::size_t route_ = 0;
  bool has_place_ = false;
  Point3d p_world_ = Point3d::Zero();  ///< The same, in the world that is published in.
  SharedFrames* shared_ = nullptr;     ///< Null: frames are given.
  std::uint64_t statements_seen_ = 0;  ///< Replicas::frame_changes().
  Instant now_;                        ///< Of the last tick.
};

}  // namespace tessera
