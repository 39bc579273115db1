// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What does a team cost, by its size and by what is lost? A simulated network in virtual time;
// prints one line of JSON. Time on the CPU is that of the exchanges and of the network between
// them.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <functional>
#include <stdexcept>

#include "network/drive.hpp"
#include "network/map_blocks.hpp"
#include "network/simulated_network.hpp"

namespace tessera::network {
namespace {

constexpr std::int64_t kSecond = 1'000'000;

struct Settings {
  int robots = 3;
  double loss = 0.0;
  double seconds = 5.0;           ///< That all publish.
  int blocks_per_s = 20;          ///< Of each, where there are no maps.
  std::vector<std::string> maps;  ///< A map for each robot, which is published in that time.
  std::string dataset;            ///< That is driven along by all, each a stretch of it.
  std::string labels = "predictions";
  int scan_ms = 1000;
  double rest_s = 10.0;  ///< After all hold the same.
};

double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// All that was sent, with what stands before the payload: the channel with its zero, LCM, UDP, IP.
std::uint64_t wire_bytes(Network& network) {
  constexpr std::uint64_t kBeforePayload = 8 + 8 + 8 + 20;
  std::uint64_t bytes = network.sent_bytes();
  for (int i = 0; i < network.size(); ++i)
    bytes += kBeforePayload * network.robot(i).exchange().report().sent;
  return bytes;
}

double seconds(std::int64_t us) { return 1e-6 * static_cast<double>(us); }

/// What the robots publish, up to a time.
using Source = std::function<void(Network& network, std::int64_t now_us)>;

Source random_blocks(const Settings& settings) {
  return [published = std::vector<int>(static_cast<std::size_t>(settings.robots)),
          blocks_per_s = settings.blocks_per_s](Network& network, std::int64_t now_us) mutable {
    for (int i = 0; i < network.size(); ++i) {
      int& done = published[static_cast<std::size_t>(i)];
      for (; done < static_cast<int>(seconds(now_us) * blocks_per_s); ++done) {
        oracle::Random& random = network.random();
        const int x = done / 20 + random.below(8);
        const int voxels = 10 + random.below(60);
        const BlockKey key = *pack({x, random.below(8), 0});
        if (!network.robot(i).publish(key, random, voxels).ok())
          throw std::runtime_error("no room for a block");
      }
    }
  };
}

/// All blocks of maps, each once, within the time.
Source blocks_of_maps(const Settings& settings) {
  struct Maps {
    std::vector<std::unique_ptr<MapBlocks>> maps;
    std::vector<std::size_t> published;
    std::unique_ptr<AlignedMemory> memory;
    BlockContent content;
  };
  const auto all = std::make_shared<Maps>();
  for (const std::string& map : settings.maps)
    all->maps.push_back(std::make_unique<MapBlocks>(map));
  all->published.resize(all->maps.size());
  const int components = all->maps.front()->map().num_components();
  all->memory = std::make_unique<AlignedMemory>(BlockContent::required_bytes(components));
  Arena arena(all->memory->span());
  all->content = *BlockContent::make(arena, components);
  return [all, end_s = settings.seconds](Network& network, std::int64_t now_us) {
    const double share = std::min(1.0, seconds(now_us) / end_s);
    for (std::size_t i = 0; i < all->maps.size(); ++i) {
      const auto due = static_cast<std::size_t>(share * static_cast<double>(all->maps[i]->size()));
      for (std::size_t& done = all->published[i]; done < due; ++done) {
        const BlockKey key = all->maps[i]->read(done, all->content);
        if (!network.robot(static_cast<int>(i)).exchange().publish(key, all->content).ok())
          throw std::runtime_error("no room for a block");
      }
    }
  };
}

/// Robots that map the scans of a dataset, cut into as many stretches, as they drive.
Source drives(const Settings& settings, const Dataset& dataset) {
  const auto all = std::make_shared<std::vector<std::unique_ptr<Drive>>>();
  const std::size_t each = dataset.num_scans() / static_cast<std::size_t>(settings.robots);
  for (std::size_t i = 0; i < static_cast<std::size_t>(settings.robots); ++i)
    all->push_back(std::make_unique<Drive>(dataset, i * each, each));
  return [all, scan_us = std::int64_t{1000} * settings.scan_ms, due_us = std::int64_t{0}](
             Network& network, std::int64_t now_us) mutable {
    const bool is_due = now_us >= due_us;
    if (is_due) due_us += scan_us;
    for (std::size_t i = 0; i < all->size(); ++i) {
      Drive& drive = *(*all)[i];
      if (is_due && !drive.is_over()) drive.integrate_next();
      drive.tick(now_us, network.robot(static_cast<int>(i)).exchange());
    }
  };
}

ReplicasConfig room(bool is_real) {
  if (!is_real)
    return {.segments = 1U << 15U,
            .blocks = 1U << 14U,
            .contributions = 64,
            .robot_segments = 1U << 14U};
  return {
      .segments = 1U << 20U, .blocks = 1U << 18U, .contributions = 16, .robot_segments = 1U << 19U};
}

void measure(Settings settings) {
  std::optional<Dataset> dataset;
  int classes = kClasses;
  if (!settings.maps.empty()) {
    settings.robots = static_cast<int>(settings.maps.size());
    classes = MapBlocks(settings.maps.front()).map().classes().num_classes();
  }
  if (!settings.dataset.empty()) {
    DatasetOptions options;
    options.labels = settings.labels;
    Outcome<Dataset> opened = Dataset::open(settings.dataset, options);
    if (!opened.ok()) throw std::runtime_error(opened.failure().text());
    dataset = std::move(*opened);
    classes = dataset->classes().table().num_classes();
    const std::size_t each = dataset->num_scans() / static_cast<std::size_t>(settings.robots);
    // What changed last waits for four seconds where voxels are only free.
    settings.seconds = 1e-3 * settings.scan_ms * static_cast<double>(each) + 4.5;
  }
  const bool is_real = dataset || !settings.maps.empty();
  Network network(settings.robots, {.loss = settings.loss}, 551, room(is_real), {}, false, classes);
  const Source publish = dataset   ? drives(settings, *dataset)
                         : is_real ? blocks_of_maps(settings)
                                   : random_blocks(settings);
  double cpu = 0.0;
  while (seconds(network.now_us()) < settings.seconds) {
    publish(network, network.now_us());
    const double before = cpu_s();
    network.run(kSecond / 20);
    cpu += cpu_s() - before;
  }
  const std::int64_t published_us = network.now_us();
  const std::uint64_t published_bytes = wire_bytes(network);
  if (!network.settle(3600 * kSecond)) throw std::runtime_error("they do not agree after an hour");
  const double settled_s = seconds(network.now_us() - published_us);
  const std::uint64_t settled_bytes = wire_bytes(network);
  const double before = cpu_s();
  network.run(static_cast<std::int64_t>(settings.rest_s * 1e6));
  const double rest_cpu = cpu_s() - before;
  const double each = 1.0 / settings.robots;
  const ExchangeReport report = network.robot(0).exchange().report();
  std::printf(
      "{\"robots\": %d, \"loss\": %g, \"seconds\": %g, \"bytes\": %llu, \"settled_s\": %.2f, "
      "\"bytes_per_robot_s\": %.1f, \"cpu_per_robot_s\": %.6f, \"rest_bytes_per_robot_s\": %.1f, "
      "\"rest_cpu_per_robot_s\": %.6f, \"parts\": %llu}\n",
      settings.robots, settings.loss, settings.seconds,
      static_cast<unsigned long long>(settled_bytes), settled_s,
      each * static_cast<double>(published_bytes) / settings.seconds, each * cpu / settings.seconds,
      each * static_cast<double>(wire_bytes(network) - settled_bytes) / settings.rest_s,
      each * rest_cpu / settings.rest_s, static_cast<unsigned long long>(report.published_parts));
}

}  // namespace
}  // namespace tessera::network

int main(int argc, char** argv) {
  tessera::network::Settings settings;
  CLI::App app("What a team costs, by its size and by what is lost");
  app.add_option("--robots", settings.robots, "as many as there are maps, if any");
  app.add_option("--loss", settings.loss, "of every link, 0 to 1")->check(CLI::Range(0.0, 0.999));
  app.add_option("--seconds", settings.seconds, "that all publish");
  app.add_option("--blocks-per-s", settings.blocks_per_s, "of each");
  app.add_option("--map", settings.maps, "a map file for each robot, instead of random blocks");
  app.add_option("--dataset", settings.dataset, "robots that map a stretch of it each, instead");
  app.add_option("--labels", settings.labels, "folder of labels, or none");
  app.add_option("--scan-ms", settings.scan_ms, "from a scan to the next");
  app.add_option("--rest", settings.rest_s, "seconds after all hold the same");
  CLI11_PARSE(app, argc, argv);
  try {
    tessera::network::measure(settings);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "team_costs: %s\n", error.what());
    return 1;
  }
}
