// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot from scan to global map in one thread: a Mapper and a Sharer. Without sockets or a clock:
// scans, datagrams and times are handed in.
#pragma once

#include "tessera/robot/mapper.hpp"
#include "tessera/robot/sharer.hpp"

namespace tessera {

class Robot {
 public:
  /// Bytes of arena that make takes. num_components: of the class table.
  [[nodiscard]] static constexpr std::size_t required_bytes(const RobotSettings& config,
                                                            int num_components) noexcept {
    return arena_bytes<Robot>(1) + Mapper::required_bytes(config) +
           Sharer::required_bytes(config, num_components) +
           (config.window ? EvictionQueue::required_bytes(config.archived_blocks) : 0) +
           arena_bytes<PlacedBox>(config.exchange.teammates) +
           arena_bytes<WatchedPoint>(watched_points(config));
  }
  /// A robot in the arena, of use as long as its memory is. clock: for deadlines. What keys name
  /// must outlive it. Fails with kInvalidArgument iff a setting is out of its range;
  /// kResourceExhausted iff the arena has under required_bytes left or is not aligned to
  /// kArenaAlignment.
  [[nodiscard]] static Result<Robot*> make(Arena& arena, const RobotConfig& config,
                                           const ClassTable& classes, const RobotKeys& keys,
                                           const Clock& clock) noexcept;
  /// Unusable until one from make() is move-assigned.
  Robot() noexcept = default;
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;
  Robot(Robot&&) = delete;
  Robot& operator=(Robot&&) = delete;
  ~Robot() = default;

  /// As Mapper::integrate, Sharer::note_scan and Sharer::note_place; now_us is the scan's stamp
  /// too. Other robots that say where they are are left out, if the scan names none itself.
  ScanReport integrate(const ScanView& scan, std::int64_t now_us) noexcept {
    const ScanView view = with_others(scan, now_us);
    return noted(view, now_us, mapper_->integrate(view, now_us));
  }
  /// The same as Mapper::integrate_until. stamp_us: of the scan, for corrections, and of the clock
  /// of receive().
  ScanReport integrate_until(const ScanView& scan, std::int64_t due_us,
                             std::int64_t stamp_us) noexcept {
    const ScanView view = with_others(scan, stamp_us);
    return noted(view, stamp_us, mapper_->integrate_until(view, due_us));
  }
  // The rest as Sharer's functions of the same names.
  void receive(std::span<const std::byte> datagram, std::int64_t now_us) noexcept {
    sharer_->receive(datagram, now_us);
  }
  PublisherReport tick(std::int64_t now_us) noexcept {
    return sharer_->tick(mapper_->maps(), now_us);
  }
  /// The next scan is the first of another submap with this frame, as soon as the submap before the
  /// one at hand is published and kept. Fails as Sharer::set_next_frame, with kBusy iff one that
  /// was asked for has not begun yet, and with kInvalidArgument iff there are no submaps.
  [[nodiscard]] Status new_submap(const Matrix34d& T_global_map) noexcept;
  [[nodiscard]] Status set_frame(std::uint32_t submap, const Matrix34d& T_global_map) noexcept {
    return sharer_->set_frame(submap, T_global_map);
  }
  CorrectionReport correct(const CorrectedTrajectory& trajectory, std::uint32_t revision) noexcept {
    return sharer_->correct(trajectory, revision);
  }
  CorrectionReport correct(const CorrectedFrames& frames, std::uint32_t revision) noexcept {
    return sharer_->correct(frames, revision);
  }
  void set_route(std::span<const Point3d> p_global) noexcept { sharer_->set_route(p_global); }
  void fuse() noexcept { sharer_->fuse(); }
  bool fuse_in_spare_time() noexcept { return sharer_->fuse_in_spare_time(); }
  void finish() noexcept { sharer_->finish(); }
  [[nodiscard]] std::size_t send(std::int64_t now_us, std::span<std::byte> into) noexcept {
    return sharer_->send(now_us, into);
  }
  [[nodiscard]] bool idle() const noexcept { return sharer_->idle(); }

  [[nodiscard]] Mapper& mapper() noexcept { return *mapper_; }
  [[nodiscard]] Sharer& sharer() noexcept { return *sharer_; }
  [[nodiscard]] const Sharer& sharer() const noexcept { return *sharer_; }
  [[nodiscard]] Exchange& exchange() noexcept { return sharer_->exchange(); }
  [[nodiscard]] const Exchange& exchange() const noexcept {
    return static_cast<const Sharer*>(sharer_)->exchange();
  }
  [[nodiscard]] const LocalMap& map() const noexcept { return mapper_->map(); }
  [[nodiscard]] const LocalMaps& maps() const noexcept { return mapper_->maps(); }
  [[nodiscard]] const GlobalMap& global() const noexcept { return sharer_->global(); }
  [[nodiscard]] const Publisher& publisher() const noexcept { return sharer_->publisher(); }
  [[nodiscard]] std::uint64_t fusion_work() const noexcept { return sharer_->fusion_work(); }
  [[nodiscard]] const RobotConfig& config() const noexcept { return config_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return required_bytes(config_, map().num_components());
  }
  /// Of memory_bytes(), what holds something, and what is scratch.
  [[nodiscard]] std::size_t used_bytes() const noexcept {
    return mapper_->used_bytes() + sharer_->used_bytes();
  }

 private:
  static constexpr std::size_t watched_points(const RobotSettings& config) noexcept {
    return config.objections == 0 ? 0 : Objections::kMostPoints;
  }
  [[nodiscard]] ScanView with_others(const ScanView& scan, std::int64_t now_us) noexcept;
  ScanReport noted(const ScanView& scan, std::int64_t stamp_us, const ScanReport& report) noexcept;

  RobotConfig config_{};
  Mapper* mapper_ = nullptr;
  Sharer* sharer_ = nullptr;
  std::span<PlacedBox> boxes_;  ///< Scratch: of teammates.
  std::span<WatchedPoint> watched_;
  std::uint32_t watched_in_ = 0;  ///< The submap in whose frame they are.
};

}  // namespace tessera
