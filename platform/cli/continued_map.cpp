// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/continued_map.hpp"

#include <cmath>
#include <optional>

#include "base/number_text.hpp"
#include "cli/command.hpp"
#include "maps/stored_map.hpp"

namespace tessera {

namespace {

/// What is fixed for the life of a map, with the option that gives it to a new one.
struct FixedSetting {
  const char* option;
  std::optional<double> given;
  double held;
};

}  // namespace

void warn_of_another_mode(const MapOptions& options, const MapFileHeader& header) {
  const Json mode = recorded_setting(header, "inference");
  if (!mode.is_string() || mode == options.inference) return;
  warn(options.continue_from + " was made with --inference " + mode.get<std::string>() +
       " and continues with " + options.inference);
}

Outcome<void> adopt_settings(const MapOptions& options, const MapFileHeader& header,
                             const RecordedScans& source, MapSetup& setup) {
  const std::string& path = options.continue_from;
  if (header.identity.kind != MapKind::kLocal)
    return Failure{path + " is a global map; continue a robot's local map"};
  const MapConfig& held = header.config;
  std::optional<double> robot;
  if (options.robot) robot = static_cast<double>(*options.robot);
  const FixedSetting fixed[] = {
      {"--resolution", options.resolution_m, held.resolution_m},
      {"--prior", options.prior, held.prior},
      {"--max-evidence", options.max_evidence, static_cast<double>(held.max_evidence)},
      {"--free-weight", options.free_weight, static_cast<double>(held.free_weight)},
      {"--robot", robot, static_cast<double>(header.identity.robot)}};
  for (const FixedSetting& setting : fixed) {
    // The file keeps some of them as floats.
    if (!setting.given || std::abs(*setting.given - setting.held) <= 1e-6 * setting.held) continue;
    return Failure{path + " was made with " + setting.option + " " + text_of(setting.held) +
                   "; leave " + setting.option + " out or give the same"};
  }
  if (!options.counts.empty() && options.counts != to_string(held.tuple)) {
    return Failure{path + " was made with --counts " + to_string(held.tuple) +
                   "; leave --counts out or give the same"};
  }
  if (!(header.classes == source.classes().table())) {
    return Failure{path + " has other classes than " + options.folder() +
                   "; use data with the same classes"};
  }
  setup.map = held;
  if (options.downsample.empty()) setup.inference.thinning_m = held.resolution_m;
  return {};
}

Outcome<void> load_earlier(const MapOptions& options, const MapFileHeader& header,
                           const MapSetup& setup, std::size_t max_points, LocalMap& map) {
  const Outcome<bool> loaded = load_into(options.continue_from, map);
  if (!loaded.ok()) return loaded.failure();
  if (!*loaded) {
    const std::size_t enough =
        budget_for_storage(setup, max_points, header.config.storage_bytes) >> 20U;
    return Failure{"--memory " + options.memory + " is too small for the map " +
                   options.continue_from + "; give a larger --memory, at least " +
                   std::to_string(enough) + "M"};
  }
  warn_of_another_mode(options, header);
  return {};
}

}  // namespace tessera
