// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A recorded run in submaps: cuts them, writes each when it ends, and moves them by corrected
// trajectories.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/json.hpp"
#include "cli/map_report.hpp"
#include "maps/submaps.hpp"
#include "scans/pose_file.hpp"
#include "scans/scan.hpp"
#include "settings/map_options.hpp"
#include "tessera/robot/mapper.hpp"
#include "tessera/submap/submap_cutter.hpp"

namespace tessera {

/// Fails iff options are given that a map in submaps cannot have, or corrections of another map.
Outcome<void> check_submaps(const MapOptions& options);
/// Corrected poses find their scans by stamps; those of a dataset are read apart.
[[nodiscard]] inline bool needs_stamps(const MapOptions& options) {
  return options.dataset.empty() && !options.corrections.empty();
}

class MapSubmaps {
 public:
  /// Reads the corrections and opens the output. empty: a map without content. Fails with kUsage
  /// iff a file of corrections is none, or the output cannot be written.
  [[nodiscard]] static Outcome<std::unique_ptr<MapSubmaps>> make(const MapOptions& options,
                                                                 const MapIdentity& identity,
                                                                 const LocalMap& empty);
  /// For each scan before it is integrated: where a submap ended it is written, and the map is
  /// empty. scan: as its source gave it. Fails as SubmapWriter::add.
  Outcome<void> begin_scan(const Scan& scan, const ScanView& view, Mapper& mapper);
  /// For each scan after it: applies the corrections that reach as far.
  void end_scan();
  /// Writes the last submap and the table. Fails as SubmapWriter::add and commit.
  Outcome<MapSummary> finish(Mapper& mapper);
  /// What the submap took that took most.
  void describe(MapRun& run) const noexcept {
    run.usage = largest_;
    run.free_voxels = largest_free_voxels_;
    run.in_submaps = true;
  }
  /// Adds what became of submaps and corrections.
  void write(Json& json) const;
  /// A line of text.
  [[nodiscard]] std::string summary() const;

 private:
  /// The pose with which a scan was integrated.
  struct Placed {
    std::int32_t number = 0;
    double stamp_s = 0.0;
    Matrix34d T_map_sensor = Matrix34d::Identity();
  };
  struct Correction {
    std::string path;
    PoseRows rows;
    bool applied = false;
    std::int32_t after_scan = 0;
    std::uint32_t moved = 0;  ///< Submaps.
    double most_m = 0.0;      ///< How far one moved, at its middle scan.
    /// Of the corrected places, from where the frames put the scans: root of the mean square.
    double residual_m = 0.0;
  };
  explicit MapSubmaps(SubmapWriter writer, double length_m)
      : writer_(std::move(writer)), cutter_({.length_m = length_m}) {}
  Outcome<void> seal(Mapper& mapper);
  [[nodiscard]] bool is_due(const Correction& correction) const;
  void apply(Correction& correction);
  [[nodiscard]] std::int64_t stamp_us(const Scan& scan) const;
  [[nodiscard]] Outcome<void> check_stamps(const Scan& scan) const;
  /// T_world_sensor of a scan; nothing where it has none.
  [[nodiscard]] static std::optional<Matrix34d> corrected(const Correction& correction,
                                                          const Placed& scan);

  SubmapWriter writer_;
  SubmapCutter cutter_;
  std::vector<Placed> placed_;
  std::vector<std::size_t> firsts_;  ///< In placed_, of each submap.
  /// T_world_map of each submap, the last one included.
  std::vector<Matrix34d> frames_{Matrix34d::Identity()};
  std::vector<std::uint32_t> revisions_{1};
  std::vector<double> lengths_m_;
  std::vector<Correction> corrections_;
  std::vector<std::int64_t> times_us_;  ///< By the number of a scan, where scans have no stamps.
  MapUsage largest_{};
  std::uint64_t largest_free_voxels_ = 0;
};

}  // namespace tessera
