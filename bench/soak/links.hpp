// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Datagrams between robots in virtual time: what is lost is lost in bursts (Gilbert-Elliott), some
// overtake others, and partitions cut robots off.
#pragma once

#include <cstdint>
#include <memory>
#include <queue>
#include <tuple>
#include <vector>

#include "simulator/random.hpp"

namespace tessera::soak {

/// Of each direction between two robots.
struct BurstLoss {
  double share = 0.3;   ///< Of datagrams that are lost, over time.
  double burst = 12.0;  ///< Datagrams of a burst, on the average.
  std::int64_t least_delay_us = 1'000;
  std::int64_t most_delay_us = 80'000;
};

class Links {
 public:
  using Bytes = std::vector<std::byte>;

  Links(int robots, const BurstLoss& loss);
  /// What follows is drawn from this.
  void seed(std::uint64_t hash) { random_ = street::Random(hash); }
  /// To all that it reaches.
  void send(int from, Bytes bytes, std::int64_t now_us);
  /// The next that has arrived there, or nothing.
  [[nodiscard]] std::shared_ptr<const Bytes> receive(int to, std::int64_t now_us);
  /// Nothing more arrives of what is on its way there: nobody listens.
  void drop_for(int to);
  /// Robots of different groups do not hear each other.
  void partition(std::vector<int> groups) { groups_ = std::move(groups); }
  [[nodiscard]] const std::vector<int>& groups() const { return groups_; }

  [[nodiscard]] std::uint64_t sent() const { return sent_; }
  [[nodiscard]] std::uint64_t sent_bytes() const { return sent_bytes_; }
  /// Deliveries that were tried where no partition was, and of these the lost.
  [[nodiscard]] std::uint64_t tried() const { return tried_; }
  [[nodiscard]] std::uint64_t lost() const { return lost_; }

 private:
  struct Arrival {
    std::int64_t at_us;
    std::uint64_t order;
    std::shared_ptr<const Bytes> bytes;
    bool operator<(const Arrival& other) const {
      return std::tie(at_us, order) > std::tie(other.at_us, other.order);
    }
  };
  [[nodiscard]] bool is_lost(int from, int to);

  int robots_;
  BurstLoss loss_;
  street::Random random_{0};
  std::vector<int> groups_;
  std::vector<bool> bursts_;  ///< Of each direction: whether it is in one.
  std::vector<std::priority_queue<Arrival>> on_their_way_;
  std::uint64_t order_ = 0;
  std::uint64_t sent_ = 0;
  std::uint64_t sent_bytes_ = 0;
  std::uint64_t tried_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace tessera::soak
