// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Hours of a team in virtual time: robots drive, map, share, are cut off, killed and started again,
// and correct themselves; at the end of each minute what must hold is looked at.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "soak/invariants.hpp"
#include "soak/links.hpp"
#include "soak/member.hpp"

namespace tessera::soak {

struct SoakOptions {
  std::uint64_t seed = 1;
  int minutes = 60;
  std::string folder;  ///< Of the state, the checkpoint and minutes.jsonl.
  bool resume = false;
  int robots = 3;
  double resolution_m = 0.4;
  double submap_m = 20.0;
  int map_submaps = 40;  ///< After which a robot begins an empty map; 0: it never does.
  double kills = 0.25;   ///< Of a robot in a minute.
  int checkpoint_minutes = 5;
  /// Of these neither a checkpoint nor another seed may differ.
  [[nodiscard]] Json fixed() const;
};

/// What happened so far.
struct Totals {
  std::uint64_t kills = 0;
  std::uint64_t team_kills = 0;  ///< Of these, times that all were killed at once.
  std::uint64_t restarts = 0;    ///< With the map of before; those of a resumed soak too.
  std::uint64_t maps = 0;        ///< Begun empty.
  std::uint64_t corrections = 0;
  std::uint64_t partitions = 0;
  std::uint64_t violations = 0;
  std::uint64_t late = 0;  ///< Minutes at whose end digests took longer to be equal.
  double worst_settle_s = 0.0;
  double worst_false = 0.0;  ///< Share.
  double worst_ratio = 0.0;  ///< Truth::most_ratio.
  std::uint64_t recounted = 0;
  double worst_miscounted = 0.0;  ///< Truth::most_miscounted.
  double wall_s = 0.0;
  double processor_s = 0.0;
  std::uint64_t allocations = 0;  ///< By processes that are gone, since they were looked at.
  [[nodiscard]] Json state() const;
  void restore(const Json& state);
};

class Soak {
 public:
  explicit Soak(const SoakOptions& options);
  /// Fails as the system does, and where a start refuses what is there.
  Outcome<void> run();
  [[nodiscard]] bool is_clean() const { return totals_.violations == 0; }

 private:
  static constexpr std::int64_t kStep_us = 50'000;
  static constexpr int kStepsOfScan = 10;  ///< 2 Hz.
  static constexpr int kStepsOfMinute = 1200;
  static constexpr int kDrivenSteps = 900;  ///< Then all stand, and digests become equal.
  static constexpr int kLastKill = 1000;
  static constexpr int kMostDown = 100;
  static constexpr std::int64_t kMostSettle_us = 90'000'000;

  struct Robot {
    Robot(const MemberConfig& config, const ClassTable& classes, const street::StreetGrid& grid,
          std::uint64_t seed)
        : member(config, classes), drive(grid, seed, static_cast<int>(config.node.robot)) {}
    Member member;
    Drive drive;
    int up_at = -1;  ///< Step of the minute at which it is started; -1: it runs.
    std::uint64_t scans = 0;
  };
  /// Of a robot in a minute.
  struct Fate {
    int kill_at = -1;
    int stage = 0;  ///< Of the step, after which it is killed.
    int down = 0;   ///< Steps.
  };

  Outcome<void> set_up();
  Outcome<void> run_minute();
  void draw_fates();
  void look_for_partition(int step);
  Outcome<void> step(int step, bool drives);
  Outcome<void> work(Robot& robot, int step, bool drives);
  Outcome<void> drive(Robot& robot);
  Outcome<void> begin_map(Robot& robot);
  void correct(Robot& robot);  // correction.cpp
  void kill(Robot& robot, int step);
  [[nodiscard]] bool is_killed(const Robot& robot, int step, int stage) const;
  [[nodiscard]] std::int64_t clock_us(const Robot& robot) const;
  [[nodiscard]] bool agree();
  Outcome<double> settle();
  // report.cpp
  [[nodiscard]] Json check(double settle_s);
  void report_fault(const std::string& fault);
  void say_minute(const Json& row) const;
  void say_totals() const;
  [[nodiscard]] double way_km() const;
  // checkpoint.cpp
  [[nodiscard]] std::string path(const char* name) const;
  Outcome<void> save_checkpoint();
  Outcome<void> load_checkpoint();
  [[nodiscard]] Json state() const;
  void restore(const Json& state);

  SoakOptions options_;
  FileDescriptor lock_;
  street::StreetGrid grid_;
  Scanner scanner_;
  Links links_;
  Logbook logbook_;
  std::vector<std::unique_ptr<Robot>> robots_;
  std::vector<Fate> fates_;
  int minute_ = 0;
  std::int64_t now_us_ = 1'000'000;
  int partition_at_ = -1;              ///< Step of this minute at which one begins.
  std::int64_t partition_end_us_ = 0;  ///< 0: there is none.
  Totals totals_;
};

}  // namespace tessera::soak
