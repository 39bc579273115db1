// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What does a robot that maps at 10 Hz have to say? Drives along recorded scans with a tick every
// 50 ms, and prints what was published in each second, how late, how often, what it costs, and how
// much of the map means another thing than what others know of it. Datagrams are made, counted, and
// heard by another robot. All but CPU time is the same in every run.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <optional>

#include "link/fleet_signatures.hpp"
#include "published.hpp"
#include "scenes.hpp"
#include "tessera/exchange/publisher.hpp"
#include "tessera/map/internal/packed_block.hpp"
#include "tessera/map/moving_window.hpp"

namespace tessera::bench {

namespace {

struct Settings {
  std::string dataset;
  std::string labels = "predictions";
  std::string
      secret;  ///< Key file of the robot that drives, and of its fleet; none: no signatures.
  std::string public_keys;
  int laps = 1;  ///< The drive again, from where it ended.
  int scans = 0;
  int scan_ms = 100;
  int tick_ms = 50;
  PublisherConfig publisher;
  PublisherBudget budget;
};

/// What is published of the map, against what the map means now.
class Disagreement {
 public:
  explicit Disagreement(const LocalMap& map)
      : memory_(2 * BlockContent::required_bytes(map.num_components())),
        significance_(map.config(), map.num_components(), 1e6F) {
    Arena arena = memory_.arena();
    published_ = *BlockContent::make(arena, map.num_components());
    current_ = *BlockContent::make(arena, map.num_components());
  }
  void measure(const LocalMap& map, const Published& published) {
    SweepCursor cursor;
    double labels = 0.0;
    double free = 0.0;
    double all_free = 0.0;
    map.visit_blocks(cursor, map.index().slots(), [&](BlockKey key, SlabHandle at) {
      published_.clear();
      current_.clear();
      static_cast<void>(published.read(key, published_));
      add_block(map, map.block_at(at), current_);
      const Difference difference = significance_.compare(published_, current_);
      labels += difference.labels;
      free += difference.free;
      for (int row = 0; row < kBlockVoxels; ++row) all_free += current_.passes(row) != 0 ? 1 : 0;
      return true;
    });
    label_shares.push_back(labels / static_cast<double>(map.usage().label_voxels + 1));
    free_shares.push_back(free / (all_free + 1.0));
  }
  std::vector<double> label_shares;
  std::vector<double> free_shares;

