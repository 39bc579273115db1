// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots that drive on one street, near each other: how many voxels of each other they map, with
// and without saying where they are; and what hearing it and leaving it out costs.
#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <random>
#include <set>

#include "harness.hpp"
#include "link/fleet_keys.hpp"
#include "link/key_maker.hpp"
#include "one_robot.hpp"
#include "simulator/street_simulator.hpp"
#include "teammate_scenes.hpp"
#include "tessera/base/rigid.hpp"
#include "thread_time.hpp"

namespace tessera::bench {

namespace {

constexpr std::int64_t kPeriod_us = 100'000;

struct TeammateOptions {
  int robots = 4;
  int scans = 30;
  std::uint64_t seed = 5;
};

/// What is said of a robot's place, and what becomes of it on its way.
struct Way {
  const char* name = "";
  bool says = false;
  double loss = 0.0;
  double frame_error_m = 0.0;
};

/// Drives all robots through their scans. Returns the voxels that were mapped of other robots.
std::size_t drive(const std::vector<RobotScans>& all, const Way& way, std::uint64_t seed) {
  std::vector<std::unique_ptr<OneRobot>> robots;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (std::size_t i = 0; i < all.size(); ++i) {
    RobotConfig config = street_robot(static_cast<std::uint32_t>(i), way.says);
    // So that a voxel is occupied by its own returns, and not by those beside it.
    config.inference.mode = InferenceMode::kCounting;
    config.T_global_map = all[i].T_global_map;
    const double angle = 6.28 * share(random);
    config.T_global_map(0, 3) += way.frame_error_m * std::cos(angle);
    config.T_global_map(1, 3) += way.frame_error_m * std::sin(angle);
    robots.push_back(std::make_unique<OneRobot>(config, street_classes(), RobotKeys{}));
  }
  std::array<std::byte, kMostDatagramBytes> datagram;
  const auto exchange_all = [&](std::int64_t now_us) {
    for (std::size_t from = 0; from < all.size(); ++from) {
      while (const std::size_t size = robots[from]->robot->send(now_us, datagram)) {
        for (std::size_t to = 0; to < all.size(); ++to) {
          if (to != from && share(random) >= way.loss)
            robots[to]->robot->receive(std::span(datagram).first(size), now_us);
        }
      }
    }
  };
  // They have driven for a second.
  std::int64_t now_us = 1'000'000;
  for (std::size_t k = 0; k < all.front().T_map_before.size(); ++k, now_us += kPeriod_us) {
    for (std::size_t i = 0; i < all.size(); ++i)
      robots[i]->robot->sharer().note_place(0, now_us, all[i].T_map_before[k], now_us);
    exchange_all(now_us);
  }
  std::vector<std::set<std::array<std::int32_t, 3>>> mapped(all.size());
  std::uint64_t left_out = 0;
  for (std::size_t k = 0; k < all.front().scans.size(); ++k, now_us += kPeriod_us) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      exchange_all(now_us);
      const StreetScan& scan = all[i].scans[k];
      const ScanReport report = robots[i]->robot->integrate(scan.view(), now_us);
      left_out += report.on_teammate;
      const LocalMap& map = robots[i]->robot->map();
      for (const std::size_t point : scan.on_others) {
        const Point3f p_map = transform(scan.T_map_sensor, scan.xyz.data() + 3 * point);
        const Result<VoxelCoord> voxel = map.lattice().voxel_of(p_map);
        if (voxel.ok() && all[i].others.count({voxel->x, voxel->y, voxel->z}) == 0 &&
            map.query(p_map).state == VoxelState::kOccupied)
          mapped[i].insert({voxel->x, voxel->y, voxel->z});
      }
    }
  }
  std::size_t voxels = 0;
  for (const auto& of_robot : mapped) voxels += of_robot.size();
  std::printf("| %s | %zu | %llu |\n", way.name, voxels, static_cast<unsigned long long>(left_out));
  return voxels;
}

