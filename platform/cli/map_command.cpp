// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera map: integrates a sequence of scans into the local map of one robot.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include "base/allocation_counter.hpp"
#include "base/monotonic_clock.hpp"
#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "base/progress.hpp"
#include "base/stop_signals.hpp"
#include "cli/command.hpp"
#include "cli/continued_map.hpp"
#include "cli/map_ending.hpp"
#include "cli/map_report.hpp"
#include "cli/map_submaps.hpp"
#include "cli/map_window.hpp"
#include "cli/open_source.hpp"
#include "cli/setting_options.hpp"
#include "maps/held_mapper.hpp"
#include "maps/prior_map.hpp"
#include "maps/stored_map.hpp"
#include "scans/recorded_source.hpp"
#include "scans/registrar.hpp"
#include "scans/transform_file.hpp"
#include "settings/window_setup.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/grid/lattice.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

std::atomic<bool> interrupted{false};

/// Reads and integrates every scan, or those before a signal requests to stop. Does not use the
/// heap unless it fails, except for decoding the cameras' images or files of clouds and for an
/// archive that is made when memory is short, which a robot does not do.
Outcome<void> integrate_all(const RecordedScans& scans, Registrar& registrar, Mapper& mapper,
                            MapWindow* window, MapSubmaps* submaps, MapRun& run) {
  RecordedSource source(scans);
  Progress progress("mapping", scans.num_scans());
  const std::optional<std::uint64_t> before = heap_allocations();
  std::uint64_t decoding = 0;
  while (!source.ended()) {
    run.interrupted = interrupted.load(std::memory_order_relaxed);
    if (run.interrupted) break;
    const std::uint64_t before_reading = heap_allocations().value_or(0);
    Scan* const scan = source.front();
    if (scan == nullptr) return source.outcome();
    if (scans.decodes()) decoding += heap_allocations().value_or(0) - before_reading;
    ScanView view;
    const std::uint64_t no_returns = count_no_returns(*scan);
    if (!registrar.view(*scan, view)) return does_not_suit(*scan);
    if (submaps != nullptr) {
      const std::uint64_t before_writing = heap_allocations().value_or(0);
      TESSERA_TRY(submaps->begin_scan(*scan, view, mapper));
      decoding += heap_allocations().value_or(0) - before_writing;
    }
    const std::int64_t start_us = MonotonicClock::now_us();
    const ScanReport report = mapper.integrate(view, start_us);
    const double ms = static_cast<double>(MonotonicClock::now_us() - start_us) / 1000.0;
    run.scans.push_back({scan->number, ms, scan->unknown, report, registrar.last(), no_returns,
                         check_rigid(view.T_map_sensor) == Status::kOk});
    if (submaps != nullptr) submaps->end_scan();
    source.pop();
    std::array<char, 48> suffix{};
    std::snprintf(suffix.data(), suffix.size(), "%.1f ms/scan", ms);
    progress.update(run.scans.size(), suffix.data());
    run.obstacle = window == nullptr ? std::nullopt : window->obstacle();
    // While there is room nothing is lost.
    if (run.obstacle && report.refused_storage + report.rays_refused_memory > 0) break;
    run.obstacle.reset();
  }
  const std::optional<std::uint64_t> after = heap_allocations();
  const std::uint64_t opening = window == nullptr ? 0 : window->opening_allocations();
  if (before && after) run.heap_allocations = *after - *before - decoding - opening;
  progress.finish();
  return {};
}

Outcome<void> check_places(const MapOptions& options) {
  if (options.out.empty()) return Failure{"--out has no name; name the map file to write"};
  // A map may be continued under its own name: it is read before it is written.
  std::error_code error;
  const bool in_place = std::filesystem::equivalent(options.out, options.continue_from, error);
  const std::string archive = options.archive.empty() ? "" : archive_path(options.archive);
  TESSERA_TRY_ASSIGN(std::vector<NamedFile> inputs, cloud_files(options));
  inputs.push_back({kMapFileSettings["--continue"], in_place ? "" : options.continue_from});
  inputs.push_back({kMapSettings["--archive"], archive});
  inputs.push_back({kMapSettings["--kernels"], options.kernels});
  inputs.push_back({kMapFileSettings["--prior-map"], options.prior_map});
  for (const std::string& path : options.corrections) inputs.push_back({"--corrections", path});
  return check_outputs({{"--out", options.out}, {"--report", options.report}}, inputs,
                       dataset_folder(options));
}

