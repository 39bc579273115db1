// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The local map of a node over restarts: continues what an earlier start has left, and keeps what
// this one maps.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "maps/kept_submaps.hpp"
#include "maps/map_journal.hpp"
#include "node/found_map.hpp"
#include "node/mapping_thread.hpp"
#include "node/sharing_thread.hpp"
#include "tessera/robot/robot.hpp"

namespace tessera {

/// For the thread that waits for the disk.
class DurableMap {
 public:
  /// For a robot that begins with an empty map. Fails as MapJournal::make.
  static Outcome<std::unique_ptr<DurableMap>> begin(const MapName& name, Robot& robot,
                                                    const MapIdentity& identity);
  /// Reads what was found into the maps of a robot that was made for it (RobotSettings'
  /// first_submap and submaps_before), and continues its files. same_clock: stamps of scans are of
  /// the clock that they were of. What could not be used is added to the notes of found. Fails as
  /// read_journal and MapJournal::make.
  static Outcome<std::unique_ptr<DurableMap>> resume(FoundMap& found, Robot& robot,
                                                     const MapIdentity& identity, bool same_clock);
  DurableMap(const DurableMap&) = delete;
  DurableMap& operator=(const DurableMap&) = delete;

  /// Makes durable what was mapped up to now. mapping: the last state, of a cycle that has ended;
  /// frames: the last that the sharing thread has set, or null. kept: of submaps that are in files,
  /// null without submaps. now_us: of one clock; where poses alone are new, frames of hundreds of
  /// submaps are written so seldom that it is kFrameBytes_per_s on average, and always at kAtEnd.
  /// Fails with kFailure iff the system does; the next call tries again.
  static constexpr std::int64_t kFrameBytes_per_s = 1 << 16;
  static constexpr std::int64_t kAtEnd = INT64_MAX;
  Outcome<void> keep(const MappingThreadState& mapping, const SubmapFramesState* frames,
                     const KeptSubmaps* kept, std::int64_t now_us);
  /// False: something could not be read at the last call (MapJournal::is_whole).
  [[nodiscard]] bool is_whole() const noexcept { return journal_->is_whole(); }
  /// True if another submap is mapped into than at the last call, or the map was cleared.
  [[nodiscard]] bool is_behind(const MappingThreadState& mapping) const noexcept {
    return mapping.clears != clears_ || (mapping.cycles != 0 && mapping.submap != submap_);
  }
  /// The last pose of the start before, if there was a scan; its stamp is 0 if its clock is
  /// another.
  [[nodiscard]] const std::optional<JournalNote>& resumed() const noexcept { return resumed_; }
  [[nodiscard]] std::uint64_t resumed_blocks() const noexcept { return resumed_blocks_; }
  [[nodiscard]] std::uint64_t damaged_bytes() const noexcept { return damaged_bytes_; }
  /// Of appends that were not finished (JournalContent).
  [[nodiscard]] std::uint64_t torn_bytes() const noexcept { return torn_bytes_; }
  /// Whole, but of no map.
  [[nodiscard]] std::uint64_t left_out_blocks() const noexcept { return left_out_blocks_; }
  [[nodiscard]] std::uint64_t file_bytes() const noexcept;
  [[nodiscard]] std::uint64_t written_bytes() const noexcept;
  [[nodiscard]] std::uint64_t failed_renewals() const noexcept;

 private:
  DurableMap(MapName name, Robot& robot, const MapIdentity& identity);
  Outcome<void> resume_journals(const FoundMap& found);
  Outcome<void> resume_frames(FoundMap& found, bool same_clock);
  Outcome<void> keep_frames(const SubmapFramesState& frames, const KeptSubmaps* kept,
                            std::int64_t now_us);
  Outcome<void> follow(std::uint32_t submap, const KeptSubmaps* kept);

  MapName name_;
  Robot& robot_;
  MapIdentity identity_;
  std::unique_ptr<MapJournal> journal_;  ///< Of the submap that is mapped into.
  std::uint32_t submap_ = 0;             ///< Its number.
  std::unique_ptr<MapJournal> ended_;    ///< Of the one before, while that is in no file.
  std::uint32_t ended_submap_ = 0;
  JournalNote note_{};
  std::uint64_t clears_ = 0;  ///< Of the mapping thread, that are in the file.
  SubmapState state_{};
  std::vector<std::byte> state_bytes_{};  ///< As it is in the file.
  std::int64_t poses_due_us_ = 0;         ///< When it is written though poses alone are new.
  std::optional<JournalNote> resumed_;
  std::uint64_t resumed_blocks_ = 0;
  std::uint64_t damaged_bytes_ = 0;
  std::uint64_t torn_bytes_ = 0;
  std::uint64_t left_out_blocks_ = 0;
  std::uint64_t written_before_ = 0;  ///< By journals that are gone.
};

}  // namespace tessera
