// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera info: prints what is in a map file.
#include <fmt/core.h>

#include <array>
#include <cstdio>

#include "base/input_file.hpp"
#include "base/json.hpp"
#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "cli/command.hpp"
#include "maps/map_journal.hpp"
#include "maps/open_map.hpp"
#include "maps/submaps.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

/// What a file says of its map, and whether that was read from the voxels.
struct Content {
  MapFileHeader header;
  MapSummary summary;
  bool verified = false;
  std::vector<SubmapRow> submaps{};
};

/// Of a file of submaps the table says what they hold.
Outcome<Content> content_of_submaps(const std::string& path, const MapFileHeader& header,
                                    bool verify) {
  TESSERA_TRY_ASSIGN(StoredSubmaps submaps, load_submaps(path, header));
  for (const SubmapRow& row : submaps.rows) {
    if (!verify) break;
    TESSERA_TRY_ASSIGN(const std::unique_ptr<StoredMap> stored, load_submap(submaps, row));
    std::vector<KeyedIndex> workspace = workspace_for(stored->map);
    const std::uint64_t found = digest(stored->map, workspace);
    if (found != row.digest)
      return Failure{
          fmt::format("{}: the table has another digest ({}) of submap {} than its "
                      "voxels ({}); make the map again or use another copy",
                      path, hex64(row.digest), row.number, hex64(found))};
  }
  return Content{header, summary_of(submaps.rows), verify, std::move(submaps.rows)};
}

/// A map that a node keeps while it maps has no summary: all is counted.
Outcome<Content> content_of_journal(const std::string& path) {
  TESSERA_TRY_ASSIGN(const JournalContent found, read_journal(path, nullptr));
  if (found.damaged_bytes != 0)
    warn(fmt::format("{}: {} bytes are damaged, and left out", path, found.damaged_bytes));
  if (found.torn_bytes != 0)
    warn(fmt::format("{}: the last append was not finished: {} bytes are left out", path,
                     found.torn_bytes));
  TESSERA_TRY_ASSIGN(const std::unique_ptr<StoredMap> stored, load_map(path));
  std::vector<KeyedIndex> workspace = workspace_for(stored->map);
  return Content{stored->header, summarize(stored->map, workspace), true};
}

Outcome<Content> content_of(const std::string& path, bool verify) {
  if (is_journal(path)) return content_of_journal(path);
  TESSERA_TRY_ASSIGN(MapFileHeader header, load_map_header(path));
  if (header.identity.kind == MapKind::kSubmaps) return content_of_submaps(path, header, verify);
  TESSERA_TRY_ASSIGN(header, load_whole_header(path));
  // Files of 0.1.0's first layout have no summary.
  if (header.summary && !verify) return Content{header, *header.summary, false};
  TESSERA_TRY_ASSIGN(const std::unique_ptr<StoredMap> stored, open_map(path));
  std::vector<KeyedIndex> workspace = workspace_for(stored->map);
  const MapSummary summary = summarize(stored->map, workspace);
  if (header.summary && !(summary == *header.summary)) {
    return Failure{
        fmt::format("{}: the header has other counts or another digest ({}) than the voxels "
                    "({}); make the map again or use another copy",
                    path, hex64(header.summary->digest), hex64(summary.digest))};
  }
  return Content{header, summary, true};
}

constexpr std::array<const char*, 3> kKinds{"local", "global", "submaps"};

