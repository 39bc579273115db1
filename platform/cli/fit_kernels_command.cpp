// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera fit-kernels: kernels by class for the mode lattice, from scans with true labels.
#include <cstdio>
#include <memory>
#include <span>
#include <utility>

#include "base/atomic_file.hpp"
#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "cli/command.hpp"
#include "cli/fitted_kernels.hpp"
#include "cli/setting_options.hpp"

namespace tessera {

namespace {

constexpr Setting kFitRows[] = {
    path_row<&FitOptions::out>({"--out"}, "File of kernels to write",
                               {.value = "FILE", .required = "a file"}),
    path_row<&FitOptions::report>({"--report"}, "JSON report to write", {.value = "FILE"}),
    row<&FitOptions::first>({"--first"}, "Number of the first scan",
                            {.value = "N", .otherwise = "the first", .allowed = {.least = 0.0}}),
    row<&FitOptions::last>({"--last"}, "Number of the last scan, itself included",
                           {.value = "N", .otherwise = "the last", .allowed = {.least = 0.0}}),
    row<&FitOptions::truth>({"--truth"}, "Folder of true labels", {.value = "FOLDER"}),
    row<&FitOptions::input>({"--labels"}, "Folder of the labels that maps are made from",
                            {.value = "FOLDER"}),
    row<&FitOptions::map, &MapOptions::resolution_m>(
        {"--resolution"}, "Edge of a voxel",
        {.value = "M", .otherwise = "0.1", .allowed = from_to(0.001, 100.0, "metres")}),
    row<&FitOptions::map, &MapOptions::max_range_m>(
        {"--max-range"}, "Farther returns do not count; 0: no limit",
        {.value = "M", .allowed = from_to(0.0, 1e6, "metres")}),
    bytes_row<&FitOptions::map, &MapOptions::memory_bytes>(
        {"--memory"}, "Memory for a map and for the work on a scan",
        {.value = "BYTES", .allowed = {.most = 1e15}}),
};
constexpr SettingTable<FitOptions> kFitSettings{kFitRows};

std::vector<NamedKernel> kernels_of(const KernelChoice& choice) {
  std::vector<NamedKernel> kernels;
  for (std::size_t i = 0; i < choice.names.size(); ++i) {
    const ClassKernel kernel = KernelGrid::kernel(choice.kernels[i]);
    kernels.push_back({choice.names[i], decimal_of(kernel.reach_m), decimal_of(kernel.height_m)});
  }
  return kernels;
}

void print_fit(const KernelFit& fit, const FitResult& result) {
  const KernelChoice one = fit.of_one({});
  std::printf("  %-20s %8s %8s %10s %8s %8s\n", "class", "reach m", "height m", "one kernel",
              "fitted", "gain");
  for (std::size_t i = 0; i < result.fitted.names.size(); ++i) {
    const std::string& name = result.fitted.names[i];
    const double before = fit.iou(one, name);
    if (before < 0.0) continue;
    const double after = fit.iou(result.fitted, name);
    const ClassKernel kernel = KernelGrid::kernel(result.fitted.kernels[i]);
    std::printf("  %-20s %8.2f %8.2f %10.4f %8.4f %+8.2f\n", name.c_str(),
                static_cast<double>(kernel.reach_m), static_cast<double>(kernel.height_m), before,
                after, 100.0 * (after - before));
  }
  std::printf("mean IoU: input %.4f, one kernel %.4f, by names %.4f, fitted %.4f\n", result.input,
              result.one, result.by_name, result.by_class);
  if (!result.apart_one) return;
  std::printf("  scans that were left out of the fit: one kernel %.4f, fitted %.4f (%+.2f)\n",
              *result.apart_one, *result.apart_by_class,
              100.0 * (*result.apart_by_class - *result.apart_one));
}

Json report_of(const FitOptions& options, const FitResult& result) {
  Json json;
  json["mean_iou"] = {{"input", result.input},
                      {"one_kernel", result.one},
                      {"by_names", result.by_name},
                      {"fitted", result.by_class}};
  if (result.apart_one)
    json["mean_iou_left_out"] = {{"one_kernel", *result.apart_one},
                                 {"fitted", *result.apart_by_class}};
  for (const NamedKernel& kernel : kernels_of(result.fitted))
    json["kernels"][kernel.name] = {kernel.reach_m, kernel.height_m};
  json["config"] = {{"datasets", options.datasets},
                    {"labels", options.input},
                    {"truth", options.truth},
                    {"without", options.without},
                    {"resolution", *options.map.complete().resolution_m},
                    {"max_range", options.map.max_range_m},
                    {"first", options.first ? Json(*options.first) : Json()},
                    {"last", options.last ? Json(*options.last) : Json()},
                    {"memory", options.map.memory_bytes},
                    {"out", options.out},
                    {"report", options.report}};
  return json;
}

Outcome<void> run_fit(const FitOptions& options) {
  for (const std::string& folder : {options.truth, options.input}) {
    if (folder == kNoLabels || folder == kCameraLabels)
      return Failure{"--truth and --labels need folders of labels; " + folder + " is none"};
  }
  for (const std::string& path : options.datasets)
    TESSERA_TRY(check_outputs({{"--out", options.out}, {"--report", options.report}}, {},
                              {path, {options.truth, options.input}}));
  std::vector<FitData> data;
  double input = 0.0;
  for (const std::string& path : options.datasets) {
    TESSERA_TRY_ASSIGN(FittedSet set, read_fit_data(options, path));
    input += set.input.mean_iou(set.data.classes.num_classes());
    data.push_back(std::move(set.data));
  }
  const KernelFit fit(data);
  FitResult result = fit_all(data, fit);
  result.input = input / static_cast<double>(data.size());
  print_fit(fit, result);
  const std::string text = "# Kernels by class for the mode lattice, fitted by fit-kernels.\n" +
                           text_of(kernels_of(result.fitted));
  TESSERA_TRY(write_report(report_of(options, result), options.report));
  TESSERA_TRY_ASSIGN(AtomicFile file, AtomicFile::open(options.out));
  static_cast<void>(file.write(std::as_bytes(std::span(text))));
  return file.commit();
}

}  // namespace

void add_fit_kernels_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("fit-kernels", "Fit the kernels of the mode lattice to true labels");
  auto o = std::make_shared<FitOptions>();
  command
      ->add_option("--dataset", o->datasets,
                   "Folder in the KITTI layout, with labels and true labels; may be repeated")
      ->required()
      ->type_name("DIR");
  declare_settings(*command, kFitSettings, *o);
  declare_without(*command, o->without);
  command->footer(
      "Example: tessera fit-kernels --dataset semantickitti_08 --last 5 --out kernels.toml");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_fit(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
