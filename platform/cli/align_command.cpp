// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera align: finds the transform between two maps of one place.
#include <fmt/core.h>

#include <cstdio>
#include <optional>

#include "base/atomic_file.hpp"
#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "base/progress.hpp"
#include "cli/align_picture.hpp"
#include "cli/command.hpp"
#include "cli/setting_options.hpp"
#include "maps/frame_run.hpp"
#include "maps/open_map.hpp"
#include "scans/transform_file.hpp"

namespace tessera {

namespace {

struct AlignOptions {
  std::vector<std::string> maps;
  std::string guess;
  std::string out;
  std::string png;
  std::string report;
};

constexpr Setting kAlignRows[] = {
    path_row<&AlignOptions::guess>(
        {"--guess"}, "4x4 matrix, row by row: roughly the transform from B's frame to A's",
        {.value = "T.txt", .otherwise = "none: any heading, and translations up to 72 m"}),
    path_row<&AlignOptions::out>({"--out"}, "4x4 matrix to write: from B's frame to A's",
                                 {.value = "T.txt"}),
    path_row<&AlignOptions::png>({"--png"}, "Picture of both maps in A's frame to write",
                                 {.value = "FILE"}),
    path_row<&AlignOptions::report>({"--report"}, "JSON report to write", {.value = "FILE"}),
};
constexpr SettingTable<AlignOptions> kAlignSettings{kAlignRows};

Outcome<void> write_transform(const Matrix34d& T, const std::string& path) {
  std::string text;
  for (int row = 0; row < 3; ++row)
    text += fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}\n", T(row, 0), T(row, 1), T(row, 2),
                        T(row, 3));
  text += "0 0 0 1\n";
  TESSERA_TRY_ASSIGN(AtomicFile file, AtomicFile::open(path));
  file.write(std::as_bytes(std::span<const char>(text)));
  return file.commit();
}

void print_agreement(const char* name, const Agreement& agreement) {
  std::printf("  %-9s %5.1f %% of what stands agrees, of %u samples that both have seen", name,
              100.0 * agreement.share(), agreement.agreed + agreement.contradicted);
  if (agreement.labelled != 0)
    std::printf("; the same class at %.1f %% of surfaces",
                100.0 * agreement.same_label / agreement.labelled);
  std::printf("\n");
}

void print(const FrameAnswer& answer, const AlignOptions& options) {
  std::printf("%s and %s: %s\n", options.maps[0].c_str(), options.maps[1].c_str(),
              to_string(answer.verdict));
  const bool is_found = answer.verdict == FrameVerdict::kFound;
  std::printf("  %s%s is %s\n",
              is_found ? "" : "best place, not accepted: ", options.maps[1].c_str(),
              motion_text(answer.T_a_b).c_str());
  if (is_held(answer))
    std::printf("  standard deviation of the direction least held %.3f m, %.2f degrees\n",
                answer.worst_sigma_m, degrees_of(answer.worst_sigma_rad));
  print_agreement(options.guess.empty() ? "before" : "guess", answer.agreement_guess);
  print_agreement("there", answer.agreement);
}

Outcome<FrameQuestion> question_for(const AlignOptions& options, const StoredMap& a,
                                    const StoredMap& b) {
  std::optional<Matrix34d> guess;
  if (!options.guess.empty()) {
    TESSERA_TRY_ASSIGN(guess, read_transform(options.guess));
  }
  return question_of(guess, a.header.identity, b.header.identity);
}

Outcome<FrameAnswer> find(const StoredMap& a, const StoredMap& b, const FrameQuestion& question) {
  TESSERA_TRY_ASSIGN(const std::unique_ptr<FrameRun> run, FrameRun::prepare());
  constexpr std::uint32_t kAll = 100;
  Progress progress("aligning", kAll);
  TESSERA_TRY_ASSIGN(const FrameAnswer answer,
                     run->find(a.map, b.map, question,
                               [&progress](std::uint32_t percent) { progress.update(percent); }));
  progress.update(kAll);
  progress.finish();
  return answer;
}

Outcome<void> run_align(const AlignOptions& options) {
  const std::vector<NamedFile> files{
      {"MAPS", options.maps[0]}, {"MAPS", options.maps[1]}, {"--guess", options.guess}};
  TESSERA_TRY(check_outputs(
      {{"--out", options.out}, {"--png", options.png}, {"--report", options.report}}, files));
  TESSERA_TRY_ASSIGN(const std::unique_ptr<StoredMap> a, open_map(options.maps[0]));
  TESSERA_TRY_ASSIGN(const std::unique_ptr<StoredMap> b, open_map(options.maps[1]));
  TESSERA_TRY_ASSIGN(const FrameQuestion question, question_for(options, *a, *b));
  TESSERA_TRY_ASSIGN(const FrameAnswer answer, find(*a, *b, question));
  print(answer, options);
  if (!options.png.empty())
    TESSERA_TRY(
        write_alignment_png(a->map, b->map, answer.T_a_b, to_string(answer.verdict), options.png));
  Json report = to_json(answer);
  report["config"] = {{"maps", options.maps},
                      {"guess", options.guess},
                      {"out", options.out},
                      {"png", options.png},
                      {"report", options.report}};
  TESSERA_TRY(write_report(report, options.report));
  TESSERA_TRY(check_found(answer, options.maps[0], options.maps[1]));
  return options.out.empty() ? Outcome<void>() : write_transform(answer.T_a_b, options.out);
}

}  // namespace

void add_align_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("align", "Find the transform between two maps of one place");
  auto o = std::make_shared<AlignOptions>();
  command->add_option("MAPS", o->maps, "Two maps, A and B")
      ->required()
      ->expected(2)
      ->type_name("A.tsm B.tsm");
  declare_settings(*command, kAlignSettings, *o);
  command->footer("Example: tessera align a.tsm b.tsm --out T_a_b.txt --png both.png");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_align(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
