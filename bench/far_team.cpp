// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot of little memory among robots that have published much more: does it hold what is near
// it, how soon has it what its route needs, and what does it keep of the rest? Robots drive along
// roads, two on each but the last, and their submaps lie in a row. The network is simulated, and
// the time is virtual.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <random>

#include "far_robots.hpp"
#include "tessera/map/internal/block_lookup.hpp"
#include "tessera/map/queries.hpp"

namespace tessera::bench {

namespace {

constexpr std::int64_t kTick_us = 10'000;

/// The blocks of a map near a place, and their digest.
struct Near {
  std::vector<std::uint64_t> keys;
  std::uint64_t digest = 0;
  friend bool operator==(const Near&, const Near&) = default;
};

Near near_of(const LocalMap& map, const Point3d& place, double radius_m) {
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  std::vector<KeyedIndex> near;
  for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
    const BlockCoord at = unpack(BlockKey{item.key});
    const Point3d middle(at.x + 0.5, at.y + 0.5, at.z + 0.5);
    if (norm(kFarBlock_m * middle - place) <= radius_m) near.push_back(item);
  }
  Near found;
  for (const KeyedIndex& item : near) found.keys.push_back(item.key);
  found.digest = made_or_end(digest(map, near, BlocksInMemory(map).lookup()));
  return found;
}

/// The robot and the others on a simulated network. The others do not hold each other's.
class Team {
 public:
  Team(const FarOptions& options, std::vector<std::unique_ptr<FarOrigin>>& others,
       SmallRobot& small)
      : options_(options), others_(others), small_(small), random_(options.submaps) {}

