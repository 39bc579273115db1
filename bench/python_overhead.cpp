// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The C++ side of python_overhead.py: for each line on stdin one scan is integrated into an emptied
// map, and the nanoseconds that it took are printed, of the clock and of the processor.
#include <chrono>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string_view>
#include <vector>

#include "maps/held_mapper.hpp"
#include "settings/map_options.hpp"

namespace {

using namespace tessera;

std::vector<char> bytes_of(const char* path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::int64_t processor_ns() {
  std::timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

/// The scan's files: points, x y z and intensity, and a component each; and the class table's size.
int run(const char* points_path, const char* components_path, bool free_space) {
  const std::vector<char> points = bytes_of(points_path);
  const std::vector<char> components = bytes_of(components_path);
  if (components.empty() || points.size() != 16 * components.size()) {
    std::fprintf(stderr, "python_overhead: the files are not a scan\n");
    return 1;
  }
  MapOptions options;
  options.free_space = free_space;
  Outcome<MapSetup> setup = set_up(options);
  if (!setup.ok()) return 1;
  const Outcome<ScanCapacity> capacity = split_budget(*setup, ScanCapacity{}.points);
  if (!capacity.ok()) return 1;
  ClassTable classes;
  for (int label = 1; label <= 19; ++label)
    static_cast<void>(classes.add("class " + std::to_string(label), {}));
  const Outcome<HeldMapper> mapper = make_mapper(*setup, *capacity, classes);
  if (!mapper.ok()) return 1;
  ScanView scan;
  scan.points = reinterpret_cast<const float*>(points.data());
  scan.count = components.size();
  scan.components = reinterpret_cast<const std::uint8_t*>(components.data());
  for (std::string line; std::getline(std::cin, line);) {
    (*mapper)->map().clear();
    const std::int64_t busy_ns = processor_ns();
    const auto start = std::chrono::steady_clock::now();
    const ScanReport report = (*mapper)->integrate(scan, 0);
    const std::chrono::nanoseconds took = std::chrono::steady_clock::now() - start;
    std::printf("%lld %lld %u\n", static_cast<long long>(took.count()),
                static_cast<long long>(processor_ns() - busy_ns), report.admitted);
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: python_overhead POINTS COMPONENTS on|off\n");
    return 1;
  }
  return run(argv[1], argv[2], std::string_view(argv[3]) == "on");
}
