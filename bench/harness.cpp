// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "harness.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "base/atomic_file.hpp"
#include "base/input_file.hpp"
#include "scenes.hpp"

namespace tessera::bench {

namespace {

constexpr std::size_t kBins = 24;

Json histogram(const std::vector<double>& sorted) {
  const double low = sorted.front();
  const double width = (sorted.back() - low) / static_cast<double>(kBins);
  std::array<std::uint64_t, kBins> counts{};
  for (const double value : sorted) {
    const double place = width > 0.0 ? (value - low) / width : 0.0;
    ++counts[std::min(static_cast<std::size_t>(place), kBins - 1)];
  }
  return {{"from", low}, {"bin", width}, {"counts", counts}};
}

int tell(const char* name, const Failure& failure) {
  std::fprintf(stderr, "%s: %s\n", name, failure.text().c_str());
  return failure.kind == FailureKind::kUsage ? 1 : 2;
}

Json build_of_this_program() {
  return {{"compiler", TESSERA_BENCH_COMPILER},
          {"flags", TESSERA_BENCH_FLAGS},
          {"asserts", TESSERA_BENCH_ASSERTS != 0}};
}

}  // namespace

void Times::append(const Times& more) {
  ms.insert(ms.end(), more.ms.begin(), more.ms.end());
  cpu_ms.insert(cpu_ms.end(), more.cpu_ms.begin(), more.cpu_ms.end());
}

double quantile(const std::vector<double>& sorted, double q) {
  if (sorted.empty()) return 0.0;
  const double rank = std::ceil(q * static_cast<double>(sorted.size()));
  const auto place = static_cast<std::size_t>(std::max(rank, 1.0)) - 1;
  return sorted[std::min(place, sorted.size() - 1)];
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return quantile(values, 0.5);
}

Json statistics(const std::vector<double>& values) {
  if (values.empty()) return {{"count", 0}};
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  return {{"count", sorted.size()},          {"min", sorted.front()},
          {"median", quantile(sorted, 0.5)}, {"p99", quantile(sorted, 0.99)},
          {"p999", quantile(sorted, 0.999)}, {"max", sorted.back()},
          {"histogram", histogram(sorted)},  {"values", values}};
}

Outcome<void> write_json(const Json& json, const std::string& path) {
  TESSERA_TRY_ASSIGN(AtomicFile file, AtomicFile::open(path));
  const std::string text = json.dump(1) + "\n";
  file.write(std::as_bytes(std::span(text)));  // commit() tells a failure
  return file.commit();
}

std::string hex64(std::uint64_t value) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(value));
  return text.data();
}

Outcome<Records> Records::load(const std::string& path, const std::string& input) {
  Records records;
  records.input_ = input;
  if (path.empty()) return records;
  TESSERA_TRY_ASSIGN(const std::string text, read_text_file(path, std::size_t{1} << 20U));
  const Json all = Json::parse(text, nullptr, false);
  if (!all.is_object()) return Failure{path + " is not JSON; restore it from the repository"};
  if (all.contains(input)) records.known_ = all[input]["digests"];
  return records;
}

void Records::check(const std::string& name, std::uint64_t digest) {
  results_[name] = hex64(digest);
  recorded_[name] = known_.contains(name) ? known_[name] : Json();
  if (known_.contains(name) && known_[name] != results_[name]) differing_.push_back(name);
}

Json Records::to_json() const {
  return {{"input", input_}, {"results", results_}, {"recorded", recorded_}};
}

int run(int argc, char** argv, const char* name,
        Outcome<Json> (*measure)(const Options& options, Records& records)) {
  Options options;
  CLI::App app(std::string("Benchmark: ") + name);
  app.add_option("--dataset", options.dataset, "Folder of the sequence")->required();
  app.add_option("--out", options.out, "JSON file to write")->required();
  app.add_option("--digests", options.digests, "Recorded digests to compare with");
  app.add_option("--first", options.first, "First scan");
  app.add_option("--last", options.last, "Last scan, inclusive");
  app.add_option("--repetitions", options.repetitions, "How often the sequence is mapped")
      ->check(CLI::Range(1, 100000));
  app.add_option("--resolution", options.resolution_m, "Edge of a voxel, metres")
      ->check(CLI::Range(0.01, 10.0));
  CLI11_PARSE(app, argc, argv);
  const Outcome<std::string> input = digest_of_input(options);
  if (!input.ok()) return tell(name, input.failure());
  Outcome<Records> records = Records::load(options.digests, *input);
  if (!records.ok()) return tell(name, records.failure());
  Outcome<Json> findings = measure(options, *records);
  if (!findings.ok()) return tell(name, findings.failure());
  Json json = {
      {"bench", name}, {"build", build_of_this_program()}, {"digests", records->to_json()}};
  json.update(*findings);
  const Outcome<void> written = write_json(json, options.out);
  if (!written.ok()) return tell(name, written.failure());
  for (const std::string& differing : records->differing()) {
    std::fprintf(stderr, "%s: the result of %s is not the one on record: the figures are void\n",
                 name, differing.c_str());
  }
  return records->differing().empty() ? 0 : 3;
}

}  // namespace tessera::bench