 private:
  Memory memory_;
  Significance significance_;
  BlockContent published_;
  BlockContent current_;
};

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

struct Drive {
  tessera::Mapper& mapper;
  const LocalMap& map;
  Publisher publisher;
};

void report(const Drive& drive, const Published& published, const Disagreement& disagreement,
            std::vector<double> tick_ms, double seconds) {
  const PublisherTotals& totals = drive.publisher.totals();
  double sent = 0.0;
  for (const auto& [key, times] : published.times_sent()) sent += times;
  std::sort(tick_ms.begin(), tick_ms.end());
  std::uint64_t all = 0;
  for (const std::uint64_t count : totals.by_staleness) all += count;
  std::uint64_t sum = 0;
  std::size_t p99 = 0;
  while (p99 + 1 < totals.by_staleness.size() && 100 * (sum += totals.by_staleness[p99]) < 99 * all)
    ++p99;
  const auto mbits = [&](std::uint64_t bytes) {
    return 8e-6 * static_cast<double>(bytes) / seconds;
  };
  std::printf(
      "label %.2f free %.2f Mbit/s | sent %.2f times | staleness p99 < %zu/8 worst %.0f ms | tick "
      "median %.2f p99 %.2f max %.2f ms | other meaning: labels %.2f %% free %.2f %%\n",
      mbits(totals.label_bytes), mbits(totals.free_bytes),
      sent / static_cast<double>(published.times_sent().size()), p99 + 1,
      1e-3 * static_cast<double>(totals.worst_staleness_us), quantile(tick_ms, 0.5),
      quantile(tick_ms, 0.99), tick_ms.back(), 100.0 * mean(disagreement.label_shares),
      100.0 * mean(disagreement.free_shares));
  std::printf(
      "compared %.0f/s unchanged %.0f/s deferred %.0f/s left out %llu forgotten waiting %llu "
      "peak waiting %u\n",
      static_cast<double>(totals.compared) / seconds,
      static_cast<double>(totals.unchanged) / seconds,
      static_cast<double>(totals.deferred) / seconds,
      static_cast<unsigned long long>(totals.left_out),
      static_cast<unsigned long long>(totals.forgotten_waiting), totals.peak_waiting);
}

Outcome<void> measure(const Settings& settings) {
  DatasetOptions of_dataset;
  of_dataset.labels = settings.labels;
  TESSERA_TRY_ASSIGN(const Scene scene, load_scene(settings.dataset, of_dataset));
  std::optional<FleetSignatures> fleet;
  if (!settings.secret.empty()) {
    TESSERA_TRY_ASSIGN(const Mission mission, Mission::make("publish rate"));
    TESSERA_TRY_ASSIGN(FleetSignatures read,
                       FleetSignatures::read(settings.secret, settings.public_keys, mission));
    fleet.emplace(std::move(read));
  }
  RobotConfig config;
  config.map.tuple = TuplePolicy::kCompact;
  config.map.storage_bytes = std::size_t{512} << 20U;
  config.scan = {.points = static_cast<std::uint32_t>(scene.max_points),
                 .tiles = 131072,
                 .ray_blocks = 131072};
  config.window = WindowConfig{.radius_m = 50.0};
  const int components = scene.classes.num_components();
  Memory memory(tessera::Mapper::required_bytes(config) +
                Publisher::required_bytes(settings.publisher, components));
  Arena arena = memory.arena();
  const Result<tessera::Mapper*> mapper = tessera::Mapper::make(arena, config, scene.classes, {});
  Result<Publisher> publisher = Publisher::make(arena, settings.publisher, config.map, components);
  if (!mapper.ok() || !publisher.ok())
    return Failure{"a setting is out of its range", FailureKind::kUsage};
  Drive drive{**mapper, (*mapper)->map(), std::move(*publisher)};
  Published published(config.map, scene.classes, fleet ? fleet->signatures() : Signatures{});
  if (!published.ok()) return Failure{"nothing can be published", FailureKind::kFailure};
  Disagreement disagreement(drive.map);
  const BlockArchive archive{&drive.publisher,
                             [](void* context, const LocalMap&, const Block& block) {
                               static_cast<Publisher*>(context)->forget(BlockKey{block.key});
                               return true;
                             },
                             nullptr, nullptr};
  drive.mapper.set_archive(archive);
  const std::size_t count = scene.scans.size();
  const auto& first = scene.scans.front().T_map_sensor;
  const auto& last = scene.scans.back().T_map_sensor;
  const Eigen::Vector3d lap = (last.col(3) - first.col(3)) * static_cast<double>(count) /
                              static_cast<double>(count > 1 ? count - 1 : 1);
  const std::size_t scans = settings.scans > 0 ? static_cast<std::size_t>(settings.scans)
                                               : count * static_cast<std::size_t>(settings.laps);
  std::vector<double> tick_ms;
  std::uint64_t new_voxels = 0;
  WireBytes second;
  std::size_t wire_bytes = 0;
  std::int64_t now_us = 0;
  std::int64_t scan_us = 0;
  std::size_t done = 0;
  while (done < scans) {
    if (now_us >= scan_us) {
      Scan scan = scene.scans[done % count];
      scan.T_map_sensor.col(3) += lap * static_cast<double>(done / count);
      const Point3f at = scan.origin_map();
      drive.publisher.set_focus(block_of(*drive.map.lattice().voxel_of(at)));
      const std::uint64_t before = drive.map.usage().label_voxels;
      const ScanReport report = drive.mapper.integrate(scan.view(), 0);
      if (report.left_out() > 0) return Failure{"a scan did not fit", FailureKind::kFailure};
      new_voxels += drive.map.usage().label_voxels - before;
      scan_us += 1000 * settings.scan_ms;
      ++done;
    }
    now_us += 1000 * settings.tick_ms;
    const double start_ms = thread_cpu_ms() - published.cpu_spent_ms();
    const PublisherReport report =
        drive.publisher.tick(drive.map, now_us, settings.budget, published.interface());
    tick_ms.push_back(thread_cpu_ms() - published.cpu_spent_ms() - start_ms);
    wire_bytes += published.send(now_us);
    second.labels += report.bytes.labels;
    second.free += report.bytes.free;
    if (tick_ms.size() % 10 == 0) disagreement.measure(drive.map, published);
    if (now_us % 1'000'000 != 0) continue;
    std::printf("%2lld s: label %.2f free %.2f Mbit/s, waiting %u + %u, late %u, blocks %zu\n",
                static_cast<long long>(now_us / 1'000'000), 8e-6 * second.labels,
                8e-6 * second.free, report.waiting, report.free_waiting, report.overdue,
                drive.map.block_count());
    second = {};
  }
  const double seconds = 1e-6 * static_cast<double>(now_us);
  std::printf(
      "%zu scans, %.0f new label voxels a scan, %.2f label bytes a new voxel\n", done,
      static_cast<double>(new_voxels) / static_cast<double>(done),
      static_cast<double>(drive.publisher.totals().label_bytes) / static_cast<double>(new_voxels));
  std::printf(
      "on the wire, everything included: %.2f Mbit/s, %.2f bytes a new voxel; %.1f ms of CPU a "
      "second to round, code and send\n",
      8e-6 * static_cast<double>(wire_bytes) / seconds,
      static_cast<double>(wire_bytes) / static_cast<double>(new_voxels),
      published.cpu_spent_ms() / seconds);
  std::printf("another robot takes %.1f ms of CPU a second to hear its %llu records\n",
              published.cpu_hearing_ms() / seconds,
              static_cast<unsigned long long>(published.records_heard()));
  report(drive, published, disagreement, tick_ms, seconds);
  return {};
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  using tessera::bench::Settings;
  Settings settings;
  CLI::App app("What a robot that maps at 10 Hz says");
  app.add_option("--dataset", settings.dataset)->required();
  app.add_option("--labels", settings.labels, "folder of labels, or none");
  app.add_option("--laps", settings.laps);
  app.add_option("--scans", settings.scans, "in all, instead of laps");
  app.add_option("--scan-ms", settings.scan_ms);
  app.add_option("--tick-ms", settings.tick_ms);
  app.add_option("--label-bytes", settings.budget.label_bytes, "a tick");
  app.add_option("--free-bytes", settings.budget.free_bytes, "a tick");
  app.add_option("--compared", settings.budget.compared, "blocks a tick");
  CLI::Option* const secret =
      app.add_option("--secret", settings.secret, "key file of robot 0: signs what it says");
  app.add_option("--public", settings.public_keys, "file of the fleet's public keys")
      ->needs(secret);
  app.add_option("--factor", settings.publisher.evidence_factor);
  app.add_option("--few", settings.publisher.few_voxels);
  app.add_option("--many", settings.publisher.many_voxels);
  app.add_option("--near", settings.publisher.near_blocks);
  app.add_option("--staleness-us", settings.publisher.staleness_us);
  app.add_option("--free-staleness-us", settings.publisher.free_staleness_us);
  CLI11_PARSE(app, argc, argv);
  const tessera::Outcome<void> outcome = tessera::bench::measure(settings);
  if (outcome.ok()) return 0;
  std::fprintf(stderr, "%s\n", outcome.failure().text().c_str());
  return static_cast<int>(outcome.failure().kind);
}
