// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// record_exchange FILE none|key|signatures: what a small team says and holds in the end, as text
// for the decoder of decode_datagram.py. Every kind of datagram and type of request occurs.
#include <cinttypes>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>

#include "link/fleet_keys.hpp"
#include "link/key_maker.hpp"
#include "network/held.hpp"
#include "network/simulated_network.hpp"
#include "record_sessions.hpp"
#include "tessera/exchange/internal/fingerprint.hpp"

namespace {

using namespace tessera;
using network::kTickUs;
using network::Network;
using network::Robot;

constexpr std::uint32_t kRobots = 5;
constexpr std::uint32_t kTwin = 4;  ///< Two processes of it say different things.
constexpr std::int64_t kSecond = 1'000'000;
constexpr const char* kMission = "harbour 7";

template <class T>
T made(Outcome<T> outcome) {
  if (!outcome.ok()) throw std::runtime_error("keys");
  return std::move(*outcome);
}

/// Keys of all robots, by files in a folder, as robots have them.
class Keys {
 public:
  Keys(const std::string& mode, const std::string& folder, std::FILE* file) {
    if (mode == "none") return;
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    const Mission mission = made(Mission::make(kMission));
    const std::vector<std::string> paths = made(make_fleet(folder, kRobots, mission));
    const std::string all = folder + "/fleet.pub";
    write(file, "key", made(read_fleet_key(folder + "/fleet.key")).key.bytes());
    std::fprintf(file, "mission %s\n", kMission);
    for (std::uint32_t robot = 0; robot < kRobots; ++robot) {
      KeyFiles files;
      files.fleet_key = folder + "/fleet.key";
      if (mode == "signatures") {
        files.robot_secret = folder + "/robot_" + std::to_string(robot) + ".key";
        files.robot_public_keys = all;
      }
      keys_.push_back(std::make_unique<FleetKeys>(made(FleetKeys::read(files, robot))));
    }
    if (mode != "signatures") return;
    for (const RobotPublic& one : made(read_public_keys(all)))
      write(file, ("public " + std::to_string(one.robot)).c_str(), one.key);
  }

  [[nodiscard]] std::unique_ptr<Robot> robot(std::uint32_t number, std::uint32_t session,
                                             std::uint32_t floor) const {
    network::RobotOptions options{.random_bits = ++processes_, .floor = floor};
    ExchangeConfig config;
    if (!keys_.empty()) {
      const RobotKeys keys = keys_[number]->keys();
      options.authenticator = keys.authenticator;
      options.signatures = keys.signatures;
      config.mission = keys_[number]->mission().number();
    }
    const ReplicasConfig replicas = Network::default_replicas();
    config.contributions = replicas.contributions;
    return std::make_unique<Robot>(number, session, replicas, config, options);
  }

 private:
  template <class Bytes>
  static void write(std::FILE* file, const char* what, const Bytes& bytes) {
    std::fprintf(file, "%s ", what);
    for (const auto byte : bytes) std::fprintf(file, "%02x", static_cast<unsigned>(byte));
    std::fprintf(file, "\n");
  }
  std::vector<std::unique_ptr<FleetKeys>> keys_;
  mutable std::uint32_t processes_ = 0;
};

/// Robots in virtual time. What one says arrives at once at those that are on, as far as it is let.
class Team {
 public:
  Team(const Keys& keys, std::FILE* file) : keys_(keys), file_(file), robots_(kRobots) {}

  void start(std::uint32_t number, std::uint32_t session, std::uint32_t floor = 0) {
    robots_[number] = keys_.robot(number, session, floor);
    std::fprintf(file_, "start %u\n", number);
  }
  [[nodiscard]] std::int64_t now_us() const { return now_us_; }
  void switch_off(std::uint32_t number) { robots_[number].reset(); }
  [[nodiscard]] Robot& robot(std::uint32_t number) { return *robots_[number]; }
  /// Whether a datagram arrives; all of them do unless this is set.
  std::function<bool(std::uint32_t from, std::uint32_t to, DatagramKind kind)> arrives;

