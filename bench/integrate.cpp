// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How long does a scan take to integrate, and how does that compare with the plain loop and with
// what the machine's memory allows? One thread. Modes, the plain loop, the memory and the clock
// take turns, so that whatever else the machine does falls on all of them.
#include <cmath>
#include <set>

#include "scenes.hpp"
#include "yardsticks.hpp"

namespace tessera::bench {

namespace {

constexpr std::size_t kBandwidthArrayBytes = std::size_t{128} << 20U;
constexpr std::uint64_t kAdditions = std::uint64_t{1} << 24U;

/// A mode's maps of the scene, and how long each scan took in each of them.
struct ModeRun {
  Mode mode;
  Mapper mapper;
  std::vector<ScanReport> reports;
  std::vector<Times> times;  ///< By scan, then repetition.
};

double work_of(const ScanReport& report) {
  return static_cast<double>(report.evaluations + report.ray_steps);
}

Outcome<void> map_once(ModeRun& run, const Scene& scene, bool timed) {
  run.mapper.map().clear();
  for (std::size_t i = 0; i < scene.scans.size(); ++i) {
    ScanReport report;
    Times time;
    time.measure([&] { report = run.mapper.integrate(scene.scans[i]); });
    if (report.pose != Status::kOk || report.left_out() > 0)
      return Failure{std::string(run.mode.name) + ": a scan did not fit", FailureKind::kFailure};
    if (timed) run.times[i].append(time);
    run.reports[i] = report;
  }
  return {};
}

/// Bytes that adding one scan's sums to a map in memory reads and writes at the least: the scan,
/// and the part of each octet's tuple that the scan has evidence for, read and written once.
std::uint64_t bytes_to_move(Mapper& mapper, const Scan& scan) {
  mapper.map().clear();
  mapper.integrate(scan);
  const LocalMap& map = mapper.map();
  std::uint64_t bytes = scan.components.size() * (4 * sizeof(float) + 1);
  for (const KeyedIndex& item : map.blocks_in_order(mapper.workspace())) {
    const Block& block = map.block_at(item.index);
    for (int octet = 0; octet < kBlockOctets; ++octet) {
      std::set<int> components;
      for (int voxel = 0; voxel < kOctetVoxels; ++voxel) {
        const VoxelEvidence evidence = map.evidence(block, octet, voxel);
        for (int l = 1; l < evidence.num_components; ++l) {
          if (evidence.sigma[static_cast<std::size_t>(l)] > 0.0F) components.insert(l);
        }
      }
      bytes += 2 * components.size() * sizeof(OctetEvidence::Plane);
    }
  }
  return bytes;
}

Json to_json(const ModeRun& run) {
  Times all;
  std::vector<double> scan_medians;
  std::vector<double> works;
  double updates = 0.0;
  Json scans = Json::array();
  for (std::size_t i = 0; i < run.times.size(); ++i) {
    const ScanReport& report = run.reports[i];
    all.append(run.times[i]);
    scan_medians.push_back(median(run.times[i].cpu_ms));
    works.push_back(work_of(report));
    updates += static_cast<double>(report.voxel_updates);
    scans.push_back({{"points", report.points},
                     {"thinned", report.thinned},
                     {"voxel_updates", report.voxel_updates},
                     {"evaluations", report.evaluations},
                     {"ray_steps", report.ray_steps},
                     {"label_octets", report.label_octets},
                     {"free_blocks", report.free_blocks},
                     {"tiles", report.tiles},
                     {"ray_blocks", report.ray_blocks},
                     {"median_ms", median(run.times[i].ms)},
                     {"median_cpu_ms", scan_medians.back()}});
  }
  const auto worst_over_median = [](const std::vector<double>& values) {
    const double middle = median(values);
    return middle > 0.0 ? *std::max_element(values.begin(), values.end()) / middle : 0.0;
  };
  const double total_ms = [&] {
    double sum = 0.0;
    for (const double ms : scan_medians) sum += ms;
    return sum;
  }();
  return {{"title", run.mode.title},
          {"counts", to_string(run.mode.tuple)},
          {"ms", statistics(all.ms)},
          {"cpu_ms", statistics(all.cpu_ms)},
          {"scans", scans},
          {"ns_per_voxel_update", updates > 0.0 ? 1e6 * total_ms / updates : 0.0},
          {"worst_scan_over_median_cpu_ms", worst_over_median(scan_medians)},
          {"worst_scan_over_median_work", worst_over_median(works)}};
}

/// Of runs of kAdditions.
std::vector<double> additions_per_ns(const std::vector<double>& ms) {
  std::vector<double> per_ns;
  for (const double value : ms) per_ns.push_back(1e-6 * static_cast<double>(kAdditions) / value);
  return per_ns;
}

/// The plain loop over the points that the library admits, scan by scan.
struct NaiveRun {
  NaiveKernelMap map;
  std::vector<std::vector<ScanPoint>> points;
  Times times;
  std::uint64_t updates = 0;  ///< Of all scans.

