// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What does it cost a robot to keep account of thousands of submaps? A team in which everybody
// holds everything, on a simulated network in virtual time; processor time of one of its robots for
// receiving, sending and fusing, 10 times a second: while nobody has anything new, while all map,
// and after all have corrected a part of their submaps. Taking news in is part of the latter two.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <deque>
#include <random>

#include "far_robots.hpp"
#include "thread_time.hpp"

namespace tessera::bench {

namespace {

constexpr std::int64_t kTick_us = 100'000;

struct ManyOptions {
  FarOptions far{.submaps = 500, .blocks = 8};
  std::uint32_t robots = 8;
  std::uint32_t seconds = 60;
  std::uint32_t corrected = 100;
};

/// The time that the first robot takes, by ticks.
class Team {
 public:
  explicit Team(const ManyOptions& options) : options_(options), random_(options.far.submaps) {
    for (std::uint32_t i = 1; i <= options.robots; ++i)
      robots_.push_back(std::make_unique<FullRobot>(i, options.robots, options.far));
  }

  [[nodiscard]] FullRobot& robot(std::size_t i) { return *robots_[i]; }
  [[nodiscard]] std::size_t size() const { return robots_.size(); }

  /// Milliseconds of the first robot in a tick.
  double tick() {
    double took_ms = 0.0;
    for (std::size_t i = 0; i < robots_.size(); ++i) {
      const double before_ms = thread_cpu_ms();
      for (std::vector<std::byte>& datagram : arriving_[i])
        robots_[i]->exchange.receive(datagram, now_us_);
      arriving_[i].clear();
      sent_.clear();
      while (const std::size_t size = robots_[i]->exchange.send(now_us_, buffer_))
        sent_.emplace_back(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(size));
      static_cast<void>(robots_[i]->map.step(kWork));
      if (i == 0) took_ms = thread_cpu_ms() - before_ms;
      for (const std::vector<std::byte>& datagram : sent_) {
        bytes_ += datagram.size();
        for (std::size_t to = 0; to < robots_.size(); ++to) {
          if (to != i && !is_lost()) arriving_[to].push_back(datagram);
        }
      }
    }
    now_us_ += kTick_us;
    return took_ms;
  }
  [[nodiscard]] bool agrees() const {
    return std::all_of(robots_.begin(), robots_.end(), [&](const auto& one) {
      return one->exchange.digest() == robots_[0]->exchange.digest() && !one->map.busy();
    });
  }
  /// Ticks until all have the same and have fused it; 0: not within so many.
  std::uint32_t settle(std::uint32_t most) {
    for (std::uint32_t ticks = 1; ticks <= most; ++ticks) {
      tick();
      if (ticks % 10 == 0 && agrees()) return ticks;
    }
    return 0;
  }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  static constexpr std::uint64_t kWork = 300'000;  ///< As RobotSettings::work_per_tick.
  [[nodiscard]] bool is_lost() {
    return options_.far.loss > 0.0 &&
           std::uniform_real_distribution<>()(random_) < options_.far.loss;
  }

  const ManyOptions& options_;
  std::mt19937_64 random_;
  std::vector<std::unique_ptr<FullRobot>> robots_;
  std::array<std::deque<std::vector<std::byte>>, 64> arriving_{};
  std::vector<std::vector<std::byte>> sent_;
  std::vector<std::byte> buffer_ = std::vector<std::byte>(kMostDatagramBytes);
  std::int64_t now_us_ = 0;
  std::uint64_t bytes_ = 0;
};

/// Runs so long, and prints what the first robot took. Returns the share of a core.
template <class EachTick>
double measure(const char* what, Team& team, std::uint32_t ticks, EachTick&& each_tick) {
  std::vector<double> took_ms;
  const std::uint64_t before = team.bytes();
  for (std::uint32_t i = 0; i < ticks; ++i) {
    each_tick(i);
    took_ms.push_back(team.tick());
  }
  double sum_ms = 0.0;
  for (const double one : took_ms) sum_ms += one;
  std::sort(took_ms.begin(), took_ms.end());
  const double share = sum_ms / (ticks * 100.0);
  std::printf("%-40s %6.2f %% of a core; a tick: median %.2f, most %.2f ms; network %.1f kB/s\n",
              what, 100.0 * share, took_ms[took_ms.size() / 2], took_ms.back(),
              static_cast<double>(team.bytes() - before) / (100.0 * ticks));
  return share;
}

int run(const ManyOptions& options) {
  Team team(options);
  std::printf("%u robots of %u submaps of %u blocks; loss %.0f %%\n", options.robots,
              options.far.submaps, options.far.blocks, 100.0 * options.far.loss);
  const std::uint32_t first = team.settle(20'000);
  if (first == 0) {
    std::fprintf(stderr, "the robots did not come to hold the same\n");
    return 1;
  }
  const ExchangeReport report = team.robot(0).exchange.report();
  std::printf("from nothing to equal digests everywhere: %.0f s; %u contributions of everybody\n",
              0.1 * first, report.contributions);
  const std::uint32_t ticks = 10 * options.seconds;
  measure("comparisons that are still under way", team, ticks, [](std::uint32_t) {});
  const double quiet = measure("nobody has anything new", team, ticks, [](std::uint32_t) {});
  for (std::size_t i = 0; i < team.size(); ++i) team.robot(i).open();
  const double mapping =
      measure("each publishes a block in two ticks", team, ticks, [&](std::uint32_t i) {
        if (i % 2 != 0) return;
        for (std::size_t r = 0; r < team.size(); ++r)
          team.robot(r).publish(i / 2 % options.far.blocks, 1);
      });
  std::uint32_t revisions = 0;
  const double corrected =
      measure("each corrects submaps every 10 s", team, ticks, [&](std::uint32_t i) {
        if (i % 100 != 0) return;
        ++revisions;
        for (std::size_t r = 0; r < team.size(); ++r) {
          FullRobot& robot = team.robot(r);
          for (std::uint32_t k = 0; k < std::min(options.corrected, options.far.submaps); ++k) {
            Matrix34d T = far_frame(robot.number, k);
            T(0, 3) += 0.125 * revisions;
            if (robot.exchange.move(1, k, T) != Status::kOk) std::exit(1);
          }
        }
      });
  const std::uint32_t last = team.settle(20'000);
  std::printf("equal digests after the last correction: %s, %.0f s\n", last == 0 ? "NO" : "yes",
              0.1 * last);
  const bool is_good = last != 0 && quiet < 0.05;
  std::printf("book-keeping under 5 %% of a core: %s (%.2f %%; with news %.2f and %.2f %%)\n",
              quiet < 0.05 ? "yes" : "NO", 100.0 * quiet, 100.0 * mapping, 100.0 * corrected);
  return is_good ? 0 : 1;
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  tessera::bench::ManyOptions options;
  CLI::App app("What it costs a robot to keep account of thousands of submaps");
  app.add_option("--robots", options.robots)->check(CLI::Range(2, 8))->capture_default_str();
  app.add_option("--submaps", options.far.submaps, "Of each robot")
      ->check(CLI::Range(2, 510))
      ->capture_default_str();
  app.add_option("--blocks", options.far.blocks, "Of a submap")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_option("--seconds", options.seconds, "Of virtual time, of each part")
      ->check(CLI::Range(1, 3600))
      ->capture_default_str();
  app.add_option("--corrected", options.corrected, "Submaps of a correction")
      ->check(CLI::Range(1, 510))
      ->capture_default_str();
  app.add_option("--loss", options.far.loss, "Of datagrams, to each receiver")
      ->check(CLI::Range(0.0, 0.9))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return tessera::bench::run(options);
}
