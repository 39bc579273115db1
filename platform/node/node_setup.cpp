// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A node before its loop: checks paths, allocates memory, opens the network.
#include <filesystem>
#include <utility>

#include "base/allocation_counter.hpp"
#include "base/monotonic_clock.hpp"
#include "base/outputs.hpp"
#include "link/key_settings.hpp"
#include "link/session.hpp"
#include "node/kept_maps.hpp"
#include "node/node.hpp"
#include "node/node_settings.hpp"
#include "node/published_map.hpp"
#include "node/sensor_settings.hpp"
#include "node/thread_roles.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

/// Time for listening before anything is sent: each robot announces its content once a second.
constexpr std::int64_t kListen_us = 1'200'000;

/// Memory that a node allocates after its memory is locked: stacks, and for writing maps. Writing a
/// contribution makes it a map, of no more than is shared.
std::size_t later_bytes(const NodeConfig& config) {
  constexpr std::size_t kAlways = std::size_t{64} << 20U;
  return kAlways + (config.contribution.empty() ? 0 : config.fusion_memory_bytes);
}

}  // namespace

Outcome<std::unique_ptr<Node>> Node::make(const NodeConfig& config) {
  std::unique_ptr<Node> node(new Node(config));
  node->run_.made_us = MonotonicClock::now_us();
  const Outcome<void> done = node->set_up();
  if (!done.ok()) return config.places.worded(done.failure());
  return node;
}

Outcome<void> Node::check(const NodeConfig& config) {
  const Outcome<void> checked = Node(config).check_all();
  return checked.ok() ? checked : config.places.worded(checked.failure());
}

Outcome<void> Node::check_all() {
  const Outcome<void> inputs = open_inputs();
  if (!inputs.ok()) return inputs.failure();
  const Outcome<void> places = check_places();
  if (!places.ok()) return places.failure();
  const Outcome<RobotSetup> trial = set_up_robot(config_, scan_sizes(), 1);
  if (!trial.ok()) return trial.failure();
  setup_ = *trial;
  const Outcome<void> urls = check_urls();
  if (!urls.ok()) return urls.failure();
  const Outcome<void> registrar = make_registrar();
  if (!registrar.ok()) return registrar.failure();
  const Outcome<void> sectors = check_sectors();
  if (!sectors.ok()) return sectors.failure();
  return read_keys();
}

/// Checked with the smallest map with these voxels, as the robot's own is made later.
Outcome<void> Node::check_sectors() const {
  if (config_.vehicle.can.empty()) return {};
  MapConfig config = setup_.robot.map;
  config.storage_bytes = 4 * SlabPool::kPageBytes;
  Outcome<ArenaMemory> memory = ArenaMemory::allocate(required_bytes(config));
  if (!memory.ok()) return memory.failure();
  Arena arena(memory->span());
  const Result<LocalMap> map = LocalMap::make(arena, config, classes());
  if (!map.ok()) return Failure{std::string("the map cannot be made: ") + to_string(map.status())};
  const Outcome<ArenaMemory> room = ArenaMemory::allocate(ObstacleSectors::required_bytes(*map));
  if (!room.ok()) return room.failure();
  Arena sectors_arena(room->span());
  if (ObstacleSectors::make(sectors_of(config_.vehicle), *map, sectors_arena).ok()) return {};
  return Failure{Message(kVehicleSettings["vehicle.sector_range_m"]) +
                 ", own_radius_m, sector_low_m or sector_high_m is more than 4096 voxels of [map] "
                 "resolution_m; give less, or larger voxels"};
}

/// Checks what the ports would refuse when they are opened.
Outcome<void> Node::check_urls() const {
  struct Named {
    const SettingName& key;
    const std::string& text;
    bool used;
    const char* local = nullptr;  ///< Why nothing may leave this machine.
  };
  const Named urls[] = {{kNodeSettings["network.url"], config_.link.url, true},
                        {kSensorSettings["sensors.url"], config_.sensors.url,
                         config_.sensors.enabled, "long messages must stay on this machine"},
                        {kNodeSettings["service.url"], config_.query_url, config_.queries,
                         "queries are not authenticated, so they must stay on this machine"}};
  for (const Named& named : urls) {
    if (!named.used) continue;
    const Outcome<UdpmUrl> url = UdpmUrl::parse(named.text);
    if (!url.ok()) return Failure{Message(named.key) + " " + url.failure().message};
    if (named.local != nullptr && url->ttl != 0)
      return Failure{Message(named.key) + " " + named.local + "; write ttl=0"};
  }
  return {};
}

Outcome<void> Node::check_places() const {
  std::vector<NamedFile> inputs = {
      {"--config", config_.places.path()},
      {kKeySettings["security.fleet_key"], config_.keys.fleet_key},
      {kKeySettings["security.robot_secret"], config_.keys.robot_secret},
      {kKeySettings["security.robot_public_keys"], config_.keys.robot_public_keys},
      {kNodeSettings["robot.T_global_map"], config_.T_global_map},
      {kMapSettings["--archive"],
       config_.map.archive.empty() ? std::string() : archive_path(config_.map.archive)}};
  const Outcome<std::vector<NamedFile>> clouds = cloud_files(config_.map);
  if (!clouds.ok()) return clouds.failure();
  inputs.insert(inputs.end(), clouds->begin(), clouds->end());
  return check_outputs({{kNodeSettings["output.global_map"], config_.global_map},
                        {kNodeSettings["output.local_map"], config_.local_map},
                        {kNodeSettings["output.contribution"], config_.contribution},
                        {kNodeSettings["output.report"], config_.report}},
                       inputs, dataset_folder(config_.map));
}

