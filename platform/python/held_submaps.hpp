// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The submaps of a map that Python holds: those that have ended are in files of a folder, with the
// frames of all.
#pragma once

#include <memory>
#include <string>

#include "maps/kept_submaps.hpp"
#include "settings/map_options.hpp"
#include "tessera/robot/mapper.hpp"
#include "tessera/submap/submap_frames.hpp"

namespace tessera::python {

/// For who has the map's gate alone.
class HeldSubmaps {
 public:
  /// folder: made if missing; empty: one of its own among the temporary files. Raises Error iff it
  /// cannot be made or the system does not give the memory.
  HeldSubmaps(Mapper& mapper, const MapIdentity& identity, const std::string& folder);
  /// Removes the files.
  ~HeldSubmaps();
  HeldSubmaps(const HeldSubmaps&) = delete;
  HeldSubmaps& operator=(const HeldSubmaps&) = delete;
  HeldSubmaps(HeldSubmaps&&) = delete;
  HeldSubmaps& operator=(HeldSubmaps&&) = delete;

  /// After a scan was integrated: writes the submap that has ended, if one has. Fails as
  /// KeptSubmaps::keep: the scan is in the map, and the next one tries again.
  Outcome<void> note(std::int64_t stamp_us, const Matrix34d& T_map_sensor);
  /// As SubmapFrames::correct.
  [[nodiscard]] SubmapFrames& frames() noexcept { return frames_; }
  [[nodiscard]] const SubmapFrames& frames() const noexcept { return frames_; }
  [[nodiscard]] Outcome<MapSummary> save(const std::string& path) const;
  [[nodiscard]] std::uint64_t content_digest() const;

 private:
  [[nodiscard]] KeptSubmaps::CurrentSubmap current() const;

  Mapper& mapper_;
  MapIdentity identity_;
  std::string own_folder_;  ///< Empty: it is the user's.
  ArenaMemory memory_;
  SubmapFrames frames_{};
  std::unique_ptr<KeptSubmaps> kept_;
};

}  // namespace tessera::python
