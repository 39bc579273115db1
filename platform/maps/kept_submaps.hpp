// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The submaps of a running robot that have ended, each in a map file of its own, so that they take
// no memory and damage costs one; and all of them as one map file.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "maps/submaps.hpp"
#include "tessera/map/local_maps.hpp"
#include "tessera/submap/submap_frames.hpp"

namespace tessera {

/// For one thread.
class KeptSubmaps {
 public:
  /// stem: of the files, "folder/robot_1.epoch-2". like: settings and classes of all. Fails with
  /// kFailure iff the system does not give the memory for an empty map.
  static Outcome<std::unique_ptr<KeptSubmaps>> make(std::string stem, const LocalMap& like);
  KeptSubmaps(const KeptSubmaps&) = delete;
  KeptSubmaps& operator=(const KeptSubmaps&) = delete;

  /// Takes up those of an earlier start, whose files are there; rows: by ascending numbers, without
  /// places and frames; epoch: of their files. Before anything is kept.
  void take_up(std::vector<SubmapRow> rows, std::uint32_t epoch);
  /// A file of that start. Of the row, scans and length are not known.
  struct Found {
    SubmapRow row;
    MapFileHeader header;
  };
  /// Nothing if it cannot be read as one.
  [[nodiscard]] static std::optional<Found> find(const std::string& path, std::uint32_t number);
  /// Writes the submap that has ended, if one has and kKeeping is not done with it, durably, and is
  /// done with it. Fails as save_map, and then it still waits.
  Outcome<void> keep_ended(LocalMaps& maps, const MapIdentity& identity);
  /// A submap that is not kept: the current one.
  struct CurrentSubmap {
    const LocalMap& map;
    std::uint32_t number;
    SubmapNote note;
  };
  /// Frame of a submap, and its revision.
  struct Frame {
    std::uint32_t number = 0;
    RigidCode T_map_submap{};
    std::uint32_t revision = 1;
  };
  /// Of all that there are; each is encoded as encode_rigid takes it.
  [[nodiscard]] static std::vector<Frame> frames_of(const SubmapFrames& frames);
  /// Writes all as one map file. frames: of each submap, from the first one on. Fails as
  /// SubmapWriter, and iff a kept file cannot be read any more; its message names it.
  Outcome<MapSummary> save_as(const std::string& path, const CurrentSubmap& current,
                              std::span<const Frame> frames, const MapIdentity& identity) const;
  /// What save_as would give: Digest of numbers, frames and contents.
  [[nodiscard]] std::uint64_t digest_with(const CurrentSubmap& current,
                                          std::span<const Frame> frames) const;
  /// Removes the files: what they hold is written, or nobody wants it.
  void remove() noexcept;

  /// Of the file of a submap.
  [[nodiscard]] static std::string path_of(const std::string& stem, std::uint32_t number);
  [[nodiscard]] const std::vector<SubmapRow>& rows() const noexcept { return rows_; }
  /// Of all files.
  [[nodiscard]] std::uint64_t bytes() const noexcept;

 private:
  explicit KeptSubmaps(std::string stem) : stem_(std::move(stem)) {}
  static void set_frames(std::span<SubmapRow> rows, std::span<const Frame> frames) noexcept;

  std::string stem_;
  ArenaMemory memory_;
  LocalMap empty_{};
  std::vector<SubmapRow> rows_;
  std::optional<std::uint32_t> epoch_;  ///< Of the first that was kept: files of one map have one.
};

}  // namespace tessera
