// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/value_names.hpp"

#include <array>
#include <cctype>
#include <string_view>

namespace tessera {

namespace {

struct ValueName {
  std::string_view subcommand;  ///< Empty: of any.
  std::string_view option;
  const char* value;
};

// The first match counts. Words in lower case are literal, the others are placeholders.
constexpr std::array kNames = {
    ValueName{"map", "--out", "MAP.tsm"},
    ValueName{"fuse", "--out", "MAP.tsm"},
    ValueName{"fuse", "MAPS", "MAP.tsm"},
    ValueName{"fuse", "--transform", "MAP.tsm=T.txt"},
    ValueName{"export", "--transform", "MAP.tsm=T.txt"},
    ValueName{"view", "maps", "MAP.tsm"},
    ValueName{"view", "--transform", "MAP.tsm=T.txt"},
    ValueName{"info", "FILE", "MAP.tsm"},
    ValueName{"convert", "--out", "DIR"},
    ValueName{"simulate", "--out", "DIR"},
    ValueName{"simulate", "--cameras", "on|off"},
    ValueName{"key", "NAME", "TEXT"},
    ValueName{"play", "--poses", "FILE|lcm|can|none"},
    ValueName{"", "--alpha", "A"},
    ValueName{"", "--archive", "DIR"},
    ValueName{"", "--can", "NAME"},
    ValueName{"", "--can-base", "ID"},
    ValueName{"", "--clock", "monotonic|wall"},
    ValueName{"", "--config", "FILE.toml"},
    ValueName{"", "--continue", "FILE"},
    ValueName{"", "--counts", "dense|compact"},
    ValueName{"", "--dataset", "DIR"},
    ValueName{"", "--deadline", "MS"},
    ValueName{"", "--depth", "DIR"},
    ValueName{"", "--deskew", "on|off"},
    ValueName{"", "--diffusion", "contractive|paper|none"},
    ValueName{"", "--diffusion-length", "M"},
    ValueName{"", "--dir", "DIR"},
    ValueName{"", "--downsample", "M|off"},
    ValueName{"", "--edge", "none|label|similarity|confidence"},
    ValueName{"", "--first", "N"},
    ValueName{"", "--fleet", "FILE"},
    ValueName{"", "--format", "png|ply|pcd|npy|csv|bt|ot"},
    ValueName{"", "--free-space", "on|off"},
    ValueName{"", "--free-weight", "W"},
    ValueName{"", "--inference", "multi-entropy|kernel|counting"},
    ValueName{"", "--input", "FOLDER|cameras|none"},
    ValueName{"", "--interface", "NAME"},
    ValueName{"", "--intrinsics", "FILE.toml"},
    ValueName{"", "--iterations", "N"},
    ValueName{"", "--kernel-length", "M"},
    ValueName{"", "--key", "FILE"},
    ValueName{"", "--labels", "FOLDER|cameras|none"},
    ValueName{"", "--label-images", "DIR"},
    ValueName{"", "--last", "N"},
    ValueName{"", "--listen", "ADDRESS:PORT"},
    ValueName{"", "--map", "MAP.tsm"},
    ValueName{"", "--max-evidence", "S"},
    ValueName{"", "--max-range", "M"},
    ValueName{"", "--max-variance", "V"},
    ValueName{"", "--memory", "BYTES"},
    ValueName{"", "--messages", "semantic|raw"},
    ValueName{"", "--min-evidence", "S"},
    ValueName{"", "--min-probability", "P"},
    ValueName{"", "--min-range", "M"},
    ValueName{"", "--min-weight", "W"},
    ValueName{"", "--of", "MAP.tsm"},
    ValueName{"", "--omega", "W"},
    ValueName{"", "--out", "FILE"},
    ValueName{"", "--overlap-of", "MAP.tsm"},
    ValueName{"", "--pcd", "DIR"},
    ValueName{"", "--ply", "DIR"},
    ValueName{"", "--ply-form", "points|cubes"},
    ValueName{"", "--points", "FILE.csv"},
    ValueName{"", "--pose-error", "M"},
    ValueName{"", "--poses", "FILE"},
    ValueName{"", "--prior", "P"},
    ValueName{"", "--prior-map", "FILE"},
    ValueName{"", "--prior-map-weight", "W"},
    ValueName{"", "--rate", "HZ"},
    ValueName{"", "--report", "FILE"},
    ValueName{"", "--resolution", "M"},
    ValueName{"", "--robot", "ID"},
    ValueName{"", "--robots", "N"},
    ValueName{"", "--rotation-error", "DEG"},
    ValueName{"", "--scans", "N"},
    ValueName{"", "--scene", "street"},
    ValueName{"", "--seed", "S"},
    ValueName{"", "--send-poses", "lcm|can|none"},
    ValueName{"", "--sensor", "N"},
    ValueName{"", "--show", "class|contributors|disagreement|variance|probability"},
    ValueName{"", "--sweep", "on|off"},
    ValueName{"", "--thinning-weight", "mean|sum"},
    ValueName{"", "--title", "TEXT"},
    ValueName{"", "--transform", "FILE"},
    ValueName{"", "--truth", "FOLDER"},
    ValueName{"", "--url", "URL"},
    ValueName{"", "--view", "both|top|oblique"},
    ValueName{"", "--voxels", "occupied|observed"},
    ValueName{"", "--width", "PX"},
    ValueName{"", "--window", "M"},
    ValueName{"", "--work-budget", "N"},
};

void name_values_of(CLI::App& command, std::string_view subcommand) {
  for (CLI::Option* const option : command.get_options()) {
    // CLI11 names a set of words that it checks.
    if (is_flag(*option) || option->get_type_name().find('{') != std::string::npos) continue;
    for (const ValueName& name : kNames) {
      if ((!name.subcommand.empty() && name.subcommand != subcommand) ||
          name.option != option->get_name())
        continue;
      option->type_name(name.value);
      break;
    }
  }
  for (CLI::App* const inner : command.get_subcommands([](CLI::App*) { return true; }))
    name_values_of(*inner, subcommand.empty() ? std::string_view(inner->get_name()) : subcommand);
}

bool is_word(std::string_view text) {
  return !text.empty() && std::islower(static_cast<unsigned char>(text.front())) != 0;
}

}  // namespace

void name_values(CLI::App& app) { name_values_of(app, ""); }

bool is_flag(const CLI::Option& option) { return option.get_type_size_max() == 0; }

ValueKind kind_of(const CLI::Option& option) {
  std::string name = option.get_type_name();
  char separator = '|';
  // TEXT:{a,b} is how CLI11 names a set.
  if (const std::size_t open = name.find('{'); open != std::string::npos) {
    name = name.substr(open + 1, name.find('}', open) - open - 1);
    separator = ',';
  }
  ValueKind kind;
  for (std::size_t begin = 0; begin <= name.size();) {
    const std::size_t end = std::min(name.find(separator, begin), name.size());
    const std::string part = name.substr(begin, end - begin);
    begin = end + 1;
    if (is_word(part)) {
      kind.choices.push_back(part);
    } else if (part == "DIR") {
      kind.folders = true;
    } else if (part == "FILE" || part.find('=') != std::string::npos) {
      kind.files = true;
    } else if (const std::size_t dot = part.find('.'); dot != std::string::npos) {
      kind.files = true;
      kind.extension = part.substr(dot);
    }
  }
  return kind;
}

std::vector<const CLI::App*> shown_subcommands(const CLI::App& app) {
  std::vector<const CLI::App*> shown;
  for (const CLI::App* const command : app.get_subcommands([](const CLI::App*) { return true; }))
    if (!command->get_group().empty()) shown.push_back(command);
  return shown;
}

}  // namespace tessera
