// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Converts the options of "map" to configurations of the library, and checks what several of them
// say together.
#include <algorithm>

#include "base/number_text.hpp"
#include "settings/map_options.hpp"

namespace tessera {

namespace {

Failure refused(const SettingName& setting, double value, const Message& allowed) {
  return not_allowed(setting, text_of(value), allowed);
}

Outcome<void> set_up_map(const MapOptions& o, MapConfig& map) {
  const double most = *o.max_evidence;
  const double passes = most / *o.free_weight;
  if (most > 0.0 && !(passes >= 1.0 && passes <= 255.0)) {
    return refused(kMapSettings["--max-evidence"], most,
                   "0, or 1 to 255 times " + Message(kMapSettings["--free-weight"]));
  }
  map.tuple = *o.counts;
  map.resolution_m = *o.resolution_m;
  map.prior = *o.prior;
  map.probabilities =
      o.inference == InferenceMode::kCounting ? Probabilities::kShares : Probabilities::kEffective;
  map.label_votes = needs_votes(o.inference, map.resolution_m);
  map.max_evidence = static_cast<float>(most);
  map.free_weight = static_cast<float>(*o.free_weight);
  return {};
}

Outcome<void> check_prior_map(const MapOptions& o) {
  const SettingName& prior_map = kMapFileSettings["--prior-map"];
  const SettingName& weight = kMapFileSettings["--prior-map-weight"];
  if (o.prior_map.empty()) {
    if (!o.prior_map_weight) return {};
    return Failure{Message(weight) + " is for " + prior_map +
                   "; name an OctoMap file, or leave it out"};
  }
  if (!o.continue_from.empty())
    return Failure{Message(prior_map) +
                   " is for a new map; leave it out, as the map to continue has it"};
  const double most = *o.max_evidence > 0.0 ? *o.max_evidence : 1000.0;
  if (*o.prior_map_weight <= most) return {};
  return refused(weight, *o.prior_map_weight,
                 "evidence from 0.001 to " + Message(kMapSettings["--max-evidence"]));
}

Outcome<void> set_up_ranges(const MapOptions& o, InferenceConfig& inference) {
  if (o.max_range_m > 0.0 && !(o.min_range_m < o.max_range_m)) {
    return refused(kMapSettings["--min-range"], o.min_range_m,
                   "metres, under " + Message(kMapSettings["--max-range"]));
  }
  if (o.no_return_range_m > 0.0 && o.no_return_range_m < o.min_range_m) {
    return refused(kMapSettings["--no-return-range"], o.no_return_range_m,
                   "metres from " + Message(kMapSettings["--min-range"]) + ", or 0");
  }
  inference.no_return_range_m = static_cast<float>(o.no_return_range_m);
  inference.min_weight = static_cast<float>(o.min_weight);
  inference.min_range_m = static_cast<float>(o.min_range_m);
  inference.max_range_m = static_cast<float>(o.max_range_m);
  inference.free_space.enabled = o.free_space;
  inference.free_space.carving = o.carving;
  inference.work_budget = o.work_budget;
  return {};
}

Outcome<void> set_up_body(const MapOptions& o, RobotBody& body) {
  constexpr std::size_t kOfBox = 6;
  const auto wrong = [](const Message& what) {
    return Failure{Message(kMapSettings["--body"]) + " " + what};
  };
  const std::size_t boxes = o.body.size() / kOfBox;
  if (o.body.size() % kOfBox != 0 || boxes > RobotBody::kMostBoxes)
    return wrong("has " + counted(o.body.size(), "number") +
                 "; give six for each box, and at most 8 boxes");
  RobotBody read;
  read.count = static_cast<std::uint32_t>(boxes);
  for (std::size_t i = 0; i < o.body.size(); ++i) {
    const auto number = static_cast<float>(std::clamp(o.body[i], -1e6, 1e6));
    BodyBox& box = read.boxes[i / kOfBox];
    (i % kOfBox < 3 ? box.low : box.high)[i % 3] = number;
  }
  for (std::uint32_t i = 0; i < read.count; ++i) {
    RobotBody one;
    one.boxes[0] = read.boxes[i];
    one.count = 1;
    if (one.is_valid()) continue;
    return wrong("has a box " + std::to_string(i + 1) +
                 " that is empty or too large; give its low corner and then its high one, each "
                 "coordinate from -100 to 100");
  }
  body = read;
  return {};
}

Outcome<void> set_up_mode(const MapOptions& o, InferenceConfig& inference) {
  inference.mode = o.inference;
  inference.thinning_m = *o.downsample_m;
  inference.thinning_weight = *o.thinning_weight;
  const SettingName& kernels = kMapSettings["--kernels"];
  const SettingName& length = kMapSettings["--kernel-length"];
  const SettingName& mode = kMapSettings["--inference"];
  if (!o.kernels.empty() && (o.inference != InferenceMode::kLattice || o.kernel_length_m))
    return Failure{Message(kernels) + " applies to " + mode + " lattice without " + length +
                   "; leave out one"};
  const bool votes = needs_votes(o.inference, *o.resolution_m);
  if (o.inference == InferenceMode::kLattice && !votes && (o.kernel_length_m || !o.kernels.empty()))
    return Failure{Message(o.kernel_length_m ? length : kernels) + " applies to " + mode +
                   " lattice where voxels are under " + text_of(kVotesBelow_m) +
                   " m; leave it out, or give a finer " + kMapSettings["--resolution"]};
  if (!o.kernel_length_m) return {};
  if (!o.is_kernel() && !votes)
    return Failure{Message(length) + " applies to " + mode +
                   " kernel and lattice; leave it out, or choose one of these modes"};
  if (votes) {
    if (!(*o.kernel_length_m >= 0.001 && *o.kernel_length_m <= 1000.0))
      return refused(length, *o.kernel_length_m, "metres from 0.001 to 1000");
    inference.lattice.reach_m = static_cast<float>(*o.kernel_length_m);
    return {};
  }
  const double voxels = *o.kernel_length_m / *o.resolution_m;
  if (!(voxels >= 0.5 && voxels <= 32.0))
    return refused(length, *o.kernel_length_m, "metres from 0.5 to 32 voxels");
  inference.kernel_length_m = static_cast<float>(*o.kernel_length_m);
  return {};
}

/// An archive alone has the window that scans reach within.
Outcome<void> set_up_window(const MapOptions& o, MapSetup& setup) {
  const SettingName& window = kMapSettings["--window"];
  if (!o.window_m && o.archive.empty()) return {};
  if (!o.window_m && o.max_range_m <= 0.0)
    return Failure{Message(kMapSettings["--archive"]) + " needs " + window + " where " +
                   kMapSettings["--max-range"] + " is 0; give " + window + " too"};
  const double edge_m = setup.map.resolution_m * kBlockEdge;
  const double radius_m = o.window_m.value_or(reach_m(o));
  if (!(radius_m <= kMostWindowBlocks * edge_m))
    return refused(window, radius_m, "metres above 0, to 32000 voxels");
  WindowConfig& config = setup.window.emplace();
  config.radius_m = radius_m;
  config.hysteresis_m = 2.0 * edge_m;
  return {};
}

}  // namespace

Outcome<void> check_body(const RobotBody& body, const Matrix34d& T_body_sensor,
                         const std::string& sensor) {
  if (body.allows(T_body_sensor)) return {};
  return Failure{Message(kMapSettings["--body"]) + " has a box around " + sensor +
                 ", which would see nothing near it; give boxes beside the sensor"};
}

double reach_m(const MapOptions& o) {
  if (o.max_range_m <= 0.0) return 0.0;
  return o.max_range_m + (o.is_kernel() ? *o.complete().kernel_length_m : 0.0);
}

Outcome<MapSetup> set_up(const MapOptions& options) {
  const MapOptions o = options.complete();
  MapSetup setup;
  Outcome<void> done = set_up_map(o, setup.map);
  if (done.ok()) done = check_prior_map(o);
  if (done.ok()) done = set_up_ranges(o, setup.inference);
  if (done.ok()) done = set_up_body(o, setup.inference.body);
  if (done.ok()) done = set_up_mode(o, setup.inference);
  if (done.ok()) done = set_up_window(o, setup);
  if (!done.ok()) return done.failure();
  if (!o.kernels.empty()) {
    TESSERA_TRY_ASSIGN(setup.kernels, read_kernels(o.kernels));
    setup.kernels_path = o.kernels;
  }
  // The clock counts microseconds.
  setup.deadline_us = static_cast<std::int64_t>(o.deadline_ms * 1000.0 + 0.5);
  setup.budget_bytes = o.memory_bytes;
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
  // Half of what is left beside the images of a scan, which do not shrink.
  const std::size_t images =
      setup.inference.free_space.uses_image() ? ImageCarver::required_bytes() : 0;
  const std::size_t most = (budget_bytes + images) / 2;
  // Tables shrink first, as most scans do not fill them; then the points a scan may have.
  while (scratch() > most && capacity.tiles > 1024) {
    capacity.tiles /= 2;
    capacity.ray_blocks /= 2;
  }
  if (scratch() > most) {
    // The most that fit; at least 64.
    std::uint32_t fits = 64;
    std::uint32_t too_many = capacity.points;
    while (fits + 1 < too_many) {
      capacity.points = fits + (too_many - fits) / 2;
      (scratch() > most ? too_many : fits) = capacity.points;
    }
    capacity.points = fits;
  }
  const std::size_t taken = scratch();
  const std::size_t maps = setup.submap_length_m > 0.0 ? 2 : 1;
  if (taken < budget_bytes) setup.map = fit_to_budget(setup.map, (budget_bytes - taken) / maps);
  if (taken >= budget_bytes || setup.map.storage_bytes < 4 * SlabPool::kPageBytes) {
    constexpr std::size_t kMiB = std::size_t{1} << 20U;
    const std::size_t enough = ((2 * taken - images + setup.archive_bytes) / kMiB + 1) * kMiB;
    Message what = Message(kMapSettings["--memory"]) + " " + bytes_text(setup.budget_bytes) +
                   " is too little for a map; ";
    if (images > 0)
      what += Message("take ") + kMapSettings["--carving"] + " rays, which needs " +
              bytes_text(images / kMiB * kMiB) + " less, or ";
    what += Message("give at least ") + bytes_text(enough);
    return Failure{std::move(what)};
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
