// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera key: new keys for a fleet or a robot, and the name of a mission.
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
#include "security/key_maker.hpp"
#include "security/mission.hpp"

namespace tessera {

namespace {

constexpr std::uint32_t kMostRobots = 1024;  ///< As many as a node can have heard of.

struct KeyOptions {
  std::optional<std::uint32_t> robots;
  std::optional<std::uint32_t> robot;
  std::string fleet;
  std::string folder;
  bool without_signatures = false;
  std::string report;
};

struct MissionOptions {
  std::string name;
  bool is_new = false;
  std::string fleet = "fleet.key";
  std::string report;
};

Outcome<void> check_usage(const KeyOptions& o) {
  const char* const help = "; see tessera key new --help";
  const int kinds = (o.robot ? 1 : 0) + (o.fleet.empty() ? 0 : 1) +
                    (o.robots || (o.without_signatures && o.fleet.empty()) ? 1 : 0);
  if (kinds != 1)
    return Failure{std::string("say either --robots N --dir DIR, --robot ID --dir DIR or "
                               "--fleet FILE") +
                   help};
  if (o.fleet.empty() == o.folder.empty())
    return Failure{std::string("--robots and --robot take --dir DIR, --fleet does not") + help};
  if (o.robots && (*o.robots == 0 || *o.robots > kMostRobots))
    return Failure{"--robots " + std::to_string(*o.robots) + " is not allowed; give 1 to " +
                   std::to_string(kMostRobots)};
  return {};
}

/// Where it is not there yet, for its owner alone. The folder above it must be there.
Outcome<void> make_folder(const std::string& folder) {
  std::error_code error;
  if (folder.empty() || std::filesystem::is_directory(folder, error)) return {};
  if (::mkdir(folder.c_str(), S_IRWXU) == 0) return {};
  return system_failure("make the folder", folder, errno, FailureKind::kUsage);
}

/// What is made, and the mission that is in it.
struct Made {
  std::vector<std::string> files;
  std::string mission;
};

Outcome<Made> make_one_robot(const KeyOptions& o) {
  const Outcome<void> made = make_robot_key(*o.robot, o.folder);
  if (!made.ok()) return made.failure();
  const std::string stem = o.folder + "/robot_" + std::to_string(*o.robot);
  std::printf(
      "secret, for robot %u alone: %s.key\npublic, for the fleet's file of public keys: %s.pub\n",
      *o.robot, stem.c_str(), stem.c_str());
  return Made{{stem + ".key", stem + ".pub"}, ""};
}

Outcome<Made> make_fleet_alone(const std::string& path, bool is_meant) {
  const Outcome<Mission> mission = Mission::make_random();
  if (!mission.ok()) return mission.failure();
  const Outcome<void> made = make_fleet_key(path, *mission);
  if (!made.ok()) return made.failure();
  const std::string name(mission->name());
  std::printf("secret, the same for every robot of the fleet: %s, mission %s\n", path.c_str(),
              name.c_str());
  if (!is_meant) {
    std::fprintf(stderr,
                 "warning: with this key alone nothing is signed, and each robot can speak for any "
                 "other; --robots N --dir DIR makes a fleet that signs\n");
  }
  return Made{{path}, name};
}

Outcome<Made> make_whole_fleet(const KeyOptions& o) {
  const Outcome<Mission> mission = Mission::make_random();
  if (!mission.ok()) return mission.failure();
  const Outcome<std::vector<std::string>> files = make_fleet(o.folder, *o.robots, *mission);
  if (!files.ok()) return files.failure();
  const std::string name(mission->name());
  const char* const folder = o.folder.c_str();
  std::printf(
      "for every robot: %s/fleet.key, secret, with the mission %s; %s/fleet.pub\n"
      "for robot ID alone: %s/robot_ID.key, secret; ID is 0 to %u\n",
      folder, name.c_str(), folder, folder, *o.robots - 1);
  return Made{*files, name};
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
    const std::string stem = o.folder + "/robot_" + std::to_string(first + i);
    places.insert(places.end(), {stem + ".key", stem + ".pub"});
  }
  for (const std::string& place : places) {
    const Outcome<void> apart = check_outputs({{"--report", o.report}}, {{"the key", place}});
    if (!apart.ok()) return apart.failure();
  }
  return {};
}

Outcome<void> run_key_new(const KeyOptions& o) {
  const Outcome<void> usage = check_usage(o);
  if (!usage.ok()) return usage.failure();
  const Outcome<void> places = check_places(o);
  if (!places.ok()) return places.failure();
  const Outcome<void> folder = make_folder(o.folder);
  if (!folder.ok()) return folder.failure();
  const Outcome<Made> made = make_keys(o);
  if (!made.ok()) return made.failure();
  Json config = {{"robots", o.robots ? Json(*o.robots) : Json()},
                 {"robot", o.robot ? Json(*o.robot) : Json()},
                 {"fleet", o.fleet},
                 {"dir", o.folder},
                 {"without_signatures", o.without_signatures},
                 {"report", o.report}};
  return write_report(
      {{"files", made->files}, {"mission", made->mission}, {"config", std::move(config)}},
      o.report);
}

Outcome<void> run_key_mission(const MissionOptions& o) {
  if (o.name.empty() != o.is_new)
    return Failure{"say either a name or --new; see tessera key mission --help"};
  const Outcome<void> places =
      check_outputs({{"--report", o.report}}, {{"the fleet's key", o.fleet}});
  if (!places.ok()) return places.failure();
  const Outcome<Mission> mission = o.is_new ? Mission::make_random() : Mission::make(o.name);
  if (!mission.ok()) return mission.failure();
  const Outcome<void> set = set_mission(o.fleet, *mission);
  if (!set.ok()) return set.failure();
  const std::string name(mission->name());
  std::printf("%s names the mission %s; copy it to every robot, and start all of them again\n",
              o.fleet.c_str(), name.c_str());
  Json config = {{"name", o.name}, {"new", o.is_new}, {"fleet", o.fleet}, {"report", o.report}};
  return write_report({{"files", {o.fleet}}, {"mission", name}, {"config", std::move(config)}},
                      o.report);
}

void add_new(CLI::App& key, int& exit_status) {
  CLI::App* const command =
      key.add_subcommand("new", "Make keys for a fleet or a robot; nothing is ever replaced");
  auto o = std::make_shared<KeyOptions>();
  command->add_option("--robots", o->robots, "Make all keys of a fleet of N robots that signs")
      ->check(whole_number<std::uint32_t>());
  command->add_option("--dir", o->folder, "Folder that gets the files; made if it is not there");
  command->add_flag("--without-signatures", o->without_signatures,
                    "Make the secret of the fleet alone: each robot can speak for any other");
  command->add_option("--robot", o->robot, "Make the pair of keys of one robot")
      ->check(whole_number<std::uint32_t>());
  command->add_option("--fleet", o->fleet,
                      "Make the secret of the whole fleet alone, as this file");
  command->add_option("--report", o->report, "JSON report to write; never has a key in it");
  command->footer("Example: tessera key new --robots 3 --dir keys");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_key_new(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

void add_mission(CLI::App& key, int& exit_status) {
  CLI::App* const command =
      key.add_subcommand("mission", "Name another mission in the fleet's key file");
  auto o = std::make_shared<MissionOptions>();
  command->add_option("NAME", o->name, "Of the mission, 1 to 64 bytes");
  command->add_flag("--new", o->is_new, "A random name, such as mission-3f9c2a71d0");
  command->add_option("--fleet", o->fleet, "The fleet's key file")->capture_default_str();
  command->add_option("--report", o->report, "JSON report to write; never has a key in it");
  command->footer("Example: tessera key mission --new --fleet keys/fleet.key");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_key_mission(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace

void add_key_command(CLI::App& app, int& exit_status) {
  CLI::App* const command = app.add_subcommand("key", "Keys that robots know each other by");
  command->require_subcommand(1);
  command->footer("Example: tessera key new --robots 3 --dir keys");
  add_new(*command, exit_status);
  add_mission(*command, exit_status);
}

}  // namespace tessera
