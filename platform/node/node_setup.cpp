// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A node before its loop and after it: places checked, memory taken, network opened, maps written.
#include <filesystem>
#include <utility>

#include "mapping/outputs.hpp"
#include "node/node.hpp"
#include "node/published_map.hpp"
#include "node/start_counter.hpp"
#include "node/thread_roles.hpp"
#include "posix/allocation_counter.hpp"
#include "posix/monotonic_clock.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

Outcome<Dataset> open_dataset(const NodeConfig& config, const std::string& path) {
  const MapOptions& map = config.map;
  Outcome<Dataset> dataset =
      Dataset::open(map.dataset, {.first = map.first, .last = map.last, .labels = map.labels});
  if (!dataset.ok()) return in_words_of_config(dataset.failure(), path);
  return dataset;
}

}  // namespace

Outcome<std::unique_ptr<Node>> Node::make(const NodeConfig& config, const std::string& path) {
  Outcome<Dataset> dataset = open_dataset(config, path);
  if (!dataset.ok()) return dataset.failure();
  std::unique_ptr<Node> node(new Node(config, std::move(*dataset)));
  const Outcome<void> done = node->set_up(path);
  if (!done.ok()) return done.failure();
  return node;
}

Outcome<void> Node::check(const NodeConfig& config, const std::string& path) {
  Outcome<Dataset> dataset = open_dataset(config, path);
  if (!dataset.ok()) return dataset.failure();
  Node node(config, std::move(*dataset));
  return node.check_all(path);
}

Outcome<void> Node::check_all(const std::string& path) {
  const Outcome<void> places = check_places(path);
  if (!places.ok()) return {in_words_of_config(places.failure(), path)};
  const Outcome<RobotSetup> trial = set_up_robot(config_, dataset_, 1);
  if (!trial.ok()) return {in_words_of_config(trial.failure(), path)};
  setup_ = *trial;
  return read_keys(path);
}

Outcome<void> Node::check_places(const std::string& path) const {
  return check_outputs({{"[output] global_map", config_.global_map},
                        {"[output] local_map", config_.local_map},
                        {"[output] contribution", config_.contribution},
                        {"[output] report", config_.report}},
                       {{"--config", path},
                        {"[security] fleet_key", config_.fleet_key},
                        {"[security] robot_secret", config_.robot_secret},
                        {"[security] robot_public_keys", config_.robot_public_keys},
                        {"[robot] T_global_map", config_.T_global_map}},
                       {config_.map.dataset, {config_.map.labels}});
}

Outcome<void> Node::make_snapshot_folder() const {
  if (config_.snapshots.empty()) return {};
  std::error_code error;
  std::filesystem::create_directories(config_.snapshots, error);
  if (!error) return check_writable(config_.snapshots + "/global_0000.tsm");
  return Failure{"cannot make the folder " + config_.snapshots + ": " + error.message() +
                 "; name another one"};
}

Outcome<void> Node::read_keys(const std::string& path) {
  if (!config_.fleet_key.empty()) {
    const Outcome<SecretKey> key = read_fleet_key(config_.fleet_key);
    if (!key.ok()) return key.failure();
    Outcome<DatagramSeal> seal = DatagramSeal::make(*key, KeyUse::kDatagram);
    if (!seal.ok()) return seal.failure();
    seal_ = std::move(*seal);
  }
  if (config_.robot_secret.empty()) return {};
  Outcome<FleetSignatures> signatures =
      FleetSignatures::read(config_.robot_secret, config_.robot_public_keys);
  if (!signatures.ok()) return signatures.failure();
  signatures_.emplace(std::move(*signatures));
  if (signatures_->robot() == config_.robot) return {};
  return Failure{path + ": [security] robot_secret is of robot " +
                 std::to_string(signatures_->robot()) + ", and [robot] id is " +
                 std::to_string(config_.robot) + "; name the key file of this robot"};
}

Outcome<void> Node::set_up(const std::string& path) {
  // What can be refused is, before the start is counted.
  const Outcome<void> checked = check_all(path);
  if (!checked.ok()) return checked.failure();
  const Outcome<void> snapshots = make_snapshot_folder();
  if (!snapshots.ok()) return snapshots.failure();
  // Before anything is taken that is to stay where it is.
  if (config_.lock_memory) {
    keep_freed_memory();
    run_.not_locked = lock_memory();
  }
  Outcome<std::unique_ptr<NetworkPort>> port =
      NetworkPort::open(config_.link, config_.send_slots, thread_roles(config_).sending);
  if (!port.ok()) return port.failure();
  port_ = std::move(*port);
  Outcome<FileDescriptor> lock = lock_robot(config_.state, config_.robot);
  if (!lock.ok()) return lock.failure();
  lock_ = std::move(*lock);
  const Outcome<std::uint32_t> start = count_start(config_.state, config_.robot);
  if (!start.ok()) return start.failure();
  setup_.robot.epoch = setup_.robot.exchange.session = *start;
  const Clock clock{nullptr, [](void*) { return MonotonicClock::now_us(); }};
  Outcome<HeldRobot> robot =
      make_robot(setup_.robot, dataset_.classes().table(),
                 {.authenticator = seal_ ? seal_->authenticator() : crc_authenticator(),
                  .signatures = signatures_ ? signatures_->signatures() : Signatures{}},
                 clock);
  if (!robot.ok()) return robot.failure();
  robot_ = std::move(*robot);
  for (const std::uint32_t excluded : config_.exclude) {
    if (robot_->exchange().exclude(excluded) != Status::kOk)
      return Failure{path + ": [security] exclude: robot " + std::to_string(excluded) +
                     " cannot be excluded; leave it out"};
  }
  if (config_.lock_memory) prefault(robot_.memory());
  make_threads();
  return {};
}

