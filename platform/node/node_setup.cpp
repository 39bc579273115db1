// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A node before its loop and after it: places checked, memory taken, network opened, maps written.
#include <filesystem>
#include <utility>

#include "mapping/outputs.hpp"
#include "node/node.hpp"
#include "node/published_map.hpp"
#include "node/start_counter.hpp"
#include "posix/monotonic_clock.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

Outcome<std::unique_ptr<Node>> Node::make(const NodeConfig& config, const std::string& path) {
  const MapOptions& map = config.map;
  Outcome<Dataset> dataset =
      Dataset::open(map.dataset, {.first = map.first, .last = map.last, .labels = map.labels});
  if (!dataset.ok()) return in_words_of_config(dataset.failure(), path);
  std::unique_ptr<Node> node(new Node(config, std::move(*dataset)));
  const Outcome<void> done = node->set_up(path);
  if (!done.ok()) return done.failure();
  return node;
}

Outcome<void> Node::check_places(const std::string& path) const {
  Outcome<void> places = check_outputs({{"[output] global_map", config_.global_map},
                                        {"[output] local_map", config_.local_map},
                                        {"[output] contribution", config_.contribution},
                                        {"[output] report", config_.report}},
                                       {{"--config", path},
                                        {"[security] fleet_key", config_.fleet_key},
                                        {"[security] robot_secret", config_.robot_secret},
                                        {"[security] robot_public_keys", config_.robot_public_keys},
                                        {"[robot] T_global_map", config_.T_global_map}},
                                       {config_.map.dataset, {config_.map.labels}});
  if (!places.ok() || config_.snapshots.empty()) return places;
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
  const Outcome<void> places = check_places(path);
  if (!places.ok()) return {in_words_of_config(places.failure(), path)};
  // What can be refused is, before the start is counted.
  const Outcome<RobotSetup> trial = set_up_robot(config_, dataset_, 1);
  if (!trial.ok()) return {in_words_of_config(trial.failure(), path)};
  const Outcome<void> keys = read_keys(path);
  if (!keys.ok()) return keys.failure();
  Outcome<std::unique_ptr<NetworkPort>> port = NetworkPort::open(config_.link, config_.send_slots);
  if (!port.ok()) return port.failure();
  port_ = std::move(*port);
  Outcome<FileDescriptor> lock = lock_robot(config_.state, config_.robot);
  if (!lock.ok()) return lock.failure();
  lock_ = std::move(*lock);
  const Outcome<std::uint32_t> start = count_start(config_.state, config_.robot);
  if (!start.ok()) return start.failure();
  setup_ = *trial;
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
  return {};
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

Outcome<void> Node::write_maps() {
  robot_->finish();
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
