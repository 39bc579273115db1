// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "soak/soak.hpp"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

namespace tessera::soak {

namespace {

constexpr double kTeamKills = 0.02;  ///< Of minutes.
constexpr double kPartitions = 0.25;

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

double processor_s() {
  timespec now{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// As a node that maps in submaps: settings of the file, with those that the soak has in small.
NodeConfig node_config(const SoakOptions& options, std::uint32_t number) {
  NodeConfig node;
  node.robot = number;
  node.state = options.folder + "/state/robot_" + std::to_string(number);
  node.sensors.enabled = true;
  node.map.resolution_m = options.resolution_m;
  node.map.inference = InferenceMode::kCounting;
  node.map.max_range_m = Scanner::kRange_m;
  node.map.submap_length_m = options.submap_m;
  node.map.memory_bytes = std::size_t{64} << 20U;
  node.fusion_memory_bytes = std::size_t{512} << 20U;
  node.diffusion.mode = DiffusionMode::kNone;
  node.work_per_tick = 30'000;
  node.staleness_s = 5.0;
  node.free_staleness_s = 20.0;
  return node;
}

/// Each robot's map has a frame of its own.
FlatPose frame_of(std::uint32_t number) {
  return {31.0 * number, -17.0 * number, 0.25 * number, 0.7 * number};
}

}  // namespace

Soak::Soak(const SoakOptions& options)
    : options_(options),
      grid_({.seed = options.seed}),
      scanner_(grid_, options.seed),
      links_(options.robots, {}),
      logbook_(static_cast<std::size_t>(options.robots)),
      fates_(static_cast<std::size_t>(options.robots)) {
  for (std::uint32_t number = 0; number < static_cast<std::uint32_t>(options.robots); ++number) {
    robots_.push_back(std::make_unique<Robot>(
        MemberConfig{node_config(options, number), frame_of(number), options.seed},
        scanner_.classes(), grid_, options.seed));
  }
}

std::int64_t Soak::clock_us(const Robot& robot) const {
  return now_us_ + std::int64_t{86'400'000'000} * robot.member.number();
}

/// One soak in a folder at a time.
Outcome<void> Soak::set_up() {
  TESSERA_TRY_ASSIGN(lock_, lock_robot(options_.folder, 0));
  if (options_.resume) return load_checkpoint();
  std::error_code error;
  std::filesystem::remove_all(path("state"), error);
  std::filesystem::remove(path("minutes.jsonl"), error);
  for (const auto& robot : robots_) TESSERA_TRY(begin_map(*robot));
  return {};
}

Outcome<void> Soak::run() {
  TESSERA_TRY(set_up());
  while (minute_ < options_.minutes) {
    TESSERA_TRY(run_minute());
    if (minute_ % options_.checkpoint_minutes == 0 || minute_ == options_.minutes)
      TESSERA_TRY(save_checkpoint());
  }
  say_totals();
  return {};
}

Outcome<void> Soak::run_minute() {
  const auto begin = std::chrono::steady_clock::now();
  const double processor_before_s = processor_s();
  links_.seed(street::hash_of(options_.seed, street::Stream::kTraffic, minute_));
  draw_fates();
  for (int i = 0; i < kStepsOfMinute; ++i) TESSERA_TRY(step(i, i < kDrivenSteps));
  TESSERA_TRY_ASSIGN(const double settle_s, settle());
  ++minute_;
  Json row = check(settle_s);
  row["wall_s"] = seconds_since(begin);
  row["processor_s"] = processor_s() - processor_before_s;
  totals_.wall_s += row["wall_s"].get<double>();
  totals_.processor_s += row["processor_s"].get<double>();
  say_minute(row);
  return {};
}

void Soak::draw_fates() {
  street::Random draw(street::hash_of(options_.seed, street::Stream::kWalker, minute_));
  const bool all = draw.chance(kTeamKills);
  const int all_at = draw.below(kLastKill);
  totals_.team_kills += all ? 1U : 0U;
  for (Fate& fate : fates_) {
    const bool is_killed = draw.chance(options_.kills);
    const int at = draw.below(kLastKill);
    fate.kill_at = all ? all_at : is_killed ? at : -1;
    fate.stage = draw.below(5);
    fate.down = 1 + draw.below(kMostDown);
  }
  const bool begins = draw.chance(kPartitions);
  const int at = draw.below(kStepsOfMinute);
  partition_at_ = begins ? at : -1;
}

/// One robot alone, or each.
void Soak::look_for_partition(int step) {
  if (partition_end_us_ != 0 && now_us_ >= partition_end_us_) {
    links_.partition(std::vector<int>(robots_.size(), 0));
    partition_end_us_ = 0;
  }
  if (step != partition_at_ || partition_end_us_ != 0) return;
  street::Random draw(street::hash_of(options_.seed, street::Stream::kVerge, minute_));
  std::vector<int> groups(robots_.size(), 0);
  const int alone = draw.below(static_cast<int>(robots_.size()) + 1);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const auto number = static_cast<int>(i);
    if (alone == static_cast<int>(robots_.size())) groups[i] = number;
    if (alone == number) groups[i] = 1;
  }
  links_.partition(std::move(groups));
  partition_end_us_ = now_us_ + static_cast<std::int64_t>(draw.uniform(20e6, 150e6));
  ++totals_.partitions;
}

Outcome<void> Soak::step(int step, bool drives) {
  now_us_ += kStep_us;
  look_for_partition(step);
  for (const auto& robot : robots_) {
    if (robot->member.is_running()) {
      TESSERA_TRY(work(*robot, step, drives));
    } else if (step >= robot->up_at) {
      links_.drop_for(static_cast<int>(robot->member.number()));
      TESSERA_TRY(robot->member.start(true));
      robot->up_at = -1;
      ++totals_.restarts;
    }
  }
  return {};
}

bool Soak::is_killed(const Robot& robot, int step, int stage) const {
  const Fate& fate = fates_[robot.member.number()];
  return fate.kill_at == step && fate.stage == stage;
}

void Soak::kill(Robot& robot, int step) {
  totals_.allocations += robot.member.allocations().value_or(0);
  robot.member.kill();
  robot.up_at = step + fates_[robot.member.number()].down;
  ++totals_.kills;
}

/// What a process does in a step, with the places where it may be killed.
Outcome<void> Soak::work(Robot& robot, int step, bool drives) {
  Member& member = robot.member;
  const auto number = static_cast<int>(member.number());
  const std::int64_t clock = clock_us(robot);
  while (const std::shared_ptr<const Links::Bytes> bytes = links_.receive(number, now_us_))
    member.receive(*bytes, clock);
  if (is_killed(robot, step, 0)) return kill(robot, step), Outcome<void>();
  // Each at another time than the others.
  if (drives && (step + 3 * number) % kStepsOfScan == 0) TESSERA_TRY(drive(robot));
  if (is_killed(robot, step, 1)) return kill(robot, step), Outcome<void>();
  member.tick(clock);
  if (is_killed(robot, step, 2)) return kill(robot, step), Outcome<void>();
  while (true) {
    const std::span<const std::byte> bytes = member.send(clock);
    if (bytes.empty()) break;
    links_.send(number, Links::Bytes(bytes.begin(), bytes.end()), now_us_);
  }
  TESSERA_TRY(member.keep_ended());
  if (is_killed(robot, step, 3)) return kill(robot, step), Outcome<void>();
  TESSERA_TRY(member.keep(clock));
  if (is_killed(robot, step, 4)) kill(robot, step);
  return {};
}

Outcome<void> Soak::drive(Robot& robot) {
  Member& member = robot.member;
  const std::int64_t most = options_.map_submaps;
  if (most != 0 && member.submaps() >= most) {
    totals_.allocations += member.allocations().value_or(0);
    member.kill();
    return begin_map(robot);
  }
  const bool closes = robot.drive.step(1e-6 * static_cast<double>(kStep_us * kStepsOfScan));
  const std::uint64_t noise =
      street::hash_of(options_.seed, street::Stream::kBeam, member.number(), robot.scans++);
  const ScanView scan = scanner_.scan(robot.drive.truth(), noise);
  const FlatPose T_map_sensor = product(inverse(member.T_global_map()), robot.drive.odometry());
  const ScanReport report = member.integrate(scan, T_map_sensor, clock_us(robot));
  if (report.pose == Status::kOk) {
    MappedSubmap& submap = logbook_.submap(member.number(), member.robot().maps().number());
    submap.scans.push_back({clock_us(robot), T_map_sensor, robot.drive.truth()});
    submap.evidence += report.points_kept();
  }
  if (closes) correct(robot);
  return {};
}

Outcome<void> Soak::begin_map(Robot& robot) {
  TESSERA_TRY(robot.member.start(false));
  logbook_.begin_map(robot.member.number(), robot.member.map_epoch());
  robot.drive.begin_map();
  ++totals_.maps;
  return {};
}

/// Robots that hear each other hold and show the same.
bool Soak::agree() {
  std::vector<std::optional<Digests>> of_group(robots_.size());
  for (const auto& robot : robots_) {
    if (!robot->member.is_running()) return false;
    robot->member.robot().finish();
    const auto group = static_cast<std::size_t>(links_.groups()[robot->member.number()]);
    const Digests digests = digests_of(robot->member.robot());
    if (!of_group[group]) of_group[group] = digests;
    if (!(*of_group[group] == digests)) return false;
  }
  return true;
}

/// Seconds until they agree beyond the minute; all of kMostSettle_us: they do not.
Outcome<double> Soak::settle() {
  constexpr int kStepsBetween = 20;
  std::int64_t waited_us = 0;
  while (!agree() && waited_us < kMostSettle_us) {
    for (int i = 0; i < kStepsBetween; ++i) TESSERA_TRY(step(kStepsOfMinute, false));
    waited_us += kStepsBetween * kStep_us;
  }
  return 1e-6 * static_cast<double>(waited_us);
}

double Soak::way_km() const {
  double sum_m = 0.0;
  for (const auto& robot : robots_) sum_m += robot->drive.way_m();
  return 1e-3 * sum_m;
}

}  // namespace tessera::soak
