// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/map_arguments.hpp"

#include "cli/number_options.hpp"
#include "cli/source_arguments.hpp"

namespace tessera {

void declare_map_options(CLI::App& command, MapOptions& o) {
  declare_source_folders(command, o);
  declare_pose_file(command, o);
  command.add_option("--out", o.out, "Map file to write (.tsm), required");
  command.add_option("--report", o.report, "JSON report to write");
  declare_source_choice(command, o);
  command.add_option("--resolution", o.resolution_m, "Voxel edge, m [0.1]")
      ->check(decimal_number());
  command
      .add_option("--inference", o.inference, "Inference mode: multi-entropy, kernel or counting")
      ->capture_default_str();
  command.add_option("--kernel-length", o.kernel_length_m, "Length D of the kernel mode, m [0.5]")
      ->check(decimal_number());
  command.add_option("--prior", o.prior, "Prior sigma_0 of every component [0.001]")
      ->check(decimal_number());
  command
      .add_option("--max-range", o.max_range_m,
                  "Returns beyond this range add no hit, m; 0: no limit")
      ->check(decimal_number())
      ->capture_default_str();
  command.add_option("--min-range", o.min_range_m, "Returns within this range are refused, m")
      ->check(decimal_number())
      ->capture_default_str();
  command.add_option("--downsample", o.downsample, "Thinning cell, m, or off [the resolution]");
  command.add_option(
      "--thinning-weight", o.thinning_weight,
      "Weight of a thinned point: mean or sum of its points [kernel: sum, else mean]");
  command.add_option("--free-space", o.free_space, "on or off: map free space along rays")
      ->capture_default_str();
  command
      .add_option("--memory", o.memory,
                  "Memory for the map and for processing a scan, bytes or with K, M, G")
      ->capture_default_str();
  command.add_option("--counts", o.counts,
                     "How counts are stored: dense or compact [kernel: dense, else compact]");
  command.add_option("--robot", o.robot, "Robot id, kept in the map file [0]")
      ->check(whole_number<std::uint32_t>());
  command.add_option("--min-weight", o.min_weight, "Ignore contributions smaller than this")
      ->check(decimal_number())
      ->capture_default_str();
  command
      .add_option("--max-evidence", o.max_evidence,
                  "Cap of a voxel's evidence; 0: none [100; kernel: 250]")
      ->check(decimal_number());
  command
      .add_option("--free-weight", o.free_weight, "Evidence of one pass of a ray [0.4; kernel: 1]")
      ->check(decimal_number());
  command
      .add_option("--work-budget", o.work_budget,
                  "Most kernel evaluations and ray steps per scan; 0: no limit")
      ->check(whole_number<std::uint64_t>())
      ->capture_default_str();
  command
      .add_option("--deadline", o.deadline_ms,
                  "Time per scan, ms; what does not fit is left out; 0: no limit")
      ->check(decimal_number())
      ->capture_default_str();
  command.add_option(
      "--continue", o.continue_from,
      "Map file to continue; it sets resolution, prior, cap, weight of a pass and robot");
  command
      .add_option("--window", o.window_m,
                  "Keep only the map within this distance of the robot, m [everything]")
      ->check(decimal_number());
  command.add_option(
      "--archive", o.archive,
      "Folder for blocks that leave the window; they are reloaded when the robot returns");
  command.add_option("--prior-map", o.prior_map,
                     "OctoMap file (.bt, .ot) to initialise a new map with");
  command
      .add_option("--prior-map-weight", o.prior_map_weight, "Evidence of each voxel of --prior-map")
      ->check(decimal_number())
      ->capture_default_str();
}

}  // namespace tessera