  void run(std::int64_t duration_us) {
    for (const std::int64_t end = now_us_ + duration_us; now_us_ < end; now_us_ += kTickUs) {
      for (std::uint32_t from = 0; from < kRobots; ++from) send_from(from);
    }
  }
  [[nodiscard]] bool agree() const {
    std::optional<std::uint64_t> digest;
    for (const auto& robot : robots_) {
      if (robot == nullptr) continue;
      if (digest && *digest != robot->exchange().digest()) return false;
      digest = robot->exchange().digest();
    }
    return true;
  }
  void settle() {
    for (int s = 0; s < 60 && !agree(); ++s) run(kSecond);
    if (!agree()) throw std::runtime_error("the team does not agree");
  }
  void write_held() const {
    for (std::uint32_t i = 0; i < kRobots; ++i) {
      if (robots_[i] != nullptr) write_held_by(i, *robots_[i]);
    }
  }

 private:
  void send_from(std::uint32_t from) {
    if (robots_[from] == nullptr) return;
    std::vector<std::byte> datagram(kMostDatagramBytes);
    while (const std::size_t size = robots_[from]->exchange().send(
               Network::clock_us(static_cast<int>(from), now_us_), datagram)) {
      const std::span<const std::byte> bytes = std::span(datagram).first(size);
      std::fprintf(file_, "datagram ");
      for (const std::byte byte : bytes)
        std::fprintf(file_, "%02x", std::to_integer<unsigned>(byte));
      const auto kind = static_cast<DatagramKind>(std::to_integer<std::uint8_t>(bytes[3]) & 0x7fU);
      for (std::uint32_t to = 0; to < kRobots; ++to) {
        if (to == from || robots_[to] == nullptr || (arrives && !arrives(from, to, kind))) continue;
        std::fprintf(file_, " %u", to);
        robots_[to]->exchange().receive(bytes, Network::clock_us(static_cast<int>(to), now_us_));
      }
      std::fprintf(file_, "\n");
    }
  }
  /// "holds ROBOT CONTRIBUTION RECORDS DIGEST LOW HIGH FRAME BLOCKS PASSES LABELS" of each.
  void write_held_by(std::uint32_t number, const Robot& robot) const {
    const Replicas& replicas = robot.replicas();
    std::vector<network::Held> all = network::held(replicas, network::kClasses + 2);
    for (std::size_t i = 0; i < all.size(); ++i) {
      const ContributionId& id = all[i].id;
      Fingerprint sum;
      std::uint32_t records = 0;
      const Replicas::Contribution& held = replicas.contribution(replicas.in_order()[i]);
      for (std::uint32_t at = held.first_block; at != 0; at = replicas.record(at).next) {
        const Replicas::Replica& record = replicas.record(at);
        if (record.live == 0) continue;
        sum += fingerprint_of(record.hash, record.live);
        ++records;
      }
      std::fprintf(
          file_,
          "holds %u %u %u %u %u %" PRIx64 " %" PRIx64 " %" PRIx64 " %u %u %" PRIu64 " %.17g\n",
          number, id.robot, id.epoch, id.submap, records, digest_of(robot, id), sum.low, sum.high,
          all[i].frame_revision, all[i].blocks, all[i].passes, all[i].label_evidence);
    }
  }
  /// What the exchange says of it.
  [[nodiscard]] static std::uint64_t digest_of(const Robot& robot, const ContributionId& id) {
    std::vector<ContributionState> states(64);
    states.resize(robot.exchange().contributions(states));
    for (const ContributionState& state : states) {
      if (state.id == id) return state.digest;
    }
    throw std::runtime_error("a contribution that the exchange does not know");
  }

