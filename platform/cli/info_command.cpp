// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera info: prints what is in a map file.
#include <cstdio>
#include <limits>

#include "base/input_file.hpp"
#include "base/json.hpp"
#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "cli/command.hpp"
#include "maps/stored_map.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

struct Content {
  std::uint64_t occupied = 0;
  std::uint64_t free = 0;
  Point3d low = Point3d::Constant(std::numeric_limits<double>::infinity());
  Point3d high = Point3d::Constant(-std::numeric_limits<double>::infinity());
  std::array<std::uint64_t, kMaxComponents> by_label{};
};

Content survey(const LocalMap& map, std::span<KeyedIndex> workspace) {
  Content content;
  for_each_observed(map, workspace, [&](const VoxelCoord& voxel, const VoxelEvidence& evidence) {
    const Estimate e = estimate(evidence, map.config().prior);
    const Point3d center = map.lattice().center_of(voxel);
    content.low = content.low.cwiseMin(center);
    content.high = content.high.cwiseMax(center);
    if (e.state != VoxelState::kOccupied) {
      ++content.free;
      return;
    }
    ++content.occupied;
    ++content.by_label[static_cast<std::size_t>(e.label)];
  });
  return content;
}

Json to_json(const StoredMap& stored, const Content& content, std::uint64_t file_bytes,
             std::uint64_t digest_value) {
  const LocalMap& map = stored.map;
  const MapIdentity& identity = stored.header.identity;
  const MapUsage usage = map.usage();
  Json json = {{"kind", identity.kind == MapKind::kLocal ? "local" : "global"},
               {"robot", identity.robot},
               {"epoch", identity.epoch},
               {"revision", map.revision()},
               {"resolution", map.config().resolution_m},
               {"prior", map.config().prior},
               {"counts", to_string(map.config().tuple)},
               {"max_evidence", decimal_of(map.config().max_evidence)},
               {"free_weight", decimal_of(map.config().free_weight)},
               {"file_bytes", file_bytes},
               {"blocks", usage.blocks},
               {"label_voxels", usage.label_voxels},
               {"free_voxels", map.count_free_voxels()},
               {"occupied_state", content.occupied},
               {"free_state", content.free},
               {"digest", hex64(digest_value)}};
  if (content.occupied + content.free > 0) {
    json["extent_low"] = {content.low.x(), content.low.y(), content.low.z()};
    json["extent_high"] = {content.high.x(), content.high.y(), content.high.z()};
  }
  json["T_global_map"] = Json();
  if (identity.has_T_global_map) {
    json["T_global_map"] =
        std::vector<double>(identity.T_global_map.data(), identity.T_global_map.data() + 12);
  }
  json["classes"] = Json::array();
  for (int label = 1; label <= map.classes().num_classes(); ++label) {
    const SemanticClass& c = map.classes()[label];
    json["classes"].push_back({{"id", label},
                               {"name", std::string(c.name_view())},
                               {"color", {c.color.r, c.color.g, c.color.b}},
                               {"voxels", content.by_label[static_cast<std::size_t>(label)]}});
  }
  const std::string settings(identity.settings.data(), identity.settings_bytes);
  json["settings"] = Json::parse(settings, nullptr, false);
  if (json["settings"].is_discarded()) json["settings"] = settings;
  return json;
}

/// settings: as fuse records them; what they do not have is left out.
void print_fusion(const Json& settings, const std::string& path) {
  std::string robots;
  if (settings.is_object() && settings.contains("robots") && settings["robots"].is_array()) {
    for (const Json& robot : settings["robots"])
      robots += (robots.empty() ? "" : ", ") + robot.dump();
  }
  std::printf("%s: global map%s\n", path.c_str(),
              robots.empty() ? "" : (" of robots " + robots).c_str());
  if (!settings.is_object()) return;
  std::string text;
  for (const char* const key :
       {"diffusion", "iterations", "diffusion_length", "edge", "alpha", "omega", "whole_map"}) {
    if (!settings.contains(key)) continue;
    const Json& value = settings[key];
    text += (text.empty() ? "" : ", ") + std::string(key) + " " +
            (value.is_string() ? value.get<std::string>() : value.dump());
  }
  if (!text.empty()) std::printf("  fused with   %s\n", text.c_str());
}

void print(const Json& json, const std::string& path) {
  const auto number = [&](const char* key) { return json[key].get<unsigned long long>(); };
  const bool global = json["kind"] == "global";
  if (global) {
    print_fusion(json["settings"], path);
  } else {
    std::printf("%s: local map of robot %llu, epoch %llu\n", path.c_str(), number("robot"),
                number("epoch"));
  }
  std::printf("  resolution   %g m, %zu classes, prior %g, %s counts\n",
              json["resolution"].get<double>(), json["classes"].size(), json["prior"].get<double>(),
              json["counts"].get<std::string>().c_str());
  std::printf("  evidence     at most %g a voxel (0: no cap), %g a pass of a ray\n",
              json["max_evidence"].get<double>(), json["free_weight"].get<double>());
  if (json.contains("extent_low")) {
    const auto axis = [&](std::size_t i) {
      return json["extent_high"][i].get<double>() - json["extent_low"][i].get<double>();
    };
    std::printf("  extent       %.1f x %.1f x %.1f m\n", axis(0), axis(1), axis(2));
  }
  const char* const frame = global                           ? "the global one"
                            : json["T_global_map"].is_null() ? "the robot's own, no T_global_map"
                                                             : "T_global_map given";
  std::printf("  frame        %s\n", frame);
  std::printf(
      "  voxels       %llu labelled or occupied, %llu with free evidence only, in %llu blocks\n",
      number("label_voxels"), number("free_voxels"), number("blocks"));
  std::printf("  file         %llu bytes\n", number("file_bytes"));
  std::printf("  digest       %s\n", json["digest"].get<std::string>().c_str());
  for (const Json& c : json["classes"]) {
    const auto voxels = c["voxels"].get<unsigned long long>();
    if (voxels > 0) std::printf("  %12llu  %s\n", voxels, c["name"].get<std::string>().c_str());
  }
}

Outcome<void> run_info(const std::string& path, const std::string& report) {
  const Outcome<void> places = check_outputs({{"--report", report}}, {{"FILE", path}});
  if (!places.ok()) return places.failure();
  const Outcome<std::unique_ptr<StoredMap>> stored = load_map(path);
  if (!stored.ok()) return stored.failure();
  const Outcome<InputFile> file = InputFile::open(path);
  if (!file.ok()) return file.failure();
  std::vector<KeyedIndex> workspace = workspace_for((*stored)->map);
  const Content content = survey((*stored)->map, workspace);
  Json json = to_json(**stored, content, file->size_bytes(), digest((*stored)->map, workspace));
  json["config"] = {{"file", path}, {"report", report}};
  print(json, path);
  return write_report(json, report);
}

}  // namespace

void add_info_command(CLI::App& app, int& exit_status) {
  CLI::App* const command = app.add_subcommand("info", "Print what is in a map file");
  auto path = std::make_shared<std::string>();
  auto report = std::make_shared<std::string>();
  command->add_option("FILE", *path, "Map file")->required()->type_name("MAP.tsm");
  command->add_option("--report", *report, "JSON report to write")->type_name("FILE");
  command->footer("Example: tessera info map.tsm");
  command->callback([path, report, &exit_status] {
    const Outcome<void> outcome = run_info(*path, *report);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