Outcome<void> Node::make_snapshot_folder() const {
  if (config_.snapshots.empty()) return {};
  std::error_code error;
  std::filesystem::create_directories(config_.snapshots, error);
  if (!error) return check_writable(config_.snapshots + "/global_0000.tsm");
  return Failure{"cannot make the folder " + config_.snapshots + ": " + error.message() +
                 "; name another one"};
}

Outcome<void> Node::read_keys() {
  Outcome<FleetKeys> keys = FleetKeys::read(config_.keys, config_.robot);
  if (!keys.ok()) return keys.failure();
  keys_.emplace(std::move(*keys));
  reopening_ = EpochPace(keys_->keys().signatures.on());
  return {};
}

/// Durable before anything is sent. Each start opens a new epoch, so that no version of an epoch is
/// ever signed twice.
Outcome<void> Node::begin_state() {
  Outcome<RobotState> state = RobotState::open(config_.state, config_.robot);
  if (!state.ok()) return state.failure();
  state_.emplace(std::move(*state));
  const Outcome<void> begun = state_->begin(config_.earlier);
  if (!begun.ok()) return begun.failure();
  setup_.robot.epoch = state_->epoch();
  epoch_ = state_->epoch();
  setup_.robot.floor = state_->floor();
  const Outcome<std::uint64_t> session = make_session(state_->starts());
  if (!session.ok()) return session.failure();
  setup_.robot.exchange.session = *session;
  // No other robot chooses the blocks of the local map, and without a seed they are published in
  // the same order each time.
  const Outcome<std::uint64_t> seed = make_hash_seed();
  if (!seed.ok()) return seed.failure();
  setup_.robot.global.map.hash_seed = *seed;
  setup_.robot.exchange.mission = keys_->mission().number();
  setup_.robot.exchange.listen_us = kListen_us;
  return {};
}

/// An archive of an earlier start is one that did not end in order.
Outcome<void> Node::open_archive() {
  const std::string& folder = config_.map.archive;
  if (folder.empty()) return {};
  const Outcome<std::string> kept = config_.keep_maps ? keep_earlier_archive(archive_path(folder))
                                                      : Outcome<std::string>(std::string());
  if (!kept.ok()) return kept.failure();
  if (!kept->empty()) run_.kept_maps.push_back(*kept);
  Outcome<HeldArchive> archive = HeldArchive::make(folder, setup_.map, identity_of(MapKind::kLocal),
                                                   nullptr, robot_->mapper());
  if (!archive.ok()) return archive.failure();
  archive_.emplace(std::move(*archive));
  return {};
}

Outcome<void> Node::set_up() {
  // All checks are made before the start is counted.
  const Outcome<void> checked = check_all();
  if (!checked.ok()) return checked.failure();
  const Outcome<void> snapshots = make_snapshot_folder();
  if (!snapshots.ok()) return snapshots.failure();
  // Before anything is allocated whose address must not change.
  if (config_.lock_memory) keep_freed_memory();
  LinkConfig link = config_.link;
  link.thread = thread_roles(config_).link;
  const StatusKeys status{keys_->status_authenticator(), keys_->keys().signatures};
  door_.emplace(keys_->keys().authenticator, status, keys_->mission().number());
  fleet_.emplace(status, config_.robot);
  link.check = door_->check();
  link.side = {.channel = kStatusChannel, .check = door_->status_check()};
  Outcome<std::unique_ptr<NetworkPort>> port =
      NetworkPort::open(link, config_.send_slots, thread_roles(config_).sending, status);
  if (!port.ok()) return port.failure();
  port_ = std::move(*port);
  Outcome<FileDescriptor> lock = lock_robot(config_.state, config_.robot);
  if (!lock.ok()) return lock.failure();
  lock_ = std::move(*lock);
  const Outcome<void> kept = keep_earlier_maps();
  if (!kept.ok()) return kept.failure();
  const Outcome<void> begun = begin_state();
  if (!begun.ok()) return begun.failure();
  const Clock clock{nullptr, [](void*) { return MonotonicClock::now_us(); }};
  Outcome<HeldRobot> robot = make_robot(setup_.robot, classes(), keys_->keys(), clock);
  if (!robot.ok()) return robot.failure();
  robot_ = std::move(*robot);
  const Outcome<void> archive = open_archive();
  if (!archive.ok()) return archive.failure();
  for (const RobotFloor& heard : state_->floors())
    robot_->exchange().set_floor_of(heard.robot, heard.floor);
  excluded_ = config_.exclude;
  set_excluded(excluded_);
  const Outcome<void> threads = make_threads();
  if (!threads.ok() || !config_.lock_memory) return threads;
  prefault(robot_.memory());
  run_.not_locked = lock_memory(later_bytes(config_));
  return {};
}

}  // namespace tessera
