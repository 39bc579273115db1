// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot has to do with others: what it publishes of its map, what it exchanges, and the map
// of all. For the thread that has the network.
#pragma once

#include "tessera/robot/robot_config.hpp"

namespace tessera {

/// For one thread; others read the global map through a GlobalReader each.
class Sharer {
 public:
  /// Bytes of arena that make takes.
  [[nodiscard]] static std::size_t required_bytes(const RobotConfig& config,
                                                  int num_components) noexcept;
  /// A sharer in the arena, of use as long as its memory is, with the robot's first contribution
  /// opened. What keys name must outlive it. Fails as Publisher::make, GlobalMap::make,
  /// Exchange::make and Exchange::open.
  [[nodiscard]] static Result<Sharer*> make(Arena& arena, const RobotConfig& config,
                                            const ClassTable& classes,
                                            const RobotKeys& keys) noexcept;
  /// Of no use: make() gives those that are.
  Sharer() noexcept = default;
  Sharer(const Sharer&) = delete;
  Sharer& operator=(const Sharer&) = delete;

  /// Where the robot is, with every scan that it takes: what is new near it is published first.
  /// p_map: metres; out of the grid it is of no account. O(1).
  void set_focus(const Point3d& p_map) noexcept;
  /// What arrived, from anybody, as Exchange::receive.
  void receive(std::span<const std::byte> datagram, std::int64_t now_us) noexcept {
    exchange_.receive(datagram, now_us);
  }
  /// Publishes what has changed in map, and goes on with the global map. map: the same always. To
  /// be called at an even pace. Cost: as Publisher::tick, and work_per_tick of GlobalMap::step.
  PublisherReport tick(const LocalMap& map, std::int64_t now_us) noexcept;
  /// Goes on with the global map, as far as this tick's work is not spent: what has arrived is seen
  /// before the next tick then.
  void fuse() noexcept;
  /// The same beside what a tick may do, in a small piece: some milliseconds. False: nothing waits.
  bool fuse_in_spare_time() noexcept;
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
    return publisher_.waiting() == 0 && !global_.busy() && ticks_since_scan_ > 2;
  }

  [[nodiscard]] Exchange& exchange() noexcept { return exchange_; }
  [[nodiscard]] const Exchange& exchange() const noexcept { return exchange_; }
  [[nodiscard]] const GlobalMap& global() const noexcept { return global_; }
  [[nodiscard]] const Publisher& publisher() const noexcept { return publisher_; }
  /// Work that was done on the global map.
  [[nodiscard]] std::uint64_t fusion_work() const noexcept { return fusion_work_; }
  /// Of its memory, what holds something, and what is scratch.
  [[nodiscard]] std::size_t used_bytes() const noexcept;

 private:
  static constexpr std::int64_t kNone = INT64_MIN;
  static constexpr std::uint64_t kSpareWork = 50'000;

  [[nodiscard]] Status set_up(Arena& arena, const RobotConfig& config, const ClassTable& classes,
                              const RobotKeys& keys) noexcept;

  Publisher publisher_;
  GlobalMap global_;
  Exchange exchange_;
  PublisherBudget budget_{};
  Matrix34d T_global_map_ = Matrix34d::Identity();
  double resolution_m_ = 0.0;  ///< Of the local map.
  std::uint64_t work_per_tick_ = 0;
  std::size_t scratch_bytes_ = 0;
  std::uint64_t work_left_ = 0;
  std::uint64_t fusion_work_ = 0;
  std::int64_t first_tick_us_ = kNone;
  std::uint32_t ticks_since_scan_ = 0;
  bool near_first_ = false;
};

}  // namespace tessera
