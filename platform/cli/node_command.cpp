// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera node: the process of a robot.
#include <fmt/core.h>
#include <signal.h>

#include <atomic>
#include <cerrno>
#include <cstdio>

#include "base/number_text.hpp"
#include "base/stop_signals.hpp"
#include "base/system_failure.hpp"
#include "cli/command.hpp"
#include "cli/losses.hpp"
#include "node/node.hpp"
#include "node/robot_process.hpp"
#include "scans/scan_losses.hpp"

namespace tessera {

namespace {

NodeRequests requests;

void listen_to_signals() {
  stop_by_signals(requests.stop);
  struct sigaction action {};
  ::sigemptyset(&action.sa_mask);
  action.sa_handler = [](int) { requests.save.store(true, std::memory_order_relaxed); };
  ::sigaction(SIGUSR1, &action, nullptr);
  action.sa_handler = [](int) { requests.reload.store(true, std::memory_order_relaxed); };
  ::sigaction(SIGHUP, &action, nullptr);
  // A full disk and a closed standard output are errors of a call and do not end the process.
  for (const int signal : {SIGXFSZ, SIGPIPE}) ::signal(signal, SIG_IGN);
}

void warn_of_losses(const Node& node) {
  const NodeRun& run = node.result();
  const Robot& robot = node.robot();
  const ExchangeReport exchange = robot.exchange().report();
  const GlobalMapReport global = robot.global().report();
  const LinkReport link = node.link().report();
  const auto warn_if = [](std::uint64_t count, const char* thing, const std::string& fate) {
    if (count > 0) warn(counted(count, thing) + " " + fate);
  };
  warn_if(run.mapping.bad_poses, "scan", "left out, with a pose that is not a rigid transform");
  warn_if(run.source.unknown_ids, "point",
          "with class ids that are in no class; taken as unlabelled");
  const MappingThreadState& mapping = run.mapping;
  warn_if(left_out_for_memory(mapping.scans), "refusal",
          "of points or rays for lack of memory; give a larger [map] memory or resolution_m");
  warn_if(left_out_for_work(mapping.scans), "refusal",
          "of points or rays, as the work budget was spent; give a larger [map] work_budget");
  warn_if(mapping.scans.left_out_deadline, "refusal",
          "of points or rays, as the time was up; give a longer [map] deadline_ms or a larger "
          "resolution_m");
  warn_if(
      mapping.window.unpublished_blocks, "block",
      "archived before others had all of them, as memory was short; they have the rest once the "
      "robot returns; give a larger [map] memory");
  warn_if(global.refused_blocks + global.refused_outputs + global.refused_sums +
              global.refused_tallies + global.replicas.replicas_refused_storage,
          "refusal", "of blocks of the global map; give a larger [fusion] memory");
  warn_if(global.replicas.replicas_refused_quota, "refusal",
          "of blocks, as a robot's share is used up; give a larger [fusion] robot_share or memory");
  warn_if(exchange.contributions - exchange.complete - exchange.far_contributions, "contribution",
          "incomplete: more was announced than arrived");
  warn_if(
      link.refused_mission + exchange.refused_mission, "datagram",
      "refused, of another mission or without a fleet key; see [security] mission and fleet_key");
  warn_if(link.refused_tag + exchange.refused_tag, "datagram",
          "refused, as the sender does not have this robot's key; see [security] fleet_key");
  warn_if(node.failed_records(), "map",
          "written without the record of its settings, which is too long; shorten the names of "
          "folders");
  for (const Peer& peer : robot.exchange().peers().all()) {
    if (!peer.mismatch) continue;
    warn(fmt::format("nothing is accepted from robot {}: {}", peer.robot,
                     mismatch_text(*peer.mismatch, robot.exchange().configuration())));
  }
}

void print_summary(const Node& node) {
  const NodeRun& run = node.result();
  const LoopTimes& times = node.times();
  const ExchangeReport exchange = node.robot().exchange().report();
  const MapUsage usage = node.robot().global().map().usage();
  const auto count = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  const std::string far = exchange.far_contributions == 0
                              ? std::string()
                              : ", " + std::to_string(exchange.far_contributions) + " far";
  std::printf("%s, %s heard, %u of %u contributions complete%s; ended by %s after %.1f s\n",
              counted(run.mapping.cycles, "scan").c_str(), counted(exchange.peers, "peer").c_str(),
              exchange.complete, exchange.contributions, far.c_str(), run.ended_by,
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
  std::printf("  global   %llu voxels labelled or occupied; digest %s\n", count(usage.label_voxels),
              hex64(node.global_digest()).c_str());
}

Outcome<void> check_node(const NodeConfig& config, const std::string& path) {
  const Outcome<void> checked = Node::check(config);
  if (checked.ok()) std::printf("%s is valid: robot %u\n", path.c_str(), config.robot);
  return checked;
}

/// Signals the process that runs this robot; the result is in its log.
Outcome<void> reload_node(const NodeConfig& config) {
  TESSERA_TRY_ASSIGN(const pid_t process, find_robot_process(config.state, config.robot));
  const std::string name = std::to_string(process);
  if (::kill(process, SIGHUP) != 0)
    return system_failure("signal process", name, errno, FailureKind::kUsage);
  std::printf("robot %u (process %s) reads [security] exclude and the public keys again\n",
              config.robot, name.c_str());
  return {};
}

enum class NodeTask : std::uint8_t { kRun, kCheck, kReload };

Outcome<void> do_with_node(const std::string& path, NodeTask task) {
  TESSERA_TRY_ASSIGN(const NodeConfig config, read_node_config(path));
  if (task == NodeTask::kCheck) return check_node(config, path);
  if (task == NodeTask::kReload) return reload_node(config);
  // Before the start is counted: a start that is counted ends cleanly at a signal.
  listen_to_signals();
  TESSERA_TRY_ASSIGN(const std::unique_ptr<Node> node, Node::make(config));
  for (const Message& warning : node->warnings()) warn(warning.text(Speaker::kFile));
  TESSERA_TRY(node->run(requests));
  // Even if the maps cannot be written, the report may, for example on another disk.
  const Outcome<void> written = node->write_maps();
  const Outcome<void> reported = write_report(node->report(), config.report);
  warn_of_losses(*node);
  print_summary(*node);
  if (!written.ok()) return config.places.worded(written.failure());
  return reported;
}

}  // namespace

void add_node_command(CLI::App& app, int& exit_status) {
  CLI::App* const command = app.add_subcommand(
      "node", "Run the process of a robot: map, exchange with other robots, fuse the data of all");
  auto path = std::make_shared<std::string>();
  command->add_option("--config", *path, "TOML file; every key is in docs/reference/node.md")
      ->required()
      ->type_name("FILE.toml");
  auto task = std::make_shared<NodeTask>(NodeTask::kRun);
  CLI::Option* const check = command->add_flag_callback(
      "--check", [task] { *task = NodeTask::kCheck; },
      "Only check the configuration and the files that it names");
  command
      ->add_flag_callback(
          "--reload", [task] { *task = NodeTask::kReload; },
          "Make the running node read [security] exclude and the public keys again")
      ->excludes(check);
  command->footer("Example: tessera node --config robot_0.toml");
  command->callback([path, task, &exit_status] {
    const Outcome<void> outcome = do_with_node(*path, *task);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
