// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot's process: replays a dataset as its scans, keeps an even tick, hands datagrams over
// between the network and the robot as soon as they are there, and ends when all is told.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dataset/dataset.hpp"
#include "node/network_port.hpp"
#include "node/node_config.hpp"
#include "node/robot_loop.hpp"
#include "node/robot_setup.hpp"
#include "posix/duration_histogram.hpp"
#include "posix/file_descriptor.hpp"
#include "posix/progress.hpp"
#include "security/datagram_seal.hpp"
#include "security/fleet_signatures.hpp"

namespace tessera {

/// A picture of the global map on its way.
struct Snapshot {
  std::string path;
  double after_s = 0.0;  ///< Since the start.
  std::uint64_t label_voxels = 0;
};

/// What a run did. Durations are monotonic.
struct NodeRun {
  const char* ended_by = "";
  std::int64_t start_us = 0;
  std::int64_t end_us = 0;
  std::uint64_t scans = 0;
  std::uint64_t points = 0;
  std::uint64_t unknown_ids = 0;
  std::uint64_t bad_poses = 0;
  std::uint64_t left_out = 0;      ///< Points and rays: ScanReport::left_out.
  std::int64_t worst_late_us = 0;  ///< A scan, behind its rate.
  DurationHistogram scan_times;    ///< Integration.
  double cpu_s = 0.0;              ///< Of all threads.
  std::vector<Snapshot> snapshots;
  /// In all threads, but for what writes snapshots; none where they cannot be counted.
  std::optional<std::uint64_t> heap_allocations;
};

class Node {
 public:
  /// Reads what the configuration names, counts the start, takes all memory and opens the network.
  /// path: of the configuration, for messages. Fails as each of these does.
  static Outcome<std::unique_ptr<Node>> make(const NodeConfig& config, const std::string& path);
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  /// Until the scans are done and all is told, or stop becomes true. Fails with kFailure iff a scan
  /// cannot be read any more or a snapshot not be written.
  Outcome<void> run(const std::atomic<bool>& stop);
  /// What the configuration names of maps; brings the global map up to date first.
  Outcome<void> write_maps();
  [[nodiscard]] Json report() const;

  [[nodiscard]] const Dataset& dataset() const { return dataset_; }
  [[nodiscard]] const NodeRun& result() const { return run_; }
  /// After run().
  [[nodiscard]] const LoopTimes& times() const { return loop_->times(); }
  [[nodiscard]] const Robot& robot() const { return *robot_; }
  [[nodiscard]] std::uint64_t global_digest() const { return global_digest_; }

 private:
  /// What changes while anything new is said or heard.
  struct Activity {
    std::uint64_t taken = 0;
    std::uint64_t published = 0;
    std::uint64_t chunks = 0;
    std::uint64_t contributions = 0;
    friend bool operator==(const Activity&, const Activity&) = default;
  };

  Node(const NodeConfig& config, Dataset dataset)
      : config_(config), dataset_(std::move(dataset)), buffer_(dataset_.max_points()) {}
  Outcome<void> set_up(const std::string& path);
  Outcome<void> read_keys(const std::string& path);
  [[nodiscard]] Outcome<void> check_places(const std::string& path) const;
  Outcome<void> integrate_next(std::int64_t now_us);
  Outcome<void> tick(std::int64_t now_us);
  void say_status(std::int64_t now_us);
  Outcome<void> take_snapshot(std::int64_t now_us);
  [[nodiscard]] const char* reason_to_end(std::int64_t now_us);
  void show(Progress& progress) const;
  [[nodiscard]] MapIdentity identity_of(MapKind kind) const;

  NodeConfig config_;
  Dataset dataset_;
  ScanBuffer buffer_;
  RobotSetup setup_;
  FileDescriptor lock_;  ///< No other process is this robot.
  std::optional<DatagramSeal> seal_;
  std::optional<FleetSignatures> signatures_;
  HeldRobot robot_;
  std::unique_ptr<NetworkPort> port_;
  std::optional<RobotLoop> loop_;
  NodeRun run_;
  std::size_t next_scan_ = 0;
  bool scans_done_ = false;
  std::int64_t first_scan_us_ = 0;
  std::int64_t scan_due_us_ = 0;
  std::int64_t scans_done_us_ = 0;
  Activity activity_;
  std::int64_t quiet_since_us_ = 0;
  std::int64_t status_due_us_ = 0;
  DurationHistogram second_;  ///< Ticks since the last status.
  std::int64_t snapshot_due_us_ = 0;
  std::uint64_t snapshot_allocations_ = 0;
  std::uint64_t global_digest_ = 0;
  std::optional<std::uint64_t> local_digest_;
};

/// What of a peer's configuration is another than ours, in words; empty: nothing.
std::string mismatch_text(const ConfigurationDetails& theirs, const MapConfig& ours,
                          const ClassTable& classes);

}  // namespace tessera