/// What eight robots cost one of them in a second: to hear the seven others, signed, ten times, and
/// to compare ten scans with them.
Outcome<void> measure_costs(const std::vector<RobotScans>& all) {
  constexpr std::uint32_t kRobots = 8;
  constexpr int kSeconds = 10;
  const std::string folder =
      (std::filesystem::temp_directory_path() / "tessera_bench_teammates").string();
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  TESSERA_TRY_ASSIGN(const Mission mission, Mission::make("bench"));
  TESSERA_TRY(make_fleet(folder, kRobots, mission));
  std::vector<std::unique_ptr<FleetKeys>> keys;
  std::vector<std::unique_ptr<OneRobot>> robots;
  for (std::uint32_t i = 0; i < kRobots; ++i) {
    KeyFiles files;
    files.fleet_key = folder + "/fleet.key";
    files.robot_secret = folder + "/robot_" + std::to_string(i) + ".key";
    files.robot_public_keys = folder + "/fleet.pub";
    TESSERA_TRY_ASSIGN(FleetKeys read, FleetKeys::read(files, i));
    keys.push_back(std::make_unique<FleetKeys>(std::move(read)));
    RobotConfig config = street_robot(i, true);
    config.exchange.mission = keys.back()->mission().number();
    robots.push_back(std::make_unique<OneRobot>(config, street_classes(), keys.back()->keys()));
  }
  std::filesystem::remove_all(folder);
  double hear_ms = 0.0;
  double say_ms = 0.0;
  std::array<std::byte, kMostDatagramBytes> datagram;
  std::int64_t now_us = 1'000'000;
  for (int tick = 0; tick < 10 * kSeconds; ++tick, now_us += kPeriod_us) {
    for (std::uint32_t i = 0; i < kRobots; ++i) {
      Matrix34d T = Matrix34d::Identity();
      T.col(3) = Point3d(0.5 * tick, 4.0 * i, 0.0);
      const double before = thread_cpu_ms();
      robots[i]->robot->sharer().note_place(0, now_us, T, now_us);
      const std::size_t size = robots[i]->robot->send(now_us, datagram);
      if (i == 0) say_ms += thread_cpu_ms() - before;
      if (i == 0 || size == 0) continue;
      const double start = thread_cpu_ms();
      robots[0]->robot->receive(std::span(datagram).first(size), now_us);
      hear_ms += thread_cpu_ms() - start;
    }
  }
  const ExchangeReport report = robots[0]->robot->exchange().report();
  std::printf(
      "eight robots that sign: %.2f ms of a core a second to hear seven (%llu places), %.2f ms to "
      "say one's own\n",
      hear_ms / kSeconds, static_cast<unsigned long long>(report.presences_taken),
      say_ms / kSeconds);
  // The same scan with and without seven of them around it.
  std::vector<PlacedBox> boxes;
  for (int i = 0; i < 7; ++i) {
    Matrix34d T = Matrix34d::Identity();
    T.col(3) = Point3d(8.0 * (i - 3) + 4.0, i % 2 == 0 ? 3.5 : -3.5, 0.0);
    boxes.push_back({inverse(product(all[0].scans[0].T_map_sensor, T)), *street_body().hull()});
  }
  std::array<std::vector<double>, 2> times;
  for (int run = 0; run < 42; ++run) {
    OneRobot& one = *robots[static_cast<std::size_t>(run % 2)];
    one.robot->mapper().clear();
    ScanView view = all[0].scans[0].view();
    const PlacedBox far{.T_box_map = inverse(product(view.T_map_sensor,
                                                     [] {
                                                       Matrix34d T = Matrix34d::Identity();
                                                       T(2, 3) = 500.0;
                                                       return T;
                                                     }())),
                        .box = *street_body().hull()};
    view.teammates = (run / 2) % 2 == 0 ? std::span<const PlacedBox>(&far, 1) : boxes;
    const double before = thread_cpu_ms();
    const ScanReport done = one.robot->mapper().integrate(view, 0);
    times[static_cast<std::size_t>((run / 2) % 2)].push_back(thread_cpu_ms() - before);
    if (run == 3) std::printf("returns on the seven: %u\n", done.on_teammate);
  }
  std::printf("a scan of %zu returns: %.2f ms with one far box, %.2f ms with seven around it\n",
              all[0].scans[0].components.size(), median(times[0]), median(times[1]));
  std::printf("comparing alone: %.3f ms a scan\n", compare_ms(all[0].scans[0], boxes));
  return {};
}

Outcome<void> answer(const TeammateOptions& options) {
  TESSERA_TRY_ASSIGN(const StreetSimulator street,
                     StreetSimulator::make(
                         {.seed = options.seed, .robots = options.robots, .scans = options.scans}));
  const std::vector<RobotScans> all = street_scans(street, options.robots, options.scans);
  std::printf(
      "%d robots, %d scans each, seed %llu\n| said | voxels of others | returns left out "
      "|\n|---|---|---|\n",
      options.robots, options.scans, static_cast<unsigned long long>(options.seed));
  for (const Way& way : {Way{.name = "nothing"}, Way{.name = "places", .says = true},
                         Way{"places, 30 % lost, frames off by 0.1 m", true, 0.3, 0.1}})
    static_cast<void>(drive(all, way, 7));
  return measure_costs(all);
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera;
  CLI::App app("what robots map of each other");
  bench::TeammateOptions options;
  app.add_option("--robots", options.robots)->check(CLI::Range(2, 8));
  app.add_option("--scans", options.scans)->check(CLI::Range(1, 100));
  app.add_option("--seed", options.seed);
  CLI11_PARSE(app, argc, argv);
  const Outcome<void> done = bench::answer(options);
  if (done.ok()) return 0;
  std::fprintf(stderr, "%s\n", done.failure().text().c_str());
  return 1;
}
