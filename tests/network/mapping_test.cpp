// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The whole way: scans, local maps, what is published of them, a bad network, global maps.
#include <catch2/catch.hpp>
#include <optional>

#include "network/simulated_network.hpp"
#include "support/team.hpp"
#include "tessera/exchange/publisher.hpp"

namespace tessera::network {
namespace {

constexpr int kComponents = oracle::kTeamClasses + 2;
constexpr std::int64_t kTick50_us = 50'000;

MapConfig map_config() {
  MapConfig config = oracle::uncapped_map(0.1);
  config.free_weight = 0.5F;
  return config;
}

/// Random labels give each voxel all the classes that it can have.
GlobalMapConfig roomy_config() {
  GlobalMapConfig config = oracle::team_config();
  config.replicas.segments = config.replicas.robot_segments = config.sum_segments = 1U << 16U;
  return config;
}

/// A robot with all that it needs from scan to global map.
class MappingRobot {
 public:
  MappingRobot(std::uint32_t number, const Matrix34d& T_global_map)
      : mapper_(map_config(), {}, oracle::kTeamClasses), team_(roomy_config()) {
    const ExchangeConfig config{
        .robot = number, .free_weight = map_config().free_weight, .contributions = 8};
    memory_.emplace(Exchange::required_bytes(config, kComponents) +
                    Publisher::required_bytes(publisher_config(), kComponents));
    Arena arena(memory_->span());
    exchange_ = *Exchange::make(arena, config, store_of(team_.global()), crc_authenticator(),
                                oracle::numbered_classes(oracle::kTeamClasses));
    publisher_ = *Publisher::make(arena, publisher_config(), map_config(), kComponents);
    REQUIRE(exchange_.open(1, 0, T_global_map) == Status::kOk);
  }
  [[nodiscard]] Exchange& exchange() { return exchange_; }
  [[nodiscard]] oracle::Team& team() { return team_; }
  [[nodiscard]] const LocalMap& map() const { return mapper_.map(); }
  void integrate(const oracle::Cloud& cloud, const Matrix34d& T_map_sensor) {
    static_cast<void>(mapper_.integrate(cloud, T_map_sensor));
  }
  PublisherReport tick(std::int64_t now_us) {
    const PublisherReport report =
        publisher_.tick(mapper_.map(), now_us, {}, publication_of(exchange_));
    static_cast<void>(team_.global().step(200'000));
    return report;
  }
  [[nodiscard]] bool quiet() const { return publisher_.waiting() == 0; }
  /// Labelled voxels of the map whose label is not what was published, but for those whose
  /// evidence is nearly all of no known class, which rounding may take for all.
  [[nodiscard]] int different_labels() {
    AlignedMemory memory(BlockContent::required_bytes(kComponents));
    Arena arena(memory.span());
    BlockContent content = *BlockContent::make(arena, kComponents);
    int different = 0;
    for (const auto& [voxel, counts] : oracle::voxels_of(mapper_.map())) {
      const VoxelCoord at = oracle::coord_of(voxel);
      content.clear();
      static_cast<void>(exchange_.read_published(*pack(block_of(at)), content));
      CountSummary published(kComponents, 0.0F);
      for (int c = 1; c < kComponents; ++c) published.add(c, content.count(c, row_order(at)));
      const int label = mapper_.map().query(at).label;
      const bool faint = label != 0 && 32.0 * counts[static_cast<std::size_t>(label)] <
                                           1.1 * counts[static_cast<std::size_t>(kComponents - 1)];
      if (label != 0 && !faint && label != published.estimate(0.0).label) ++different;
    }
    return different;
  }

 private:
  static PublisherConfig publisher_config() { return {.blocks = 8192, .candidates = 8192}; }
  oracle::Mapper mapper_;
  oracle::Team team_;
  std::optional<AlignedMemory> memory_;
  Exchange exchange_;
  Publisher publisher_;
};

TEST_CASE("network: from scans to global maps that are equal to the last byte") {
  const double loss = GENERATE(0.0, 0.3);
  oracle::Random random(oracle::announce_seed(521));
  std::vector<std::unique_ptr<MappingRobot>> robots;
  for (std::uint32_t i = 0; i < 3; ++i) {
    robots.push_back(
        std::make_unique<MappingRobot>(i, i == 0 ? Matrix34d(Matrix34d::Identity())
                                                 : oracle::random_transform(random, 15.0, 0.5)));
  }
  oracle::CloudOptions options;
  options.reach_m = 2.0;
  options.classes = oracle::kTeamClasses;
  std::vector<std::byte> datagram(kMostDatagramBytes);
  std::int64_t now_us = 0;
  const auto tick = [&](double lost) {
    for (auto& robot : robots) static_cast<void>(robot->tick(now_us));
    for (std::size_t from = 0; from < robots.size(); ++from) {
      while (const std::size_t size = robots[from]->exchange().send(now_us, datagram)) {
        for (std::size_t to = 0; to < robots.size(); ++to) {
          if (to != from && random.uniform() >= lost)
            robots[to]->exchange().receive(std::span(datagram).first(size), now_us);
        }
      }
    }
    now_us += kTick50_us;
  };
  for (int scan = 0; scan < 12; ++scan) {
    for (auto& robot : robots) {
      Matrix34d T_map_sensor = Matrix34d::Identity();
      T_map_sensor(0, 3) = 0.1 * scan;
      robot->integrate(oracle::random_cloud(random, options), T_map_sensor);
    }
    tick(loss);
    tick(loss);
  }
  const auto done = [&] {
    bool quiet = true;
    for (auto& robot : robots) {
      const ExchangeReport report = robot->exchange().report();
      quiet = quiet && robot->quiet() && !robot->team().global().busy() &&
              report.contributions == 3 && report.complete == 3;
    }
    return quiet;
  };
  while (now_us < 120'000'000 && !done()) tick(loss);
  REQUIRE(done());
  for (auto& robot : robots) {
    CHECK(robot->different_labels() == 0);
    CHECK(robot->exchange().digest() == robots[0]->exchange().digest());
    CHECK(robot->team().digest() == robots[0]->team().digest());
    CHECK(robot->team().global().report().overlap_blocks > 0);
    CHECK(robot->exchange().report().refused_body == 0);
  }
}

TEST_CASE("network: a block that does not fit a datagram goes in parts, and is whole at the end") {
  oracle::Random random(oracle::announce_seed(522));
  Network network(2, {.loss = 0.3}, 522);
  for (int block = 0; block < 20; ++block)
    REQUIRE(network.robot(0).publish(*pack({block, 0, 0}), network.random(), 4000).ok());
  CHECK(network.robot(0).exchange().report().published_parts > 20);
  REQUIRE(network.settle(60'000'000));
  // Anew, and smaller: the parts of before are gone.
  for (int block = 0; block < 20; ++block)
    REQUIRE(network.robot(0).publish(*pack({block, 0, 0}), network.random(), 5).ok());
  REQUIRE(network.settle(60'000'000));
  const Replicas& replicas = network.robot(1).replicas();
  const Replicas::Slot slot = *replicas.find({0, 1, 0});
  for (int block = 0; block < 20; ++block) {
    int live = 0;
    for (const Replicas::Replica* part = replicas.find(slot, *pack({block, 0, 0})); part != nullptr;
         part = replicas.next_part(*part))
      live += part->live != 0 ? 1 : 0;
    CHECK(live == 1);
  }
}

}  // namespace
}  // namespace tessera::network
