// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera play: sends a dataset as live sensors.
#include <cstdio>

#include "base/json.hpp"
#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "base/progress.hpp"
#include "cli/command.hpp"
#include "cli/dataset_player.hpp"
#include "cli/number_options.hpp"

namespace tessera {

namespace {

struct PlayOptions {
  std::string dataset;
  std::optional<int> first;
  std::optional<int> last;
  std::string labels = "predictions";
  std::string messages = "semantic";
  std::string poses = "lcm";
  std::string can;
  std::optional<std::uint32_t> can_base;
  std::string clock = "monotonic";
  bool loop = false;
  std::string report;
  PlayerConfig player;
};

Json report_of(const DatasetPlayer& player, const PlayOptions& options) {
  const PlayerReport& report = player.report();
  return {{"scans", report.scans},
          {"images", report.images},
          {"poses", report.poses},
          {"bad_poses", report.bad_poses},
          {"late", report.late},
          {"worst_late_ms", 1e-3 * static_cast<double>(report.worst_late_us)},
          {"frames", report.frames},
          {"frames_lost", report.frames_lost},
          {"sent_bytes", player.sender().sent_bytes()},
          {"config",
           {{"dataset", options.dataset},
            {"first", options.first ? Json(*options.first) : Json()},
            {"last", options.last ? Json(*options.last) : Json()},
            {"messages", options.messages},
            {"labels", options.labels},
            {"poses", options.poses},
            {"can", options.can},
            {"can_base", options.can_base.value_or(kDefaultBaseId)},
            {"sensor", options.player.sensor},
            {"rate", options.player.rate_hz},
            {"clock", options.clock},
            {"url", options.player.url},
            {"interface", options.player.interface},
            {"report", options.report}}}};
}

Outcome<void> check_usage(const PlayOptions& options) {
  const auto refusal = [](const char* option, const std::string& given, const char* choices) {
    return Failure{std::string(option) + " " + one_line(given) + " is not allowed; give " +
                   choices};
  };
  if (options.messages != "semantic" && options.messages != "raw")
    return refusal("--messages", options.messages, "semantic or raw");
  if (options.poses != "lcm" && options.poses != "can" && options.poses != "none")
    return refusal("--poses", options.poses, "lcm, can or none");
  if (options.poses == "can" && options.can.empty())
    return Failure{"--poses can needs a bus; name its interface with --can"};
  if (options.poses != "can" && (!options.can.empty() || options.can_base))
    return Failure{"--can and --can-base need --poses can; give it, or leave them out"};
  if (!is_base_id(options.can_base.value_or(kDefaultBaseId)))
    return refusal("--can-base", std::to_string(*options.can_base), "a multiple of 32 up to 2016");
  if (options.clock != "monotonic" && options.clock != "wall")
    return refusal("--clock", options.clock, "monotonic or wall");
  if (!(options.player.rate_hz >= 0.1 && options.player.rate_hz <= 1000.0))
    return refusal("--rate", text_of(options.player.rate_hz), "scans per second from 0.1 to 1000");
  if (options.messages == "semantic" && options.labels == kNoLabels)
    return refusal("--labels", options.labels, "a folder of labels, or --messages raw");
  if (options.loop && !options.report.empty())
    return Failure{"--loop has no end at which --report would be written; give only one of them"};
  return check_outputs({{"--report", options.report}}, {}, {.path = options.dataset});
}

void print_summary(const DatasetPlayer& player, const PlayOptions& options) {
  const PlayerReport& report = player.report();
  const std::string images =
      report.images > 0 ? ", " + counted(report.images, "label image") : std::string();
  const std::string frames = options.can.empty()
                                 ? std::string()
                                 : " and " + counted(report.frames, "frame") + " to " + options.can;
  std::printf("%s%s and %s sent to %s%s, %.1f MB, stamped by the %s clock; at most %.1f ms late\n",
              counted(report.scans, "scan").c_str(), images.c_str(),
              counted(report.poses, "pose").c_str(), options.player.url.c_str(), frames.c_str(),
              1e-6 * static_cast<double>(player.sender().sent_bytes()), options.clock.c_str(),
              1e-3 * static_cast<double>(report.worst_late_us));
  if (report.bad_poses > 0)
    warn(counted(report.bad_poses, "scan") + " sent without a pose, as theirs is not rigid");
  if (report.late > 0)
    warn("late by over a period " + counted(report.late, "time") +
         ", which delayed what followed; give a lower --rate, or reduce the load of the machine");
  if (report.frames_lost > 0)
    warn(counted(report.frames_lost, "frame") + " not taken by the bus; see \"ip -details " +
         "-statistics link show " + options.can + "\"");
}

Outcome<void> run_play(PlayOptions options) {
  const Outcome<void> usage = check_usage(options);
  if (!usage.ok()) return usage.failure();
  options.player.semantic = options.messages == "semantic";
  options.player.sends_poses = options.poses == "lcm";
  options.player.can_interface = options.can;
  options.player.loop = options.loop;
  options.player.can_base_id = options.can_base.value_or(kDefaultBaseId);
  options.player.clock = options.clock == "wall" ? SensorClock::kWall : SensorClock::kMonotonic;
  DatasetOptions dataset_options;
  dataset_options.first = options.first;
  dataset_options.last = options.last;
  dataset_options.labels = options.player.semantic ? options.labels : std::string(kNoLabels);
  dataset_options.with_motion = true;
  // The node corrects raw clouds for motion.
  if (!options.player.semantic) dataset_options.deskew = Deskewing::kOff;
  const Outcome<Dataset> dataset = Dataset::open(options.dataset, dataset_options);
  if (!dataset.ok()) return dataset.failure();
  std::optional<Progress> progress;
  if (!options.loop) {
    progress.emplace("playing", dataset->num_scans());
    options.player.progress = [&progress](std::uint64_t scans) { progress->update(scans); };
  }
  const Outcome<std::unique_ptr<DatasetPlayer>> player =
      DatasetPlayer::open(options.player, *dataset, options.dataset);
  if (!player.ok()) return player.failure();
  do {
    const Outcome<void> played = (*player)->play();
    if (!played.ok()) return played.failure();
  } while (options.loop);
  progress->finish();
  print_summary(**player, options);
  return write_report(report_of(**player, options), options.report);
}

}  // namespace

void add_play_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("play", "Send a dataset over LCM as the sensors of this machine would");
  auto o = std::make_shared<PlayOptions>();
  command->add_option("--dataset", o->dataset, "Folder of the dataset to send")->required();
  command->add_option("--first", o->first, "First scan number")->check(whole_number<int>());
  command->add_option("--last", o->last, "Last scan number")->check(whole_number<int>());
  command->add_option("--labels", o->labels, "Folder of labels")->capture_default_str();
  command
      ->add_option("--messages", o->messages,
                   "semantic: labelled clouds; raw: clouds as measured, and label images")
      ->capture_default_str();
  command
      ->add_option("--poses", o->poses,
                   "How poses are sent: lcm; can: a simulated vehicle on the bus --can; none")
      ->capture_default_str();
  command->add_option("--can", o->can, "CAN interface, with --poses can");
  command->add_option("--can-base", o->can_base, "CAN identifier of COMMAND, 256 by default")
      ->check(whole_number<std::uint32_t>());
  command->add_option("--sensor", o->player.sensor, "Sensor number of the clouds")
      ->check(whole_number<std::int32_t>())
      ->capture_default_str();
  command->add_option("--rate", o->player.rate_hz, "Scans per second, 0.1 to 1000")
      ->check(decimal_number())
      ->capture_default_str();
  command->add_option("--clock", o->clock, "Clock of the stamps: monotonic or wall")
      ->capture_default_str();
  command->add_option("--url", o->player.url, "LCM network of the sensors; its ttl must be 0")
      ->capture_default_str();
  command
      ->add_option("--interface", o->player.interface, "Network interface, by name or IPv4 address")
      ->capture_default_str();
  command->add_flag("--loop", o->loop, "Play forward and backward until interrupted");
  command->add_option("--report", o->report, "JSON report to write");
  command->footer("Example: tessera play --dataset street/robot_0 --rate 10");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_play(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
