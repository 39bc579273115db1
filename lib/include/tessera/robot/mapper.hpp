// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot's local map and what makes it: for the thread that has the scans.
#pragma once

#include "tessera/map/map_file.hpp"
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
  /// LocalMap::make and Integrator::make.
  [[nodiscard]] static Result<Mapper*> make(Arena& arena, const RobotConfig& config,
                                            const ClassTable& classes, const Clock& clock) noexcept;
  /// Of no use: make() gives those that are.
  Mapper() noexcept = default;
  Mapper(const Mapper&) = delete;
  Mapper& operator=(const Mapper&) = delete;
  Mapper(Mapper&&) = delete;
  Mapper& operator=(Mapper&&) = delete;
  ~Mapper() = default;

  /// Integrates a scan, within RobotConfig::deadline_us from now_us on if there is a deadline.
  /// now_us: as of the clock; the sum must not overflow. Cost: as Integrator::integrate.
  ScanReport integrate(const ScanView& scan, std::int64_t now_us) noexcept;

  /// The same, to be done at due_us on the clock, whatever the configuration says.
  ScanReport integrate_until(const ScanView& scan, std::int64_t due_us) noexcept {
    return integrator_.integrate(map_, scan, deadline_, due_us);
  }
  /// Another limit of a scan's work than InferenceConfig::work_budget; 0: none.
  void set_work_budget(std::uint64_t work) noexcept { integrator_.set_work_budget(work); }
  /// Empties the map, as for a new submap. O(index).
  void clear() noexcept { map_.clear(); }
  /// Reads a map file into the map. As load_blocks; header: as load_header gave it.
  MapFileStatus load(const ByteSource& source, const MapFileHeader& header,
                     MapFileBuffer& buffer) noexcept {
    return load_blocks(source, header, buffer, map_);
  }

  [[nodiscard]] const LocalMap& map() const noexcept { return map_; }
  [[nodiscard]] const Integrator& integrator() const noexcept { return integrator_; }
  /// Of its memory, what holds something, and what is scratch.
  [[nodiscard]] std::size_t used_bytes() const noexcept {
    return map_.usage().used_bytes + scratch_bytes_;
  }

 private:
  LocalMap map_;
  Integrator integrator_;
  Deadline deadline_;
  std::int64_t deadline_us_ = 0;
  std::size_t scratch_bytes_ = 0;
};

}  // namespace tessera
