// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The state that a robot keeps over restarts: folder/robot_ID.state, a small text file that is
// written atomically. Other robots ignore a robot that restarts with older numbers.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/file_descriptor.hpp"
#include "base/outcome.hpp"
#include "tessera/exchange/exchange_config.hpp"

namespace tessera {

/// Locks folder/robot_ID.lock against other processes while the value lives; makes folder if it
/// does not exist. Fails with kUsage iff another process has it, or folder or file cannot be made.
Outcome<FileDescriptor> lock_robot(const std::string& folder, std::uint32_t robot);

/// What happens to a robot's earlier epochs when it starts.
enum class EarlierEpochs : std::uint8_t {
  kKeep,  ///< The newest one still counts where the new one has no evidence; not in submaps.
  kDrop,  ///< None of them counts.
};
constexpr const char* to_string(EarlierEpochs earlier) noexcept {
  return earlier == EarlierEpochs::kDrop ? "drop" : "keep";
}

/// With which map a robot starts.
enum class StartMap : std::uint8_t {
  kEmpty,  ///< Whatever there was.
  /// In submaps: a newer epoch takes the place of an older one submap by submap, so that a map
  /// which was cut elsewhere would count beside it. Its own epoch is the lowest.
  kEmptySubmaps,
  kContinued,  ///< That of the start before, which is published again.
  kSubmaps,    ///< The same in submaps: those that had ended stay as they were published, so
               ///< all epochs since the map was begun count.
};

/// For the process that has the robot's lock, and for one of its threads. Calls that change
/// something write the file and wait until it is durable, so not for a real-time thread. If that
/// fails (kFailure, or kUsage iff the file may not be written), nothing has changed.
class RobotState {
 public:
  static constexpr std::size_t kMostFloors = 256;

  /// Reads robot_ID.state, or robot_ID.starts of version 0.1.0; without both nothing is known.
  /// Fails with kUsage iff the file is damaged, another robot's or cannot be read. It is not
  /// changed.
  static Outcome<RobotState> open(const std::string& folder, std::uint32_t robot);

  /// Counts a start: starts() and epoch() become higher than ever before, and floor() follows
  /// earlier. start: of its map. Also fails with kFailure iff a count is at its maximum.
  Outcome<void> begin(EarlierEpochs earlier, StartMap start = StartMap::kEmpty);
  /// Raises epoch() to at least at_least, if the fleet knows higher epochs of this robot than this
  /// file. The epoch below is assumed to have published something. Call it after begin(). Also
  /// fails with kFailure iff at_least is over 2^32 - 1.
  Outcome<void> raise_epoch(std::uint64_t at_least);
  /// The same for starts().
  Outcome<void> raise_starts(std::uint64_t at_least);
  /// Notes that something was published in that epoch of this robot.
  Outcome<void> note_published(std::uint32_t epoch);
  /// Notes floors of other robots, of each the highest. Stores those of at most kMostFloors robots.
  Outcome<void> note_floors(std::span<const RobotFloor> heard);

  [[nodiscard]] std::uint32_t robot() const noexcept { return robot_; }
  /// Starts so far, including this one.
  [[nodiscard]] std::uint32_t starts() const noexcept { return now_.starts; }
  /// Of this start.
  [[nodiscard]] std::uint32_t epoch() const noexcept { return now_.epoch; }
  /// The epoch in which the map of this robot was begun; before begin(): of the start before, 0 if
  /// there was none.
  [[nodiscard]] std::uint32_t map_epoch() const noexcept { return now_.map_epoch; }
  /// The newest epoch in which something was published; 0: none.
  [[nodiscard]] std::uint32_t published() const noexcept { return now_.published; }
  /// The lowest of this robot's epochs that counts.
  [[nodiscard]] std::uint32_t floor() const noexcept { return now_.floor; }
  /// Of other robots, in the order of their numbers.
  [[nodiscard]] std::span<const RobotFloor> floors() const noexcept { return now_.floors; }
  /// Floors of other robots that were not stored for lack of room.
  [[nodiscard]] std::uint64_t floors_refused() const noexcept { return floors_refused_; }

 private:
  struct Values {
    std::uint32_t starts = 0;
    std::uint32_t epoch = 0;
    std::uint32_t published = 0;
    std::uint32_t floor = 0;
    std::uint32_t map_epoch = 0;
    std::vector<RobotFloor> floors{};
    friend bool operator==(const Values&, const Values&) = default;
  };
  RobotState(std::string stem, std::uint32_t robot) : stem_(std::move(stem)), robot_(robot) {}
  [[nodiscard]] std::string path() const { return stem_ + ".state"; }
  [[nodiscard]] std::string text_of(const Values& values) const;
  [[nodiscard]] Outcome<Values> parse(const std::string& text) const;
  [[nodiscard]] Outcome<Values> read_count() const;
  [[nodiscard]] std::uint32_t floor_of(const Values& values) const noexcept;
  Outcome<void> change(Values next);

  std::string stem_;
  std::uint32_t robot_ = 0;
  EarlierEpochs earlier_ = EarlierEpochs::kKeep;
  StartMap start_ = StartMap::kEmpty;
  Values now_{};
  std::uint64_t floors_refused_ = 0;
};

}  // namespace tessera
