// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera node: a robot's process.
#include <signal.h>

#include <atomic>
#include <cstdio>

#include "cli/command.hpp"
#include "cli/losses.hpp"
#include "mapping/number_text.hpp"
#include "node/node.hpp"

namespace tessera {

namespace {

NodeRequests requests;
static_assert(std::atomic<bool>::is_always_lock_free);

/// The first asks to stop, and what is there is written; the second ends at once.
void stop_by_signal() {
  struct sigaction action {};
  action.sa_handler = [](int) {
    requests.stop.store(true, std::memory_order_relaxed);
    for (const int signal : {SIGTERM, SIGINT}) ::signal(signal, SIG_DFL);
  };
  ::sigemptyset(&action.sa_mask);
  for (const int signal : {SIGTERM, SIGINT}) ::sigaction(signal, &action, nullptr);
  action.sa_handler = [](int) { requests.save.store(true, std::memory_order_relaxed); };
  ::sigaction(SIGUSR1, &action, nullptr);
  // A full disk, and nobody who reads what is said, are errors of a call and end nothing.
  for (const int signal : {SIGXFSZ, SIGPIPE}) ::signal(signal, SIG_IGN);
}

void warn_of_losses(const Node& node) {
  const NodeRun& run = node.result();
  const Robot& robot = node.robot();
  const ExchangeReport exchange = robot.exchange().report();
  const GlobalMapReport global = robot.global().report();
  const auto warn_if = [](std::uint64_t count, const char* thing, const std::string& fate) {
    if (count > 0) warn(counted(count, thing) + " " + fate);
  };
  warn_if(run.mapping.bad_poses, "scan", "left out, with a pose that is not a rigid transform");
  warn_if(run.source.unknown_ids, "point",
          "with class ids that are in no class; they count as unlabelled");
  warn_if(run.mapping.left_out, "refusal",
          "of points or rays; give a larger [map] memory, work_budget or deadline_ms");
  warn_if(global.refused_blocks + global.refused_outputs + global.refused_sums +
              global.replicas.refused_storage,
          "refusal", "of blocks of the global map; give a larger [fusion] memory");
  warn_if(global.replicas.refused_quota, "refusal",
          "of blocks, as a robot's share is used up; give a larger [fusion] robot_share or memory");
  warn_if(exchange.contributions - exchange.complete, "contribution",
          "not whole: more was announced than arrived");
  warn_if(exchange.refused_tag, "datagram",
          "refused, by none who has this robot's key; see [security] fleet_key");
  for (const Peer& peer : robot.exchange().peers().all()) {
    if (!peer.mismatch) continue;
    warn("nothing is taken of robot " + std::to_string(peer.robot) + ": " +
         mismatch_text(*peer.mismatch, robot.map().config(), robot.map().classes()));
  }
}

void print_summary(const Node& node) {
  const NodeRun& run = node.result();
  const LoopTimes& times = node.times();
  const ExchangeReport exchange = node.robot().exchange().report();
  const MapUsage usage = node.robot().global().map().usage();
  const auto count = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  std::printf("%s, %s heard, %u of %u contributions whole; ended by %s after %.1f s\n",
              counted(run.mapping.cycles, "scan").c_str(), counted(exchange.peers, "peer").c_str(),
              exchange.complete, exchange.contributions, run.ended_by,
              1e-6 * static_cast<double>(run.end_us - run.start_us));
  const DurationHistogram& cycles = node.mapping().cycles();
  std::printf("  mapping  median %.1f ms, p99 %.1f ms, max %.1f ms, %s\n",
              1e-3 * static_cast<double>(cycles.quantile_us(0.5)),
              1e-3 * static_cast<double>(cycles.quantile_us(0.99)),
              1e-3 * static_cast<double>(cycles.max_us()),
              counted(run.mapping.missed, "missed cycle").c_str());
  std::printf("  ticks    median %.1f ms, p99 %.1f ms, max %.1f ms, %s\n",
              1e-3 * static_cast<double>(times.ticks.quantile_us(0.5)),
              1e-3 * static_cast<double>(times.ticks.quantile_us(0.99)),
              1e-3 * static_cast<double>(times.ticks.max_us()),
              counted(times.overruns, "overrun").c_str());
  std::printf("  network  %.2f MB sent, %.2f MB received\n",
              1e-6 * static_cast<double>(exchange.sent_bytes),
              1e-6 * static_cast<double>(exchange.received_bytes));
  std::printf("  memory   %.1f MB used of %.1f MB\n",
              1e-6 * static_cast<double>(node.robot().used_bytes()),
              1e-6 * static_cast<double>(node.robot().memory_bytes()));
  if (run.heap_allocations)
    std::printf("  heap     %llu allocations after start\n", count(*run.heap_allocations));
  std::printf("  global   %llu label voxels; digest %s\n", count(usage.label_voxels),
              hex64(node.global_digest()).c_str());
}

Outcome<void> check_node(const NodeConfig& config, const std::string& path) {
  const Outcome<void> checked = Node::check(config, path);
  if (checked.ok()) std::printf("%s is in order: robot %u\n", path.c_str(), config.robot);
  return checked;
}

Outcome<void> run_node(const std::string& path, bool only_check) {
  const Outcome<NodeConfig> config = read_node_config(path);
  if (!config.ok()) return config.failure();
  if (only_check) return check_node(*config, path);
  // Before the start is counted: what is counted ends as it is told to.
  stop_by_signal();
  const Outcome<std::unique_ptr<Node>> node = Node::make(*config, path);
  if (!node.ok()) return node.failure();
  const Dataset* const dataset = (*node)->dataset();
  if (dataset != nullptr && !dataset->missing().empty())
    warn("there are no scans " + to_text(dataset->missing()));
  const Outcome<void> done = (*node)->run(requests);
  if (!done.ok()) return done.failure();
  // Whatever becomes of the maps, the report may have room, on another disk say.
  const Outcome<void> written = (*node)->write_maps();
  const Outcome<void> reported = write_report((*node)->report(), config->report);
  warn_of_losses(**node);
  print_summary(**node);
  return written.ok() ? reported : written;
}

}  // namespace

void add_node_command(CLI::App& app, int& exit_status) {
  CLI::App* const command = app.add_subcommand(
      "node", "A robot's process: maps, exchanges with the others, fuses what all have");
  auto path = std::make_shared<std::string>();
  command->add_option("--config", *path, "TOML file; every key is in docs/node.md")->required();
  auto only_check = std::make_shared<bool>(false);
  command->add_flag("--check", *only_check,
                    "Only look whether the configuration and what it names are in order");
  command->footer("Example: tessera node --config robot_0.toml");
  command->callback([path, only_check, &exit_status] {
    const Outcome<void> outcome = run_node(*path, *only_check);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
