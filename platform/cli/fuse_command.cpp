// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera fuse: fuses local maps into one global map by label diffusion.
#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <optional>

#include "base/allocation_counter.hpp"
#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "base/progress.hpp"
#include "cli/command.hpp"
#include "cli/setting_options.hpp"
#include "maps/fuse_sessions.hpp"
#include "maps/fusion_run.hpp"
#include "maps/session_file.hpp"

namespace tessera {

namespace {

constexpr Setting kFuseFileRows[] = {
    path_row<&FuseOptions::out>({"--out"}, "Global map to write",
                                {.value = "MAP.tsm", .required = "a file"}),
    path_row<&FuseOptions::report>({"--report"}, "JSON report to write", {.value = "FILE"}),
};
constexpr SettingTable<FuseOptions> kFuseFileSettings{kFuseFileRows};

void print_summary(const FuseRun& run, const std::vector<FuseInput>& inputs, const std::string& out,
                   bool aligned) {
  const auto count = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  const auto is_session = [](const FuseInput& input) { return input.session.has_value(); };
  const auto sessions =
      static_cast<std::size_t>(std::count_if(inputs.begin(), inputs.end(), is_session));
  std::printf("%s into %s: %llu voxels labelled or occupied, %llu free, %llu in the overlap\n",
              counted(inputs.size() - sessions, "map").c_str(), out.c_str(),
              count(run.usage.label_voxels), count(run.free_voxels), count(run.report.nodes));
  std::printf("  %s diffusion, %d iterations over %g m, residual %.3g\n",
              to_string(run.config.diffusion.mode), run.config.diffusion.iterations,
              decimal_of(run.config.diffusion.length_m), run.report.residual);
  std::printf("  mean variance of the label in the overlap %.3g, of undiffused evidence %.3g\n",
              run.report.mean_variance, run.report.mean_variance_undiffused);
  std::printf("  %.1f MB used of %.1f MB, %.1f MB of it the map\n",
              static_cast<double>(run.report.used_bytes) / 1e6,
              static_cast<double>(run.budget_bytes) / 1e6,
              static_cast<double>(run.usage.used_bytes) / 1e6);
  std::printf("  %.0f ms to publish, %.0f ms to fuse; digest %s\n", run.publish_ms, run.fuse_ms,
              hex64(run.digest).c_str());
  for (const FuseInput& input : inputs) {
    if (input.session)
      std::printf("  session %s of %s, weight %g\n", input.path.c_str(),
                  date_text(input.session->date_s).c_str(), weight_of(*input.session));
  }
  for (const JudgedRobot& robot : run.robots) {
    if (robot.whole.judged != 0)
      std::printf("  robot %u has the label of most others at %.1f %% of %llu voxels\n",
                  robot.whole.robot, 100.0 * static_cast<double>(robot.whole.agreement),
                  count(robot.whole.judged));
  }
  for (const PairAlignment& pair : run.pairs) {
    if (pair.frame)
      std::printf("  %s and %s: surfaces agree at %.1f %% of what stands and both have seen\n",
                  inputs[pair.first].path.c_str(), inputs[pair.second].path.c_str(),
                  100.0 * (aligned ? pair.frame->agreement : pair.frame->agreement_guess).share());
    if (!pair.labels) continue;
    std::printf("  %s and %s: the same class at %.1f %% of common voxels\n",
                inputs[pair.first].path.c_str(), inputs[pair.second].path.c_str(),
                100.0 * pair.labels->agreement());
  }
}

void warn_of(const std::vector<Message>& warnings) {
  for (const Message& warning : warnings) warn(warning);
}

/// Finds or judges frames with a progress bar; to judge one pair is no long work.
Outcome<std::vector<PairAlignment>> compare_pairs(const FuseOptions& options, bool with_sessions,
                                                  std::vector<FuseInput>& inputs,
                                                  std::vector<Message>& warnings) {
  std::optional<Progress> bar;
  const auto show = [&](std::uint64_t hundredths, std::uint64_t pairs) {
    if (!options.align && pairs == 1) return;
    if (!bar) bar.emplace(options.align ? "finding frames" : "comparing maps", 100 * pairs);
    const std::uint64_t at = std::min(hundredths / 100 + 1, pairs);
    bar->update(hundredths, fmt::format("pair {} of {}", at, pairs));
  };
  TESSERA_TRY_ASSIGN(std::vector<PairAlignment> pairs,
                     pairs_of(options, with_sessions, inputs, warnings, show));
  if (bar) bar->finish();
  return pairs;
}

/// Fuses with a progress bar, and counts heap allocations.
Outcome<void> fuse_all(FusionRun& fusion, const std::vector<FuseInput>& inputs) {
  const std::optional<std::uint64_t> before = heap_allocations();
  std::optional<Progress> bar;
  TESSERA_TRY(fusion.fuse(inputs, [&bar](std::uint32_t done, std::uint32_t total) {
    if (!bar) bar.emplace("fusing", total);
    bar->update(done);
  }));
  if (bar) bar->finish();
  const std::optional<std::uint64_t> after = heap_allocations();
  if (before && after) fusion.run().heap_allocations = *after - *before;
  return {};
}

Outcome<void> run_fuse(const FuseOptions& options) {
  TESSERA_TRY(check_number_of_maps(options.maps.size(), options.sessions.size()));
  std::vector<std::string> transforms = options.transforms;
  TESSERA_TRY_ASSIGN(const std::vector<SessionOptions> sessions,
                     parse_sessions(options.sessions, transforms));
  std::vector<NamedFile> files = files_of(options.maps, options.transforms, "FILE");
  for (const SessionOptions& session : sessions) files.push_back({kSessionSetting, session.file});
  TESSERA_TRY(check_outputs({{"--out", options.out}, {"--report", options.report}}, files));
  std::vector<Message> warnings;
  TESSERA_TRY_ASSIGN(std::vector<FuseInput> inputs,
                     load_inputs(options.maps, transforms, warnings));
  warn_of(warnings);
  TESSERA_TRY(check_number_of_robots(inputs));
  TESSERA_TRY_ASSIGN(const DiffusionConfig diffusion,
                     diffusion_of(options.diffusion, inputs.front().stored->map.config()));

  warnings.clear();
  TESSERA_TRY_ASSIGN(const std::vector<PairAlignment> pairs,
                     compare_pairs(options, !sessions.empty(), inputs, warnings));
  TESSERA_TRY(add_sessions(sessions, inputs, warnings));
  TESSERA_TRY_ASSIGN(const std::unique_ptr<FusionRun> fusion,
                     FusionRun::prepare(inputs, options, diffusion));
  std::vector<Message> of_frames;
  warn_of_no_frame(inputs, of_frames);
  warn_of(of_frames);
  warn_of(warnings);
  TESSERA_TRY(fuse_all(*fusion, inputs));
  FuseRun& run = fusion->run();
  run.pairs = pairs;
  const Json config_json = to_json(options, run.config);
  MapIdentity identity{.kind = MapKind::kGlobal};
  TESSERA_TRY(record_settings(record_of(inputs, config_json), identity));
  std::vector<KeyedIndex> workspace = workspace_for(fusion->map());
  TESSERA_TRY_ASSIGN(const MapSummary file,
                     save_map(fusion->map(), identity, workspace, options.out));
  fusion->measure(file.digest);
  warn_of(losses_of(run));
  warn_of(doubts_of(run, inputs.front().stored->map.classes()));
  print_summary(run, inputs, options.out, options.align);
  return write_report(to_json(run, inputs, config_json), options.report);
}

}  // namespace

void add_fuse_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("fuse", "Fuse local maps into one global map by label diffusion");
  auto o = std::make_shared<FuseOptions>();
  command
      ->add_option("MAPS", o->maps,
                   "Two or more local maps, or one and sessions, with the same resolution, "
                   "classes, prior and weight of a pass")
      ->required()
      ->type_name("MAP.tsm");
  declare_settings(*command, kFuseFileSettings, *o);
  command
      ->add_option("--transform", o->transforms,
                   "4x4 matrix T_global_map of a map, row by row; once for each map "
                   "[stored in the map, else the identity]")
      ->allow_extra_args(false)
      ->type_name("MAP.tsm=T.txt");
  command
      ->add_option("--session", o->sessions,
                   "A map of an earlier day that counts less than the maps, with the weight of its "
                   "evidence; once for each, up to 8 [weight 0.5]")
      ->allow_extra_args(false)
      ->type_name("MAP.tsm[:WEIGHT]");
  declare_settings(*command, kDiffusionSettings, o->diffusion);
  declare_settings(*command, kFuseSettings, *o);
  command->footer(
      "Example: tessera fuse robot_0.tsm robot_1.tsm --transform robot_1.tsm=T.txt --out "
      "global.tsm --report fuse.json");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_fuse(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