/// The robot, and the frame of the map if the folder has it.
Outcome<MapIdentity> identity_of(const MapOptions& options) {
  MapIdentity identity{.robot = options.robot.value_or(0)};
  const std::string path = options.folder() + "/T_global_map.txt";
  if (!std::filesystem::exists(path)) return identity;
  TESSERA_TRY_ASSIGN(const Matrix34d T_global_map, read_transform(path));
  identity.has_T_global_map = true;
  identity.T_global_map = T_global_map;
  return identity;
}

/// The part of the map that exists already.
struct Earlier {
  std::optional<ArchiveContent> archive;
  std::optional<MapFileHeader> header;
  std::optional<Octree> prior_map;
  bool spilled = false;  ///< The archive is the one beside the output.
};

Outcome<void> take_up(const MapOptions& options, const Earlier& earlier, const MapSetup& setup,
                      std::size_t max_points, LocalMap& map) {
  if (!earlier.archive) return load_earlier(options, *earlier.header, setup, max_points, map);
  // The archive has all of it, and the window reloads what it needs.
  map.restore_revision(earlier.archive->revision);
  warn_of_another_mode(options, *earlier.header, setup);
  return {};
}

Outcome<void> write_map(const MapOptions& options, const MapIdentity& identity, MapWindow* window,
                        MapSubmaps* submaps, Mapper& mapper, MapRun& run) {
  LocalMap& map = mapper.map();
  run.calibration = calibration_of(map);
  if (submaps != nullptr) {
    TESSERA_TRY_ASSIGN(run.file, submaps->finish(mapper));
    submaps->describe(run);
    return {};
  }
  run.usage = map.usage();
  run.blocks = window == nullptr ? map.block_count() : window->blocks();
  run.free_voxels = map.count_free_voxels();
  if (window == nullptr || !window->has_archive()) {
    std::vector<KeyedIndex> workspace = workspace_for(map);
    TESSERA_TRY_ASSIGN(run.file, save_map(map, identity, workspace, options.out));
    return {};
  }
  TESSERA_TRY_ASSIGN(run.file, window->save_whole(map, identity, options.out));
  return {};
}

/// After all checks: maps the scans, writes map and report.
Outcome<void> map_scans(const MapOptions& options, MapSetup& setup, const RecordedScans& source,
                        Earlier& earlier) {
  if (!options.archive.empty()) {
    setup.archive_bytes = ArchiveFile::required_bytes(
        setup.map, source.classes().table().num_components(),
        archive_blocks(setup, earlier.archive ? &*earlier.archive : nullptr));
  }
  RegistrarConfig registration = source.registration();
  registration.body = setup.inference.body;
  TESSERA_TRY_ASSIGN(const std::unique_ptr<Registrar> registrar, Registrar::make(registration));
  TESSERA_TRY_ASSIGN(const ScanCapacity capacity, split_budget(setup, source.max_points()));
  TESSERA_TRY_ASSIGN(MapIdentity own, identity_of(options));
  MapIdentity identity = earlier.header ? earlier.header->identity : own;
  Json config = to_json(options, setup);
  config["robot"] = identity.robot;
  TESSERA_TRY(record_settings(settings_of(config), identity));
  if (!options.in_submaps()) set_up_spilling(options, setup);
  if (setup.window && setup.deadline_us == 0) move_all_at_once(*setup.window);
  let_near_blocks_leave(setup, setup.deadline_us == 0);
  TESSERA_TRY_ASSIGN(HeldMapper held, make_mapper(setup, capacity, source.classes().table()));
  Mapper& mapper = *held;
  if (earlier.header) {
    TESSERA_TRY(take_up(options, earlier, setup, source.max_points(), mapper.map()));
  }
  std::unique_ptr<MapWindow> window;
  if (setup.window) {
    TESSERA_TRY_ASSIGN(std::unique_ptr<MapWindow> made,
                       MapWindow::make(options, setup, identity, earlier.archive, mapper));
    window = std::move(made);
  }
  MapRun run;
  if (earlier.prior_map) {
    const auto weight = static_cast<float>(*options.complete().prior_map_weight);
    run.prior_map = add_prior_map(*earlier.prior_map, weight, mapper.map());
    earlier.prior_map.reset();  // A file of up to a gigabyte.
  }
  run.blocks_before = window != nullptr ? window->blocks() : mapper.map().block_count();
  run.labels = config["labels"].get<std::string>();
  run.budget_bytes = setup.budget_bytes;
  run.scratch_bytes = mapper.scratch_bytes();
  run.deadline_us = setup.deadline_us;
  run.scans.reserve(source.num_scans());
  std::unique_ptr<MapSubmaps> submaps;
  if (options.in_submaps()) {
    TESSERA_TRY_ASSIGN(submaps, MapSubmaps::make(options, identity, mapper.map()));
  }
  stop_by_signals(interrupted);
  TESSERA_TRY(integrate_all(source, *registrar, mapper, window.get(), submaps.get(), run));
  if (run.scans.empty())
    return Failure{"interrupted before the first scan was mapped; nothing was written",
                   FailureKind::kFailure};
  TESSERA_TRY(check_some_integrated(run, setup.map.resolution_m));
  const Outcome<void> written =
      write_map(options, identity, window.get(), submaps.get(), mapper, run);
  if (!written.ok() && run.obstacle && window->has_archive())
    return Failure{*run.obstacle + ", and " + written.failure().message +
                       fmt::format(". {} has what left memory before scan {}", window->path(),
                                   run.scans.size()),
                   FailureKind::kFailure};
  if (!written.ok()) return written.failure();
  if (window != nullptr && (setup.window->keep_while_room ? window->has_archive() : true))
    run.window = window->report(mapper.window());
  print_summary(run, options.out);
  Json report = to_json(run, config);
  if (submaps != nullptr) {
    submaps->write(report);
    std::printf("  submaps  %s\n", submaps->summary().c_str());
  }
  const Outcome<void> reported = write_report(report, options.report);
  if (!reported.ok()) return reported;
  const bool spilled = earlier.spilled || (window != nullptr && setup.window->keep_while_room);
  const bool beside = spilled && window != nullptr && window->has_archive();
  if (run.interrupted)
    return interruption(options,
                        submaps != nullptr ? ""
                        : beside           ? window->path()
                                           : options.out,
                        run, source.num_scans());
  // The map file has all of it now.
  if (beside) window->remove_archive();
  if (run.obstacle)
    return out_of_memory(options, setup, source.max_points(), run, source.num_scans());
  // Who gives a deadline or a window sees what a robot would lose.
  const bool makes_room = submaps != nullptr || (setup.window && setup.window->keep_while_room);
  const bool keeps_all = makes_room && setup.deadline_us == 0;
  return keeps_all ? check_nothing_lost(setup, run) : Outcome<void>();
}

