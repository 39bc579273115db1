// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot's process. Its threads map, share, receive and send, each at its own pace; the one that
// runs this looks after them: it writes what they log, looks whether they live, and ends them.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dataset/dataset.hpp"
#include "node/datagram_door.hpp"
#include "node/fleet_watch.hpp"
#include "node/mapping_thread.hpp"
#include "node/network_port.hpp"
#include "node/node_config.hpp"
#include "node/query_thread.hpp"
#include "node/refusal_log.hpp"
#include "node/registrar.hpp"
#include "node/replay_source.hpp"
#include "node/robot_setup.hpp"
#include "node/security_update.hpp"
#include "node/sharing_thread.hpp"
#include "node/thread_roles.hpp"
#include "node/vehicle_thread.hpp"
#include "node/view_thread.hpp"
#include "posix/file_descriptor.hpp"
#include "posix/progress.hpp"
#include "posix/service_notice.hpp"
#include "security/fleet_keys.hpp"

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
  std::int64_t made_us = 0;  ///< Before anything was read or taken.
  std::int64_t start_us = 0;
  std::int64_t end_us = 0;
  MappingStatus mapping{};
  SourceCounters source{};
  double cpu_s = 0.0;  ///< Of all threads.
  std::vector<Snapshot> snapshots;
  std::uint64_t failed_snapshots = 0;
  /// Files of the maps that were kept: of an earlier epoch, and from before the map was cleared.
  std::vector<std::string> kept_maps;
  std::uint64_t failed_keeps = 0;  ///< Tries; the map is not cleared until one succeeds.
  std::string not_locked;          ///< Why memory is not locked; empty: it is, or was not to be.
  MissingRights missing{};
  std::size_t start_resident_bytes = 0;  ///< Once all threads run.
  std::size_t end_resident_bytes = 0;
  std::uint64_t silences = 0;  ///< Times that a thread gave no sign of life for too long.
  bool map_is_behind = false;  ///< The global map was not brought up to date in the end.
  std::int64_t save_us = 0;    ///< What writing the maps took in the end.
  /// In all threads, but for what writes maps; none where they cannot be counted.
  std::optional<std::uint64_t> heap_allocations;
};

/// Asked for from outside, by signals.
struct NodeRequests {
  std::atomic<bool> stop{false};
  std::atomic<bool> save{false};    ///< The local map.
  std::atomic<bool> reload{false};  ///< Who is excluded, and the public keys.
};

class Node {
 public:
  /// After a signal the global map is brought up to date no longer than this.
  static constexpr std::int64_t kMostFinish_us = 2'000'000;

  /// Reads what the configuration names, counts the start, takes all memory and opens the network.
  /// path: of the configuration, for messages. Fails as each of these does.
  static Outcome<std::unique_ptr<Node>> make(const NodeConfig& config, const std::string& path);
  /// As make(), up to where anything would be changed: nothing is counted, opened or written.
  static Outcome<void> check(const NodeConfig& config, const std::string& path);
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  ~Node();

  /// Until the scans are done and all is told, or it is asked to stop. Fails with kFailure iff the
  /// system gives no thread, a scan cannot be read any more or a map not be written.
  Outcome<void> run(NodeRequests& requests);
  /// What the configuration names of maps; brings the global map up to date first, after a signal
  /// for kMostFinish_us at most.
  Outcome<void> write_maps();
  [[nodiscard]] Json report() const;

  /// What is replayed; null with sensors.
  [[nodiscard]] const Dataset* dataset() const { return dataset_ ? &*dataset_ : nullptr; }
  [[nodiscard]] const NodeRun& result() const { return run_; }
  // After run().
  [[nodiscard]] const LoopTimes& times() const { return sharing_->times(); }
  [[nodiscard]] const MappingThread& mapping() const { return *mapping_; }
  [[nodiscard]] const Robot& robot() const { return *robot_; }
  [[nodiscard]] const DatagramLink& link() const { return port_->link(); }
  [[nodiscard]] std::uint64_t global_digest() const { return global_digest_; }

 private:
  Node(const NodeConfig& config, std::string path) : config_(config), path_(std::move(path)) {}
  Outcome<void> open_inputs(const std::string& path);
  Outcome<void> open_sensors();
  Outcome<void> make_sensing();
  Outcome<void> make_registrar();
  Outcome<void> make_vehicle(NodeRequests& requests);
  [[nodiscard]] ScanSizes scan_sizes() const;
  [[nodiscard]] const ClassTable& classes() const { return classes_->table(); }
  [[nodiscard]] SensorPortConfig sensor_config() const;
  [[nodiscard]] ScanSource& source() const;
  /// There is no last scan.
  [[nodiscard]] bool endless() const { return config_.loop || config_.sensors.enabled; }
  Outcome<void> set_up(const std::string& path);
  Outcome<void> read_keys();
  Outcome<void> begin_state();
  Outcome<void> check_all(const std::string& path);
  [[nodiscard]] Outcome<void> check_urls() const;
  [[nodiscard]] Outcome<void> check_sectors(const std::string& path) const;
  [[nodiscard]] Outcome<void> check_places(const std::string& path) const;
  [[nodiscard]] Outcome<void> make_snapshot_folder() const;
  Outcome<void> make_threads();
  Outcome<void> make_services();
  Outcome<void> start_threads();
  void stop_threads() noexcept;

