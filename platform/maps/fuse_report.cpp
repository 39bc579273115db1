// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/fuse_report.hpp"

#include <algorithm>
#include <set>

#include "base/number_text.hpp"
#include "maps/session_file.hpp"

namespace tessera {

namespace {

/// The least agreement of all pairs; empty if no two maps have common labels.
std::optional<double> least_agreement(const std::vector<PairAlignment>& pairs) {
  std::optional<double> least;
  for (const PairAlignment& pair : pairs) {
    if (pair.labels) least = std::min(least.value_or(1.0), pair.labels->agreement());
  }
  return least;
}

Json alignments_json(const FuseRun& run, const std::vector<FuseInput>& inputs) {
  Json json = Json::array();
  const double resolution_m = run.config.map.resolution_m;
  for (const PairAlignment& pair : run.pairs) {
    if (!pair.labels) continue;
    const Alignment& a = *pair.labels;
    json.push_back({{"first", inputs[pair.first].path},
                    {"second", inputs[pair.second].path},
                    {"compared", a.compared},
                    {"common", a.common},
                    {"agreed", a.agreed},
                    {"agreement", a.agreement()},
                    {"best_shift_m",
                     {a.best_shift[0] * resolution_m, a.best_shift[1] * resolution_m,
                      a.best_shift[2] * resolution_m}},
                    {"agreed_shifted", a.agreed_shifted},
                    {"shifted", a.shifted()}});
  }
  return json;
}

Json contributions_json(const std::vector<FuseInput>& inputs) {
  Json json = Json::array();
  for (const FuseInput& input : inputs) {
    const MapUsage usage = input.stored->map.usage();
    if (input.session) continue;
    json.push_back({{"map", input.path},
                    {"robot", input.id.robot},
                    {"epoch", input.id.epoch},
                    {"submap", input.id.submap},
                    {"blocks", usage.blocks},
                    {"label_voxels", usage.label_voxels},
                    {"digest", hex64(input.digest)},
                    {"T_global_map", std::vector<double>(input.T_global_map.data(),
                                                         input.T_global_map.data() + 12)}});
  }
  return json;
}

Json sessions_json(const std::vector<FuseInput>& inputs) {
  Json json = Json::array();
  for (const FuseInput& input : inputs) {
    if (!input.session) continue;
    Json one = to_json(*input.session);
    one["map"] = input.path;
    one["blocks"] = input.stored->map.usage().blocks;
    one["T_global_map"] =
        std::vector<double>(input.T_global_map.data(), input.T_global_map.data() + 12);
    json.push_back(std::move(one));
  }
  return json;
}

/// Blocks, or parts of them, that are not in the map for lack of room.
std::uint64_t refused_blocks(const GlobalMapReport& report) {
  return report.refused_blocks + report.refused_outputs + report.replicas.replicas_refused_storage +
         report.replicas.replicas_refused_quota;
}

double per_voxel(std::size_t bytes, std::uint64_t voxels) {
  return voxels == 0 ? 0.0 : static_cast<double>(bytes) / static_cast<double>(voxels);
}

}  // namespace

Json to_json(const FuseOptions& options, const GlobalMapConfig& config) {
  return {{"maps", options.maps},
          {"out", options.out},
          {"report", options.report},
          {"transform", options.transforms},
          {"session", options.sessions},
          {"align", options.align},
          {"diffusion", to_string(options.diffusion.mode)},
          {"edge", to_string(options.diffusion.edge)},
          {"iterations", config.diffusion.iterations},
          {"diffusion_length", decimal_of(config.diffusion.length_m)},
          {"alpha", decimal_of(config.diffusion.alpha)},
          {"omega", decimal_of(config.diffusion.omega)},
          {"whole_map", config.diffusion.whole_map},
          {"reliability", config.diffusion.weigh_robots},
          {"reliability_alarm", decimal_of(config.diffusion.reliability_alarm)},
          {"counts", to_string(config.map.tuple)},
          {"memory", options.memory_bytes ? Json(*options.memory_bytes) : Json()}};
}

Json to_json(const FuseRun& run, const std::vector<FuseInput>& inputs, const Json& config) {
  const GlobalMapReport& report = run.report;
  const std::optional<double> alignment = least_agreement(run.pairs);
  Json json = {{"voxels", run.usage.label_voxels},
               {"free_voxels", run.free_voxels},
               {"overlap_voxels", report.nodes},
               {"overlap_blocks", report.overlap_blocks},
               {"iterations", run.config.diffusion.iterations},
               {"residual", report.residual},
               {"milliseconds", run.publish_ms + run.fuse_ms},
               {"publish_milliseconds", run.publish_ms},
               {"fuse_milliseconds", run.fuse_ms},
               {"work", run.work},
               {"digest", hex64(run.digest)},
               {"mean_variance", report.mean_variance},
               {"mean_variance_undiffused", report.mean_variance_undiffused},
               {"alignment", alignment ? Json(*alignment) : Json()},
               {"alignments", alignments_json(run, inputs)},
               {"frames", frames_json(run.pairs, inputs)},
               {"reliability", to_json(run.robots, inputs.front().stored->map.classes())},
               {"contributions", contributions_json(inputs)},
               {"sessions", sessions_json(inputs)}};
  json["memory"] = {
      {"budget_bytes", run.budget_bytes},
      {"used_bytes", report.used_bytes},
      {"map_used_bytes", run.usage.used_bytes},
      {"replica_bytes", report.replicas.replica_bytes},
      {"sum_bytes", report.sum_bytes},
      {"bytes_per_replica_voxel", per_voxel(report.replicas.replica_bytes, run.replica_voxels)},
      {"bytes_per_label_voxel", per_voxel(run.usage.used_bytes, run.usage.label_voxels)},
      {"refused", refused_blocks(report) + report.refused_sums + report.refused_tallies},
      {"refused_blocks", refused_blocks(report)},
      {"refused_sums", report.refused_sums},
      {"refused_tallies", report.refused_tallies}};
  json["saturated_voxels"] = report.saturated_voxels;
  json["heap_allocations_after_init"] = run.heap_allocations ? Json(*run.heap_allocations) : Json();
  json["config"] = config;
  return json;
}

std::vector<Message> doubts_of(const FuseRun& run, const ClassTable& classes) {
  std::vector<Message> doubts;
  for (const JudgedRobot& robot : run.robots)
    if (robot.is_named()) doubts.emplace_back(doubt_of(robot, classes));
  return doubts;
}

std::vector<Message> losses_of(const FuseRun& run) {
  std::vector<Message> losses;
  const std::uint64_t blocks = refused_blocks(run.report);
  if (blocks > 0) {
    losses.push_back(counted(blocks, "refusal") + " of blocks for lack of memory; give a larger " +
                     kFuseSettings["--memory"]);
  }
  if (run.report.refused_sums > 0) {
    losses.push_back(counted(run.report.refused_sums, "block") +
                     " left undiffused for lack of memory; give a larger " +
                     kFuseSettings["--memory"]);
  }
  if (run.report.refused_tallies > 0) {
    losses.push_back(counted(run.report.refused_tallies, "block") +
                     " not asked how reliable robots are for lack of memory; give a larger " +
                     kFuseSettings["--memory"]);
  }
  return losses;
}

Json record_of(const std::vector<FuseInput>& inputs, Json config) {
  for (const char* const key : {"maps", "out", "report", "transform", "session", "memory"})
    config.erase(key);
  const Json range = recorded_setting(inputs.front().stored->header, "max_range");
  const bool same = std::all_of(inputs.begin(), inputs.end(), [&](const FuseInput& input) {
    return input.session || recorded_setting(input.stored->header, "max_range") == range;
  });
  if (same && !range.is_null()) config["max_range"] = range;
  std::set<std::uint32_t> robots;
  for (const FuseInput& input : inputs) robots.insert(input.id.robot);
  config["robots"] = robots;
  for (const FuseInput& input : inputs)
    if (input.session) config["sessions"].push_back(to_json(*input.session));
  return config;
}

}  // namespace tessera
