// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera map: a sequence of scans into one robot's local map.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "cli/command.hpp"
#include "cli/map_options.hpp"
#include "cli/map_report.hpp"
#include "cli/stored_map.hpp"
#include "dataset/dataset.hpp"
#include "posix/allocation_counter.hpp"
#include "posix/monotonic_clock.hpp"
#include "posix/progress.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

/// What is fixed for the life of a map, with the option that gives it to a new one.
struct FixedSetting {
  const char* option;
  std::optional<double> given;
  double held;
};

/// The settings of the map that is continued hold; given ones must not contradict them.
Outcome<void> adopt_settings(const MapOptions& options, const MapFileHeader& header,
                             const Dataset& dataset, MapSetup& setup) {
  const std::string& path = options.continue_from;
  if (header.identity.kind != MapKind::kLocal)
    return Failure{path + " is a global map; continue a robot's local map"};
  const MapConfig& held = header.config;
  std::optional<double> robot;
  if (options.robot) robot = static_cast<double>(*options.robot);
  const FixedSetting fixed[] = {
      {"--resolution", options.resolution_m, held.resolution_m},
      {"--prior", options.prior, held.prior},
      {"--max-evidence", options.max_evidence, static_cast<double>(held.max_evidence)},
      {"--free-weight", options.free_weight, static_cast<double>(held.free_weight)},
      {"--robot", robot, static_cast<double>(header.identity.robot)}};
  for (const FixedSetting& setting : fixed) {
    // The file keeps some of them as floats.
    if (!setting.given || std::abs(*setting.given - setting.held) <= 1e-6 * setting.held) continue;
    return Failure{path + " was made with " + setting.option + " " + text_of(setting.held) +
                   "; leave " + setting.option + " out or give the same"};
  }
  if (!(header.classes == dataset.classes().table())) {
    return Failure{path + " has other classes than " + options.dataset +
                   "; use data with the same classes"};
  }
  setup.map = held;
  if (options.downsample.empty()) setup.inference.thinning_m = held.resolution_m;
  return {};
}

void warn_of_another_mode(const MapOptions& options, const MapFileHeader& header) {
  const Json mode = recorded_setting(header, "inference");
  if (!mode.is_string() || mode == options.inference) return;
  warn(options.continue_from + " was made with --inference " + mode.get<std::string>() +
       " and goes on with " + options.inference);
}

/// Reads and integrates every scan. Nothing in here uses the heap unless it fails.
Outcome<void> integrate_all(const Dataset& dataset, ScanBuffer& buffer, Integrator& integrator,
                            LocalMap& map, MapRun& run) {
  Progress progress("mapping", dataset.num_scans());
  const std::optional<std::uint64_t> before = heap_allocations();
  for (std::size_t i = 0; i < dataset.num_scans(); ++i) {
    const Outcome<DatasetScan> scan = dataset.read(i, buffer);
    if (!scan.ok()) return scan.failure();
    const std::int64_t start_us = MonotonicClock::now_us();
    const ScanReport report = integrator.integrate(map, scan->view());
    const double ms = static_cast<double>(MonotonicClock::now_us() - start_us) / 1000.0;
    run.scans.push_back({scan->number, ms, scan->unknown.points, report});
    std::array<char, 48> suffix{};
    std::snprintf(suffix.data(), suffix.size(), "%.1f ms/scan", ms);
    progress.update(i + 1, suffix.data());
  }
  const std::optional<std::uint64_t> after = heap_allocations();
  if (before && after) run.heap_allocations = *after - *before;
  progress.finish();
  return {};
}

Outcome<void> record_settings(const Json& config, MapIdentity& identity) {
  const std::string text = config.dump();
  if (text.size() > MapIdentity::kMaxSettings) {
    return Failure{"the paths given are too long for the map's record; use shorter ones"};
  }
  std::memcpy(identity.settings.data(), text.data(), text.size());
  identity.settings_bytes = static_cast<std::uint32_t>(text.size());
  return {};
}

