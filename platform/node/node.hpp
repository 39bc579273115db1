// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The process of a robot. Its threads map, share, receive and send, each at its own pace. The
// thread that runs this supervises them: it writes their log, checks that they respond, and ends
// them.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/file_descriptor.hpp"
#include "base/progress.hpp"
#include "base/service_notice.hpp"
#include "link/fleet_keys.hpp"
#include "maps/kept_submaps.hpp"
#include "maps/window_totals.hpp"
#include "node/datagram_door.hpp"
#include "node/doubt_watch.hpp"
#include "node/durable_map.hpp"
#include "node/earlier_submaps.hpp"
#include "node/epoch_pace.hpp"
#include "node/fleet_watch.hpp"
#include "node/frames_watch.hpp"
#include "node/mapping_thread.hpp"
#include "node/network_port.hpp"
#include "node/node_config.hpp"
#include "node/query_thread.hpp"
#include "node/refusal_log.hpp"
#include "node/robot_setup.hpp"
#include "node/security_update.hpp"
#include "node/session_loader.hpp"
#include "node/sharing_thread.hpp"
#include "node/thread_roles.hpp"
#include "node/vehicle_thread.hpp"
#include "node/view_thread.hpp"
#include "scans/dataset.hpp"
#include "scans/open_scans.hpp"
#include "scans/registrar.hpp"
#include "scans/replay_source.hpp"

namespace tessera {

/// A snapshot of the global map during the run.
struct Snapshot {
  std::string path;
  double after_s = 0.0;  ///< Since the start.
  std::uint64_t label_voxels = 0;
};

/// The result of a run. Durations are monotonic.
struct NodeRun {
  const char* ended_by = "";
  std::int64_t made_us = 0;  ///< Before anything was read or allocated.
  std::int64_t start_us = 0;
  std::int64_t end_us = 0;
  MappingThreadState mapping{};
  SourceCounters source{};
  double cpu_s = 0.0;  ///< Of all threads.
  std::vector<Snapshot> snapshots;
  std::uint64_t failed_snapshots = 0;
  /// Files of maps that were kept: of an earlier epoch, and from before the map was cleared.
  std::vector<std::string> kept_maps;
  std::uint64_t failed_keeps = 0;   ///< Tries; the map is not cleared until one succeeds.
  std::size_t restart_notes = 0;    ///< Lines about what was left out of an earlier start.
  std::uint64_t failed_states = 0;  ///< Times that the map could not be made durable.
  std::int64_t most_lost_us = 0;    ///< Of mapping that a crash could have cost, at any time.
  std::string not_locked;  ///< Why memory is not locked; empty: it is, or was not requested.
  MissingRights missing{};
  std::size_t start_resident_bytes = 0;  ///< When all threads run.
  std::size_t end_resident_bytes = 0;
  std::uint64_t silences = 0;  ///< Times that a thread did not respond for too long.
  bool map_is_behind = false;  ///< The global map was not brought up to date at the end.
  std::int64_t save_us = 0;    ///< Duration of writing the maps at the end.
  /// In all threads, except for writing maps; none if they cannot be counted.
  std::optional<std::uint64_t> heap_allocations;
};

/// Requests by signals.
struct NodeRequests {
  std::atomic<bool> stop{false};
  std::atomic<bool> save{false};    ///< The local map.
  std::atomic<bool> reload{false};  ///< The exclude list and the public keys.
};

class Node {
 public:
  /// After a signal the global map is brought up to date for at most this time.
  static constexpr std::int64_t kMostFinish_us = 2'000'000;

  /// Reads files, counts the start, allocates all memory, opens the network. Fails as each does.
  static Outcome<std::unique_ptr<Node>> make(const NodeConfig& config);
  /// Checks as make() does, but changes nothing: nothing is counted, opened or written.
  static Outcome<void> check(const NodeConfig& config);
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  ~Node();

  /// Runs until all scans are mapped and everything is shared, or a stop is requested. Fails with
  /// kFailure iff the system gives no thread, a scan can no longer be read, or a map cannot be
  /// written.
  Outcome<void> run(NodeRequests& requests);
  /// Writes the configured maps; the global map is up to date first, or kMostFinish_us are over.
  Outcome<void> write_maps();
  [[nodiscard]] Json report() const;

