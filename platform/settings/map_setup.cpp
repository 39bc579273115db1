// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Converts the options of "map" to configurations of the library; each group checks its ranges.
#include <algorithm>
#include <charconv>
#include <cmath>

#include "base/number_text.hpp"
#include "settings/map_options.hpp"

namespace tessera {

namespace {

std::optional<double> parse_metres(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

Outcome<void> set_up_map(const MapOptions& o, MapSetup& setup) {
  const double resolution_m = o.resolution_m.value_or(0.1);
  if (!(resolution_m >= 1e-3 && resolution_m <= 100.0)) {
    return not_allowed("--resolution", text_of(resolution_m), "metres from 0.001 to 100");
  }
  const double prior = o.prior.value_or(0.001);
  if (!(prior >= 0.0 && prior <= 1e6))
    return not_allowed("--prior", text_of(prior), "a number from 0 to 1e6");
  const bool kernel = o.inference == "kernel";
  const double free_weight = o.free_weight.value_or(kernel ? 1.0 : 0.4);
  const double max_evidence = o.max_evidence.value_or(kernel ? 250.0 : 100.0);
  if (!(free_weight > 0.0 && free_weight <= 1e6))
    return not_allowed("--free-weight", text_of(free_weight), "a number above 0");
  const double passes = max_evidence / free_weight;
  if (!(max_evidence >= 0.0 && max_evidence <= 1e6) ||
      (max_evidence > 0.0 && !(passes >= 1.0 && passes <= 255.0))) {
    return not_allowed("--max-evidence", text_of(max_evidence),
                       "0, or 1 to 255 times --free-weight");
  }
  if (!o.counts.empty() && o.counts != "dense" && o.counts != "compact")
    return not_allowed("--counts", o.counts, "dense or compact");
  // A long kernel brings many classes into a voxel: three slots are too few for them.
  const bool dense = o.counts.empty() ? kernel : o.counts == "dense";
  setup.map.tuple = dense ? TuplePolicy::kDense : TuplePolicy::kCompact;
  setup.max_evidence = max_evidence;
  setup.free_weight = free_weight;
  setup.map.resolution_m = resolution_m;
  setup.map.prior = prior;
  setup.map.max_evidence = static_cast<float>(max_evidence);
  setup.map.free_weight = static_cast<float>(free_weight);
  if (o.prior_map_weight_given && o.prior_map.empty())
    return Failure{"--prior-map-weight is for --prior-map; name an OctoMap file, or leave it out"};
  if (!o.prior_map.empty() && !o.continue_from.empty()) {
    return Failure{"--prior-map is for a new map; leave it out, as the map to continue has it"};
  }
  const double most = max_evidence > 0.0 ? max_evidence : 1000.0;
  if (!(o.prior_map_weight >= 0.001 && o.prior_map_weight <= most))
    return not_allowed("--prior-map-weight", text_of(o.prior_map_weight),
                       "evidence from 0.001 to --max-evidence");
  return {};
}

Outcome<void> set_up_ranges(const MapOptions& o, InferenceConfig& inference) {
  if (!(o.max_range_m >= 0.0 && o.max_range_m <= 1e6))
    return not_allowed("--max-range", text_of(o.max_range_m), "metres, 0 for no limit");
  if (!(o.min_range_m >= 0.0 && (o.max_range_m <= 0.0 || o.min_range_m < o.max_range_m))) {
    return not_allowed("--min-range", text_of(o.min_range_m), "metres, under --max-range");
  }
  if (!(o.min_weight >= 0.0 && o.min_weight <= 1.0))
    return not_allowed("--min-weight", text_of(o.min_weight), "a number from 0 to 1");
  if (o.free_space != "on" && o.free_space != "off")
    return not_allowed("--free-space", o.free_space, "on or off");
  inference.min_weight = static_cast<float>(o.min_weight);
  inference.min_range_m = static_cast<float>(o.min_range_m);
  inference.max_range_m = static_cast<float>(o.max_range_m);
  inference.free_space.enabled = o.free_space == "on";
  inference.work_budget = o.work_budget;
  return {};
}

Outcome<void> set_up_deadline(const MapOptions& o, MapSetup& setup) {
  // The clock counts microseconds.
  const bool in_range = o.deadline_ms >= 0.001 && o.deadline_ms <= 1e9;
  const bool none = o.deadline_ms >= 0.0 && o.deadline_ms <= 0.0;
  if (!in_range && !none)
    return not_allowed("--deadline", text_of(o.deadline_ms),
                       "milliseconds from 0.001 to 1e9, or 0");
  setup.deadline_us = static_cast<std::int64_t>(o.deadline_ms * 1000.0 + 0.5);
  return {};
}

Outcome<void> set_up_mode(const MapOptions& o, double resolution_m, InferenceConfig& inference) {
  if (o.inference == "multi-entropy")
    inference.mode = InferenceMode::kMultiEntropy;
  else if (o.inference == "kernel")
    inference.mode = InferenceMode::kKernel;
  else if (o.inference == "counting")
    inference.mode = InferenceMode::kCounting;
  else
    return not_allowed("--inference", o.inference, "multi-entropy, kernel or counting");
  const bool kernel = inference.mode == InferenceMode::kKernel;
  if (o.kernel_length_given && !kernel) {
    return Failure{
        "--kernel-length applies to --inference kernel only; leave it out, or choose that mode"};
  }
  const bool in_range =
      o.kernel_length_m >= 0.5 * resolution_m && o.kernel_length_m <= 32.0 * resolution_m;
  if (kernel && !in_range) {
    return not_allowed("--kernel-length", text_of(o.kernel_length_m),
                       "metres from 0.5 to 32 voxels");
  }
  inference.kernel_length_m = static_cast<float>(o.kernel_length_m);
  return {};
}

Outcome<void> set_up_thinning(const MapOptions& o, double resolution_m,
                              InferenceConfig& inference) {
  inference.thinning_m = resolution_m;
  if (o.downsample == "off") {
    inference.thinning_m = 0.0;
  } else if (!o.downsample.empty()) {
    const std::optional<double> given = parse_metres(o.downsample);
    if (!given || !(*given >= 1e-3 && *given <= 1e3))
      return not_allowed("--downsample", o.downsample, "metres from 0.001 to 1000, or off");
    inference.thinning_m = *given;
  }
  if (!o.thinning_weight.empty() && o.thinning_weight != "mean" && o.thinning_weight != "sum") {
    return not_allowed("--thinning-weight", o.thinning_weight, "mean or sum");
  }
  const bool sum = o.thinning_weight.empty() ? inference.mode == InferenceMode::kKernel
                                             : o.thinning_weight == "sum";
  inference.thinning_weight = sum ? ThinningWeight::kSum : ThinningWeight::kMean;
  return {};
}

}  // namespace

double reach_m(const MapOptions& o) {
  if (o.max_range_m <= 0.0) return 0.0;
  return o.max_range_m + (o.inference == "kernel" ? o.kernel_length_m : 0.0);
}

/// An archive alone has the window that scans reach within.
Outcome<void> set_up_window(const MapOptions& o, MapSetup& setup) {
  if (!o.window_m && o.archive.empty()) return {};
  if (!o.window_m && o.max_range_m <= 0.0)
    return Failure{"--archive needs --window where --max-range is 0; give --window too"};
  const double edge_m = setup.map.resolution_m * kBlockEdge;
  const double radius_m = o.window_m.value_or(reach_m(o));
  if (!(radius_m > 0.0 && radius_m <= kMostWindowBlocks * edge_m))
    return not_allowed("--window", text_of(radius_m), "metres above 0, to 32000 voxels");
  WindowConfig& window = setup.window.emplace();
  window.radius_m = radius_m;
  window.hysteresis_m = 2.0 * edge_m;
  return {};
}

Outcome<MapSetup> set_up(const MapOptions& o) {
  MapSetup setup;
  const Outcome<void> map = set_up_map(o, setup);
  if (!map.ok()) return map.failure();
  const Outcome<void> ranges = set_up_ranges(o, setup.inference);
  if (!ranges.ok()) return ranges.failure();
  const Outcome<void> deadline = set_up_deadline(o, setup);
  if (!deadline.ok()) return deadline.failure();
  const Outcome<void> mode = set_up_mode(o, setup.map.resolution_m, setup.inference);
  if (!mode.ok()) return mode.failure();
  const Outcome<void> thinning = set_up_thinning(o, setup.map.resolution_m, setup.inference);
  if (!thinning.ok()) return thinning.failure();
  const Outcome<void> window = set_up_window(o, setup);
  if (!window.ok()) return window.failure();
  const std::optional<std::size_t> budget = parse_bytes(o.memory);
  if (!budget) return not_allowed("--memory", o.memory, "bytes, or a number with K, M or G");
  setup.budget_bytes = *budget;
  return setup;
}

Outcome<ScanCapacity> split_budget(MapSetup& setup, std::size_t max_points) {
  ScanCapacity capacity;
  const std::size_t budget_bytes =
      setup.budget_bytes - std::min(setup.budget_bytes, setup.archive_bytes);
  const auto at_most = [](std::size_t value, std::size_t limit) {
    return static_cast<std::uint32_t>(value < limit ? value : limit);
  };
  capacity.points = at_most(max_points == 0 ? 1 : max_points, std::size_t{1} << 24U);
  capacity.tiles = 131072;
  capacity.ray_blocks = 131072;
  const auto scratch = [&] { return Integrator::required_bytes(capacity, setup.inference); };
  // Tables shrink first, as most scans do not fill them; then the points a scan may have.
  while (scratch() > budget_bytes / 2 && capacity.tiles > 1024) {
    capacity.tiles /= 2;
    capacity.ray_blocks /= 2;
  }
  if (scratch() > budget_bytes / 2) {
    // The most that fit; at least 64.
    std::uint32_t fits = 64;
    std::uint32_t too_many = capacity.points;
    while (fits + 1 < too_many) {
      capacity.points = fits + (too_many - fits) / 2;
      (scratch() > budget_bytes / 2 ? too_many : fits) = capacity.points;
    }
    capacity.points = fits;
  }
  const std::size_t taken = scratch();
  if (taken < budget_bytes) setup.map = fit_to_budget(setup.map, budget_bytes - taken);
  if (taken >= budget_bytes || setup.map.storage_bytes < 4 * SlabPool::kPageBytes) {
    return Failure{"--memory " + std::to_string(setup.budget_bytes) +
                   " bytes are too few for a map; give at least " +
                   std::to_string(((2 * taken + setup.archive_bytes) >> 20U) + 1) + "M"};
  }
  return capacity;
}

std::size_t budget_for_storage(const MapSetup& setup, std::size_t max_points,
                               std::size_t storage_bytes) {
  constexpr std::size_t kMiB = std::size_t{1} << 20U;
  MapSetup trial = setup;
  trial.budget_bytes = storage_bytes / kMiB * kMiB;
  // Ends soon: scratch takes at most half, and the index a few percent of the rest.
  while (true) {
    trial.budget_bytes += kMiB;
    if (split_budget(trial, max_points).ok() && trial.map.storage_bytes >= storage_bytes)
      return trial.budget_bytes;
  }
}

}  // namespace tessera
