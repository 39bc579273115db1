// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera play: sends recorded scans as live sensors.
#include <cstdio>

#include "base/json.hpp"
#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "base/progress.hpp"
#include "cli/command.hpp"
#include "cli/number_options.hpp"
#include "cli/scan_player.hpp"
#include "cli/source_arguments.hpp"
#include "scans/dataset.hpp"

namespace tessera {

namespace {

struct PlayOptions {
  SourceOptions source;
  std::string messages = "semantic";
  std::string poses;       ///< A file of poses; or, as earlier, how they are sent.
  std::string send_poses;  ///< Empty: lcm.
  std::string can;
  std::optional<std::uint32_t> can_base;
  std::string clock = "monotonic";
  bool loop = false;
  std::string report;
  PlayerConfig player;
};

Json report_of(const ScanPlayer& player, const PlayOptions& options) {
  const PlayerReport& report = player.report();
  Json config = to_json(options.source);
  config["poses_file"] = options.source.poses;
  config["poses"] = options.send_poses;
  config["messages"] = options.messages;
  config["can"] = options.can;
  config["can_base"] = options.can_base.value_or(kDefaultBaseId);
  config["sensor"] = options.player.sensor;
  config["rate"] = options.player.rate_hz;
  config["clock"] = options.clock;
  config["url"] = options.player.url;
  config["interface"] = options.player.interface;
  config["report"] = options.report;
  return {{"scans", report.scans},
          {"images", report.images},
          {"poses", report.poses},
          {"bad_poses", report.bad_poses},
          {"late", report.late},
          {"worst_late_ms", 1e-3 * static_cast<double>(report.worst_late_us)},
          {"frames", report.frames},
          {"frames_lost", report.frames_lost},
          {"sent_bytes", player.sender().sent_bytes()},
          {"config", config}};
}

bool is_way_to_send(const std::string& text) {
  return text == "lcm" || text == "can" || text == "none";
}

/// A dataset has its own poses, so that --poses says how they are sent, as it always did.
const char* way_option(const PlayOptions& options) {
  return options.source.dataset.empty() ? "--send-poses" : "--poses";
}

void tell_poses_apart(PlayOptions& options) {
  const bool is_way = is_way_to_send(options.poses) || !options.source.dataset.empty();
  if (is_way && options.send_poses.empty()) {
    options.send_poses = options.poses;
  } else {
    options.source.poses = options.poses;
  }
  if (options.send_poses.empty()) options.send_poses = "lcm";
}

Outcome<void> check_usage(const PlayOptions& options) {
  const auto refusal = [](const char* option, const std::string& given, const char* choices) {
    return Failure{std::string(option) + " " + one_line(given) + " is not allowed; give " +
                   choices};
  };
  if (options.messages != "semantic" && options.messages != "raw")
    return refusal("--messages", options.messages, "semantic or raw");
  const char* const way = way_option(options);
  if (!is_way_to_send(options.send_poses))
    return refusal(way, options.send_poses, "lcm, can or none");
  if (options.send_poses == "can" && options.can.empty())
    return Failure{std::string(way) + " can needs a bus; name its interface with --can"};
  if (options.send_poses != "can" && (!options.can.empty() || options.can_base))
    return Failure{std::string("--can and --can-base need ") + way +
                   " can; give it, or leave them out"};
  if (!is_base_id(options.can_base.value_or(kDefaultBaseId)))
    return refusal("--can-base", std::to_string(*options.can_base), "a multiple of 32 up to 2016");
  if (options.clock != "monotonic" && options.clock != "wall")
    return refusal("--clock", options.clock, "monotonic or wall");
  if (!(options.player.rate_hz >= 0.1 && options.player.rate_hz <= 1000.0))
    return refusal("--rate", text_of(options.player.rate_hz), "scans per second from 0.1 to 1000");
  if (options.messages == "semantic" && options.source.labels == kNoLabels)
    return refusal("--labels", options.source.labels, "a folder of labels, or --messages raw");
  if (options.messages == "raw" && options.source.deskew == "on")
    return Failure{"--messages raw sends scans as measured; leave --deskew out, or give off"};
  if (options.loop && !options.report.empty())
    return Failure{"--loop has no end at which --report would be written; give only one of them"};
  const Outcome<void> source = check_source(options.source);
  if (!source.ok()) return source.failure();
  const Outcome<std::vector<NamedFile>> inputs = cloud_files(options.source);
  if (!inputs.ok()) return inputs.failure();
  return check_outputs({{"--report", options.report}}, *inputs, dataset_folder(options.source));
}

void print_summary(const ScanPlayer& player, const PlayOptions& options) {
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

/// The node corrects raw clouds for motion, and labels them.
SourceOptions as_measured(SourceOptions source) {
  if (source.dataset.empty()) return source;
  source.labels = kNoLabels;
  source.deskew = "off";
  return source;
}

Outcome<void> run_play(PlayOptions options) {
  tell_poses_apart(options);
  const Outcome<void> usage = check_usage(options);
  if (!usage.ok()) return usage.failure();
  options.player.semantic = options.messages == "semantic";
  options.player.sends_poses = options.send_poses == "lcm";
  options.player.can_interface = options.can;
  options.player.loop = options.loop;
  options.player.can_base_id = options.can_base.value_or(kDefaultBaseId);
  options.player.clock = options.clock == "wall" ? SensorClock::kWall : SensorClock::kMonotonic;
  const bool semantic = options.player.semantic;
  const Outcome<std::unique_ptr<RecordedScans>> scans =
      open_source(semantic ? options.source : as_measured(options.source),
                  {.motion = true, .times = !semantic, .images = !semantic});
  if (!scans.ok()) return scans.failure();
  std::optional<Progress> progress;
  if (!options.loop) {
    progress.emplace("playing", (*scans)->num_scans());
    options.player.progress = [&progress](std::uint64_t sent) { progress->update(sent); };
  }
  const Outcome<std::unique_ptr<ScanPlayer>> player = ScanPlayer::open(options.player, **scans);
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
  CLI::App* const command = app.add_subcommand(
      "play", "Send recorded scans over LCM as the sensors of this machine would");
  auto o = std::make_shared<PlayOptions>();
  declare_source_folders(*command, o->source);
  command->add_option(
      "--poses", o->poses,
      "File of poses, for --pcd, --ply and --depth; with --dataset as --send-poses");
  declare_source_choice(*command, o->source);
  command
      ->add_option("--messages", o->messages,
                   "semantic: labelled clouds; raw: clouds or depth images as measured, and label "
                   "images")
      ->capture_default_str();
  command->add_option(
      "--send-poses", o->send_poses,
      "How poses are sent: lcm; can: a simulated vehicle on the bus --can; none [lcm]");
  command->add_option("--can", o->can, "CAN interface, with --send-poses can");
  command->add_option("--can-base", o->can_base, "CAN identifier of COMMAND, 256 by default")
      ->check(whole_number<std::uint32_t>());
  command->add_option("--sensor", o->player.sensor, "Sensor number of the clouds or depth images")
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
  command->callback([command, o, &exit_status] {
    o->source.labels_given = command->count("--labels") > 0;
    const Outcome<void> outcome = run_play(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
