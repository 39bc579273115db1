// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera play: sends recorded scans as live sensors.
#include <cstdio>

#include "base/json.hpp"
#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "base/progress.hpp"
#include "cli/command.hpp"
#include "cli/open_source.hpp"
#include "cli/scan_player.hpp"
#include "cli/setting_options.hpp"
#include "scans/dataset.hpp"

namespace tessera {

namespace {

struct PlayOptions {
  SourceOptions source;
  std::string messages = "semantic";
  std::string poses;          ///< A file of poses; or, as earlier, how they are sent.
  std::string send_poses;     ///< Empty: lcm.
  bool way_by_poses = false;  ///< --poses said how they are sent.
  std::string can;
  std::optional<std::uint32_t> can_base;
  bool loop = false;
  std::string report;
  std::vector<std::string> corrections;
  PlayerConfig player;
};

constexpr std::array<std::string_view, 2> kMessages{"semantic", "raw"};
constexpr Setting kPlayRows[] = {
    row<&PlayOptions::messages>(
        {"--messages"},
        "semantic: labelled clouds; raw: clouds or depth images as measured, and label images",
        {.choices = kMessages}),
    row<&PlayOptions::poses>(
        {"--poses"}, "File of poses, for --pcd, --ply and --depth; with --dataset as --send-poses",
        {.value = "FILE|lcm|can|none"}),
    row<&PlayOptions::send_poses>(
        {"--send-poses"},
        "How poses are sent: lcm; can: a simulated vehicle on the bus --can; none",
        {.value = "lcm|can|none", .otherwise = "lcm"}),
    row<&PlayOptions::can>({"--can"}, "CAN interface, with --send-poses can", {.value = "NAME"}),
    row<&PlayOptions::can_base>({"--can-base"},
                                "CAN identifier of COMMAND; a multiple of 32 up to 2016",
                                {.value = "ID", .otherwise = "256"}),
    row<&PlayOptions::player, &PlayerConfig::sensor>(
        {"--sensor"},
        "Sensor number of the clouds or depth images; the body's frame is the sensor's",
        {.value = "N"}),
    row<&PlayOptions::player, &PlayerConfig::rate_hz>(
        {"--rate"}, "Rate of the scans",
        {.value = "HZ", .allowed = from_to(0.1, 1000.0, "scans per second")}),
    row<&PlayOptions::player, &PlayerConfig::clock>(
        {"--clock"}, "Clock of the stamps; the node must use the same"),
    row<&PlayOptions::player, &PlayerConfig::url>(
        {"--url"}, "LCM network of the sensors; its ttl must be 0", {.value = "URL"}),
    row<&PlayOptions::player, &PlayerConfig::interface>(
        {"--interface"}, "Network interface, by name or IPv4 address", {.value = "NAME"}),
    row<&PlayOptions::player, &PlayerConfig::robot>(
        {"--robot"}, "Number of the robot, which --corrections are for", {.value = "ID"}),
    row<&PlayOptions::loop>(
        {"--loop"}, "Play forward and backward until interrupted; no pose jumps", {.flag = true}),
    path_row<&PlayOptions::report>({"--report"}, "JSON report to write, not with --loop",
                                   {.value = "FILE"}),
};
constexpr SettingTable<PlayOptions> kPlaySettings{kPlayRows};

Json report_of(const ScanPlayer& player, const PlayOptions& options) {
  const PlayerReport& report = player.report();
  Json config = to_json(options.source);
  config.update(json_of(kPlaySettings, options));
  config["poses_file"] = options.source.poses;
  config["poses"] = options.send_poses;
  config["can_base"] = options.can_base.value_or(kDefaultBaseId);
  for (const char* const key : {"send_poses", "loop"}) config.erase(key);
  return {{"scans", report.scans},
          {"images", report.images},
          {"poses", report.poses},
          {"bad_poses", report.bad_poses},
          {"corrections", report.corrections},
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

/// The option that the user gave.
const SettingName& way_option(const PlayOptions& options) {
  return options.way_by_poses ? kPlaySettings["--poses"] : kPlaySettings["--send-poses"];
}

/// A dataset has its own poses, so that --poses says how they are sent, as it always did.
void tell_poses_apart(PlayOptions& options) {
  const bool is_way = is_way_to_send(options.poses) || !options.source.dataset.empty();
  if (is_way && options.send_poses.empty()) {
    options.send_poses = options.poses;
    options.way_by_poses = !options.poses.empty();
  } else {
    options.source.poses = options.poses;
  }
  if (options.send_poses.empty()) options.send_poses = "lcm";
}

Outcome<void> check_usage(const PlayOptions& options) {
  const SettingName& way = way_option(options);
  if (!is_way_to_send(options.send_poses))
    return not_allowed(way, options.send_poses, "lcm, can or none");
  if (options.send_poses == "can" && options.can.empty())
    return Failure{Message(way) + " can needs a bus; name its interface with --can"};
  if (options.send_poses != "can" && (!options.can.empty() || options.can_base))
    return Failure{Message("--can and --can-base need ") + way +
                   " can; give it, or leave them out"};
  if (!is_base_id(options.can_base.value_or(kDefaultBaseId)))
    return not_allowed(kPlaySettings["--can-base"], std::to_string(*options.can_base),
                       "a multiple of 32 up to 2016");
  if (options.messages == "semantic" && options.source.labels == kNoLabels)
    return not_allowed(kSourceSettings["--labels"], std::string(kNoLabels),
                       "a folder of labels, or --messages raw");
  if (options.messages == "raw" && options.source.deskew == true)
    return Failure{"--messages raw sends scans as measured; leave --deskew out, or give off"};
  if (options.loop && !options.report.empty())
    return Failure{"--loop has no end at which --report would be written; give only one of them"};
  if (options.source.first.value_or(0) != 0 && !options.corrections.empty())
    return Failure{
        "--corrections have a row for each scan from the first one on; leave out --first"};
  if (options.loop && !options.corrections.empty())
    return Failure{"--corrections are of scans that are played once; leave out --loop"};
  TESSERA_TRY(check_source(options.source));
  TESSERA_TRY_ASSIGN(std::vector<NamedFile> inputs, cloud_files(options.source));
  for (const std::string& path : options.corrections) inputs.push_back({"--corrections", path});
  return check_outputs({{"--report", options.report}}, inputs, dataset_folder(options.source));
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
              1e-6 * static_cast<double>(player.sender().sent_bytes()),
              to_string(options.player.clock), 1e-3 * static_cast<double>(report.worst_late_us));
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
  source.labels = std::string(kNoLabels);
  source.deskew = false;
  return source;
}

Outcome<void> run_play(PlayOptions options) {
  tell_poses_apart(options);
  TESSERA_TRY(check_usage(options));
  options.player.semantic = options.messages == "semantic";
  options.player.sends_poses = options.send_poses == "lcm";
  options.player.can_interface = options.can;
  options.player.loop = options.loop;
  options.player.can_base_id = options.can_base.value_or(kDefaultBaseId);
  const bool semantic = options.player.semantic;
  TESSERA_TRY_ASSIGN(
      const std::unique_ptr<RecordedScans> scans,
      open_source(semantic ? options.source : as_measured(options.source),
                  {.motion = true, .times = !semantic, .images = !semantic, .no_returns = true}));
  TESSERA_TRY_ASSIGN(options.player.corrections,
                     read_corrections(options.corrections, options.source));
  for (const CorrectionFile& file : options.player.corrections) {
    if (!file.rows.stamps_s.empty())
      return Failure{file.path + " has stamps; give a row for each of the first scans"};
  }
  std::optional<Progress> progress;
  if (!options.loop) {
    progress.emplace("playing", scans->num_scans());
    options.player.progress = [&progress](std::uint64_t sent) { progress->update(sent); };
  }
  TESSERA_TRY_ASSIGN(const std::unique_ptr<ScanPlayer> player,
                     ScanPlayer::open(options.player, *scans));
  if (options.loop) {
    std::printf("%s are sent forward and backward to %s, until interrupted\n",
                counted(scans->num_scans(), "scan").c_str(), options.player.url.c_str());
    std::fflush(stdout);
  }
  do {
    TESSERA_TRY(player->play());
  } while (options.loop);
  progress->finish();
  print_summary(*player, options);
  return write_report(report_of(*player, options), options.report);
}

}  // namespace

void add_play_command(CLI::App& app, int& exit_status) {
  CLI::App* const command = app.add_subcommand(
      "play", "Send recorded scans over LCM as the sensors of this machine would");
  auto o = std::make_shared<PlayOptions>();
  declare_settings(*command, kSourceSettings, o->source, {"--poses"});
  declare_settings(*command, kPlaySettings, *o);
  command
      ->add_option(
          "--corrections", o->corrections,
          "Corrected poses, sent as by a pose graph: a row for each of the first scans; sent "
          "after the last of these; may be repeated")
      ->type_name("FILE");
  command->footer("Example: tessera play --dataset street/robot_0 --rate 10");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_play(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
