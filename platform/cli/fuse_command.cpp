// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera fuse: fuses local maps into one global map by label diffusion.
#include <algorithm>
#include <cstdio>
#include <optional>

#include "base/allocation_counter.hpp"
#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "base/progress.hpp"
#include "cli/command.hpp"
#include "cli/setting_options.hpp"
#include "maps/fusion_run.hpp"

namespace tessera {

namespace {

constexpr Setting kFuseFileRows[] = {
    path_row<&FuseOptions::out>({"--out"}, "Global map to write",
                                {.value = "MAP.tsm", .required = "a file"}),
    path_row<&FuseOptions::report>({"--report"}, "JSON report to write", {.value = "FILE"}),
};
constexpr SettingTable<FuseOptions> kFuseFileSettings{kFuseFileRows};

void print_summary(const FuseRun& run, const std::vector<FuseInput>& inputs,
                   const std::string& out) {
  const auto count = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  std::printf("%zu maps into %s: %llu label voxels, %llu free ones, %llu in the overlap\n",
              inputs.size(), out.c_str(), count(run.usage.label_voxels), count(run.free_voxels),
              count(run.report.nodes));
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
  for (const PairAlignment& pair : run.pairs) {
    std::printf("  %s and %s: the same class at %.1f %% of common voxels\n",
                inputs[pair.first].path.c_str(), inputs[pair.second].path.c_str(),
                100.0 * pair.alignment.agreement());
  }
}

void warn_of(const std::vector<Message>& warnings) {
  for (const Message& warning : warnings) warn(warning);
}

/// If only some have a frame, arrange_inputs warns.
void warn_of_no_frame(const std::vector<FuseInput>& inputs) {
  const auto placed = [](const FuseInput& input) { return input.placed; };
  if (std::any_of(inputs.begin(), inputs.end(), placed)) return;
  warn(
      "none of the " + std::to_string(inputs.size()) +
      " maps has a T_global_map: their frames are taken for the same one; where they are not, give "
      "--transform MAP.tsm=T.txt for each");
}

/// Fuses with a progress bar, and counts heap allocations.
Outcome<void> fuse_all(FusionRun& fusion, const std::vector<FuseInput>& inputs) {
  const std::optional<std::uint64_t> before = heap_allocations();
  std::optional<Progress> bar;
  const Outcome<void> fused = fusion.fuse(inputs, [&bar](std::uint32_t done, std::uint32_t total) {
    if (!bar) bar.emplace("fusing", total);
    bar->update(done);
  });
  if (!fused.ok()) return fused.failure();
  if (bar) bar->finish();
  const std::optional<std::uint64_t> after = heap_allocations();
  if (before && after) fusion.run().heap_allocations = *after - *before;
  return {};
}

Outcome<void> run_fuse(const FuseOptions& options) {
  const Outcome<void> number = check_number_of_maps(options.maps.size());
  if (!number.ok()) return number.failure();
  const Outcome<void> places = check_outputs({{"--out", options.out}, {"--report", options.report}},
                                             files_of(options.maps, options.transforms, "FILE"));
  if (!places.ok()) return places.failure();
  std::vector<Message> warnings;
  const Outcome<std::vector<FuseInput>> inputs =
      load_inputs(options.maps, options.transforms, warnings);
  if (!inputs.ok()) return inputs.failure();
  warn_of(warnings);
  const Outcome<void> robots = check_number_of_robots(*inputs);
  if (!robots.ok()) return robots.failure();
  const Outcome<DiffusionConfig> diffusion =
      diffusion_of(options.diffusion, inputs->front().stored->map.config());
  if (!diffusion.ok()) return diffusion.failure();

  warnings.clear();
  const std::vector<PairAlignment> pairs = align_inputs(*inputs, warnings);
  warn_of(warnings);
  const Outcome<std::unique_ptr<FusionRun>> fusion =
      FusionRun::prepare(*inputs, options, *diffusion);
  if (!fusion.ok()) return fusion.failure();
  warn_of_no_frame(*inputs);
  const Outcome<void> fused = fuse_all(**fusion, *inputs);
  if (!fused.ok()) return fused.failure();
  (*fusion)->measure();
  FuseRun& run = (*fusion)->run();
  run.pairs = pairs;
  const Json config_json = to_json(options, run.config);
  MapIdentity identity{.kind = MapKind::kGlobal};
  const Outcome<void> recorded = record_settings(record_of(*inputs, config_json), identity);
  if (!recorded.ok()) return recorded.failure();
  std::vector<KeyedIndex> workspace = workspace_for((*fusion)->map());
  const Outcome<void> saved = save_map((*fusion)->map(), identity, workspace, options.out);
  if (!saved.ok()) return saved.failure();
  warn_of(losses_of(run));
  print_summary(run, *inputs, options.out);
  return write_report(to_json(run, *inputs, config_json), options.report);
}

}  // namespace

void add_fuse_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("fuse", "Fuse local maps into one global map by label diffusion");
  auto o = std::make_shared<FuseOptions>();
  command->add_option("MAPS", o->maps, "Local maps with the same resolution and classes")
      ->required()
      ->type_name("MAP.tsm");
  declare_settings(*command, kFuseFileSettings, *o);
  command
      ->add_option("--transform", o->transforms,
                   "MAP.tsm=T.txt: 4x4 matrix T_global_map, row by row [as the map says]")
      ->allow_extra_args(false)
      ->type_name("MAP.tsm=T.txt");
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
