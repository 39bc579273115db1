// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera key: new keys for a fleet or a robot, and the name of a mission.
#include <fmt/core.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "base/json.hpp"
#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "base/system_failure.hpp"
#include "cli/command.hpp"
#include "cli/setting_options.hpp"
#include "link/key_maker.hpp"
#include "link/mission.hpp"

namespace tessera {

namespace {

constexpr std::uint32_t kMostRobots = 1024;  ///< As many as a node can know of.

struct KeyOptions {
  std::optional<std::uint32_t> robots;
  std::optional<std::uint32_t> robot;
  std::string fleet;
  std::string folder;
  bool without_signatures = false;
  std::string report;
};

constexpr Setting kNewKeyRows[] = {
    row<&KeyOptions::robots>({"--robots"}, "Make all keys of a fleet of N robots, with signatures",
                             {.value = "N", .allowed = from_to(1.0, kMostRobots)}),
    path_row<&KeyOptions::folder>(
        {"--dir"}, "Folder to write the files into; made if it does not exist", {.value = "DIR"}),
    row<&KeyOptions::without_signatures>(
        {"--without-signatures"},
        "Make only the secret of the fleet: each robot can forge the data of any other",
        {.flag = true}),
    row<&KeyOptions::robot>({"--robot"}, "Make the key pair of the robot with this id",
                            {.value = "ID"}),
    path_row<&KeyOptions::fleet>(
        {"--fleet"}, "Make only the secret of the whole fleet, as this file", {.value = "FILE"}),
    path_row<&KeyOptions::report>({"--report"}, "JSON report to write; never has a key in it",
                                  {.value = "FILE"}),
};
constexpr SettingTable<KeyOptions> kNewKeySettings{kNewKeyRows};

struct MissionOptions {
  std::string name;
  bool is_new = false;
  std::string fleet = "fleet.key";
  std::string report;
};

constexpr Setting kMissionRows[] = {
    row<&MissionOptions::is_new>({"--new"}, "Choose a random name, such as mission-3f9c2a71d0",
                                 {.flag = true}),
    path_row<&MissionOptions::fleet>({"--fleet"}, "The fleet's key file", {.value = "FILE"}),
    path_row<&MissionOptions::report>({"--report"}, "JSON report to write; never has a key in it",
                                      {.value = "FILE"}),
};
constexpr SettingTable<MissionOptions> kMissionSettings{kMissionRows};

Outcome<void> check_usage(const KeyOptions& o) {
  const char* const help = "; see tessera key new --help";
  const int kinds = (o.robot ? 1 : 0) + (o.fleet.empty() ? 0 : 1) +
                    (o.robots || (o.without_signatures && o.fleet.empty()) ? 1 : 0);
  if (kinds != 1)
    return Failure{std::string("give either --robots N --dir DIR, --robot ID --dir DIR or "
                               "--fleet FILE") +
                   help};
  if (o.fleet.empty() == o.folder.empty())
    return Failure{std::string("--robots and --robot take --dir DIR, --fleet does not") + help};
  return {};
}

/// Makes a missing folder, with access for its owner only. The parent folder must exist.
Outcome<void> make_folder(const std::string& folder) {
  std::error_code error;
  if (folder.empty() || std::filesystem::is_directory(folder, error)) return {};
  if (::mkdir(folder.c_str(), S_IRWXU) == 0) return {};
  return system_failure("make the folder", folder, errno, FailureKind::kUsage);
}

/// The files made, and the mission in them.
struct Made {
  std::vector<std::string> files;
  std::string mission;
};

Outcome<Made> make_one_robot(const KeyOptions& o) {
  TESSERA_TRY(make_robot_key(*o.robot, o.folder));
  const std::string stem = fmt::format("{}/robot_{}", o.folder, *o.robot);
  std::printf(
      "secret, for robot %u alone: %s.key\npublic, for the fleet's file of public keys: %s.pub\n",
      *o.robot, stem.c_str(), stem.c_str());
  return Made{{stem + ".key", stem + ".pub"}, ""};
}

Outcome<Made> make_fleet_alone(const std::string& path, bool is_meant) {
  TESSERA_TRY_ASSIGN(const Mission mission, Mission::make_random());
  TESSERA_TRY(make_fleet_key(path, mission));
  const std::string name(mission.name());
  std::printf("secret, the same for every robot of the fleet: %s, mission %s\n", path.c_str(),
              name.c_str());
  if (!is_meant) {
    std::fprintf(
        stderr,
        "warning: with this key alone nothing is signed, and each robot can forge the data of "
        "any other; --robots N --dir DIR makes a fleet that signs\n");
  }
  return Made{{path}, name};
}

Outcome<Made> make_whole_fleet(const KeyOptions& o) {
  TESSERA_TRY_ASSIGN(const Mission mission, Mission::make_random());
  TESSERA_TRY_ASSIGN(const std::vector<std::string> files,
                     make_fleet(o.folder, *o.robots, mission));
  const std::string name(mission.name());
  const char* const folder = o.folder.c_str();
  std::printf(
      "for every robot: %s/fleet.key, secret, with the mission %s; %s/fleet.pub\n"
      "for robot ID alone: %s/robot_ID.key, secret; ID is 0 to %u\n",
      folder, name.c_str(), folder, folder, *o.robots - 1);
  return Made{files, name};
}

Outcome<Made> make_keys(const KeyOptions& o) {
  if (o.robot) return make_one_robot(o);
  if (!o.fleet.empty()) return make_fleet_alone(o.fleet, o.without_signatures);
  if (o.without_signatures) return make_fleet_alone(o.folder + "/fleet.key", true);
  return make_whole_fleet(o);
}

/// Every file that may be made.
Outcome<void> check_places(const KeyOptions& o) {
  std::vector<std::string> places = {o.fleet.empty() ? o.folder + "/fleet.key" : o.fleet,
                                     o.folder + "/fleet.pub"};
  const std::uint32_t first = o.robot.value_or(0);
  for (std::uint32_t i = 0; i < (o.robot ? 1 : o.robots.value_or(0)); ++i) {
    const std::string stem = fmt::format("{}/robot_{}", o.folder, first + i);
    places.insert(places.end(), {stem + ".key", stem + ".pub"});
  }
  for (const std::string& place : places) {
    TESSERA_TRY(check_outputs({{"--report", o.report}}, {{"the key", place}}));
  }
  return {};
}

Outcome<void> run_key_new(const KeyOptions& o) {
  TESSERA_TRY(check_usage(o));
  TESSERA_TRY(check_places(o));
  TESSERA_TRY(make_folder(o.folder));
  TESSERA_TRY_ASSIGN(const Made made, make_keys(o));
  Json config = {{"robots", o.robots ? Json(*o.robots) : Json()},
                 {"robot", o.robot ? Json(*o.robot) : Json()},
                 {"fleet", o.fleet},
                 {"dir", o.folder},
                 {"without_signatures", o.without_signatures},
                 {"report", o.report}};
  return write_report(
      {{"files", made.files}, {"mission", made.mission}, {"config", std::move(config)}}, o.report);
}

Outcome<void> run_key_mission(const MissionOptions& o) {
  if (o.name.empty() != o.is_new)
    return Failure{"give either a name or --new; see tessera key mission --help"};
  TESSERA_TRY(check_outputs({{"--report", o.report}}, {{"the fleet's key", o.fleet}}));
  TESSERA_TRY_ASSIGN(const Mission mission,
                     o.is_new ? Mission::make_random() : Mission::make(o.name));
  TESSERA_TRY(set_mission(o.fleet, mission));
  const std::string name(mission.name());
  std::printf("%s names the mission %s; copy it to every robot, and restart all of them\n",
              o.fleet.c_str(), name.c_str());
  Json config = {{"name", o.name}, {"new", o.is_new}, {"fleet", o.fleet}, {"report", o.report}};
  return write_report({{"files", {o.fleet}}, {"mission", name}, {"config", std::move(config)}},
                      o.report);
}

void add_new(CLI::App& key, int& exit_status) {
  CLI::App* const command = key.add_subcommand(
      "new", "Make keys for a fleet or a robot; existing files are never replaced");
  auto o = std::make_shared<KeyOptions>();
  declare_settings(*command, kNewKeySettings, *o);
  command->footer("Example: tessera key new --robots 3 --dir keys");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_key_new(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

void add_mission(CLI::App& key, int& exit_status) {
  CLI::App* const command =
      key.add_subcommand("mission", "Write another mission into the fleet's key file");
  auto o = std::make_shared<MissionOptions>();
  command->add_option("NAME", o->name, "Name of the mission, 1 to 64 bytes");
  declare_settings(*command, kMissionSettings, *o);
  command->footer("Example: tessera key mission --new --fleet keys/fleet.key");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_key_mission(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace

void add_key_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("key", "Make the keys by which robots recognise each other");
  command->require_subcommand(1);
  command->footer("Example: tessera key new --robots 3 --dir keys");
  add_new(*command, exit_status);
  add_mission(*command, exit_status);
}

}  // namespace tessera
