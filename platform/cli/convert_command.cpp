// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera convert: writes recorded scans of any format as a dataset in the KITTI layout.
#include <fmt/core.h>

#include <atomic>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "base/input_file.hpp"
#include "base/json.hpp"
#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "base/progress.hpp"
#include "base/stop_signals.hpp"
#include "cli/command.hpp"
#include "cli/open_source.hpp"
#include "cli/registration_report.hpp"
#include "cli/setting_options.hpp"
#include "scans/kitti_writer.hpp"
#include "scans/recorded_source.hpp"

namespace tessera {

namespace {

std::atomic<bool> interrupted{false};

struct ConvertOptions {
  SourceOptions source;
  std::string out;
  std::string report;

  /// Points stay where they were measured, and what corrects them is written too.
  [[nodiscard]] bool keeps_motion() const { return source.deskew == false; }
};

constexpr Setting kConvertRows[] = {
    path_row<&ConvertOptions::out>({"--out"}, "Folder to write, new or empty, required",
                                   {.value = "DIR"}),
    path_row<&ConvertOptions::report>({"--report"}, "JSON report to write", {.value = "FILE"}),
};
constexpr SettingTable<ConvertOptions> kConvertSettings{kConvertRows};

/// What was written.
struct Converted {
  std::uint64_t scans = 0;
  std::uint64_t points = 0;
  std::uint64_t unknown_ids = 0;
  RegistrarReport registration{};
};

Outcome<void> check_usage(const ConvertOptions& options) {
  TESSERA_TRY(check_source(options.source));
  if (options.out.empty()) return Failure{"--out has no name; name the folder to write"};
  TESSERA_TRY_ASSIGN(const std::vector<NamedFile> inputs, cloud_files(options.source));
  return check_outputs({{"--report", options.report}}, inputs, dataset_folder(options.source));
}

/// The files that go with the scans of any format.
Outcome<void> copy_descriptions(const std::string& from, KittiWriter& writer) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 20U;
  for (const char* const name : {"classes.toml", "T_global_map.txt"}) {
    const std::string path = (std::filesystem::path(from) / name).string();
    std::error_code error;
    if (!std::filesystem::exists(path, error)) continue;
    TESSERA_TRY_ASSIGN(const std::string text, read_text_file(path, kMostBytes));
    TESSERA_TRY(writer.add_file(name, text));
  }
  return {};
}

Failure stopped(const ConvertOptions& options, std::size_t done, std::size_t num_scans) {
  return {fmt::format("interrupted after scan {} of {}; {} has no poses.txt, remove it", done,
                      num_scans, options.out),
          FailureKind::kFailure};
}

Outcome<Converted> convert(const ConvertOptions& options, const RecordedScans& scans,
                           KittiWriter& writer) {
  TESSERA_TRY_ASSIGN(const std::unique_ptr<Registrar> registrar,
                     Registrar::make(scans.registration()));
  RecordedSource source(scans);
  Progress progress("converting", scans.num_scans());
  Converted converted;
  while (!source.ended()) {
    if (interrupted.load(std::memory_order_relaxed))
      return stopped(options, writer.num_scans(), scans.num_scans());
    Scan* const scan = source.front();
    if (scan == nullptr) return source.outcome().failure();
    if (options.keeps_motion()) scan->has_times = false;
    ScanView view;
    if (!registrar->view(*scan, view)) return does_not_suit(*scan);
    TESSERA_TRY(writer.add(*scan, view));
    converted.registration.add(registrar->last());
    converted.points += view.count;
    source.pop();
    progress.update(writer.num_scans());
  }
  progress.finish();
  converted.scans = writer.num_scans();
  converted.unknown_ids = source.counters().unknown_ids;
  return converted;
}

Json report_of(const ConvertOptions& options, const Converted& converted) {
  Json config = to_json(options.source);
  config["out"] = options.out;
  config["report"] = options.report;
  Json json = {{"scans", converted.scans},
               {"points", converted.points},
               {"unknown_ids", converted.unknown_ids},
               {"config", config}};
  write_registration(converted.registration, json);
  return json;
}

Outcome<void> run_convert(const ConvertOptions& options) {
  TESSERA_TRY(check_usage(options));
  TESSERA_TRY_ASSIGN(
      const std::unique_ptr<RecordedScans> scans,
      open_source(options.source, {.motion = true, .times = options.keeps_motion()}));
  const bool with_times = options.keeps_motion() && scans->has_times();
  // Later commands would move the points, and not the labels that were projected onto them.
  if (with_times && options.source.labels == kCameraLabels)
    return Failure{
        "--labels cameras needs points that are corrected for motion; leave --deskew out"};
  TESSERA_TRY_ASSIGN(KittiWriter writer,
                     KittiWriter::create(options.out, scans->classes(), with_times));
  stop_by_signals(interrupted);
  TESSERA_TRY(copy_descriptions(options.source.folder(), writer));
  TESSERA_TRY_ASSIGN(const Converted converted, convert(options, *scans, writer));
  TESSERA_TRY(writer.finish(scans->motion()));
  std::printf("%s, %s in %s\n", counted(converted.scans, "scan").c_str(),
              counted(converted.points, "point").c_str(), options.out.c_str());
  print_registration(converted.registration);
  if (converted.unknown_ids > 0)
    warn(counted(converted.unknown_ids, "point") +
         " with a raw label id that is in no class; written as unlabelled");
  return write_report(report_of(options, converted), options.report);
}

}  // namespace

void add_convert_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("convert", "Write recorded scans of any format as a KITTI-layout folder");
  auto o = std::make_shared<ConvertOptions>();
  declare_settings(*command, kSourceSettings, o->source);
  declare_settings(*command, kConvertSettings, *o);
  command->footer("Example: tessera convert --pcd clouds --poses poses.txt --out dataset");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_convert(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
