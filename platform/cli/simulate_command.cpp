// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera simulate: a dataset a robot, with ground truth.
#include <cstdio>

#include "cli/command.hpp"
#include "cli/report.hpp"
#include "posix/progress.hpp"
#include "simulator/dataset_writer.hpp"
#include "simulator/street_simulator.hpp"

namespace tessera {

namespace {

struct SimulateOptions {
  SimulatorConfig config;
  PoseError pose_error;
  std::string out;
  std::string report;
};

Outcome<void> run_simulate(const SimulateOptions& options) {
  const Outcome<StreetSimulator> simulator = StreetSimulator::make(options.config);
  if (!simulator.ok()) return simulator.failure();
  const Outcome<void> writable = check_writable(options.report);
  if (!writable.ok()) return writable.failure();
  Progress progress("simulating", static_cast<std::uint64_t>(options.config.robots) *
                                      static_cast<std::uint64_t>(options.config.scans));
  const DatasetWriterOptions writer{
      .pose_error = options.pose_error,
      .progress = [&](int done, int) { progress.update(static_cast<std::uint64_t>(done)); }};
  const Outcome<void> written = write_dataset(*simulator, options.out, writer);
  if (!written.ok()) return written.failure();
  progress.finish();
  std::printf("%d robots, %d scans each into %s (seed %llu)\n", options.config.robots,
              options.config.scans, options.out.c_str(),
              static_cast<unsigned long long>(options.config.seed));
  return write_report({{"scene", options.config.scene},
                       {"robots", options.config.robots},
                       {"scans", options.config.scans},
                       {"seed", options.config.seed},
                       {"out", options.out}},
                      options.report);
}

}  // namespace

void add_simulate_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("simulate", "Make a dataset a robot, with ground truth");
  auto o = std::make_shared<SimulateOptions>();
  command->add_option("--scene", o->config.scene, "Scene: street")->capture_default_str();
  command->add_option("--robots", o->config.robots, "Robots, 1 to 8")->capture_default_str();
  command->add_option("--scans", o->config.scans, "Scans a robot, 1 to 1000")
      ->capture_default_str();
  command->add_option("--seed", o->config.seed, "Seed; the same gives the same bytes")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--out", o->out, "Folder to write robot_0, robot_1, ... into")->required();
  command
      ->add_option("--pose-error", o->pose_error.translation_m,
                   "Sigma of T_global_map_perturbed.txt, m an axis")
      ->capture_default_str();
  command->add_option("--rotation-error", o->pose_error.rotation_deg, "The same, degrees an axis")
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
