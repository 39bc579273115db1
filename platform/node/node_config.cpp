// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/node_config.hpp"

#include <array>
#include <cctype>
#include <utility>

#include "base/input_file.hpp"
#include "settings/config_file.hpp"
#include "tessera/exchange/exchange_config.hpp"
#include "tessera/replica/replicas.hpp"

namespace tessera {

namespace {

constexpr std::int64_t kMost32 = std::numeric_limits<std::uint32_t>::max();

/// The options of "map" and "fuse" that correspond to keys.
struct OptionName {
  std::string_view option;
  ConfigKey key;
};
constexpr auto kOptionNames = std::to_array<OptionName>({
    {"--dataset", {"replay", "dataset"}},
    {"--pcd", {"replay", "pcd"}},
    {"--ply", {"replay", "ply"}},
    {"--depth", {"replay", "depth"}},
    {"--label-images", {"replay", "label_images"}},
    {"--intrinsics", {"replay", "intrinsics"}},
    {"--poses", {"replay", "poses"}},
    {"--deskew", {"replay", "deskew"}},
    {"--first", {"replay", "first"}},
    {"--last", {"replay", "last"}},
    {"--labels", {"replay", "labels"}},
    {"--resolution", {"map", "resolution_m"}},
    {"--inference", {"map", "inference"}},
    {"--kernel-length", {"map", "kernel_length_m"}},
    {"--prior", {"map", "prior"}},
    {"--max-range", {"map", "max_range_m"}},
    {"--min-range", {"map", "min_range_m"}},
    {"--downsample", {"map", "downsample_m"}},
    {"--thinning-weight", {"map", "thinning_weight"}},
    {"--free-space", {"map", "free_space"}},
    {"--free-weight", {"map", "free_weight"}},
    {"--memory", {"map", "memory"}},
    {"--fusion-memory", {"fusion", "memory"}},
    {"--counts", {"map", "counts"}},
    {"--min-weight", {"map", "min_weight"}},
    {"--max-evidence", {"map", "max_evidence"}},
    {"--work-budget", {"map", "work_budget"}},
    {"--deadline", {"map", "deadline_ms"}},
    {"--window", {"map", "window_m"}},
    {"--archive", {"map", "archive"}},
    {"--diffusion-length", {"fusion", "diffusion_length_m"}},
    {"--iterations", {"fusion", "iterations"}},
    {"--alpha", {"fusion", "alpha"}},
    {"--omega", {"fusion", "omega"}},
});

void take_robot(ConfigFile& file, NodeConfig& c) {
  file.require({"robot", "id"}, "a number that no other robot of the fleet has");
  file.take({"robot", "id"}, c.robot, {0, kMost32});
  file.require({"robot", "state"}, "a folder in which the node keeps its state");
  file.take_path({"robot", "state"}, c.state);
  std::string earlier = "keep";
  file.take({"robot", "earlier"}, earlier, {"keep", "drop"});
  c.earlier = earlier == "drop" ? EarlierEpochs::kDrop : EarlierEpochs::kKeep;
  file.take_path({"robot", "T_global_map"}, c.T_global_map);
}

void take_map(ConfigFile& file, NodeConfig& c) {
  MapOptions& o = c.map;
  const ConfigFile::Real any;
  file.take({"map", "resolution_m"}, o.resolution_m, any);
  file.take({"map", "inference"}, o.inference);
  file.take({"map", "kernel_length_m"}, o.kernel_length_m, any);
  o.kernel_length_given = file.is_given({"map", "kernel_length_m"});
  file.take({"map", "prior"}, o.prior, any);
  file.take({"map", "max_range_m"}, o.max_range_m, any);
  file.take({"map", "min_range_m"}, o.min_range_m, any);
  file.take_number_or({"map", "downsample_m"}, o.downsample, "off");
  file.take({"map", "thinning_weight"}, o.thinning_weight);
  bool free_space = true;
  file.take({"map", "free_space"}, free_space);
  o.free_space = free_space ? "on" : "off";
  std::size_t memory_bytes = std::size_t{192} << 20U;
  file.take_bytes({"map", "memory"}, memory_bytes);
  o.memory = std::to_string(memory_bytes);
  file.take({"map", "counts"}, o.counts);
  file.take({"map", "min_weight"}, o.min_weight, any);
  file.take({"map", "max_evidence"}, o.max_evidence, any);
  file.take({"map", "free_weight"}, o.free_weight, any);
  file.take({"map", "work_budget"}, o.work_budget, {});
  file.take({"map", "deadline_ms"}, o.deadline_ms, any);
  file.take({"map", "window_m"}, o.window_m, any);
  file.take_path({"map", "archive"}, o.archive);
  o.robot = c.robot;
}

void take_mapping(ConfigFile& file, NodeConfig& c) {
  file.take({"mapping", "period_ms"}, c.period_ms, {1, 10'000});
  // A replay must be reproducible; sensor data must be mapped in time.
  constexpr double kShare = 0.55;
  if (c.sensors.enabled) c.map.deadline_ms = kShare * static_cast<double>(c.period_ms);
  c.priority = c.sensors.enabled ? 40 : 0;
  c.lock_memory = c.sensors.enabled;
  file.take({"realtime", "priority"}, c.priority, {0, 95});
  file.take({"realtime", "lock_memory"}, c.lock_memory);
  file.take({"realtime", "mapping_cpus"}, c.mapping_cpus);
  file.take({"realtime", "other_cpus"}, c.other_cpus);
}

void take_publish(ConfigFile& file, NodeConfig& c) {
  file.take({"publish", "staleness_s"}, c.staleness_s, ConfigFile::Real{0.001, 3600.0});
  file.take({"publish", "free_staleness_s"}, c.free_staleness_s,
            ConfigFile::Real{c.staleness_s, 3600.0});
  file.take({"publish", "evidence_factor"}, c.evidence_factor, ConfigFile::Real{1.01, 1e6});
  file.take({"publish", "blocks"}, c.blocks, {64, std::int64_t{1} << 28});
  file.take({"publish", "label_bytes_per_s"}, c.label_bytes_per_s, {1000, kMost32});
  file.take({"publish", "free_bytes_per_s"}, c.free_bytes_per_s, {1000, kMost32});
}

void take_network(ConfigFile& file, NodeConfig& c) {
  file.take({"network", "url"}, c.link.url);
  file.take({"network", "interface"}, c.link.interface);
  file.take({"network", "receive_slots"}, c.link.queue_slots, {16, 1 << 20});
  file.take({"network", "send_slots"}, c.send_slots, {16, 1 << 20});
  file.take({"network", "bytes_per_s"}, c.bytes_per_s, {1000, 125'000'000});
  file.take({"network", "burst_bytes"}, c.burst_bytes, {4096, 16 << 20});
  file.take({"network", "peers"}, c.peers, {1, 1024});
  file.take({"network", "contributions"}, c.contributions, {1, Replicas::kMostContributions});
  file.take({"network", "contributions_per_robot"}, c.contributions_per_robot, {1, 65535});
  file.take({"network", "status"}, c.status);
}

void take_security(ConfigFile& file, NodeConfig& c) {
  file.take_path({"security", "fleet_key"}, c.keys.fleet_key);
  file.take_path({"security", "robot_secret"}, c.keys.robot_secret);
  file.take_path({"security", "robot_public_keys"}, c.keys.robot_public_keys);
  file.take({"security", "mission"}, c.keys.mission);
  file.take({"security", "exclude"}, c.exclude);
  file.take({"security", "conflicts"}, c.conflicts, {"alarm", "exclude"});
}

Outcome<void> check_excluded(const ConfigFile& file, const NodeConfig& c) {
  const ConfigKey key{"security", "exclude"};
  if (c.exclude.size() > ExchangeConfig::kMostExcluded) {
    return file.refusal(
        key, "takes at most " + std::to_string(ExchangeConfig::kMostExcluded) + " robots");
  }
  if (std::find(c.exclude.begin(), c.exclude.end(), c.robot) == c.exclude.end()) return {};
  return file.refusal(key, "names this robot itself; leave it out");
}

/// The mission of the fleet's key file is checked when that is read.
Outcome<void> check_mission(const ConfigFile& file, const NodeConfig& c) {
  const ConfigKey key{"security", "mission"};
  if (!file.is_given(key)) return {};
  if (c.keys.fleet_key.empty() && c.keys.robot_secret.empty())
    return file.refusal(key, "protects nothing without a key; name fleet_key, or leave it out");
  const Outcome<Mission> mission = Mission::make(c.keys.mission);
  if (mission.ok()) return {};
  return file.refusal(key, "is not allowed: " + mission.failure().message);
}

/// A robot does not run without the keys that its configuration asks for.
Outcome<void> check_keys(const ConfigFile& file, const NodeConfig& c) {
  using Named = std::pair<const char*, const std::string&>;
  for (const auto& [name, path] :
       {Named{"fleet_key", c.keys.fleet_key}, Named{"robot_secret", c.keys.robot_secret},
        Named{"robot_public_keys", c.keys.robot_public_keys}}) {
    const ConfigKey key{"security", name};
    if (file.is_given(key) && path.empty())
      return file.refusal(key, "is empty; name a key file, or leave it out");
  }
  if (c.keys.robot_secret.empty() == c.keys.robot_public_keys.empty()) return {};
  const bool has_secret = !c.keys.robot_secret.empty();
  return file.refusal({"security", has_secret ? "robot_secret" : "robot_public_keys"},
                      std::string("signatures need both keys: name ") +
                          (has_secret ? "robot_public_keys" : "robot_secret") + " too");
}

void take_fusion(ConfigFile& file, NodeConfig& c) {
  DiffusionOptions& d = c.diffusion;
  const ConfigFile::Real any;
  file.take_bytes({"fusion", "memory"}, c.fusion_memory_bytes);
  file.take({"fusion", "diffusion"}, d.mode, {"contractive", "paper", "none"});
  file.take({"fusion", "edge"}, d.edge, {"none", "label", "similarity", "confidence"});
  file.take({"fusion", "iterations"}, d.iterations, {0, 16});
  file.take({"fusion", "diffusion_length_m"}, d.length_m, any);
  file.take({"fusion", "alpha"}, d.alpha, any);
  file.take({"fusion", "omega"}, d.omega, any);
  file.take({"fusion", "whole_map"}, d.whole_map);
  file.take({"fusion", "counts"}, c.counts, {"dense", "compact"});
  file.take({"fusion", "robot_share"}, c.robot_share, ConfigFile::Real{0.01, 1.0});
  file.take({"fusion", "work_per_tick"}, c.work_per_tick, {1000, std::int64_t{1} << 40});
  file.take({"fusion", "near_first"}, c.near_first);
}

void take_output(ConfigFile& file, NodeConfig& c) {
  file.take_path({"output", "global_map"}, c.global_map);
  file.take_path({"output", "local_map"}, c.local_map);
  file.take({"output", "keep_maps"}, c.keep_maps);
  file.take_path({"output", "contribution"}, c.contribution);
  file.take_path({"output", "report"}, c.report);
  file.take_path({"output", "snapshots"}, c.snapshots);
  file.take({"output", "snapshot_every_s"}, c.snapshot_every_s, ConfigFile::Real{0.05, 86400.0});
}

void take_run(ConfigFile& file, NodeConfig& c) {
  file.take({"run", "tick_ms"}, c.tick_ms, {1, 1000});
  file.take({"run", "wait_for_peers"}, c.wait_for_peers, {0, 1024});
  file.take({"run", "silence_s"}, c.silence_s, ConfigFile::Real{0.0, 86400.0});
  file.take({"run", "quiet_s"}, c.quiet_s, ConfigFile::Real{0.0, 3600.0});
  file.take({"run", "linger_s"}, c.linger_s, ConfigFile::Real{0.0, 86400.0});
  file.take({"run", "duration_s"}, c.duration_s, ConfigFile::Real{0.0, 1e7});
}

}  // namespace

Outcome<NodeConfig> parse_node_config(std::string_view text, const std::string& path) {
  Outcome<ConfigFile> file = ConfigFile::parse(text, path);
  if (!file.ok()) return file.failure();
  NodeConfig config;
  for (const auto take :
       {take_robot, take_replay, take_sensors, take_vehicle, take_mapping, take_map, take_publish,
        take_network, take_security, take_fusion, take_service, take_output, take_run})
    take(*file, config);
  const Outcome<void> finished = file->finish();
  if (!finished.ok()) return finished.failure();
  const Outcome<void> keys = check_keys(*file, config);
  if (!keys.ok()) return keys.failure();
  const Outcome<void> mission = check_mission(*file, config);
  if (!mission.ok()) return mission.failure();
  const Outcome<void> excluded = check_excluded(*file, config);
  if (!excluded.ok()) return excluded.failure();
  const Outcome<void> view = check_view(*file, config);
  if (!view.ok()) return view.failure();
  const Outcome<void> sensors = check_sensors(*file, config);
  if (!sensors.ok()) return sensors.failure();
  config.values = file->values();
  return config;
}

namespace {

constexpr std::size_t kMostConfigBytes = 1U << 20U;

}  // namespace

Outcome<NodeConfig> read_node_config(const std::string& path) {
  const Outcome<std::string> text = read_text_file(path, kMostConfigBytes);
  if (!text.ok()) return text.failure();
  return parse_node_config(*text, path);
}

Failure in_words_of_config(const Failure& failure, const std::string& path) {
  std::string message = failure.message;
  const ConfigKey* first = nullptr;
  std::size_t first_at = std::string::npos;
  for (const OptionName& name : kOptionNames) {
    std::size_t at = message.find(name.option);
    const auto ends = [&] {
      const std::size_t end = at + name.option.size();
      return end == message.size() ||
             (message[end] != '-' && std::isalpha(static_cast<unsigned char>(message[end])) == 0);
    };
    while (at != std::string::npos && !ends()) at = message.find(name.option, at + 1);
    if (at == std::string::npos) continue;
    if (at < first_at) {
      first = &name.key;
      first_at = at;
    }
    message.replace(at, name.option.size(), name.key.name);
  }
  if (first == nullptr) return failure;
  const Outcome<std::string> text = read_text_file(path, kMostConfigBytes);
  if (!text.ok()) return {path + ": " + message, failure.kind};
  const Outcome<ConfigFile> file = ConfigFile::parse(*text, path);
  if (!file.ok()) return {path + ": " + message, failure.kind};
  return {file->refusal(*first, message).message, failure.kind};
}

}  // namespace tessera
