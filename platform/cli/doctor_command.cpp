// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera doctor: checks what a node needs of this machine and its network, and says how to fix
// what is missing.
#include <algorithm>
#include <cstdio>
#include <optional>

#include "base/json.hpp"
#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "cli/command.hpp"
#include "cli/doctor.hpp"
#include "cli/setting_options.hpp"

namespace tessera {

namespace {

const char* to_string(CheckState state) {
  switch (state) {
    case CheckState::kGood:
      return "good";
    case CheckState::kAdvice:
      return "advice";
    case CheckState::kStops:
      return "stops";
  }
  return "";
}

void print(const std::vector<Check>& checks) {
  std::printf("%-7s %-18s %-44s  %s\n", "", "check", "found", "needed");
  for (const Check& check : checks) {
    std::printf("%-7s %-18s %-44s  %s\n", to_string(check.state), check.name, check.found.c_str(),
                check.needed.c_str());
    if (!check.mend.empty()) std::printf("%-26s -> %s\n", "", check.mend.c_str());
  }
}

std::size_t count(const std::vector<Check>& checks, CheckState state) {
  return static_cast<std::size_t>(std::count_if(
      checks.begin(), checks.end(), [state](const Check& check) { return check.state == state; }));
}

Json to_json(const std::vector<Check>& checks, const DoctorOptions& options) {
  Json json = {{"stops", count(checks, CheckState::kStops)},
               {"advice", count(checks, CheckState::kAdvice)},
               {"checks", Json::array()}};
  for (const Check& check : checks) {
    json["checks"].push_back({{"check", check.name},
                              {"state", to_string(check.state)},
                              {"found", check.found},
                              {"needed", check.needed},
                              {"mend", check.mend}});
  }
  json["config"] = {{"url", options.url},
                    {"interface", options.interface},
                    {"key", options.key},
                    {"config", options.config},
                    {"report", options.report}};
  return json;
}

/// Options that are given on the command line.
constexpr Setting kDoctorRows[] = {
    row<&DoctorOptions::url>({"--url"}, "LCM URL of the robots", {.value = "URL"}),
    row<&DoctorOptions::interface>({"--interface"}, "Network interface, by name or IPv4 address",
                                   {.value = "NAME", .otherwise = "as the routes choose"}),
    path_row<&DoctorOptions::key>({"--key"}, "Key file of the fleet", {.value = "FILE"}),
    path_row<&DoctorOptions::config>(
        {"--config"},
        "Configuration of a node: checks its network and keys, and compares exclude lists",
        {.value = "FILE.toml"}),
    path_row<&DoctorOptions::report>({"--report"}, "JSON report to write", {.value = "FILE"}),
};
constexpr SettingTable<DoctorOptions> kDoctorSettings{kDoctorRows};

struct NamedOptions {
  bool url = false;
  bool interface = false;
  bool key = false;
};

/// Takes what the command line does not give from the configuration.
Outcome<std::optional<NodeConfig>> take_config(DoctorOptions& options, const NamedOptions& named) {
  if (options.config.empty()) return std::optional<NodeConfig>();
  TESSERA_TRY_ASSIGN(NodeConfig config, read_node_config(options.config));
  if (!named.url) options.url = config.link.url;
  if (!named.interface) options.interface = config.link.interface;
  if (!named.key) options.key = config.keys.fleet_key;
  config.link.url = options.url;
  config.link.interface = options.interface;
  config.keys.fleet_key = options.key;
  return std::optional<NodeConfig>(std::move(config));
}

Outcome<void> run_doctor(DoctorOptions options, const NamedOptions& named) {
  TESSERA_TRY_ASSIGN(const std::optional<NodeConfig> config, take_config(options, named));
  TESSERA_TRY(check_outputs({{"--report", options.report}},
                            {{"--key", options.key}, {"--config", options.config}}));
  std::vector<Check> checks = check_network(options);
  for (Check& check : check_machine(options)) checks.push_back(std::move(check));
  if (config) {
    for (Check& check : check_fleet(*config)) checks.push_back(std::move(check));
  }
  print(checks);
  TESSERA_TRY(write_report(to_json(checks, options), options.report));
  std::string stops;
  for (const Check& check : checks) {
    if (check.state == CheckState::kStops)
      stops += (stops.empty() ? "" : ", ") + std::string(check.name);
  }
  if (stops.empty()) return {};
  return Failure{"a node cannot work here: " + stops + "; the table says how to fix each",
                 FailureKind::kFailure};
}

}  // namespace

void add_doctor_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("doctor", "Check whether this machine and network have what a node needs");
  auto o = std::make_shared<DoctorOptions>();
  declare_settings(*command, kDoctorSettings, *o);
  command->footer("Example: tessera doctor --interface eth0 --key fleet.key");
  command->callback([command, o, &exit_status] {
    const auto is_named = [command](const char* option) { return command->count(option) > 0; };
    const Outcome<void> outcome = run_doctor(
        *o,
        {.url = is_named("--url"), .interface = is_named("--interface"), .key = is_named("--key")});
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