Json to_json(const Content& content, std::uint64_t file_bytes) {
  const MapFileHeader& header = content.header;
  const MapIdentity& identity = header.identity;
  const MapSummary& summary = content.summary;
  Json json = {{"kind", kKinds[static_cast<std::size_t>(identity.kind)]},
               {"robot", identity.robot},
               {"epoch", identity.epoch},
               {"revision", header.revision},
               {"resolution", header.config.resolution_m},
               {"prior", header.config.prior},
               {"probabilities", to_string(header.config.probabilities)},
               {"counts", to_string(header.config.tuple)},
               {"max_evidence", decimal_of(header.config.max_evidence)},
               {"free_weight", decimal_of(header.config.free_weight)},
               {"file_bytes", file_bytes},
               {"blocks", header.content.blocks},
               {"label_voxels", summary.label_voxels},
               {"free_voxels", summary.free_voxels},
               {"occupied_state", summary.occupied},
               {"free_state", summary.free},
               {"digest", hex64(summary.digest)},
               {"verified", content.verified}};
  // Submaps are in frames of their own.
  if (summary.observed() > 0 && content.submaps.empty()) {
    const Lattice lattice(header.config.resolution_m);
    const Point3d low = lattice.center_of(summary.low);
    const Point3d high = lattice.center_of(summary.high);
    json["extent_low"] = {low.x(), low.y(), low.z()};
    json["extent_high"] = {high.x(), high.y(), high.z()};
  }
  for (const SubmapRow& row : content.submaps) json["submaps"].push_back(to_json(row));
  json["T_global_map"] = Json();
  if (identity.has_T_global_map) {
    json["T_global_map"] =
        std::vector<double>(identity.T_global_map.data(), identity.T_global_map.data() + 12);
  }
  json["classes"] = Json::array();
  for (int label = 1; label <= header.classes.num_classes(); ++label) {
    const SemanticClass& c = header.classes[label];
    json["classes"].push_back(
        {{"id", label},
         {"name", std::string(c.name_view())},
         {"color", {c.color.r, c.color.g, c.color.b}},
         {"voxels", summary.occupied_by_label[static_cast<std::size_t>(label)]}});
  }
  const std::string settings(identity.settings.data(), identity.settings_bytes);
  json["settings"] = Json::parse(settings, nullptr, false);
  if (json["settings"].is_discarded()) json["settings"] = settings;
  return json;
}

/// Maps of earlier days that were fused too.
void print_sessions(const Json& settings) {
  if (!settings.contains("sessions") || !settings["sessions"].is_array()) return;
  for (const Json& session : settings["sessions"]) {
    const auto text = [&session](const char* key) {
      return session.is_object() && session.contains(key) && session[key].is_string()
                 ? session[key].get<std::string>()
                 : std::string("?");
    };
    const bool has_weight =
        session.is_object() && session.contains("weight") && session["weight"].is_number();
    std::printf("  session      %s of %s, weight %g\n", text("digest").c_str(),
                text("date").c_str(), has_weight ? session["weight"].get<double>() : 0.0);
  }
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
  print_sessions(settings);
}

void print(const Json& json, const std::string& path) {
  const auto number = [&](const char* key) { return json[key].get<unsigned long long>(); };
  const bool global = json["kind"] == "global";
  if (global) {
    print_fusion(json["settings"], path);
  } else {
    std::printf("%s: local map of robot %llu, epoch %llu", path.c_str(), number("robot"),
                number("epoch"));
    if (json.contains("submaps")) std::printf(", in %zu submaps", json["submaps"].size());
    std::printf("\n");
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
  std::printf("  voxels       %llu labelled or occupied, %llu with free evidence only",
              number("label_voxels"), number("free_voxels"));
  if (!json.contains("submaps")) std::printf(", in %llu blocks", number("blocks"));
  std::printf("\n");
  std::printf("  file         %llu bytes\n", number("file_bytes"));
  std::printf("  digest       %s%s\n", json["digest"].get<std::string>().c_str(),
              json["verified"].get<bool>() ? ", computed from the voxels" : "");
  for (const Json& c : json["classes"]) {
    const auto voxels = c["voxels"].get<unsigned long long>();
    if (voxels > 0) std::printf("  %12llu  %s\n", voxels, c["name"].get<std::string>().c_str());
  }
}

Outcome<void> run_info(const std::string& path, const std::string& report, bool verify) {
  TESSERA_TRY(check_outputs({{"--report", report}}, {{"FILE", path}}));
  TESSERA_TRY_ASSIGN(const Content content, content_of(path, verify));
  TESSERA_TRY_ASSIGN(const InputFile file, InputFile::open(path));
  Json json = to_json(content, file.size_bytes());
  json["config"] = {{"file", path}, {"report", report}, {"verify", verify}};
  print(json, path);
  return write_report(json, report);
}

}  // namespace

void add_info_command(CLI::App& app, int& exit_status) {
  CLI::App* const command = app.add_subcommand("info", "Print what is in a map file");
  auto path = std::make_shared<std::string>();
  auto report = std::make_shared<std::string>();
  auto verify = std::make_shared<bool>(false);
  command->add_option("FILE", *path, "Map file")->required()->type_name("MAP.tsm");
  command->add_option("--report", *report, "JSON report to write")->type_name("FILE");
  command->add_flag("--verify", *verify,
                    "Read all voxels, and compare their counts and digest with the file's header");
  command->footer("Example: tessera info map.tsm");
  command->callback([path, report, verify, &exit_status] {
    const Outcome<void> outcome = run_info(*path, *report, *verify);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
