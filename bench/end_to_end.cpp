// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How long from a voxel that changes in one robot's local map until it is in another's global map?
// Two robots as a node runs them, each in a thread of its own, over real multicast on one
// interface. Both have mapped the same ground, so that what changes is in their overlap and goes
// through the diffusion. end_to_end [SAMPLES] [INTERFACE] [TICK_MS]: 500 by lo at 50 ms by default.
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <thread>
#include <vector>

#include "node/robot_loop.hpp"
#include "node/robot_setup.hpp"

namespace tessera::bench {

namespace {

constexpr int kEdge = 100;  ///< Voxels of the ground, along x and y.
constexpr double kVoxel_m = 0.1;
constexpr double kSensorHeight_m = 2.0;
constexpr std::int64_t kGiveUp_us = 10'000'000;

struct Settings {
  int samples = 500;
  const char* interface = "lo";
  std::int64_t tick_us = 50'000;
};

/// What the two threads tell each other: which voxel was changed last, and when; which was seen.
struct Watch {
  std::atomic<int> changed{0};
  std::atomic<std::int64_t> changed_us{0};
  std::atomic<int> seen{0};
  std::atomic<std::int64_t> seen_us{0};
  std::atomic<bool> failed{false};
  std::atomic<bool> done{false};
};

RobotConfig config_of(std::uint32_t number) {
  RobotConfig config;
  config.map.resolution_m = kVoxel_m;
  config.map.tuple = TuplePolicy::kCompact;
  config.map.storage_bytes = std::size_t{16} << 20U;
  config.inference.mode = InferenceMode::kCounting;
  config.inference.free_space.enabled = false;
  config.inference.thinning_m = 0.0;
  config.scan = {.points = kEdge * kEdge, .tiles = 4096, .ray_blocks = 4096};
  config.publisher.blocks = 4096;
  config.publisher.candidates = 4096;
  config.exchange.robot = number;
  config.global.map = config.map;
  config.global.map.max_evidence = 0.0F;
  config.global.replicas = {
      .segments = 1U << 15U, .blocks = 8192, .contributions = 4, .robot_segments = 1U << 15U};
  config.global.blocks = 8192;
  return config;
}

Point3f centre(int i, int layer) {
  return {static_cast<float>(kVoxel_m * (i % kEdge - kEdge / 2 + 0.5)),
          static_cast<float>(kVoxel_m * (i / kEdge % kEdge - kEdge / 2 + 0.5)),
          static_cast<float>(kVoxel_m * (layer + 0.5))};
}

/// Points at the centres of voxels first .. last - 1 of a layer.
void add_points(Robot& robot, int first, int last, int layer) {
  std::vector<float> points;
  std::vector<std::uint8_t> labels;
  for (int i = first; i < last; ++i) {
    const Point3f p = centre(i, layer);
    points.insert(points.end(), {p.x(), p.y(), p.z() - static_cast<float>(kSensorHeight_m)});
    labels.push_back(static_cast<std::uint8_t>(1 + i % 2));
  }
  ScanView scan{.points = points.data(),
                .stride_floats = 3,
                .count = labels.size(),
                .components = labels.data()};
  scan.T_map_sensor(2, 3) = kSensorHeight_m;
  robot.integrate(scan, MonotonicClock::now_us());
}

struct Party {
  HeldRobot robot;
  std::unique_ptr<NetworkPort> port;
};

Outcome<Party> make_party(std::uint32_t number, const ClassTable& classes,
                          const Settings& settings) {
  Party party;
  TESSERA_TRY_ASSIGN(
      std::unique_ptr<NetworkPort> port,
      NetworkPort::open({.url = "udpm://239.255.76.69:7669?ttl=0&recv_buf_size=2097152",
                         .interface = settings.interface},
                        512));
  party.port = std::move(port);
  TESSERA_TRY_ASSIGN(HeldRobot robot, make_robot(config_of(number), classes, {}, {}));
  party.robot = std::move(robot);
  return party;
}

template <class EachPass>
void run(Party& party, std::int64_t tick_us, std::int64_t start_us, const Watch& watch,
         EachPass&& each_pass) {
  RobotLoop loop(party.robot->sharer(), party.robot->mapper().maps(), *party.port, tick_us);
  loop.begin(start_us);
  while (!watch.done.load() && !watch.failed.load()) {
    const std::int64_t now_us = MonotonicClock::now_us();
    loop.receive(now_us);
    if (now_us >= loop.tick_due_us()) loop.tick(now_us);
    const std::int64_t next_us = each_pass();
    loop.send(MonotonicClock::now_us());
    loop.wait_until(std::min(next_us, loop.tick_due_us()));
  }
}

/// Changes one voxel after another, at any moment between ticks, once the last was seen.
void change_voxels(Party& party, const Settings& settings, std::int64_t start_us, Watch& watch) {
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int64_t> pause_us(0, 2 * settings.tick_us);
  std::int64_t next_us = start_us + 3'000'000;  // By then both grounds are fused.
  run(party, settings.tick_us, start_us, watch, [&] {
    const std::int64_t now_us = MonotonicClock::now_us();
    const int last = watch.changed.load();
    if (watch.seen.load() < last) {
      if (now_us - watch.changed_us.load() > kGiveUp_us) watch.failed.store(true);
      return now_us + settings.tick_us;
    }
    if (last == settings.samples) {
      watch.done.store(true);
      return now_us;
    }
    if (last > 0 && next_us == INT64_MAX) next_us = watch.seen_us.load() + pause_us(random);
    if (now_us < next_us) return next_us;
    next_us = INT64_MAX;
    add_points(*party.robot, last, last + 1, 1);
    watch.changed_us.store(MonotonicClock::now_us());
    watch.changed.store(last + 1);
    return now_us + settings.tick_us;
  });
}

void watch_voxels(Party& party, const Settings& settings, std::int64_t start_us, Watch& watch,
                  std::vector<double>& ms) {
  run(party, settings.tick_us, start_us, watch, [&] {
    const int wanted = watch.changed.load();
    const GlobalMap& global = party.robot->global();
    if (wanted > watch.seen.load()) {
      const VoxelCoord voxel = *global.map().lattice().voxel_of(centre(wanted - 1, 1));
      if (global.query(voxel).state == VoxelState::kOccupied) {
        const std::int64_t now_us = MonotonicClock::now_us();
        ms.push_back(1e-3 * static_cast<double>(now_us - watch.changed_us.load()));
        watch.seen_us.store(now_us);
        watch.seen.store(wanted);
      }
    }
    return INT64_MAX;
  });
}

int measure(const Settings& settings) {
  ClassTable classes;
  if (classes.add("ground", {128, 128, 128}) != Status::kOk ||
      classes.add("thing", {255, 0, 0}) != Status::kOk)
    return 2;
  Outcome<Party> changing = make_party(1, classes, settings);
  Outcome<Party> watching = make_party(2, classes, settings);
  for (const auto* const party : {&changing, &watching}) {
    if (party->ok()) continue;
    std::fprintf(stderr, "end_to_end: %s\n", party->failure().text().c_str());
    return 2;
  }
  for (Party* const party : {&*changing, &*watching})
    add_points(*party->robot, 0, kEdge * kEdge, 0);
  std::vector<double> ms;
  ms.reserve(static_cast<std::size_t>(settings.samples));
  Watch watch;
  const std::int64_t start_us = MonotonicClock::now_us();
  // The two tick at other moments, as robots do.
  std::thread watcher(
      [&] { watch_voxels(*watching, settings, start_us + settings.tick_us / 3, watch, ms); });
  change_voxels(*changing, settings, start_us, watch);
  watcher.join();
  DurationHistogram histogram;
  for (const double one : ms) histogram.add(static_cast<std::int64_t>(1e3 * one));
  const auto overlap = watching->robot->global().report().overlap_blocks;
  std::printf(
      "%zu of %d voxels seen, tick %.0f ms, %u blocks of overlap: p50 %.1f ms, p99 %.1f ms, max "
      "%.1f ms\n",
      ms.size(), settings.samples, 1e-3 * static_cast<double>(settings.tick_us), overlap,
      1e-3 * static_cast<double>(histogram.quantile_us(0.5)),
      1e-3 * static_cast<double>(histogram.quantile_us(0.99)),
      1e-3 * static_cast<double>(histogram.max_us()));
  return watch.failed.load() || overlap == 0 ? 3 : 0;
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  tessera::bench::Settings settings;
  if (argc > 1) settings.samples = std::atoi(argv[1]);
  if (argc > 2) settings.interface = argv[2];
  if (argc > 3) settings.tick_us = 1000 * std::int64_t{std::atoi(argv[3])};
  if (settings.samples < 1 || settings.samples > 10'000 || settings.tick_us < 1000) {
    std::fprintf(stderr, "end_to_end: give 1 to 10000 samples and a tick of at least 1 ms\n");
    return 1;
  }
  return tessera::bench::measure(settings);
}