Outcome<void> run_map(MapOptions& options) {
  TESSERA_TRY(check_source(options));
  TESSERA_TRY(check_submaps(options));
  TESSERA_TRY_ASSIGN(const bool spilled, find_spilled(options));
  Outcome<MapSetup> setup = set_up(options);
  if (!setup.ok()) return setup.failure();
  TESSERA_TRY(check_body(setup->inference.body, Matrix34d::Identity(), "the sensor"));
  // Before the work, so that an unwritable output is reported at once.
  TESSERA_TRY(check_places(options));
  TESSERA_TRY_ASSIGN(const std::unique_ptr<RecordedScans> source,
                     open_source(options, {.motion = needs_stamps(options), .no_returns = true}));
  Earlier earlier;
  earlier.spilled = spilled;
  TESSERA_TRY_ASSIGN(std::optional<ArchiveContent> archive, find_archive(options.archive));
  earlier.archive = std::move(archive);
  TESSERA_TRY_ASSIGN(std::optional<MapFileHeader> header, earlier_map(options, earlier.archive));
  earlier.header = std::move(header);
  if (earlier.header) {
    TESSERA_TRY(adopt_settings(*earlier.header, *source, options));
    setup = set_up(options);
    if (!setup.ok()) return setup.failure();
    setup->map = earlier.header->config;
    setup->map.label_votes = needs_votes(options.inference, setup->map.resolution_m);
  }
  if (!options.prior_map.empty()) {
    TESSERA_TRY_ASSIGN(Octree octree, read_prior_map(options.prior_map, setup->map.resolution_m));
    earlier.prior_map = std::move(octree);
  }
  return map_scans(options, *setup, *source, earlier);
}

}  // namespace

void add_map_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("map", "Integrate a sequence of scans into one robot's local map");
  auto options = std::make_shared<MapOptions>();
  declare_settings(*command, kSourceSettings, *options);
  declare_settings(*command, kMapFileSettings, *options);
  declare_settings(*command, kMapSettings, *options);
  command
      ->add_option("--corrections", options->corrections,
                   "Corrected poses, which move the submaps: a row for each of the first scans, or "
                   "with stamps; may be repeated, each is applied after its last scan")
      ->type_name("FILE");
  command->footer(
      "Example: tessera map --dataset semantickitti_08 --last 5 --max-range 40 --out map.tsm "
      "--report map.json");
  command->callback([options, &exit_status] {
    const Outcome<void> outcome = run_map(*options);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