  [[nodiscard]] std::int64_t now_us() const { return now_us_; }
  void run(std::int64_t for_us) {
    const std::int64_t until_us = now_us_ + for_us;
    for (; now_us_ < until_us; now_us_ += kTick_us) {
      for (const auto& other : others_) {
        while (const std::size_t size = other->exchange.send(now_us_, datagram_)) {
          received_bytes_ += size;
          if (!is_lost()) small_.exchange.receive(std::span(datagram_).first(size), now_us_);
        }
      }
      while (const std::size_t size = small_.exchange.send(now_us_, datagram_)) {
        for (const auto& other : others_) {
          if (!is_lost()) other->exchange.receive(std::span(datagram_).first(size), now_us_);
        }
      }
      // With fuse_in_spare_time() of a node, some half of a core.
      static_cast<void>(small_.map.step(200'000));
      fullest_ = std::max(fullest_, small_.map.fullness());
    }
  }
  [[nodiscard]] std::uint64_t received_bytes() const { return received_bytes_; }
  [[nodiscard]] std::uint32_t fullest() const { return fullest_; }

 private:
  [[nodiscard]] bool is_lost() {
    return options_.loss > 0.0 && std::uniform_real_distribution<>()(random_) < options_.loss;
  }

  const FarOptions& options_;
  std::vector<std::unique_ptr<FarOrigin>>& others_;
  SmallRobot& small_;
  std::mt19937_64 random_;
  std::vector<std::byte> datagram_ = std::vector<std::byte>(kMostDatagramBytes);
  std::int64_t now_us_ = 0;
  std::uint64_t received_bytes_ = 0;
  std::uint32_t fullest_ = 0;
};

/// Whether the robot knows of each contribution the digest that its origin has.
bool has_all_digests(const std::vector<std::unique_ptr<FarOrigin>>& others,
                     const SmallRobot& small) {
  std::vector<ContributionState> known(small.exchange.contributions({}));
  static_cast<void>(small.exchange.contributions(known));
  const auto before = [](const ContributionState& a, const ContributionState& b) {
    return a.id < b.id;
  };
  std::sort(known.begin(), known.end(), before);
  for (const auto& other : others) {
    std::vector<ContributionState> all(other->exchange.contributions({}));
    static_cast<void>(other->exchange.contributions(all));
    for (const ContributionState& one : all) {
      if (!one.own) continue;
      const auto found = std::lower_bound(known.begin(), known.end(), one, before);
      if (found == known.end() || found->id != one.id || found->digest != one.digest) return false;
    }
  }
  return true;
}

/// Seconds of virtual time until the robot has what the map of all has within radius_m of a place;
/// below 0: not within most_s.
double time_until(Team& team, const SmallRobot& small, const MapOfAll& all, const Point3d& place,
                  double radius_m, double most_s) {
  const Near wanted = near_of(all.map.map(), place, radius_m);
  if (wanted.keys.empty()) std::exit(1);
  const std::int64_t from_us = team.now_us();
  const auto since_s = [&] { return 1e-6 * static_cast<double>(team.now_us() - from_us); };
  while (since_s() <= most_s) {
    if (near_of(small.map.map(), place, radius_m) == wanted) return since_s();
    team.run(100'000);
  }
  return -1.0;
}

int run(const FarOptions& options) {
  std::vector<std::unique_ptr<FarOrigin>> others;
  std::uint64_t held_bytes = 0;
  std::uint64_t records = 0;
  for (std::uint32_t robot = 1; robot <= kFarOthers; ++robot) {
    others.push_back(std::make_unique<FarOrigin>(robot, options));
    held_bytes += others.back()->replicas.usage().replica_bytes;
    records += others.back()->replicas.usage().replica_blocks;
  }
  std::printf("%u robots: %u submaps each, %llu records, %.2f GiB of replicas\n", kFarOthers,
              options.submaps, static_cast<unsigned long long>(records),
              static_cast<double>(held_bytes) / 0x1p30);
  const MapOfAll all(others, options);
  SmallRobot small(options);
  Team team(options, others, small);
  bool is_good = true;
  const auto report = [&](const char* what, double took_s, double most_s) {
    const bool is_met = took_s >= 0.0 && took_s <= most_s;
    is_good = is_good && is_met;
    took_s < 0.0 ? std::printf("%-64s not at all  MISSED\n", what)
                 : std::printf("%-64s %7.1f s%s\n", what, took_s, is_met ? "" : "  MISSED");
  };
  const std::uint32_t middle = options.submaps / 2;
  Point3d here = far_place(1, middle);
  small.exchange.set_reach({&here, 1}, options.reach_m + small.map.dependence_m());
  report("from nothing to all within reach",
         time_until(team, small, all, here, options.reach_m, 300), 300);
  double known_s = 0.0;
  for (; !has_all_digests(others, small) && known_s < 600; known_s += 1.0) team.run(1'000'000);
  report("then to the digest of every contribution", known_s, 599);

  // Its route takes it elsewhere: a place on each other road.
  const double block_m = 2.0;
  for (const std::uint32_t robot : {3U, 5U, 7U}) {
    const std::array places{here, far_place(robot, (middle / 2 + 7 * robot) % options.submaps)};
    small.exchange.set_reach(places, options.reach_m + small.map.dependence_m());
    char what[80];
    std::snprintf(what, sizeof(what), "blocks on road %u that its route needs", robot / 2);
    report(what, time_until(team, small, all, places[1], block_m, 60), 2);
    std::snprintf(what, sizeof(what), "and all within reach of there");
    report(what, time_until(team, small, all, places[1], options.reach_m, 120), 120);
  }
  // It drives 200 m at 10 m/s, and its route is known for 60 m.
  double worst_s = 0.0;
  for (int metre = 0; metre <= 200; metre += 10) {
    const Point3d now = here + Point3d(metre, 0.0, 0.0);
    const std::array places{now, Point3d(now + Point3d(30.0, 0.0, 0.0)),
                            Point3d(now + Point3d(60.0, 0.0, 0.0))};
    small.exchange.set_reach(places, options.reach_m + small.map.dependence_m());
    const double late_s = time_until(team, small, all, now, options.reach_m, 60);
    worst_s = late_s < 0.0 ? 60.0 : std::max(worst_s, late_s);
    team.run(1'000'000);
  }
  report("driving at 10 m/s: latest that all within reach was there", worst_s, 2);
  const bool knows = has_all_digests(others, small);
  is_good = is_good && knows;
  const ExchangeReport exchange = small.exchange.report();
  const std::size_t far_bytes = FarContributions::required_bytes(4096);
  const double not_held =
      static_cast<double>(records) - small.map.replicas().usage().replica_blocks;
  std::printf("digests of all contributions: %s\n", knows ? "equal" : "DIFFERENT");
  std::printf(
      "contributions: %u known, %u complete, %u far; made far %llu times, near %llu times\n",
      exchange.contributions, exchange.complete, exchange.far_contributions,
      static_cast<unsigned long long>(exchange.made_far),
      static_cast<unsigned long long>(exchange.made_near));
  std::printf("records: %u held, %.0f not held; %.2f bytes a record that is not held\n",
              small.map.replicas().usage().replica_blocks, not_held,
              static_cast<double>(far_bytes) / std::max(1.0, not_held));
  std::printf("storage: at most %.0f %% full; refused %llu records, %llu contributions\n",
              static_cast<double>(team.fullest()) / 10.24,
              static_cast<unsigned long long>(exchange.records_refused),
              static_cast<unsigned long long>(exchange.refused_contributions));
  std::printf("network: %.1f MB from the others in %.0f s\n",
              static_cast<double>(team.received_bytes()) / 1e6,
              1e-6 * static_cast<double>(team.now_us()));
  return is_good ? 0 : 1;
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  tessera::bench::FarOptions options;
  CLI::App app("A robot of little memory among robots that have published much more");
  app.add_option("--submaps", options.submaps, "Of each of the seven others")
      ->check(CLI::Range(20, 500))
      ->capture_default_str();
  app.add_option("--blocks", options.blocks, "Of a submap")
      ->check(CLI::Range(50, 1500))
      ->capture_default_str();
  app.add_option("--loss", options.loss, "Of datagrams, to each receiver")
      ->check(CLI::Range(0.0, 0.9))
      ->capture_default_str();
  app.add_option("--memory", options.memory, "Of the robot, for what it shares; with a unit")
      ->transform(CLI::AsSizeValue(false));
  CLI11_PARSE(app, argc, argv);
  return tessera::bench::run(options);
}