  /// About oddities of the replayed scans.
  [[nodiscard]] const std::vector<Message>& warnings() const { return recorded_.warnings; }
  [[nodiscard]] const NodeRun& result() const { return run_; }
  // After run().
  [[nodiscard]] const LoopTimes& times() const { return sharing_->times(); }
  [[nodiscard]] const MappingThread& mapping() const { return *mapping_; }
  [[nodiscard]] const Robot& robot() const { return *robot_; }
  [[nodiscard]] const DatagramLink& link() const { return port_->link(); }
  [[nodiscard]] std::uint64_t global_digest() const { return global_digest_; }
  /// Maps and archives that were written without the record of their settings, which was too long.
  [[nodiscard]] std::uint64_t failed_records() const { return failed_records_.load(); }

 private:
  explicit Node(const NodeConfig& config) : config_(config), sessions_(config.sessions) {}
  Outcome<void> open_inputs();
  Outcome<void> open_sensors();
  Outcome<void> make_sensing();
  Outcome<void> make_registrar();
  Outcome<void> make_vehicle(NodeRequests& requests);
  [[nodiscard]] ScanContent scan_content() const;
  [[nodiscard]] const ClassTable& classes() const { return classes_->table(); }
  [[nodiscard]] SensorPortConfig sensor_config() const;
  [[nodiscard]] ScanSource& source() const;
  /// True if there is no last scan.
  [[nodiscard]] bool endless() const { return config_.loop || config_.sensors.enabled; }
  Outcome<void> set_up();
  Outcome<void> read_keys();
  Outcome<void> begin_state();
  Outcome<void> open_archive();
  Outcome<void> open_submaps();
  [[nodiscard]] MapName map_name() const;
  Outcome<void> find_earlier_map();
  void set_earlier_files_aside();
  [[nodiscard]] bool is_continued(const std::string& path) const;
  Outcome<void> open_durable_map();
  Outcome<void> check_all();
  [[nodiscard]] Outcome<void> check_urls() const;
  [[nodiscard]] Outcome<void> check_sectors() const;
  [[nodiscard]] Outcome<void> check_places() const;
  [[nodiscard]] Outcome<void> make_snapshot_folder() const;
  Outcome<void> make_threads();
  Outcome<void> make_services();
  Outcome<void> start_threads();
  void stop_threads() noexcept;

  // In the sharing thread, after each tick.
  void after_tick(std::int64_t now_us);
  void take_corrections(std::int64_t now_us);
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
  void say_what_is_missing();
  void look_for_sharing(std::int64_t now_us);
  void look_for_others(std::int64_t now_us);
  void look_for_twins(const SharingThreadState& sharing, std::int64_t now_us);
  void look_for_conflicts(const SharingThreadState& sharing, std::int64_t now_us);
  void keep_state(const SharingThreadState& sharing, std::int64_t now_us);
  void leave_epoch(const SharingThreadState& sharing, std::int64_t now_us);
  void save_local_map();
  void reload();
  Outcome<void> read_again();
  void keep_before_clear(std::int64_t now_us);
  void keep_submaps(std::int64_t now_us);
  void say_restart(LogWriter& writer, std::span<LogQueue* const> queues);
  void keep_durable(std::int64_t now_us);
  void look_for_earlier_submaps(std::int64_t now_us);
  void look_for_sessions(std::int64_t now_us);
  void note_durable(const Outcome<void>& kept, std::int64_t now_us);
  void keep_at_end();
  [[nodiscard]] Outcome<void> keep_ended();
  [[nodiscard]] KeptSubmaps::CurrentSubmap current_submap() const;
  [[nodiscard]] std::vector<KeptSubmaps::Frame> submap_frames() const;
  [[nodiscard]] Outcome<void> keep_map();
  [[nodiscard]] Outcome<MapSummary> save_paused_map(const std::string& path);
  [[nodiscard]] Outcome<void> save_while_mapping();
  [[nodiscard]] Outcome<std::uint64_t> local_digest();
  [[nodiscard]] Outcome<void> keep_earlier_maps();
  void say_kept(const std::string& name);
  Outcome<void> write_what_is_named();
  void show(Progress& progress) const;
  [[nodiscard]] Json mapping_json() const;
  [[nodiscard]] Json memory_json() const;
  [[nodiscard]] Json submaps_json() const;
  [[nodiscard]] Json state_json() const;
  [[nodiscard]] Json realtime_json() const;
  [[nodiscard]] Json sensors_json() const;
  [[nodiscard]] Json vehicle_json() const;
  [[nodiscard]] Json queries_json() const;
  [[nodiscard]] Json view_json() const;
  [[nodiscard]] Json security_json() const;
  [[nodiscard]] MapIdentity identity_of(MapKind kind) const;

