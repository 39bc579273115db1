// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/reference_tables.hpp"

#include <algorithm>
#include <cctype>
#include <vector>

#include "cli/value_names.hpp"
#include "link/key_settings.hpp"
#include "link/status_table.hpp"
#include "node/node_settings.hpp"
#include "node/query_port.hpp"
#include "node/sensor_settings.hpp"
#include "node/view_thread.hpp"
#include "scans/match_report.hpp"
#include "scans/registrar.hpp"
#include "settings/sharing_settings.hpp"
#include "vehicle/vehicle_port.hpp"

namespace tessera {

namespace {

/// Rows, and an object with their defaults.
struct Group {
  std::span<const Setting> rows;
  const void* defaults;
};

std::string code(const std::string& text) { return "`" + text + "`"; }

/// In a cell a bar would end it.
std::string escaped(std::string text) {
  for (std::size_t at = text.find('|'); at != std::string::npos; at = text.find('|', at + 2))
    text.insert(at, 1, '\\');
  return text;
}

std::string row_text(const CLI::Option& option) {
  std::string name = option.get_name(option.get_positional());
  if (!is_flag(option) && !option.get_positional()) name += " " + option.get_type_name();
  if (option.get_expected_max() > 1 && option.get_allow_extra_args()) name += " ...";
  // The default is in brackets at the end.
  std::string sentence = option.get_description();
  std::string otherwise = is_flag(option) ? "off" : "none";
  const std::size_t bracket = sentence.rfind(" [");
  if (sentence.ends_with(']') && bracket != std::string::npos) {
    otherwise = sentence.substr(bracket + 2, sentence.size() - bracket - 3);
    sentence.resize(bracket);
  }
  if (option.get_required()) otherwise = "required";
  return "| " + code(escaped(name)) + " | " + escaped(otherwise) + " | " + escaped(sentence) +
         " |\n";
}

/// words: of the command before its subcommands, with a space behind them.
void add_option_tables(std::string& text, const CLI::App& app, const std::string& words) {
  for (const CLI::App* const command : shown_subcommands(app)) {
    const std::string name = words + command->get_name();
    std::string rows;
    for (const CLI::Option* const option : command->get_options()) {
      if (option != command->get_help_ptr() && option != command->get_version_ptr())
        rows += row_text(*option);
    }
    if (!rows.empty())
      text +=
          "\n## " + name + "\n\n| option | default | range and meaning |\n|---|---|---|\n" + rows;
    add_option_tables(text, *command, name + " ");
  }
}

std::string default_text(const Setting& row, const void* defaults) {
  if (!row.required.empty()) return "required";
  if (!row.otherwise.empty()) return std::string(row.otherwise);
  const SettingValue value = row.member.get(defaults);
  const std::string text = text_of(row, value);
  if (text.empty()) return "none";
  const bool is_word = std::holds_alternative<std::string>(value);
  if (const bool* const on = std::get_if<bool>(&value)) return *on ? "true" : "false";
  return is_word || row.kind == SettingKind::kBytes ? code('"' + text + '"') : text;
}

std::string choices_text(const Setting& row) {
  std::string text;
  for (const std::string_view word : row.words())
    text += (text.empty() ? "" : ", ") + code('"' + std::string(word) + '"');
  return text;
}

std::string row_text(const Setting& row, const void* defaults) {
  std::string meaning(row.sentence);
  if (!meaning.empty())
    meaning[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(meaning[0])));
  if (const std::string range = stated_range(row).text(Speaker::kFile); !range.empty())
    meaning += "; " + range;
  if (!row.words().empty()) meaning += "; " + choices_text(row);
  return "| " + code(std::string(row.name.key)) + " | " + default_text(row, defaults) + " | " +
         escaped(meaning) + " |\n";
}

template <class Report>
void add_counters_table(std::string& text, const char* name) {
  text += "\n## counters " + std::string(name) + "\n\n| counter | meaning |\n|---|---|\n";
  for (const Counter<Report>& row : kCounters<Report>)
    text += "| " + code(row.name) + " | " + escaped(row.sentence) + " |\n";
}

}  // namespace

std::string reference_tables(const CLI::App& app) {
  std::string text;
  add_option_tables(text, app, "");
  const NodeConfig node;
  const SessionOptions session;
  const Group groups[] = {{kSharingRows, static_cast<const SharingOptions*>(&node)},
                          {kNodeRows, &node},
                          {kSourceRows, static_cast<const SourceOptions*>(&node.map)},
                          {kSensorRows, &node.sensors},
                          {kVehicleRows, &node.vehicle},
                          {kMapRows, &node.map},
                          {kDiffusionRows, &node.diffusion},
                          {kKeyRows, &node.keys},
                          {kSessionRows, &session}};
  std::vector<std::string_view> tables;
  for (const Group& group : groups) {
    for (const Setting& row : group.rows) {
      if (!row.name.table.empty() &&
          std::find(tables.begin(), tables.end(), row.name.table) == tables.end())
        tables.push_back(row.name.table);
    }
  }
  for (const std::string_view table : tables) {
    text += "\n## node [" + std::string(table) +
            "]\n\n| key | default | unit, range, meaning |\n|---|---|---|\n";
    for (const Group& group : groups) {
      for (const Setting& row : group.rows) {
        if (row.name.table == table) text += row_text(row, group.defaults);
      }
    }
  }
  add_counters_table<ScanReport>(text, "scan");
  add_counters_table<WindowReport>(text, "window");
  add_counters_table<PublisherReport>(text, "publisher");
  add_counters_table<ExchangeReport>(text, "exchange");
  add_counters_table<ObjectionsReport>(text, "objections");
  add_counters_table<GlobalMapReport>(text, "global_map");
  add_counters_table<ReplicasUsage>(text, "replicas");
  add_counters_table<LinkReport>(text, "link");
  add_counters_table<StatusTableReport>(text, "statuses");
  add_counters_table<MatchReport>(text, "match");
  add_counters_table<AssemblerReport>(text, "fragments");
  add_counters_table<RegistrarReport>(text, "registration");
  add_counters_table<DeskewReport>(text, "deskew");
  add_counters_table<LabelReport>(text, "projection");
  add_counters_table<LabelCameraReport>(text, "projection, camera");
  add_counters_table<DepthReport>(text, "depth");
  add_counters_table<VehicleInputReport>(text, "vehicle, frames");
  add_counters_table<VehiclePortState>(text, "vehicle, port");
  add_counters_table<CanSocketReport>(text, "vehicle, socket");
  add_counters_table<QueryPortReport>(text, "queries");
  add_counters_table<QueryReport>(text, "queries, answers");
  add_counters_table<WebServerReport>(text, "view, server");
  add_counters_table<ViewerReport>(text, "view, messages");
  return text;
}

}  // namespace tessera
