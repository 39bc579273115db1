// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/reference_tables.hpp"

#include <algorithm>
#include <cctype>
#include <vector>

#include "cli/setting_options.hpp"
#include "link/key_settings.hpp"
#include "node/node_settings.hpp"
#include "node/sensor_settings.hpp"
#include "settings/sharing_settings.hpp"

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

std::string default_text(const Setting& row, const void* defaults, Speaker speaker) {
  if (!row.required.empty()) return "required";
  if (!row.otherwise.empty()) return std::string(row.otherwise);
  const SettingValue value = row.member.get(defaults);
  const std::string text = text_of(row, value);
  if (text.empty()) return "none";
  const bool is_word = std::holds_alternative<std::string>(value);
  if (speaker == Speaker::kCommand) return is_word ? code(text) : text;
  if (const bool* const on = std::get_if<bool>(&value)) return *on ? "true" : "false";
  return is_word || row.kind == SettingKind::kBytes ? code('"' + text + '"') : text;
}

std::string choices_text(const Setting& row) {
  std::string text;
  for (const std::string_view word : row.words())
    text += (text.empty() ? "" : ", ") + code('"' + std::string(word) + '"');
  return text;
}

std::string row_text(const Setting& row, const void* defaults, Speaker speaker) {
  std::string name(speaker == Speaker::kCommand ? row.name.option : row.name.key);
  if (speaker == Speaker::kCommand) name += " " + value_name(row);
  std::string meaning(row.sentence);
  if (!meaning.empty())
    meaning[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(meaning[0])));
  if (const std::string range = stated_range(row).text(speaker); !range.empty())
    meaning += "; " + range;
  // On the command line they are beside the name.
  if (speaker == Speaker::kFile && !row.words().empty()) meaning += "; " + choices_text(row);
  return "| " + code(escaped(name)) + " | " + default_text(row, defaults, speaker) + " | " +
         escaped(meaning) + " |\n";
}

}  // namespace

std::string reference_tables() {
  const MapOptions map;
  std::string text = "## map\n\n| option | default | range and meaning |\n|---|---|---|\n";
  for (const Group& group : {Group{kSourceRows, static_cast<const SourceOptions*>(&map)},
                             {kMapFileRows, &map},
                             {kMapRows, &map}}) {
    for (const Setting& row : group.rows) text += row_text(row, group.defaults, Speaker::kCommand);
  }
  NodeConfig node;
  node.map.memory_bytes = NodeConfig::kMapMemoryBytes;
  const Group groups[] = {{kSharingRows, static_cast<const SharingOptions*>(&node)},
                          {kNodeRows, &node},
                          {kSourceRows, static_cast<const SourceOptions*>(&node.map)},
                          {kSensorRows, &node.sensors},
                          {kVehicleRows, &node.vehicle},
                          {kMapRows, &node.map},
                          {kDiffusionRows, &node.diffusion},
                          {kKeyRows, &node.keys}};
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
        if (row.name.table == table) text += row_text(row, group.defaults, Speaker::kFile);
      }
    }
  }
  return text;
}

}  // namespace tessera