  NodeConfig config_;
  OpenedScans recorded_;  ///< No scans with sensors.
  std::optional<DatasetClasses> classes_;
  std::vector<CameraDescription> cameras_;
  Matrix34d T_body_lidar_ = Matrix34d::Identity();
  RobotSetup setup_;
  FileDescriptor lock_;              ///< Held so that no other process runs this robot.
  std::optional<RobotState> state_;  ///< Of the thread of run(), once threads run.
  std::optional<FleetKeys> keys_;
  HeldRobot robot_;
  std::optional<HeldArchive> archive_;  ///< Of the mapping thread while that runs.
  WindowTotals window_;                 ///< After it.
  std::unique_ptr<KeptSubmaps> kept_;   ///< Null if the map is not in submaps.
  std::optional<FoundMap> found_;       ///< Until it is read.
  std::vector<std::string> restart_notes_;
  std::unique_ptr<EarlierSubmaps> earlier_;  ///< Null if there are none.
  SessionLoader sessions_;
  std::string session_text_;             ///< The last log text about one.
  std::unique_ptr<DurableMap> durable_;  ///< Null if no start continues the map.
  SecurityUpdates updates_;
  std::optional<DatagramDoor> door_;  ///< Before the port, whose thread calls it.
  std::optional<FleetWatch> fleet_;
  DoubtWatch doubts_;
  FramesWatch frames_{config_.frames};
  std::unique_ptr<NetworkPort> port_;
  WakeUp mapping_wake_;  ///< Before its users.
  // Each may be null, except mapping and sharing.
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
  std::atomic<std::uint64_t> saves_{0};  ///< Requested saves of the local map.
  std::atomic<std::uint64_t> failed_saves_{0};
  mutable std::atomic<std::uint64_t> failed_records_{0};
  std::atomic<bool> counting_{false};  ///< The number before allocations are counted.
  // Of the sharing thread.
  std::vector<std::uint32_t> corrected_submaps_;  ///< Scratch.
  std::uint64_t scans_heard_ = 0;                 ///< Scans that sensors sent, mapped or not.
  std::int64_t scan_heard_us_ = 0;
  std::int64_t scans_done_us_ = 0;
  std::int64_t status_due_us_ = 0;
  std::int64_t fleet_due_us_ = 0;
  std::int64_t snapshot_due_us_ = 0;
  std::uint64_t snapshot_allocations_ = 0;
  LogQueue sharing_log_{"sharing"};
  std::uint32_t exclude_digest_ = 0;
  std::uint32_t late_threads_ = 0;  ///< A bit each, so that each silence is reported once.
  // Of the thread of run().
  bool sharing_is_late_ = false;
  std::uint64_t sharing_silences_ = 0;
  std::uint64_t save_allocations_ = 0;
  std::int64_t notice_due_us_ = 0;
  RefusalLog refusals_;
  std::vector<std::uint32_t> excluded_;  ///< By the last read configuration.
  std::string ignored_keys_;
  std::string reload_failure_;
  std::uint32_t peers_seen_ = 0;
  std::int64_t state_due_us_ = 0;
  std::uint64_t twins_told_ = 0;
  std::int64_t twins_due_us_ = 0;
  std::uint32_t conflicts_told_ = 0;
  EpochPace reopening_{true};
  std::atomic<std::uint32_t> epoch_{0};  ///< Of state_, which belongs to one thread.
  std::string save_failure_;             ///< Why the last failed save failed.
  std::string keep_text_;                ///< The last log text about a kept map.
  std::uint32_t clears_kept_ = 0;        ///< MappingThread::clears_asked() that is saved.
  std::int64_t keep_due_us_ = 0;         ///< When to try again.
  std::int64_t submaps_due_us_ = 0;
  std::string submap_failure_;
  std::int64_t durable_due_us_ = 0;
  std::int64_t durable_us_ = 0;  ///< When the last time that all was made durable began.
  bool durable_failed_ = false;  ///< The last try.
  std::string durable_failure_;
  bool has_stopped_ = false;  ///< No other thread runs any more.
  std::uint64_t global_digest_ = 0;
  std::optional<std::uint64_t> local_digest_;
};

}  // namespace tessera
