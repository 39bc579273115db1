// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <vector>

#include "fuzz/forged_datagram.hpp"
#include "network/simulated_network.hpp"

namespace tessera::fuzz {

namespace {

using network::Robot;

constexpr std::int64_t kTickUs = 20'000;
constexpr int kMostSettleTicks = 15'000;
constexpr int kMostRestarts = 3;
constexpr std::size_t kMostOnTheWay = 64;

constexpr ReplicasConfig kReplicas{
    .segments = 2048, .blocks = 256, .contributions = 8, .robot_segments = 2048};
constexpr ExchangeConfig kExchange{.contributions = 8, .peers = 4, .answers = 8};

class Team {
 public:
  explicit Team(Bytes bytes) : input_(bytes), fleet_(input_.u8()), robots_(2 + fleet_ % 2) {
    sessions_.resize(robots_.size(), 0);
    for (std::size_t i = 0; i < robots_.size(); ++i) start(i);
  }
  void run() {
    while (!input_.empty()) step();
    for (int tick = 0; tick < kMostSettleTicks && !agree(); ++tick) {
      send_all(0xff);
      deliver_all();
    }
    bool full = false;
    for (const auto& robot : robots_) {
      const ReplicasUsage usage = robot->replicas().usage();
      const ExchangeReport report = robot->exchange().report();
      full = full || usage.replicas_refused_quota + usage.replicas_refused_storage +
                             report.refused_contributions >
                         0;
      require(report.impostors == 0 && report.refused_body == 0, "who means well is refused");
    }
    require(full || agree(), "they do not hold the same in the end");
  }

 private:
  struct Arrival {
    std::size_t to;
    Datagram bytes;
  };
  void start(std::size_t i) {
    ++sessions_[i];
    const auto number = static_cast<std::uint32_t>(i);
    network::RobotOptions options;
    if ((fleet_ & 0x80U) != 0) options.key = number;
    robots_[i] = std::make_unique<Robot>(number, sessions_[i], kReplicas, kExchange, options);
  }
  void step() {
    const int what = input_.below(7);
    const unsigned how = input_.u8();
    const std::size_t whom = how % robots_.size();
    switch (what) {
      case 0: {
        const unsigned which = input_.u8();
        const auto at = [which](unsigned shift) { return static_cast<int>((which >> shift) & 3U); };
        oracle::Random random(input_.u16());
        // Few voxels, many, or none, which is a block that is gone.
        const int voxels = (how & 0x80U) != 0 ? static_cast<int>(how & 0x7fU) * 5 : at(6);
        static_cast<void>(robots_[whom]->publish(*pack({at(0), at(2), at(4)}), random, voxels));
        return;
      }
      case 1:
        send_all(input_.u8());
        return deliver_all();
      case 2:
        for (unsigned tick = 0; tick < (how & 31U); ++tick) {
          send_all(0xff);
          deliver_all();
        }
        return;
      case 3:
        now_us_ += kTickUs * (how & 63U);
        return send_all(input_.u8());
      case 4:
        return disturb(how);
      case 5: {
        Matrix34d moved = Matrix34d::Identity();
        moved(1, 3) = input_.u8();
        require(robots_[whom]->exchange().move(sessions_[whom], 0, moved) == Status::kOk, "move");
        return;
      }
      default:
        if (restarts_++ < kMostRestarts) start(whom);
        return;
    }
  }
  /// links: a bit for each that something gets through.
  void send_all(unsigned links) {
    now_us_ += kTickUs;
    Datagram datagram(kMostDatagramBytes);
    for (std::size_t from = 0; from < robots_.size(); ++from) {
      while (const std::size_t size = robots_[from]->exchange().send(now_us_, datagram)) {
        for (std::size_t to = 0; to < robots_.size(); ++to) {
          const bool heard = ((links >> (from * 3 + to) % 8) & 1U) != 0;
          if (to == from || !heard || on_the_way_.size() == kMostOnTheWay) continue;
          on_the_way_.push_back(
              {to,
               Datagram(datagram.begin(), datagram.begin() + static_cast<std::ptrdiff_t>(size))});
        }
      }
    }
  }
  void deliver_all() {
    for (const Arrival& arrival : on_the_way_)
      robots_[arrival.to]->exchange().receive(arrival.bytes, now_us_);
    on_the_way_.clear();
  }
  void disturb(unsigned how) {
    if (on_the_way_.empty()) return;
    const std::size_t which = input_.u8() % on_the_way_.size();
    const auto at = on_the_way_.begin() + static_cast<std::ptrdiff_t>(which);
    if (how % 4 == 0) {
      on_the_way_.erase(at);
    } else if (how % 4 == 1) {
      std::reverse(at, on_the_way_.end());
    } else if (how % 4 == 2) {
      robots_[at->to]->exchange().receive(at->bytes, now_us_);
    } else {
      Datagram damaged = at->bytes;
      damaged[input_.u16() % damaged.size()] ^= static_cast<std::byte>(input_.u8() | 1U);
      on_the_way_.push_back({at->to, std::move(damaged)});
    }
  }
  [[nodiscard]] bool agree() const {
    const auto& first = robots_.front();
    const auto same_digest = [&](const auto& robot) {
      return robot->exchange().digest() == first->exchange().digest();
    };
    if (!std::all_of(robots_.begin(), robots_.end(), same_digest)) return false;
    const std::uint64_t content = first->content_digest();
    return std::all_of(robots_.begin() + 1, robots_.end(),
                       [&](const auto& robot) { return robot->content_digest() == content; });
  }

  Input input_;
  unsigned fleet_;  ///< Bit 0: three robots; bit 7: they sign.
  std::vector<std::unique_ptr<Robot>> robots_;
  std::vector<std::uint32_t> sessions_;
  std::vector<Arrival> on_the_way_;
  std::int64_t now_us_ = 0;
  int restarts_ = 0;
};

}  // namespace

void exchange_team(Bytes bytes) { Team(bytes).run(); }

}  // namespace tessera::fuzz
