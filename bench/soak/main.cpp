// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>

#include "soak/soak.hpp"

int main(int argc, char** argv) {
  tessera::soak::SoakOptions options;
  CLI::App app("Hours of a team in virtual time, and what must hold after each minute");
  app.add_option("--minutes", options.minutes, "Virtual minutes in all")
      ->check(CLI::Range(1, 100'000));
  app.add_option("--seed", options.seed, "Of all that is drawn");
  app.add_option("--state", options.folder, "Folder for state, checkpoints and minutes.jsonl")
      ->required();
  app.add_flag("--resume", options.resume, "Go on from the last checkpoint in that folder");
  app.add_option("--robots", options.robots, "How many")->check(CLI::Range(2, 8));
  app.add_option("--resolution", options.resolution_m, "Edge of a voxel, metres")
      ->check(CLI::Range(0.05, 1.0));
  app.add_option("--submap-length", options.submap_m, "Way of a submap, metres")
      ->check(CLI::Range(1.0, 1000.0));
  app.add_option("--map-submaps", options.map_submaps,
                 "Submaps after which a robot begins an empty map; 0: never")
      ->check(CLI::Range(0, 10'000));
  app.add_option("--kills", options.kills, "Of a robot in a minute")->check(CLI::Range(0.0, 1.0));
  app.add_option("--checkpoint", options.checkpoint_minutes, "Minutes from one to the next")
      ->check(CLI::Range(1, 1000));
  CLI11_PARSE(app, argc, argv);
  tessera::soak::Soak soak(options);
  const tessera::Outcome<void> done = soak.run();
  if (done.ok()) return soak.is_clean() ? 0 : 1;
  std::fprintf(stderr, "soak: %s\n", done.failure().text().c_str());
  return 2;
}