  void map_once(bool timed) {
    map.clear();
    updates = 0;
    for (const std::vector<ScanPoint>& scan : points) {
      Times time;
      time.measure([&] { updates += map.integrate(scan); });
      if (timed) times.append(time);
    }
  }
};

/// The part of the labelled voxels to which library and plain loop give the same label.
double agreement(Mapper& mapper, const NaiveKernelMap& naive) {
  std::uint64_t labelled = 0;
  std::uint64_t same = 0;
  for (const VoxelCoord& voxel : observed_voxels(mapper)) {
    const int label = mapper.map().query(voxel).label;
    if (label == 0) continue;
    ++labelled;
    same += label == naive.label_of(voxel) ? 1U : 0U;
  }
  return labelled > 0 ? static_cast<double>(same) / static_cast<double>(labelled) : 0.0;
}

Json kernel_limits(ModeRun& kernel, const Scene& scene, double bytes_per_s) {
  std::vector<double> bytes;
  for (const Scan& scan : scene.scans)
    bytes.push_back(static_cast<double>(bytes_to_move(kernel.mapper, scan)));
  return {{"median_bytes", median(bytes)},
          {"median_ms_at_bandwidth", 1e3 * median(bytes) / bytes_per_s}};
}

Outcome<Json> measure(const Options& options, Records& records) {
  TESSERA_TRY_ASSIGN(const Scene scene, load_scene(options));
  std::vector<ModeRun> runs;
  for (const Mode& mode : kModes) {
    TESSERA_TRY_ASSIGN(Mapper mapper, Mapper::make(mode, scene, options.resolution_m));
    runs.push_back({mode, std::move(mapper), std::vector<ScanReport>(scene.scans.size()),
                    std::vector<Times>(scene.scans.size())});
    // Not timed: brings every page into memory, and shows whether the result is right.
    TESSERA_TRY(map_once(runs.back(), scene, false));
    records.check(mode.name, runs.back().mapper.digest_of_map());
  }
  NaiveRun naive{NaiveKernelMap(options.resolution_m, 3.0 * options.resolution_m,
                                scene.classes.num_components()),
                 {},
                 {}};
  Mapper& kernel = runs.front().mapper;
  kernel.map().clear();
  for (const Scan& scan : scene.scans) {
    kernel.integrate(scan);
    const std::span<const ScanPoint> points = kernel.integrator().admitted();
    naive.points.emplace_back(points.begin(), points.end());
  }
  naive.map_once(false);
  const double same_labels = agreement(kernel, naive.map);
  if (same_labels < 0.999)
    return Failure{"the plain loop and the library do not agree", FailureKind::kFailure};
  MemoryBandwidth memory(kBandwidthArrayBytes);
  std::vector<double> bytes_per_s;
  Times additions;
  Times at_once;
  for (int i = 0; i < options.repetitions; ++i) {
    for (ModeRun& run : runs) {
      TESSERA_TRY(map_once(run, scene, true));
    }
    naive.map_once(true);
    bytes_per_s.push_back(memory.measure());
    for (int k = 0; k < 4; ++k) {
      additions.measure([] { add_dependently(kAdditions); });
      at_once.measure([] { add_in_four_chains(kAdditions); });
    }
  }
  Json modes = Json::object();
  for (const ModeRun& run : runs) {
    modes[run.mode.name] = to_json(run);
    Json& mode = modes[run.mode.name];
    mode["naive_over_this"] = median(naive.times.ms) / mode["ms"]["median"].get<double>();
    mode["naive_over_this_cpu"] =
        median(naive.times.cpu_ms) / mode["cpu_ms"]["median"].get<double>();
  }
  modes[kKernelMode.name]["limit"] = kernel_limits(runs.front(), scene, median(bytes_per_s));
  return Json{{"scans", scene.scans.size()},
              {"repetitions", options.repetitions},
              {"resolution_m", options.resolution_m},
              {"memory_bytes_per_s", statistics(bytes_per_s)},
              {"clock_ghz", statistics(additions_per_ns(additions.ms))},
              {"cpu_clock_ghz", statistics(additions_per_ns(additions.cpu_ms))},
              {"cpu_additions_per_ns", statistics(additions_per_ns(at_once.cpu_ms))},
              {"naive",
               {{"ms", statistics(naive.times.ms)},
                {"cpu_ms", statistics(naive.times.cpu_ms)},
                {"updates", naive.updates},
                {"bytes", naive.map.bytes()},
                {"same_labels", same_labels}}},
              {"modes", modes}};
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  return tessera::bench::run(argc, argv, "integrate", tessera::bench::measure);
}
