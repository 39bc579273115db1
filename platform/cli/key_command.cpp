// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera key new: a key for the fleet, or a pair for a robot.
#include <sys/stat.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "cli/command.hpp"
#include "cli/number_options.hpp"
#include "mapping/number_text.hpp"
#include "mapping/outputs.hpp"
#include "mapping/report.hpp"
#include "posix/system_failure.hpp"
#include "security/key_file.hpp"

namespace tessera {

namespace {

struct KeyOptions {
  std::string fleet;
  std::optional<std::uint32_t> robot;
  std::string folder;
  std::string report;
};

Outcome<void> check_usage(const KeyOptions& options) {
  const bool for_robot = options.robot.has_value();
  if (options.fleet.empty() == !for_robot)
    return Failure{"say either --fleet FILE or --robot ID --dir DIR; see tessera key new --help"};
  if (for_robot == options.folder.empty())
    return Failure{"--robot and --dir go together; see tessera key new --help"};
  return {};
}

/// Where it is not there yet, for its owner alone. The folder above it must be there.
Outcome<void> make_folder(const std::string& folder) {
  std::error_code error;
  if (folder.empty() || std::filesystem::is_directory(folder, error)) return {};
  if (::mkdir(folder.c_str(), S_IRWXU) == 0) return {};
  return system_failure("make the folder", folder, errno, FailureKind::kUsage);
}

Outcome<void> run_key_new(const KeyOptions& options) {
  const Outcome<void> usage = check_usage(options);
  if (!usage.ok()) return usage.failure();
  const std::string stem =
      options.robot ? options.folder + "/robot_" + std::to_string(*options.robot) : "";
  const std::string secret = options.robot ? stem + ".key" : options.fleet;
  const std::string open = options.robot ? stem + ".pub" : "";
  const Outcome<void> places =
      check_outputs({{"--report", options.report}}, {{"the key", secret}, {"the key", open}});
  if (!places.ok()) return places.failure();
  const Outcome<void> folder = make_folder(options.folder);
  if (!folder.ok()) return folder.failure();
  const Outcome<void> made =
      options.robot ? make_robot_key(*options.robot, options.folder) : make_fleet_key(secret);
  if (!made.ok()) return made.failure();
  Json files = {secret};
  if (options.robot) {
    files.push_back(open);
    std::printf("secret, for robot %u alone: %s\npublic, for the fleet's file of public keys: %s\n",
                *options.robot, secret.c_str(), open.c_str());
  } else {
    std::printf("secret, the same for every robot of the fleet: %s\n", secret.c_str());
  }
  Json config = {{"fleet", options.fleet},
                 {"robot", options.robot ? Json(*options.robot) : Json()},
                 {"dir", options.folder},
                 {"report", options.report}};
  return write_report({{"files", std::move(files)}, {"config", std::move(config)}}, options.report);
}

}  // namespace

void add_key_command(CLI::App& app, int& exit_status) {
  CLI::App* const command = app.add_subcommand("key", "Keys that robots know each other by");
  command->require_subcommand(1);
  command->footer("Example: tessera key new --fleet fleet.key");
  CLI::App* const make = command->add_subcommand("new", "Make a key; nothing is ever replaced");
  auto o = std::make_shared<KeyOptions>();
  make->add_option("--fleet", o->fleet, "File to make: the secret of the whole fleet");
  make->add_option("--robot", o->robot, "Whose pair of keys to make")
      ->check(whole_number<std::uint32_t>());
  make->add_option("--dir", o->folder, "Folder that gets robot_ID.key and robot_ID.pub");
  make->add_option("--report", o->report, "JSON report to write; never has a key in it");
  make->footer("Example: tessera key new --robot 3 --dir keys");
  make->callback([o, &exit_status] {
    const Outcome<void> outcome = run_key_new(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
