// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the team clears together: one robot maps the first half of a sequence and looks no more, a
// second one the other half in the same frame, there and back. Of the points on moving things in
// the first half through which scans of the second look, and which they do not meet again, how many
// are free in the global map; and of all other points, how many are occupied. With and without
// objections.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>

#include "ghost_truth.hpp"
#include "one_robot.hpp"
#include "thread_time.hpp"

namespace tessera::bench {

namespace {

constexpr std::int64_t kTick_us = 50'000;

struct TeamGhostOptions {
  std::string dataset;
  int first = 0;
  int last = 5;
  double resolution_m = 0.1;
  double frame_error_m = 0.0;
  int rounds = 4;
};

RobotConfig config_of(std::uint32_t number, const Scene& scene, double resolution_m,
                      std::uint32_t objections) {
  RobotConfig config;
  config.map.resolution_m = resolution_m;
  config.map.storage_bytes = std::size_t{512} << 20U;
  config.inference.max_range_m = static_cast<float>(kGhostRange_m);
  config.scan.points = static_cast<std::uint32_t>(scene.max_points);
  config.objections = objections;
  config.budget = {.entries = 1U << 20U,
                   .compared = 1U << 16U,
                   .label_bytes = 1U << 24U,
                   .free_bytes = 1U << 24U,
                   .at_once = true};
  config.exchange.robot = number;
  config.exchange.resolution_m = resolution_m;
  config.exchange.records = 1U << 18U;
  config.exchange.bytes_per_s = 1U << 28U;
  config.exchange.burst_bytes = 1U << 26U;
  config.global.map = config.map;
  config.global.map.max_evidence = 0.0F;
  config.global.replicas = {
      .segments = 1U << 21U, .blocks = 1U << 18U, .contributions = 64, .robot_segments = 1U << 21U};
  config.global.blocks = 1U << 18U;
  config.global.sum_segments = 1U << 21U;
  config.global.diffusion.mode = DiffusionMode::kNone;
  return config;
}

class Pair {
 public:
  Pair(const Scene& scene, const TeamGhostOptions& options, std::uint32_t objections) {
    for (std::uint32_t i = 0; i < 2; ++i) {
      RobotConfig config = config_of(i, scene, options.resolution_m, objections);
      config.T_global_map(0, 3) = i * options.frame_error_m;
      robots_[i] = std::make_unique<OneRobot>(config, scene.classes, RobotKeys{});
    }
  }
  [[nodiscard]] Robot& robot(std::size_t i) const { return *robots_[i]->robot; }
  /// For a second, in which both hear all.
  void talk() {
    std::array<std::byte, kMostDatagramBytes> datagram;
    for (int tick = 0; tick < 20; ++tick) {
      now_us_ += kTick_us;
      for (std::size_t i = 0; i < 2; ++i) {
        const double before = thread_cpu_ms();
        static_cast<void>(robot(i).tick(now_us_));
        tick_ms.push_back(thread_cpu_ms() - before);
      }
      for (std::size_t i = 0; i < 2; ++i)
        while (const std::size_t size = robot(i).send(now_us_, datagram)) {
          bytes += size;
          robot(1 - i).receive(std::span(datagram).first(size), now_us_);
        }
    }
    for (std::size_t i = 0; i < 2; ++i) robot(i).finish();
  }
  void map(std::size_t i, const Scan& scan) {
    static_cast<void>(robot(i).integrate(scan.view(), now_us_));
    talk();
  }
  std::vector<double> tick_ms;
  std::uint64_t bytes = 0;

 private:
  std::array<std::unique_ptr<OneRobot>, 2> robots_;
  std::int64_t now_us_ = 1'000'000;
};

double occupied_part(const Robot& robot, const std::vector<Judged>& points) {
  std::size_t occupied = 0;
  for (const Judged& point : points) {
    occupied += robot.global().map().query(point.p_map).state == VoxelState::kOccupied ? 1U : 0U;
  }
  return points.empty()
             ? 0.0
             : 100.0 * static_cast<double>(occupied) / static_cast<double>(points.size());
}

/// What is on moving things in the first half, and seen through by scans of the second.
Truth truth_of_halves(const Scene& scene, const TrueIds& ids, std::size_t half,
                      const Lattice& lattice) {
  Truth truth = truth_of(scene, ids, lattice, 0);
  std::erase_if(truth.moving, [&](const Judged& point) {
    return point.first_seen < half ||
           truth.met(*lattice.voxel_of(point.p_map), static_cast<int>(half),
                     static_cast<int>(scene.scans.size()) - 1);
  });
  return truth;
}

Outcome<void> answer(const TeamGhostOptions& options) {
  TESSERA_TRY_ASSIGN(const Scene scene, load_scene(options.dataset, {.first = options.first,
                                                                     .last = options.last,
                                                                     .labels = "predictions"}));
  TESSERA_TRY_ASSIGN(const TrueIds ids, read_true_ids(options.dataset, options.first, scene));
  const std::size_t half = scene.scans.size() / 2;
  const Truth truth = truth_of_halves(scene, ids, half, Lattice(options.resolution_m));
  std::printf(
      "%zu scans, %zu of the first robot; frames off by %.2f m; %zu points on moving things, %zu "
      "others\n| objections | cleared, %% | kept, %% | objected voxels | datagrams, kB | median, "
      "longest tick, ms |\n|---|---|---|---|---|---|\n",
      scene.scans.size(), half, options.frame_error_m, truth.moving.size(), truth.standing.size());
  for (const std::uint32_t objections : {0U, 1024U}) {
    Pair pair(scene, options, objections);
    for (std::size_t s = 0; s < half; ++s) pair.map(0, scene.scans[s]);
    for (int round = 0; round < options.rounds; ++round) {
      const std::size_t count = scene.scans.size() - half;
      for (std::size_t s = 0; s < count; ++s)
        pair.map(1, scene.scans[half + (round % 2 == 0 ? s : count - 1 - s)]);
    }
    for (int i = 0; i < 5; ++i) pair.talk();
    std::printf("| %s | %.1f | %.2f | %llu | %llu | %.2f, %.2f |\n",
                objections == 0 ? "none" : "made",
                100.0 - occupied_part(pair.robot(0), truth.moving),
                occupied_part(pair.robot(0), truth.standing),
                static_cast<unsigned long long>(pair.robot(0).global().report().objected_voxels),
                static_cast<unsigned long long>(pair.bytes / 1000), median(pair.tick_ms),
                *std::max_element(pair.tick_ms.begin(), pair.tick_ms.end()));
  }
  return {};
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  CLI::App app{"Ghosts of one robot that another sees through, by true labels"};
  tessera::bench::TeamGhostOptions options;
  app.add_option("--dataset", options.dataset, "Sequence in the KITTI layout")->required();
  app.add_option("--first", options.first);
  app.add_option("--last", options.last);
  app.add_option("--resolution", options.resolution_m);
  app.add_option("--rounds", options.rounds,
                 "How often the second robot maps its scans, there and back, as if it looked on");
  app.add_option("--frame-error", options.frame_error_m, "Of the second robot, metres along x");
  CLI11_PARSE(app, argc, argv);
  const tessera::Outcome<void> done = tessera::bench::answer(options);
  if (done.ok()) return 0;
  std::fprintf(stderr, "%s\n", done.failure().text().c_str());
  return 1;
}
