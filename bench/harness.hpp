// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the benchmark programs share: their options, statistics of what they timed, records that
// what was computed is still the same, and the JSON file that they leave.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "base/monotonic_clock.hpp"
#include "base/outcome.hpp"
#include "thread_time.hpp"

namespace tessera::bench {

using Json = nlohmann::ordered_json;

struct Options {
  std::string dataset;  ///< Folder of a sequence in the KITTI layout.
  std::string out;      ///< JSON file to write.
  std::string digests;  ///< File of recorded digests; empty: nothing is compared.
  int first = 0;        ///< Scan numbers, inclusive.
  int last = 5;
  int repetitions = 5;  ///< Of the whole sequence, each in an empty map.
  double resolution_m = 0.1;
};

/// Seconds that work takes by the monotonic clock, in microsecond steps: for work of a millisecond
/// and more.
template <class Work>
[[nodiscard]] double seconds_of(Work&& work) {
  const std::int64_t start_us = MonotonicClock::now_us();
  std::forward<Work>(work)();
  return static_cast<double>(MonotonicClock::now_us() - start_us) * 1e-6;
}

/// How long pieces of work took: by the clock, and the time that the thread had a core. Where the
/// two differ, others had the machine.
struct Times {
  std::vector<double> ms;
  std::vector<double> cpu_ms;

  template <class Work>
  void measure(Work&& work) {
    const double cpu_start_ms = thread_cpu_ms();
    ms.push_back(1e3 * seconds_of(std::forward<Work>(work)));
    cpu_ms.push_back(thread_cpu_ms() - cpu_start_ms);
  }
  void append(const Times& more);
};

/// Of sorted values, nearest rank: the smallest that at least the part q of them does not exceed. 0
/// of none.
[[nodiscard]] double quantile(const std::vector<double>& sorted, double q);
[[nodiscard]] double median(std::vector<double> values);

/// count, min, median, p99, p999, max, a histogram of equal bins from min to max, and the values in
/// the order in which they were measured.
[[nodiscard]] Json statistics(const std::vector<double>& values);

/// Digests of what a program computed, compared with those on record for the same input.
class Records {
 public:
  /// Fails with kUsage iff path is not empty and cannot be read as JSON.
  static Outcome<Records> load(const std::string& path, const std::string& input);
  /// Notes a result. It differs iff there is a record for this input and name that says otherwise.
  void check(const std::string& name, std::uint64_t digest);
  [[nodiscard]] const std::vector<std::string>& differing() const { return differing_; }
  /// {input, results: {name: digest}, recorded: {name: digest or null}}.
  [[nodiscard]] Json to_json() const;

 private:
  std::string input_;
  Json known_ = Json::object();
  Json results_ = Json::object();
  Json recorded_ = Json::object();
  std::vector<std::string> differing_;
};

/// Writes a file as a whole. Fails with kFailure iff it cannot be written.
Outcome<void> write_json(const Json& json, const std::string& path);

/// Sixteen hexadecimal digits.
[[nodiscard]] std::string hex64(std::uint64_t value);

/// The main function of every program: reads the options, runs, writes the JSON with the records
/// and the build's compiler and flags. The exit status is 0; 1 for bad options or input, 2 for work
/// that failed, 3 if a result differs from the one on record (the JSON is written even so).
int run(int argc, char** argv, const char* name,
        Outcome<Json> (*measure)(const Options& options, Records& records));

}  // namespace tessera::bench
