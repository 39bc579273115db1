// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot has to do with others: what it publishes of its map, what it exchanges, and the map
// of all. For the thread that has the network.
#pragma once

#include "tessera/robot/internal/eviction_queue.hpp"
#include "tessera/robot/robot_config.hpp"
#include "tessera/submap/submap_cutter.hpp"

namespace tessera {

/// For one thread; others read the global map through a GlobalReader each.
class Sharer {
 public:
  /// Bytes of arena that make takes.
  [[nodiscard]] static constexpr std::size_t required_bytes(const RobotSettings& config,
                                                            int num_components) noexcept {
    return arena_bytes<Sharer>(1) + Publisher::required_bytes(config.publisher, num_components) +
           GlobalMap::required_bytes(config.global, num_components) +
           Exchange::required_bytes(config.exchange, num_components);
  }
  /// A sharer in the arena, of use as long as its memory is, with the robot's first contribution
  /// opened. What keys name must outlive it. Fails as Publisher::make, GlobalMap::make,
  /// Exchange::make and Exchange::open.
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

  /// Where the robot is, with every scan that it takes: what is new near it is published first, and
  /// its way is summed up for RobotSettings::submap_length_m. p_map: metres; out of the grid it is
  /// of no account. O(1).
  void set_focus(const Point3d& p_map) noexcept;
  /// What arrived, from anybody, as Exchange::receive.
  void receive(std::span<const std::byte> datagram, std::int64_t now_us) noexcept {
    exchange_.receive(datagram, now_us);
  }
  /// Publishes what has changed in map, and goes on with the global map. map: the same always;
  /// another thread may write to it meanwhile (MapReader). To be called at an even pace. Cost: as
  /// Publisher::tick, and work_per_tick of GlobalMap::step.
  PublisherReport tick(const LocalMap& map, std::int64_t now_us) noexcept;

  // --- Submaps -----------------------------------------------------------------------------------
  //
  // A submap that ends is published whole first: from the request on ticks hold nothing off, until
  // all that has changed up to then is noted and nothing waits, or for RobotSettings::submap_ticks.
  // After that nothing is published until open_submap() was called, which counts as lost what
  // waits, and what has changed and was not noted. The map is to be cleared (Mapper::clear) between
  // that call and the next tick. Robot does both.
  //
  // Where another thread has the map, it must be handed over: that thread stops writing when
  // it learns of submap_due(), this one calls open_submap() then, and no tick until that one has
  // cleared the map. What it writes until it stops is of the old submap, published or counted; what
  // it would write between open_submap() and Mapper::clear() would be lost uncounted.

  /// Asks for a new submap with this frame. Fails with kInvalidArgument iff it is no frame
  /// (GridTransform::make); kBusy iff one is being waited for; kResourceExhausted iff there is no
  /// number left.
  [[nodiscard]] Status request_submap(const Matrix34d& T_global_map) noexcept;
  /// The submap that ends is published, as far as it ever will be.
  [[nodiscard]] bool submap_due() const noexcept { return flush_.due; }
  /// Opens the submap that was asked for. map: as tick's, and not written to until it was cleared.
  /// Fails with kInvalidArgument iff none is due; else as Exchange::open, and then the request is
  /// over, and all goes on as before it: the map must not be cleared. O(Publisher::clear +
  /// Publisher::unnoted).
  [[nodiscard]] Status open_submap(const LocalMap& map) noexcept;
  /// Moves a submap of this start to another frame, nothing being sent anew but that. One that was
  /// requested for submap_length_m and is not open yet follows the submap that it continues; one of
  /// request_submap has the frame that was given there. Fails with kInvalidArgument iff there is no
  /// such submap or it is no frame.
  [[nodiscard]] Status set_frame(std::uint32_t submap, const Matrix34d& T_global_map) noexcept;
  /// Leaves the epoch, as Exchange::overtaken() asks for: publishes the whole map anew in an epoch
  /// above it; of a map with a window, what is in memory: blocks that are archived follow when they
  /// are back in the map, as reading all of an archive would take too long. floor:
  /// RobotSettings::floor from now on. A submap that was requested is none any more. Fails as
  /// Exchange::open, and then nothing is published until it succeeds.
  [[nodiscard]] Status reopen(std::uint32_t epoch, std::uint32_t floor) noexcept;
  [[nodiscard]] const SubmapReport& submap() const noexcept { return submap_; }
  /// T_global_map of the submap that is published into.
  [[nodiscard]] const Matrix34d& frame() const noexcept { return frame_; }

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
           !submap_.ending && (evictions_ == nullptr || !evictions_->is_withdrawing());
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

  /// What a submap that ends still has to do.
  struct Flush {
    Matrix34d T_global_map = Matrix34d::Identity();  ///< Of the next one.
    std::uint64_t rounds = 0;                        ///< Of the publisher's, at which all is noted.
    std::uint32_t ticks_left = 0;
    bool due = false;
    bool keeps_frame = false;  ///< Of the submap that ends, wherever that is moved.
  };
  PublisherReport publish(const LocalMap& map, std::int64_t now_us) noexcept;
  void note_flush(const LocalMap& map) noexcept;
  void note_way(const Point3d& p_map) noexcept;
  [[nodiscard]] Status set_up(Arena& arena, const RobotConfig& config, const ClassTable& classes,
                              const RobotKeys& keys) noexcept;

  EvictionQueue* evictions_ = nullptr;
  Publisher publisher_;
  GlobalMap global_;
  Exchange exchange_;
  PublisherBudget budget_{};
  Matrix34d frame_ = Matrix34d::Identity();
  SubmapReport submap_{};
  Flush flush_{};
  SubmapCutter cutter_{};
  double resolution_m_ = 0.0;  ///< Of the local map.
  std::uint64_t work_per_tick_ = 0;
  std::uint32_t submap_ticks_ = 1;
  std::size_t scratch_bytes_ = 0;
  std::uint64_t work_left_ = 0;
  std::uint64_t fusion_work_ = 0;
  std::uint32_t ticks_since_scan_ = 0;
  bool near_first_ = false;
};

}  // namespace tessera
