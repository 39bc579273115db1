// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera simulate: makes a dataset for each robot, with ground truth.
#include <cstdio>
#include <utility>

#include "base/json.hpp"
#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "base/progress.hpp"
#include "cli/command.hpp"
#include "cli/number_options.hpp"
#include "simulator/dataset_writer.hpp"
#include "simulator/street_simulator.hpp"

namespace tessera {

namespace {

struct SimulateOptions {
  SimulatorConfig config;
  PoseError pose_error;
  std::string cameras = "off";
  std::string sweep = "off";
  std::string out;
  std::string report;
};

// The simulator has the same limits; messages here have the names of the options.
constexpr int kMaxRobots = 8;
constexpr int kMaxScans = 1000;
constexpr double kMaxPoseErrorM = 100.0;
constexpr double kMaxRotationErrorDeg = 180.0;

Outcome<void> check_usage(const SimulateOptions& options) {
  const auto in_range = [](int value, int most) { return value >= 1 && value <= most; };
  const auto refusal = [](const char* option, const std::string& given, const std::string& range) {
    return Failure{std::string(option) + " " + given + " is not allowed; give " + range};
  };
  const SimulatorConfig& config = options.config;
  if (config.scene != "street") return refusal("--scene", config.scene, "street");
  if (!in_range(config.robots, kMaxRobots))
    return refusal("--robots", std::to_string(config.robots), "1 to " + std::to_string(kMaxRobots));
  if (!in_range(config.scans, kMaxScans))
    return refusal("--scans", std::to_string(config.scans), "1 to " + std::to_string(kMaxScans));
  const double error_m = options.pose_error.translation_m;
  if (!(error_m >= 0.0 && error_m <= kMaxPoseErrorM))
    return refusal("--pose-error", text_of(error_m), "metres from 0 to 100");
  const double error_deg = options.pose_error.rotation_deg;
  if (!(error_deg >= 0.0 && error_deg <= kMaxRotationErrorDeg))
    return refusal("--rotation-error", text_of(error_deg), "degrees from 0 to 180");
  for (const auto& [option, value] :
       {std::pair{"--cameras", options.cameras}, std::pair{"--sweep", options.sweep}}) {
    if (value != "on" && value != "off") return refusal(option, value, "on or off");
  }
  for (int robot = 0; robot < config.robots; ++robot) {
    const std::string folder = options.out + "/robot_" + std::to_string(robot);
    const Outcome<void> places =
        check_outputs({{"--report", options.report}}, {}, {.path = folder});
    if (!places.ok()) return places.failure();
  }
  return {};
}

Json report_of(const SimulateOptions& options) {
  Json json = {{"scene", options.config.scene},
               {"robots", options.config.robots},
               {"scans", options.config.scans},
               {"seed", options.config.seed},
               {"out", options.out}};
  Json config = json;
  config["pose_error"] = options.pose_error.translation_m;
  config["rotation_error"] = options.pose_error.rotation_deg;
  config["cameras"] = options.cameras;
  config["sweep"] = options.sweep;
  config["report"] = options.report;
  json["config"] = config;
  return json;
}

Outcome<void> run_simulate(const SimulateOptions& options) {
  const Outcome<void> usage = check_usage(options);
  if (!usage.ok()) return usage.failure();
  SimulatorConfig config = options.config;
  config.sweep = options.sweep == "on";
  const Outcome<StreetSimulator> simulator = StreetSimulator::make(config);
  if (!simulator.ok()) return simulator.failure();
  Progress progress("simulating", static_cast<std::uint64_t>(options.config.robots) *
                                      static_cast<std::uint64_t>(options.config.scans));
  const DatasetWriterOptions writer{
      .pose_error = options.pose_error,
      .cameras = options.cameras == "on",
      .progress = [&](int done, int) { progress.update(static_cast<std::uint64_t>(done)); }};
  const Outcome<void> written = write_dataset(*simulator, options.out, writer);
  if (!written.ok()) return written.failure();
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
  command->add_option("--scene", o->config.scene, "Scene: street")->capture_default_str();
  command->add_option("--robots", o->config.robots, "Number of robots, 1 to 8")
      ->check(whole_number<int>())
      ->capture_default_str();
  command->add_option("--scans", o->config.scans, "Scans per robot, 1 to 1000")
      ->check(whole_number<int>())
      ->capture_default_str();
  command->add_option("--seed", o->config.seed, "Seed; the same gives the same bytes")
      ->check(whole_number<std::uint64_t>())
      ->capture_default_str();
  command->add_option("--out", o->out, "Folder to write robot_0, robot_1, ... into")->required();
  command
      ->add_option("--pose-error", o->pose_error.translation_m,
                   "Sigma of the translation in T_global_map_perturbed.txt, 0 to 100 m per axis")
      ->check(decimal_number())
      ->capture_default_str();
  command
      ->add_option("--rotation-error", o->pose_error.rotation_deg,
                   "Sigma of the rotation in T_global_map_perturbed.txt, 0 to 180 degrees per axis")
      ->check(decimal_number())
      ->capture_default_str();
  command
      ->add_option("--cameras", o->cameras,
                   "on or off: add label images of three cameras, and cameras.toml")
      ->capture_default_str();
  command
      ->add_option("--sweep", o->sweep,
                   "on or off: sweep scans while the robot drives; adds times/")
      ->capture_default_str();
  command->add_option("--report", o->report, "JSON report to write");
  command->footer(
      "Example: tessera simulate --scene street --robots 2 --scans 20 --seed 1 --out street");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_simulate(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
