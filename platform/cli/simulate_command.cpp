// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera simulate: makes a dataset for each robot, with ground truth.
#include <fmt/core.h>

#include <cstdio>
#include <utility>

#include "base/json.hpp"
#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "base/progress.hpp"
#include "cli/command.hpp"
#include "cli/setting_options.hpp"
#include "simulator/dataset_writer.hpp"
#include "simulator/street_simulator.hpp"
#include "tessera/registration/label_limits.hpp"

namespace tessera {

namespace {

struct SimulateOptions {
  SimulatorConfig config;
  PoseError pose_error;
  bool cameras = false;
  bool sweep = false;
  std::string out;
  std::string report;
};

constexpr std::array<std::string_view, 1> kScenes{"street"};
constexpr Setting kSimulateRows[] = {
    row<&SimulateOptions::config, &SimulatorConfig::scene>({"--scene"}, "Scene",
                                                           {.choices = kScenes}),
    row<&SimulateOptions::config, &SimulatorConfig::robots>(
        {"--robots"}, "Number of robots", {.value = "N", .allowed = from_to(1.0, 8.0)}),
    row<&SimulateOptions::config, &SimulatorConfig::scans>(
        {"--scans"}, "Scans of each robot", {.value = "N", .allowed = from_to(1.0, 1000.0)}),
    row<&SimulateOptions::config, &SimulatorConfig::apart_m>(
        {"--apart"},
        "Distance along the street between the starts of robots 0 and 1; a robot drives 0.84 to "
        "0.96 m a scan",
        {.value = "M", .allowed = from_to(0.0, SimulatorConfig::kMostApart_m, "metres")}),
    row<&SimulateOptions::config, &SimulatorConfig::seed>(
        {"--seed"}, "Seed; the same gives the same bytes", {.value = "S"}),
    path_row<&SimulateOptions::out>({"--out"}, "Folder to write robot_0, robot_1, ... into",
                                    {.value = "DIR", .required = "a folder"}),
    row<&SimulateOptions::pose_error, &PoseError::translation_m>(
        {"--pose-error"},
        "Standard deviation of the position in T_global_map_perturbed.txt, on each axis",
        {.value = "M", .allowed = from_to(0.0, 100.0, "metres")}),
    row<&SimulateOptions::pose_error, &PoseError::rotation_deg>(
        {"--rotation-error"},
        "Standard deviation of the rotation in T_global_map_perturbed.txt, about each axis",
        {.value = "DEG", .allowed = from_to(0.0, 180.0, "degrees")}),
    row<&SimulateOptions::cameras>(
        {"--cameras"},
        "Label images of three cameras, as a network would predict them; adds cameras.toml "
        "and poses_dense.txt"),
    row<&SimulateOptions::sweep>({"--sweep"},
                                 "Sweep each scan while the robot drives; adds times/ and "
                                 "poses_dense.txt"),
    row<&SimulateOptions::config, &SimulatorConfig::weighted_labels>(
        {"--topk"},
        "Labels of each point with weights, as a network would give them; adds topk/, for map "
        "--labels topk; 0: none",
        {.value = "K", .allowed = from_to(0.0, double{kMostLabels})}),
    path_row<&SimulateOptions::report>({"--report"}, "JSON report to write", {.value = "FILE"}),
};
constexpr SettingTable<SimulateOptions> kSimulateSettings{kSimulateRows};

Outcome<void> check_places(const SimulateOptions& options) {
  for (int robot = 0; robot < options.config.robots; ++robot) {
    const std::string folder = fmt::format("{}/robot_{}", options.out, robot);
    TESSERA_TRY(check_outputs({{"--report", options.report}}, {}, {.path = folder}));
  }
  return {};
}

Json report_of(const SimulateOptions& options) {
  const Json config = json_of(kSimulateSettings, options);
  Json json = Json::object();
  for (const char* const key : {"scene", "robots", "scans", "seed", "out"}) json[key] = config[key];
  json["config"] = config;
  return json;
}

Outcome<void> run_simulate(const SimulateOptions& options) {
  TESSERA_TRY(check_places(options));
  SimulatorConfig config = options.config;
  config.sweep = options.sweep;
  TESSERA_TRY_ASSIGN(const StreetSimulator simulator, StreetSimulator::make(config));
  Progress progress("simulating", static_cast<std::uint64_t>(options.config.robots) *
                                      static_cast<std::uint64_t>(options.config.scans));
  const DatasetWriterOptions writer{
      .pose_error = options.pose_error, .cameras = options.cameras, .progress = [&](int done, int) {
        progress.update(static_cast<std::uint64_t>(done));
      }};
  TESSERA_TRY(write_dataset(simulator, options.out, writer));
  progress.finish();
  const auto number = [](int n, const char* thing) {
    return counted(static_cast<std::uint64_t>(n), thing);
  };
  std::printf("%s, %s each into %s (seed %llu)\n", number(options.config.robots, "robot").c_str(),
              number(options.config.scans, "scan").c_str(), options.out.c_str(),
              static_cast<unsigned long long>(options.config.seed));
  return write_report(report_of(options), options.report);
}

}  // namespace

void add_simulate_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("simulate", "Make a dataset for each robot, with ground truth");
  auto o = std::make_shared<SimulateOptions>();
  declare_settings(*command, kSimulateSettings, *o);
  command->footer(
      "Example: tessera simulate --scene street --robots 2 --scans 20 --seed 1 --out street");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_simulate(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