/// How the map was made, for its own record: without the paths and ranges of this run.
Json settings_of(Json config) {
  for (const char* const key : {"dataset", "out", "continue", "memory", "first", "last"})
    config.erase(key);
  return config;
}

Outcome<void> run_map(const MapOptions& options) {
  Outcome<MapSetup> setup = set_up(options);
  if (!setup.ok()) return setup.failure();
  const Outcome<Dataset> dataset = Dataset::open(
      options.dataset, {.first = options.first, .last = options.last, .labels = options.labels});
  if (!dataset.ok()) return dataset.failure();
  if (!dataset->missing().empty()) warn("there are no scans " + to_text(dataset->missing()));
  MapIdentity identity{.robot = options.robot.value_or(0)};
  std::optional<MapFileHeader> earlier;
  if (!options.continue_from.empty()) {
    const Outcome<MapFileHeader> header = load_map_header(options.continue_from);
    if (!header.ok()) return header.failure();
    const Outcome<void> adopted = adopt_settings(options, *header, *dataset, *setup);
    if (!adopted.ok()) return adopted.failure();
    identity = header->identity;
    earlier = *header;
  }
  // Before the work, so that an unwritable place is told at once.
  if (options.out.empty()) return Failure{"--out has no name; name the map file to write"};
  for (const std::string& path : {options.out, options.report}) {
    const Outcome<void> writable = check_writable(path);
    if (!writable.ok()) return writable.failure();
  }
  const Outcome<ScanCapacity> capacity = split_budget(*setup, dataset->max_points());
  if (!capacity.ok()) return capacity.failure();
  Json config = to_json(options, *setup);
  config["robot"] = identity.robot;
  const Outcome<void> recorded = record_settings(settings_of(config), identity);
  if (!recorded.ok()) return recorded.failure();

  MapRun run;
  run.budget_bytes = setup->budget_bytes;
  run.scratch_bytes = Integrator::required_bytes(*capacity, setup->inference.free_space.enabled);
  const Outcome<ArenaMemory> memory =
      ArenaMemory::allocate(required_bytes(setup->map) + run.scratch_bytes);
  if (!memory.ok()) return memory.failure();
  Arena arena(memory->span());
  Result<LocalMap> map = LocalMap::make(arena, setup->map, dataset->classes().table());
  if (!map.ok()) return Failure{std::string("the map cannot be made: ") + to_string(map.status())};
  Result<Integrator> integrator = Integrator::make(arena, setup->inference, *capacity);
  if (!integrator.ok())
    return Failure{std::string("the inference cannot be set up: ") +
                   to_string(integrator.status())};
  if (earlier) {
    const Outcome<void> loaded = load_into(options.continue_from, *map);
    if (!loaded.ok()) return loaded.failure();
    warn_of_another_mode(options, *earlier);
  }
  ScanBuffer buffer(dataset->max_points());
  run.scans.reserve(dataset->num_scans());
  const Outcome<void> done = integrate_all(*dataset, buffer, *integrator, *map, run);
  if (!done.ok()) return done.failure();
  std::vector<KeyedIndex> workspace = workspace_for(*map);
  run.digest = digest(*map, workspace);
  const Outcome<void> saved = save_map(*map, identity, workspace, options.out);
  if (!saved.ok()) return saved.failure();
  print_summary(run, *map, options.out);
  return write_report(to_json(run, *map, config), options.report);
}

}  // namespace

void add_map_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("map", "Integrate a sequence of scans into one robot's local map");
  auto options = std::make_shared<MapOptions>();
  declare_map_options(*command, *options);
  command->footer(
      "Example: tessera map --dataset semantickitti_08 --last 5 --max-range 40 --out map.tsm "
      "--report map.json");
  command->callback([command, options, &exit_status] {
    options->kernel_length_given = command->count("--kernel-length") > 0;
    const Outcome<void> outcome = run_map(*options);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