void Node::make_threads() {
  // The source wakes the mapping thread, which takes from the source.
  replay_ = std::make_unique<ReplaySource>(
      dataset_, ReplayConfig{config_.rate_hz, config_.loop, config_.start_delay_s}, mapping_wake_);
  mapping_ = std::make_unique<MappingThread>(robot_->mapper(), *replay_, mapping_wake_,
                                             MappingConfig{.period_us = 1000 * config_.period_ms},
                                             Registration{});
  const EachTick each_tick{
      this, [](void* self, std::int64_t now_us) { static_cast<Node*>(self)->after_tick(now_us); }};
  sharing_ = std::make_unique<SharingThread>(robot_->sharer(), robot_->map(), *mapping_, *port_,
                                             1000 * config_.tick_ms, each_tick);
}

MapIdentity Node::identity_of(MapKind kind) const {
  MapIdentity identity{.kind = kind};
  Json settings;
  if (kind == MapKind::kLocal) {
    identity.robot = config_.robot;
    identity.epoch = setup_.robot.epoch;
    identity.has_T_global_map = true;
    identity.T_global_map = setup_.robot.T_global_map;
    settings = to_json(config_.map, setup_.map);
    for (const char* const key :
         {"dataset", "out", "report", "continue", "memory", "first", "last", "window", "archive"})
      settings.erase(key);
  } else {
    settings = config_.values.value("fusion", Json::object());
    settings.erase("memory");
    settings["max_range"] = config_.map.max_range_m;
    Json robots = Json::array();
    const Replicas& replicas = robot_->global().replicas();
    for (const Replicas::Slot slot : replicas.in_order()) {
      const Json robot = replicas.contribution(slot).id.robot;
      if (robots.empty() || robots.back() != robot) robots.push_back(robot);
    }
    settings["robots"] = std::move(robots);
  }
  static_cast<void>(record_settings(settings, identity));
  return identity;
}

void Node::save_local_map() {
  if (config_.local_map.empty()) {
    log_.say(LogLevel::kWarning, MonotonicClock::now_us(),
             "a save was asked for, but [output] local_map names no file");
    return;
  }
  // The map is this thread's while mapping pauses; what shares goes on reading it.
  mapping_->pause(kPausedToSave, true);
  while (!mapping_->paused()) service_.sleep_until(MonotonicClock::now_us() + 1'000);
  const std::optional<std::uint64_t> before = heap_allocations();
  std::vector<KeyedIndex> workspace = workspace_for(robot_->map());
  const Outcome<void> saved =
      save_map(robot_->map(), identity_of(MapKind::kLocal), workspace, config_.local_map);
  const std::optional<std::uint64_t> after = heap_allocations();
  if (before && after) save_allocations_ += *after - *before;
  mapping_->pause(kPausedToSave, false);
  // A disk that is full now may have room later: the node goes on.
  if (!saved.ok()) {
    ++run_.failed_saves;
    log_.say(LogLevel::kError, MonotonicClock::now_us(), "the map could not be saved");
  } else {
    ++run_.saves;
  }
}

Outcome<void> Node::write_maps() {
  const std::int64_t start_us = MonotonicClock::now_us();
  const bool hurried = std::string_view(run_.ended_by) == "signal";
  bool behind = true;
  while (behind && (!hurried || MonotonicClock::now_us() - start_us < kMostFinish_us))
    behind = robot_->fuse_in_spare_time();
  run_.map_is_behind = behind;
  const Outcome<void> written = write_what_is_named();
  run_.save_us = MonotonicClock::now_us() - start_us;
  return written;
}

Outcome<void> Node::write_what_is_named() {
  const LocalMap& global = robot_->global().map();
  std::vector<KeyedIndex> workspace = workspace_for(global);
  global_digest_ = digest(global, workspace);
  if (!config_.global_map.empty()) {
    const Outcome<void> saved =
        save_map(global, identity_of(MapKind::kGlobal), workspace, config_.global_map);
    if (!saved.ok()) return saved.failure();
  }
  std::vector<KeyedIndex> local_workspace = workspace_for(robot_->map());
  local_digest_ = digest(robot_->map(), local_workspace);
  if (!config_.local_map.empty()) {
    const Outcome<void> saved =
        save_map(robot_->map(), identity_of(MapKind::kLocal), local_workspace, config_.local_map);
    if (!saved.ok()) return saved.failure();
  }
  if (config_.contribution.empty()) return {};
  const Outcome<std::unique_ptr<PublishedMap>> published = published_map(*robot_);
  if (!published.ok()) return published.failure();
  std::vector<KeyedIndex> published_workspace = workspace_for((*published)->map);
  return save_map((*published)->map, identity_of(MapKind::kLocal), published_workspace,
                  config_.contribution);
}

}  // namespace tessera
