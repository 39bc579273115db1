// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot's local map and what makes it: integrator, deadline, and the window that follows the
// robot. For the thread that has the scans.
#pragma once

#include "tessera/map/map_file.hpp"
#include "tessera/robot/internal/eviction_queue.hpp"
#include "tessera/robot/robot_config.hpp"

namespace tessera {

/// For one thread; others read its map through a MapReader each.
class Mapper {
 public:
  /// Bytes of arena that make takes.
  [[nodiscard]] static constexpr std::size_t required_bytes(const RobotSettings& config) noexcept {
    return arena_bytes<Mapper>(1) + tessera::required_bytes(config.map) +
           Integrator::required_bytes(config.scan, config.inference);
  }
  /// A mapper in the arena, of use as long as its memory is. clock: for deadlines. Fails as
  /// LocalMap::make, Integrator::make and MovingWindow::make.
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
  /// has BlockArchive::clear, as submaps ask for.
  void set_archive(const BlockArchive& archive) noexcept { archive_ = archive; }

  /// Moves the window to the scan and integrates it, within RobotConfig::deadline_us from now_us on
  /// if there is a deadline. now_us: as of the clock; the sum must not overflow. Cost: as
  /// MovingWindow::step and Integrator::integrate.
  ScanReport integrate(const ScanView& scan, std::int64_t now_us) noexcept;

  /// The same, to be done at due_us on the clock, whatever the configuration says.
  ScanReport integrate_until(const ScanView& scan, std::int64_t due_us) noexcept;
  /// Another limit of a scan's work than InferenceConfig::work_budget; 0: none.
  void set_work_budget(std::uint64_t work) noexcept { integrator_.set_work_budget(work); }
  /// Empties map and archive, as for a new submap. False, and nothing is done: the archive cannot
  /// be emptied, or what publishes has to take notice of something before. O(index).
  bool clear() noexcept;
  /// Reads a map file into the map. As load_blocks; header: as load_header gave it.
  MapFileStatus load(const ByteSource& source, const MapFileHeader& header,
                     MapFileBuffer& buffer) noexcept {
    return load_blocks(source, header, buffer, map_);
  }

  [[nodiscard]] const LocalMap& map() const noexcept { return map_; }
  /// For what is done to the map between scans: filling it, saving it block by block.
  [[nodiscard]] LocalMap& map() noexcept { return map_; }
  [[nodiscard]] const Integrator& integrator() const noexcept { return integrator_; }
  /// For scans with a clock of their own.
  [[nodiscard]] Integrator& integrator() noexcept { return integrator_; }
  [[nodiscard]] bool has_window() const noexcept { return has_window_; }
  /// What the window did since the mapper was made.
  [[nodiscard]] const WindowReport& window() const noexcept { return window_report_; }
  /// Of its memory, what holds something, and what is scratch.
  [[nodiscard]] std::size_t used_bytes() const noexcept {
    return map_.usage().used_bytes + scratch_bytes_;
  }
  [[nodiscard]] std::size_t scratch_bytes() const noexcept { return scratch_bytes_; }

  /// Blocks leave by way of this queue, as others have them; nullptr: they just leave.
  void set_eviction_queue(EvictionQueue* evictions) noexcept { evictions_ = evictions; }

 private:
  friend struct MapperArchive;
  void step_window(const ScanView& scan) noexcept;
  bool evict(const Block& block) noexcept;
  [[nodiscard]] bool is_archived(BlockKey key) const noexcept;
  Status reload(BlockKey key) noexcept;

  LocalMap map_;
  Integrator integrator_;
  Deadline deadline_;
  MovingWindow window_;
  BlockArchive archive_{};
  EvictionQueue* evictions_ = nullptr;
  WindowReport window_report_{};
  SlabPool::Counts reserve_{};
  std::int64_t deadline_us_ = 0;
  std::size_t scratch_bytes_ = 0;
  bool has_window_ = false;
};

}  // namespace tessera