  const Keys& keys_;
  std::FILE* file_;
  std::vector<std::unique_ptr<Robot>> robots_;
  std::int64_t now_us_ = 0;
};

void publish(Robot& robot, const BlockCoord& block, oracle::Random& random, int voxels) {
  if (!robot.publish(*pack(block), random, voxels).ok()) throw std::runtime_error("publish");
}

/// Three robots publish; some chunks are lost, blocks are published again, come in parts, and get
/// empty, and a frame moves.
void drive(Team& team, oracle::Random& random) {
  int chunks = 0;
  team.arrives = [&](std::uint32_t /*from*/, std::uint32_t /*to*/, DatagramKind kind) {
    return kind != DatagramKind::kChunk || ++chunks % 4 != 0;
  };
  for (std::int32_t step = 0; step < 20; ++step) {
    exchange_tests::note_place(team.robot(0).exchange(), team.now_us());
    for (std::uint32_t robot = 0; robot < 3; ++robot) {
      const BlockCoord block{step % 7 - 3, static_cast<std::int32_t>(robot), step % 3 - 1};
      publish(team.robot(robot), block, random, step % 10 == 3 ? 4000 : 15);
    }
    publish(team.robot(0), {-1'000'000, step, 1'000'000}, random, step % 2 == 0 ? 2 : 0);
    team.run(kSecond / 5);
  }
  exchange_tests::publish_sessions(team.robot(2).exchange(), random);
  team.run(3 * kSecond);
  exchange_tests::remove_session(team.robot(2).exchange());
  publish(team.robot(1), {1, 1, 1}, random, 0);
  publish(team.robot(1), {0, 1, 0}, random, 0);
  team.run(2 * kSecond);
  exchange_tests::move_submaps(team.robot(1).exchange());
  team.run(2 * kSecond);
  team.arrives = nullptr;
  team.settle();
}

/// One process of a robot says something to robot 3, the next one something else of the same
/// versions to robot 0, and its last version to both. Then it is gone.
void teach_differently(Team& team) {
  for (const std::uint32_t listener : {3U, 0U}) {
    team.start(kTwin, 1);
    team.arrives = [listener](std::uint32_t from, std::uint32_t to, DatagramKind /*kind*/) {
      return (from == kTwin && to == listener) || (from == listener && to == kTwin);
    };
    for (std::int32_t i = 0; i < 600; ++i) {
      oracle::Random random(1902 + static_cast<std::uint64_t>(i));
      const bool other = listener == 3 && i % 19 == 0;
      publish(team.robot(kTwin), {i % 30, i / 30, 9}, random, other ? 3 : 2);
    }
    team.run(3 * kSecond);
    if (listener == 3) team.switch_off(kTwin);
  }
  team.arrives = [](std::uint32_t from, std::uint32_t to, DatagramKind kind) {
    return (from == kTwin && kind == DatagramKind::kChunk) || to == kTwin ||
           kind == DatagramKind::kAnnounce;
  };
  team.run(3 * kSecond);
  oracle::Random random(1901);
  publish(team.robot(kTwin), {0, 0, 9}, random, 5);
  team.run(kSecond);
  team.switch_off(kTwin);
  team.arrives = nullptr;
}

void record(const std::string& path, const std::string& mode) {
  std::FILE* file = std::fopen(path.c_str(), "w");
  if (file == nullptr) throw std::runtime_error(path);
  const ExchangeConfig config;
  std::fprintf(file, "configuration %.17g %.17g %.17g %.17g %d\n", config.resolution_m,
               config.prior, static_cast<double>(config.free_weight),
               static_cast<double>(config.max_evidence), static_cast<int>(config.conflicts));
  for (int c = 1; c <= network::kClasses; ++c)
    std::fprintf(file, "class %s\n",
                 std::string(oracle::numbered_classes(network::kClasses)[c].name_view()).c_str());
  const Keys keys(mode, path + ".keys", file);
  oracle::Random random(1901);
  Team team(keys, file);
  for (const std::uint32_t robot : {0U, 1U, 2U}) team.start(robot, 2);
  drive(team, random);

  // Robot 1 goes, and robot 3 learns from others what it said.
  team.robot(1).exchange().leave();
  team.run(kSecond);
  team.switch_off(1);
  team.start(3, 1);
  team.run(kSecond);
  team.settle();

  // A process of robot 2 that lost its counter: whether it is the new one, the others ask.
  team.start(2, 1);
  team.run(2 * kSecond);
  publish(team.robot(2), {5, 5, 5}, random, 30);
  team.run(5 * kSecond);
  // And one that states that only its epochs from 3 on count.
  team.start(2, 3, 3);
  publish(team.robot(2), {6, 6, 6}, random, 30);
  team.run(5 * kSecond);
  team.settle();

  // With nobody else there, robots 0 and 3 must compare what they hold.
  team.switch_off(2);
  teach_differently(team);
  team.settle();
  team.start(2, 4, 3);
  team.run(kSecond);
  team.settle();
  team.write_held();
  if (std::fclose(file) != 0) throw std::runtime_error(path);
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) throw std::runtime_error("record_exchange FILE none|key|signatures");
  record(argv[1], argv[2]);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
