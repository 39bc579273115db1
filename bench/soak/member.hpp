// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot of the soak: what a node's process is, without threads and sockets. Its map is kept on
// disk by the node's own code, and it can be killed between any two steps, with nothing saved.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/allocation_counter.hpp"
#include "maps/kept_submaps.hpp"
#include "node/durable_map.hpp"
#include "node/earlier_submaps.hpp"
#include "node/robot_setup.hpp"
#include "soak/drive.hpp"

namespace tessera::soak {

/// Things that happened, by name.
using Counts = std::map<std::string, std::uint64_t>;
void add(Counts& to, const Counts& more);

struct MemberConfig {
  NodeConfig node{};  ///< With its number and the folder of its state.
  FlatPose T_global_map{};
  std::uint64_t seed = 1;
};

class Member {
 public:
  /// classes must outlive it.
  Member(const MemberConfig& config, const ClassTable& classes)
      : config_(config), classes_(classes) {}

  /// As a process starts: with the map of before, as far as it is durable, or with an empty one.
  /// Fails as the system does, and where a start finds what it cannot use.
  Outcome<void> start(bool continues);
  /// Nothing is saved.
  void kill();
  [[nodiscard]] bool is_running() const { return robot_.has_value(); }

  /// One of each step, in this order. All but the last are the robot's own calls.
  void receive(std::span<const std::byte> datagram, std::int64_t now_us);
  ScanReport integrate(ScanView scan, const FlatPose& T_map_sensor, std::int64_t now_us);
  void tick(std::int64_t now_us);
  /// The next to send; empty: nothing is due.
  [[nodiscard]] std::span<const std::byte> send(std::int64_t now_us);
  /// The submap that has ended goes into its file.
  Outcome<void> keep_ended();
  /// What was mapped becomes durable, if that is due.
  Outcome<void> keep(std::int64_t now_us);

  CorrectionReport correct(const CorrectedTrajectory& trajectory);
  CorrectionReport correct(const CorrectedFrames& frames);

  [[nodiscard]] Robot& robot() const { return **robot_; }
  [[nodiscard]] std::uint32_t number() const { return config_.node.robot; }
  [[nodiscard]] const FlatPose& T_global_map() const { return config_.T_global_map; }
  /// The epoch in which its map was begun.
  [[nodiscard]] std::uint32_t map_epoch() const { return state_->map_epoch(); }
  /// Submaps of this map, over all starts.
  [[nodiscard]] std::uint32_t submaps() const;
  /// Of the heap, in the robot's own calls since it was made; nothing: they cannot be counted.
  [[nodiscard]] std::optional<std::uint64_t> allocations() const;
  /// Of all processes of this robot: what ran into a limit, and what else happened.
  [[nodiscard]] Counts limits() const;
  [[nodiscard]] Counts events() const;
  /// Bytes on disk of its state.
  [[nodiscard]] std::uint64_t file_bytes() const;
  /// Lines about what starts could not use, since the last call.
  [[nodiscard]] std::vector<std::string> take_notes() { return std::exchange(notes_, {}); }
  /// Counters of processes that are gone, for a checkpoint.
  [[nodiscard]] Json state() const;
  void restore(const Json& state);

 private:
  /// Between two times that the map is made durable: a second, so that at most two are lost.
  static constexpr std::int64_t kKeep_us = 1'000'000;

  template <class Call>
  auto counted(Call&& call);
  Outcome<void> make_robot_of(std::optional<FoundMap>& found);
  Outcome<void> keep_state();
  Outcome<void> leave_epoch();
  void remove_files() const;
  [[nodiscard]] MapName map_name() const;
  [[nodiscard]] MapIdentity identity() const;
  [[nodiscard]] Counts limits_now() const;
  [[nodiscard]] Counts events_now() const;

  MemberConfig config_;
  const ClassTable& classes_;
  FileDescriptor lock_;
  std::optional<RobotState> state_;
  std::optional<HeldRobot> robot_;
  std::unique_ptr<KeptSubmaps> kept_;
  std::unique_ptr<DurableMap> durable_;
  std::unique_ptr<EarlierSubmaps> earlier_;
  MappingThreadState mapping_{};
  std::unique_ptr<SubmapFramesState> frames_ = std::make_unique<SubmapFramesState>();
  std::int64_t keep_due_us_ = 0;
  std::array<std::byte, kMostDatagramBytes> datagram_{};
  std::uint64_t allocations_ = 0;
  std::vector<std::string> notes_;
  ScanTotals scans_{};
  Counts limits_before_;
  Counts events_before_;
};

}  // namespace tessera::soak
