// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot's local map and what makes it: integrator, deadline, the window that follows the robot,
// or the submaps that it is cut into. For the thread that has the scans.
#pragma once

#include <algorithm>

#include "tessera/map/local_maps.hpp"
#include "tessera/map/map_file.hpp"
#include "tessera/robot/internal/eviction_queue.hpp"
#include "tessera/robot/robot_config.hpp"

namespace tessera {

/// What became of a robot's submaps.
struct SubmapCounts {
  std::uint32_t by_length = 0;
  std::uint32_t by_time = 0;
  std::uint32_t by_memory = 0;
  std::uint32_t by_jump = 0;
  std::uint32_t by_request = 0;
  /// Scans with which a submap should have ended, and went on: the one before it was still needed.
  std::uint64_t late = 0;
  /// Scans that were left out, as they are beyond a jump and no submap could begin for them.
  std::uint64_t left_out = 0;
};

/// For one thread; others read its map through a MapReader each.
class Mapper {
 public:
  /// Bytes of arena that make takes.
  [[nodiscard]] static constexpr std::size_t required_bytes(const RobotSettings& config) noexcept {
    return arena_bytes<Mapper>(1) +
           LocalMaps::required_bytes(config.map, config.most_submaps != 0) +
           Integrator::required_bytes(config.scan, config.inference);
  }
  /// A mapper in the arena, of use as long as its memory is. clock: for deadlines. Fails as
  /// LocalMap::make, Integrator::make and MovingWindow::make, and with kInvalidArgument iff
  /// settings of submaps are out of their range, or there are submaps and a window.
  [[nodiscard]] static Result<Mapper*> make(Arena& arena, const RobotConfig& config,
                                            const ClassTable& classes, const Clock& clock) noexcept;
  /// Unusable until one from make() is move-assigned.
  Mapper() noexcept = default;
  Mapper(const Mapper&) = delete;
  Mapper& operator=(const Mapper&) = delete;
  Mapper(Mapper&&) = delete;
  Mapper& operator=(Mapper&&) = delete;
  ~Mapper() = default;

  /// Where blocks that leave the window are kept, from the next scan on; it must outlive the
  /// mapper's use. Without it they are lost and counted; in a Robot, whose blocks others have, they
  /// stay in the map, and its archive must be empty at first. The map can be cleared if the archive
  /// has BlockArchive::clear.
  void set_archive(const BlockArchive& archive) noexcept { archive_ = archive; }

  /// Moves the window to the scan and integrates it, within RobotConfig::deadline_us from now_us on
  /// if there is a deadline. now_us: as of the clock; the sum must not overflow. Where a submap is
  /// due, the scan is the first of the next one. ScanReport::pose is kBusy, and nothing was done,
  /// iff it is beyond a jump and the next submap cannot begin yet, or never, as most_submaps are
  /// used up. Cost: as MovingWindow::step and Integrator::integrate, and O(index) where a submap
  /// begins.
  ScanReport integrate(const ScanView& scan, std::int64_t now_us) noexcept;

  /// The same, to be done at due_us on the clock, whatever the configuration says.
  ScanReport integrate_until(const ScanView& scan, std::int64_t due_us) noexcept;
  /// For callers that may wait rather than lose: moves the window to a scan that is to come, as
  /// integrate() does once more. False: the map has no room for WindowConfig::reserve yet, as the
  /// archive or what publishes has not taken enough. Cost: as MovingWindow::step.
  [[nodiscard]] bool make_room(const ScanView& scan) noexcept;
  /// Another limit of a scan's work than InferenceConfig::work_budget; 0: none.
  void set_work_budget(std::uint64_t work) noexcept { integrator_.set_work_budget(work); }
  /// The next scan is the first of another submap: as its place is in another frame than those
  /// before it (kJump), or as it was asked for (nothing). For any thread; of use with submaps
  /// alone.
  void end_submap(std::optional<SubmapEnd> why) noexcept {
    asked_.fetch_or(why == SubmapEnd::kJump ? kJumped : kRequested, std::memory_order_relaxed);
  }
  /// One that was asked for has not begun yet. For any thread.
  [[nodiscard]] bool ends_submap() const noexcept {
    return asked_.load(std::memory_order_relaxed) != 0;
  }
  /// From the current submap on it begins fewer than it was made for: as whoever publishes them
  /// has places for so many. Of no account if it is not in submaps. O(1).
  void set_most_submaps(std::uint32_t most) noexcept {
    const std::uint32_t before = maps_.number() - first_submap_;
    if (most_submaps_ != 0 && most < most_submaps_ - std::min(before, most_submaps_))
      most_submaps_ = before + most;
  }
  [[nodiscard]] const SubmapCounts& submaps() const noexcept { return submaps_; }
  /// Of the current submap, so far.
  [[nodiscard]] SubmapNote submap_note() const noexcept {
    const std::uint64_t last = scans_ == 0 ? 0 : scans_ - 1;
    return {.first_scan = first_scan_, .last_scan = last, .length_m = way_m_};
  }
  /// The map was filled with what an earlier start has mapped: it goes on from there. note: of the
  /// current submap then. Before the first scan.
  void resume(const SubmapNote& note) noexcept;
  /// Another submap of the earlier start: what was filled in so far has ended. continues: it lies
  /// in the same frame. Before the first scan, and at most once. False: there are no submaps.
  bool resume_next(const SubmapNote& ended, bool continues) noexcept;
  /// Empties map and archive; of submaps the current one. False, and nothing is done: the archive
  /// cannot be emptied, or what publishes has to take notice of something before. O(index).
  bool clear() noexcept;
  /// Reads a map file into the map. As load_blocks; header: as load_header gave it.
  MapFileStatus load(const ByteSource& source, const MapFileHeader& header,
                     MapFileBuffer& buffer) noexcept {
    return load_blocks(source, header, buffer, map());
  }

