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
  TESSERA_TRY(open_inputs());
  TESSERA_TRY(check_places());
  TESSERA_TRY_ASSIGN(const RobotSetup trial, set_up_robot(config_, scan_content(), 1));
  setup_ = trial;
  TESSERA_TRY(check_urls());
  TESSERA_TRY(make_registrar());
  TESSERA_TRY(check_sectors());
  return read_keys();
}

/// Checked with the smallest map with these voxels, as the robot's own is made later.
Outcome<void> Node::check_sectors() const {
  if (config_.vehicle.can.empty()) return {};
  MapConfig config = setup_.robot.map;
  config.storage_bytes = 4 * SlabPool::kPageBytes;
  TESSERA_TRY_ASSIGN(ArenaMemory memory, ArenaMemory::allocate(required_bytes(config)));
  Arena arena(memory.span());
  const Result<LocalMap> map = LocalMap::make(arena, config, classes());
  if (!map.ok()) return Failure{std::string("the map cannot be made: ") + to_string(map.status())};
  TESSERA_TRY_ASSIGN(const ArenaMemory room,
                     ArenaMemory::allocate(ObstacleSectors::required_bytes(*map)));
  Arena sectors_arena(room.span());
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
      {kMapSettings["--kernels"], config_.map.kernels},
      {kMapSettings["--archive"],
       config_.map.archive.empty() ? std::string() : archive_path(config_.map.archive)}};
  TESSERA_TRY_ASSIGN(const std::vector<NamedFile> clouds, cloud_files(config_.map));
  inputs.insert(inputs.end(), clouds.begin(), clouds.end());
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
  TESSERA_TRY_ASSIGN(FleetKeys keys, FleetKeys::read(config_.keys, config_.robot));
  keys_.emplace(std::move(keys));
  reopening_ = EpochPace(keys_->keys().signatures.on());
  return {};
}

/// Durable before anything is sent. Each start opens a new epoch, so that no version of an epoch is
/// ever signed twice.
Outcome<void> Node::begin_state() {
  const StartMap continued =
      setup_.robot.most_submaps != 0 ? StartMap::kSubmaps : StartMap::kContinued;
  const StartMap empty =
      setup_.robot.most_submaps != 0 ? StartMap::kEmptySubmaps : StartMap::kEmpty;
  // A map of an earlier start that is not continued has another frame, which nobody knows.
  const EarlierEpochs earlier =
      config_.frames == FrameMode::kGiven ? config_.earlier : EarlierEpochs::kDrop;
  TESSERA_TRY(state_->begin(earlier, found_ ? continued : empty));
  set_earlier_files_aside();
  setup_.robot.epoch = state_->epoch();
  epoch_ = state_->epoch();
  setup_.robot.floor = state_->floor();
  TESSERA_TRY_ASSIGN(const std::uint64_t session, make_session(state_->starts()));
  setup_.robot.exchange.session = session;
  // No other robot chooses the blocks of the local map, and without a seed they are published in
  // the same order each time.
  TESSERA_TRY_ASSIGN(const std::uint64_t seed, make_hash_seed());
  setup_.robot.global.map.hash_seed = seed;
  setup_.robot.exchange.mission = keys_->mission().number();
  setup_.robot.exchange.listen_us = kListen_us;
  return {};
}

/// An archive of an earlier start is one that did not end in order.
Outcome<void> Node::open_archive() {
  const std::string& folder = config_.map.archive;
  if (folder.empty()) return {};
  TESSERA_TRY_ASSIGN(const std::string kept, config_.keep_maps
                                                 ? keep_earlier_archive(archive_path(folder))
                                                 : Outcome<std::string>(std::string()));
  if (!kept.empty()) run_.kept_maps.push_back(kept);
  TESSERA_TRY_ASSIGN(HeldArchive archive,
                     HeldArchive::make(folder, setup_.map, identity_of(MapKind::kLocal), nullptr,
                                       robot_->mapper()));
  archive_.emplace(std::move(archive));
  return {};
}

Outcome<void> Node::open_submaps() {
  if (setup_.robot.most_submaps == 0) return {};
  TESSERA_TRY_ASSIGN(kept_, KeptSubmaps::make(map_name().stem(), robot_->map()));
  kept_->take_up(found_ ? found_->state.kept : std::vector<SubmapRow>(), state_->map_epoch());
  robot_->mapper().maps().require(LocalMaps::User::kKeeping);
  return {};
}

Outcome<void> Node::set_up() {
  // All checks are made before the start is counted.
  TESSERA_TRY(check_all());
  TESSERA_TRY(make_snapshot_folder());
  // Before anything is allocated whose address must not change.
  if (config_.lock_memory) keep_freed_memory();
  LinkConfig link = config_.link;
  link.thread = thread_roles(config_).link;
  const StatusKeys status{keys_->status_authenticator(), keys_->keys().signatures};
  door_.emplace(keys_->keys().authenticator, status, keys_->mission().number());
  fleet_.emplace(status, config_.robot);
  corrected_submaps_.resize(CorrectionMessage::kMostPoses);
  link.check = door_->check();
  link.side = {.channel = kStatusChannel, .check = door_->status_check()};
  TESSERA_TRY_ASSIGN(
      std::unique_ptr<NetworkPort> port,
      NetworkPort::open(link, config_.send_slots, thread_roles(config_).sending, status));
  port_ = std::move(port);
  TESSERA_TRY_ASSIGN(FileDescriptor lock, lock_robot(config_.state, config_.robot));
  lock_ = std::move(lock);
  TESSERA_TRY_ASSIGN(RobotState state, RobotState::open(config_.state, config_.robot));
  state_.emplace(std::move(state));
  TESSERA_TRY(find_earlier_map());
  TESSERA_TRY(keep_earlier_maps());
  TESSERA_TRY(begin_state());
  const Clock clock{nullptr, [](void*) { return MonotonicClock::now_us(); }};
  TESSERA_TRY_ASSIGN(HeldRobot robot,
                     make_robot(setup_.robot, setup_.classes, keys_->keys(), clock));
  robot_ = std::move(robot);
  TESSERA_TRY(open_archive());
  TESSERA_TRY(open_submaps());
  for (const RobotFloor& heard : state_->floors())
    robot_->exchange().set_floor_of(heard.robot, heard.floor);
  excluded_ = config_.exclude;
  set_excluded(excluded_);
  TESSERA_TRY(make_threads());
  TESSERA_TRY(open_durable_map());
  if (!config_.lock_memory) return {};
  prefault(robot_.memory());
  run_.not_locked = lock_memory(later_bytes(config_));
  return {};
}

}  // namespace tessera
