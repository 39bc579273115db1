// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/map_options.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace tessera {

namespace {

/// "512M" and the like; K, M, G are powers of 1024.
std::optional<std::size_t> parse_bytes(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || !(value >= 0.0)) return std::nullopt;
  std::string unit(end, text.data() + text.size());
  if (!unit.empty() && (unit.back() == 'B' || unit.back() == 'b')) unit.pop_back();
  double factor = 1.0;
  if (unit == "K" || unit == "k")
    factor = 1024.0;
  else if (unit == "M" || unit == "m")
    factor = 1024.0 * 1024.0;
  else if (unit == "G" || unit == "g")
    factor = 1024.0 * 1024.0 * 1024.0;
  else if (!unit.empty())
    return std::nullopt;
  if (value * factor > 1e15) return std::nullopt;
  return static_cast<std::size_t>(value * factor);
}

std::optional<double> parse_metres(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

Failure out_of_range(const char* option, const std::string& given, const char* allowed) {
  return {std::string(option) + " " + given + " is not allowed; give " + allowed};
}

}  // namespace

std::string text_of(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

void declare_map_options(CLI::App& command, MapOptions& o) {
  command.add_option("--dataset", o.dataset, "Folder in the KITTI layout")->required();
  command.add_option("--out", o.out, "Map file to write (.tsm)")->required();
  command.add_option("--report", o.report, "JSON report to write");
  command.add_option("--first", o.first, "First scan number");
  command.add_option("--last", o.last, "Last scan number, inclusive");
  command.add_option("--labels", o.labels, "Folder of labels to learn from, or none")
      ->capture_default_str();
  command.add_option("--resolution", o.resolution_m, "Voxel edge, m [0.1]");
  command.add_option("--inference", o.inference, "multi-entropy, kernel or counting")
      ->capture_default_str();
  command.add_option("--kernel-length", o.kernel_length_m, "D of the kernel mode, m [0.5]");
  command.add_option("--prior", o.prior, "sigma_0 of every component [0.001]");
  command.add_option("--max-range", o.max_range_m, "Farther returns add no hit, m; 0: no limit")
      ->capture_default_str();
  command.add_option("--min-range", o.min_range_m, "Nearer returns are refused, m")
      ->capture_default_str();
  command.add_option("--downsample", o.downsample, "Thinning cell, m, or off [the resolution]");
  command.add_option(
      "--thinning-weight", o.thinning_weight,
      "A thinned point weighs the mean or the sum of its points [kernel: sum, else mean]");
  command.add_option("--free-space", o.free_space, "on or off")->capture_default_str();
  command.add_option("--memory", o.memory, "Budget for map and scratch, bytes or with K, M, G")
      ->capture_default_str();
  command.add_option("--counts", o.counts, "How counts are stored: dense")->capture_default_str();
  command.add_option("--robot", o.robot, "Robot id, kept in the map file [0]");
  command.add_option("--min-weight", o.min_weight, "Smaller contributions are not added")
      ->capture_default_str();
  command.add_option("--max-evidence", o.max_evidence,
                     "Cap of a voxel's evidence; 0: none [100; kernel: 250]");
  command.add_option("--free-weight", o.free_weight,
                     "Evidence of one pass of a ray [0.4; kernel: 1]");
  command
      .add_option("--work-budget", o.work_budget,
                  "Most kernel evaluations and ray steps a scan; 0: no limit")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.add_option(
      "--continue", o.continue_from,
      "Map file to go on from; resolution, prior, cap, weight of a pass and robot are its own");
}

Outcome<MapSetup> set_up(const MapOptions& o) {
  MapSetup setup;
  const double resolution_m = o.resolution_m.value_or(0.1);
  if (!(resolution_m >= 1e-3 && resolution_m <= 100.0)) {
    return out_of_range("--resolution", text_of(resolution_m), "metres from 0.001 to 100");
  }
  const double prior = o.prior.value_or(0.001);
  if (!(prior >= 0.0 && prior <= 1e6))
    return out_of_range("--prior", text_of(prior), "a number from 0 to 1e6");
  if (!(o.max_range_m >= 0.0 && o.max_range_m <= 1e6))
    return out_of_range("--max-range", text_of(o.max_range_m), "metres, 0 for no limit");
  if (!(o.min_range_m >= 0.0 && (o.max_range_m <= 0.0 || o.min_range_m < o.max_range_m))) {
    return out_of_range("--min-range", text_of(o.min_range_m), "metres, under --max-range");
  }
  if (!(o.min_weight >= 0.0 && o.min_weight <= 1.0))
    return out_of_range("--min-weight", text_of(o.min_weight), "a number from 0 to 1");
  const bool kernel = o.inference == "kernel";
  const double free_weight = o.free_weight.value_or(kernel ? 1.0 : 0.4);
  const double max_evidence = o.max_evidence.value_or(kernel ? 250.0 : 100.0);
  if (!(free_weight > 0.0 && free_weight <= 1e6))
    return out_of_range("--free-weight", text_of(free_weight), "a number above 0");
  const double passes = max_evidence / free_weight;
  if (!(max_evidence >= 0.0 && max_evidence <= 1e6) ||
      (max_evidence > 0.0 && !(passes >= 1.0 && passes <= 255.0))) {
    return out_of_range("--max-evidence", text_of(max_evidence),
                        "0, or 1 to 255 times --free-weight");
  }
  InferenceConfig& inference = setup.inference;
  if (o.inference == "multi-entropy")
    inference.mode = InferenceMode::kMultiEntropy;
  else if (o.inference == "kernel")
    inference.mode = InferenceMode::kKernel;
  else if (o.inference == "counting")
    inference.mode = InferenceMode::kCounting;
  else
    return out_of_range("--inference", o.inference, "multi-entropy, kernel or counting");
  if (o.kernel_length_given && inference.mode != InferenceMode::kKernel) {
    return Failure{
        "--kernel-length applies to --inference kernel only; leave it out, or choose that mode"};
  }
  if (!(o.kernel_length_m >= 0.5 * resolution_m && o.kernel_length_m <= 32.0 * resolution_m)) {
    if (inference.mode == InferenceMode::kKernel) {
      return out_of_range("--kernel-length", text_of(o.kernel_length_m),
                          "metres from 0.5 to 32 voxels");
    }
  }
  double thinning_m = resolution_m;
  if (o.downsample == "off") {
    thinning_m = 0.0;
  } else if (!o.downsample.empty()) {
    const std::optional<double> given = parse_metres(o.downsample);
    if (!given || !(*given >= 1e-3 && *given <= 1e3))
      return out_of_range("--downsample", o.downsample, "metres from 0.001, or off");
    thinning_m = *given;
  }
  if (!o.thinning_weight.empty() && o.thinning_weight != "mean" && o.thinning_weight != "sum") {
    return out_of_range("--thinning-weight", o.thinning_weight, "mean or sum");
  }
  const bool sum = o.thinning_weight.empty() ? inference.mode == InferenceMode::kKernel
                                             : o.thinning_weight == "sum";
  inference.thinning_weight = sum ? ThinningWeight::kSum : ThinningWeight::kMean;
  if (o.free_space != "on" && o.free_space != "off")
    return out_of_range("--free-space", o.free_space, "on or off");
  if (o.counts != "dense")
    return out_of_range("--counts", o.counts, "dense, the only store of this version");
  const std::optional<std::size_t> budget = parse_bytes(o.memory);
  if (!budget) return out_of_range("--memory", o.memory, "bytes, or a number with K, M or G");
  setup.budget_bytes = *budget;
  inference.kernel_length_m = static_cast<float>(o.kernel_length_m);
  inference.min_weight = static_cast<float>(o.min_weight);
  inference.min_range_m = static_cast<float>(o.min_range_m);
  inference.max_range_m = static_cast<float>(o.max_range_m);
  inference.thinning_m = thinning_m;
  inference.free_space.enabled = o.free_space == "on";
  inference.work_budget = o.work_budget;
  setup.map.resolution_m = resolution_m;
  setup.map.prior = prior;
  setup.map.max_evidence = static_cast<float>(max_evidence);
  setup.map.free_weight = static_cast<float>(free_weight);
  return setup;
}

Json to_json(const MapOptions& o, const MapSetup& setup) {
  Json json;
  json["dataset"] = o.dataset;
  json["out"] = o.out;
  json["first"] = o.first ? Json(*o.first) : Json();
  json["last"] = o.last ? Json(*o.last) : Json();
  json["labels"] = o.labels;
  json["resolution"] = setup.map.resolution_m;
  json["inference"] = o.inference;
  json["kernel_length"] =
      setup.inference.mode == InferenceMode::kKernel ? Json(o.kernel_length_m) : Json();
  json["prior"] = setup.map.prior;
  json["max_range"] = o.max_range_m;
  json["min_range"] = o.min_range_m;
  json["downsample"] =
      setup.inference.thinning_m > 0.0
          ? Json(o.downsample.empty() ? setup.map.resolution_m : *parse_metres(o.downsample))
          : Json("off");
  json["thinning_weight"] =
      setup.inference.thinning_weight == ThinningWeight::kSum ? "sum" : "mean";
  json["free_space"] = o.free_space;
  json["memory"] = setup.budget_bytes;
  json["counts"] = o.counts;
  json["robot"] = o.robot.value_or(0);
  json["min_weight"] = o.min_weight;
  json["max_evidence"] = setup.map.max_evidence;
  json["free_weight"] = setup.map.free_weight;
  json["work_budget"] = o.work_budget;
  json["continue"] = o.continue_from;
  return json;
}

Outcome<ScanCapacity> split_budget(MapSetup& setup, std::size_t max_points) {
  ScanCapacity capacity;
  const auto at_most = [](std::size_t value, std::size_t limit) {
    return static_cast<std::uint32_t>(value < limit ? value : limit);
  };
  capacity.points = at_most(max_points == 0 ? 1 : max_points, std::size_t{1} << 24U);
  capacity.tiles = 131072;
  capacity.ray_blocks = 131072;
  const bool free_space = setup.inference.free_space.enabled;
  const auto scratch = [&] { return Integrator::required_bytes(capacity, free_space); };
  // Tables shrink first, as most scans do not fill them; then the points a scan may have.
  while (scratch() > setup.budget_bytes / 2 && capacity.tiles > 1024) {
    capacity.tiles /= 2;
    capacity.ray_blocks /= 2;
  }
  while (scratch() > setup.budget_bytes / 2 && capacity.points > 64) capacity.points /= 2;
  const std::size_t taken = scratch();
  if (taken < setup.budget_bytes) setup.map = fit_to_budget(setup.map, setup.budget_bytes - taken);
  if (taken >= setup.budget_bytes || setup.map.storage_bytes < 4 * SlabPool::kPageBytes) {
    return Failure{"--memory " + std::to_string(setup.budget_bytes) +
                   " bytes hold no map; give at least " + std::to_string((2 * taken >> 20U) + 1) +
                   "M"};
  }
  return capacity;
}

}  // namespace tessera