  /// The map, or that of the current submap: another one after each scan with which one began.
  [[nodiscard]] const LocalMap& map() const noexcept { return maps_.map(); }
  /// For what is done to the map between scans: filling it, saving it block by block.
  [[nodiscard]] LocalMap& map() noexcept { return maps_.map(); }
  /// For other threads, and who needs submaps that have ended.
  [[nodiscard]] LocalMaps& maps() noexcept { return maps_; }
  [[nodiscard]] const LocalMaps& maps() const noexcept { return maps_; }
  [[nodiscard]] const Integrator& integrator() const noexcept { return integrator_; }
  /// For scans with a clock of their own.
  [[nodiscard]] Integrator& integrator() noexcept { return integrator_; }
  [[nodiscard]] bool has_window() const noexcept { return has_window_; }
  /// What the window did since the mapper was made.
  [[nodiscard]] const WindowReport& window() const noexcept { return window_report_; }
  /// Of its memory, what holds something, and what is scratch.
  [[nodiscard]] std::size_t used_bytes() const noexcept {
    const LocalMap* const other = maps_.in_submaps() ? &maps_.of(maps_.number() + 1) : nullptr;
    return map().usage().used_bytes + (other != nullptr ? other->usage().used_bytes : 0) +
           scratch_bytes_;
  }
  [[nodiscard]] std::size_t scratch_bytes() const noexcept { return scratch_bytes_; }

  /// Blocks leave by way of this queue, as others have them; nullptr: they just leave.
  void set_eviction_queue(EvictionQueue* evictions) noexcept { evictions_ = evictions; }

 private:
  friend struct MapperArchive;
  static constexpr std::uint32_t kJumped = 1;  ///< Of asked_.
  static constexpr std::uint32_t kRequested = 2;
  template <class Integrate>
  ScanReport integrate_at(const ScanView& scan, std::int64_t now_us,
                          Integrate&& integrate) noexcept;
  [[nodiscard]] bool take_place(const ScanView& scan, std::int64_t now_us) noexcept;
  [[nodiscard]] std::uint32_t places_left() const noexcept;
  [[nodiscard]] SubmapAllowance allowance() const noexcept;
  [[nodiscard]] bool may_begin(bool asked) const noexcept;
  void begin_submap(std::optional<SubmapEnd> why, bool jumps) noexcept;
  void step_window(const Point3d& p_map) noexcept;
  bool evict(const Block& block) noexcept;
  [[nodiscard]] bool is_archived(BlockKey key) const noexcept;
  Status reload(BlockKey key) noexcept;

  LocalMaps maps_;
  SubmapCutter cutter_{};
  SubmapCounts submaps_{};
  std::uint64_t scans_ = 0;       ///< That were integrated.
  std::uint64_t first_scan_ = 0;  ///< Of the current submap.
  double way_m_ = 0.0;            ///< In it, up to its last scan.
  std::uint32_t first_submap_ = 0;
  std::uint32_t most_submaps_ = 0;
  std::atomic<std::uint32_t> asked_{0};  ///< Reasons to begin a submap, a bit each.
  Integrator integrator_;
  Deadline deadline_;
  MovingWindow window_;
  BlockArchive archive_{};
  EvictionQueue* evictions_ = nullptr;
  WindowReport window_report_{};
  std::int64_t deadline_us_ = 0;
  std::size_t scratch_bytes_ = 0;
  bool has_window_ = false;
};

}  // namespace tessera