  // In the sharing thread, after each tick.
  void after_tick(std::int64_t now_us);
  void apply_security();
  void set_excluded(std::span<const std::uint32_t> robots);
  void look_for_life(std::int64_t now_us);
  void say_status(std::int64_t now_us);
  void hear_statuses(std::int64_t now_us);
  Outcome<void> take_snapshot(std::int64_t now_us);
  void listen_for_scans(std::int64_t now_us);
  [[nodiscard]] bool no_scan_will_come(std::int64_t now_us) const;
  [[nodiscard]] const char* reason_to_end(std::int64_t now_us);
  void end(const char* reason) noexcept;

  // In the thread of run().
  void look_after(NodeRequests& requests, Progress& progress);
  void say_missing_rights();
  void look_for_sharing(std::int64_t now_us);
  void look_for_others(std::int64_t now_us);
  void look_for_twins(const SharingStatus& sharing, std::int64_t now_us);
  void keep_state(const SharingStatus& sharing, std::int64_t now_us);
  void leave_epoch(const SharingStatus& sharing, std::int64_t now_us);
  void save_local_map();
  void reload();
  Outcome<void> read_again();
  void keep_before_clear(std::int64_t now_us);
  [[nodiscard]] Outcome<void> keep_map();
  void say_kept();
  Outcome<void> write_what_is_named();
  void show(Progress& progress) const;
  [[nodiscard]] Json mapping_json() const;
  [[nodiscard]] Json realtime_json() const;
  [[nodiscard]] Json sensors_json() const;
  [[nodiscard]] Json vehicle_json() const;
  [[nodiscard]] Json queries_json() const;
  [[nodiscard]] Json view_json() const;
  [[nodiscard]] Json security_json() const;
  [[nodiscard]] MapIdentity identity_of(MapKind kind) const;

  NodeConfig config_;
  const std::string path_;  ///< Of the configuration.
  std::optional<Dataset> dataset_;
  std::optional<DatasetClasses> classes_;
  std::vector<CameraDescription> cameras_;
  Matrix34d T_body_lidar_ = Matrix34d::Identity();
  RobotSetup setup_;
  FileDescriptor lock_;              ///< No other process is this robot.
  std::optional<RobotState> state_;  ///< Of the thread of run(), once threads are there.
  std::optional<FleetKeys> keys_;
  HeldRobot robot_;
  SecurityUpdates updates_;
  std::optional<DatagramDoor> door_;  ///< Before the port, whose thread asks it.
  std::optional<FleetWatch> fleet_;
  std::unique_ptr<NetworkPort> port_;
  WakeUp mapping_wake_;  ///< Before whoever wakes by it.
  // Each may be null, but for mapping and sharing.
  std::unique_ptr<VehiclePort> vehicle_port_;
  std::unique_ptr<ReplaySource> replay_;
  std::unique_ptr<SensingThread> sensing_;
  std::unique_ptr<Registrar> registrar_;
  std::unique_ptr<MappingThread> mapping_;
  std::unique_ptr<SharingThread> sharing_;
  std::unique_ptr<VehicleThread> vehicle_;
  std::unique_ptr<QueryThread> queries_;
  std::unique_ptr<ViewThread> view_;
  ServiceNotice notice_;
  LogQueue log_{"node"};
  NodeRun run_;
  WakeUp service_;
  std::atomic<const char*> ended_by_{nullptr};
  std::atomic<std::uint64_t> saves_{0};  ///< Of the local map, asked for while it ran.
  std::atomic<std::uint64_t> failed_saves_{0};
  std::atomic<bool> counting_{false};  ///< From here on allocations are counted.
  // Of the sharing thread.
  std::uint64_t scans_heard_ = 0;  ///< That sensors sent, whatever became of them.
  std::int64_t scan_heard_us_ = 0;
  std::int64_t scans_done_us_ = 0;
  std::int64_t status_due_us_ = 0;
  std::int64_t fleet_due_us_ = 0;
  std::int64_t snapshot_due_us_ = 0;
  std::uint64_t snapshot_allocations_ = 0;
  LogQueue sharing_log_{"sharing"};
  std::uint32_t exclude_digest_ = 0;
  std::uint32_t late_threads_ = 0;  ///< A bit each, so that each silence is told once.
  // Of the thread of run().
  bool sharing_is_late_ = false;
  std::uint64_t sharing_silences_ = 0;
  std::uint64_t save_allocations_ = 0;
  std::int64_t notice_due_us_ = 0;
  RefusalLog refusals_;
  std::vector<std::uint32_t> excluded_;  ///< By the configuration as it was last read.
  std::string ignored_keys_;
  std::string reload_failure_;
  std::uint32_t peers_seen_ = 0;
  std::int64_t state_due_us_ = 0;
  std::uint64_t twins_told_ = 0;
  std::int64_t twins_due_us_ = 0;
  std::int64_t reopen_due_us_ = 0;
  std::string save_failure_;       ///< Why the last save that failed did.
  std::string keep_text_;          ///< What was said last of a map that is kept.
  std::uint32_t clears_kept_ = 0;  ///< MappingThread::clears_asked() of what is saved.
  std::int64_t keep_due_us_ = 0;   ///< When to try again.
  std::uint64_t global_digest_ = 0;
  std::optional<std::uint64_t> local_digest_;
};

/// What of a peer's configuration is another than ours, in words; empty: nothing.
std::string mismatch_text(const ConfigurationDetails& theirs, const MapConfig& ours,
                          const ClassTable& classes);

}  // namespace tessera
