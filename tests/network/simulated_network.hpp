// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots that exchange datagrams over a network that is as bad as asked for, in virtual time. All
// is drawn from one seed.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <queue>
#include <set>
#include <vector>

#include "network/toy_signatures.hpp"
#include "support/mapper.hpp"
#include "support/random.hpp"
#include "tessera/exchange/exchange.hpp"

namespace tessera::network {

inline constexpr int kClasses = 5;
inline constexpr std::int64_t kTickUs = 10'000;

/// What happens to a datagram on its way to one receiver.
struct Link {
  double loss = 0.0;
  double burst = 0.0;     ///< Chance, a datagram, that a burst of losses begins.
  int burst_length = 20;  ///< Datagrams.
  std::int64_t delay_us = 500;
  std::int64_t jitter_us = 500;  ///< More than the time between datagrams: they overtake.
  double duplicate = 0.0;
  double corrupt = 0.0;  ///< A byte, or the length.
};

/// Adds what a robot may publish, quantised: so many random voxels.
void add_random_voxels(BlockContent& content, oracle::Random& random, int voxels);

struct RobotOptions {
  std::optional<std::uint32_t> key{};  ///< Whose it signs with; nobody's: it signs nothing.
  Signatures signatures{};             ///< Instead of toy ones.
  int classes = kClasses;
  Authenticator authenticator = crc_authenticator();
  std::uint32_t random_bits = 0;  ///< Of its session.
  std::uint32_t floor = 0;        ///< The lowest of its epochs that counts.
};

class Robot {
 public:
  Robot(std::uint32_t number, std::uint32_t session, const ReplicasConfig& replicas,
        const ExchangeConfig& config, const RobotOptions& options = {});
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;
  [[nodiscard]] Exchange& exchange() { return exchange_; }
  [[nodiscard]] const Exchange& exchange() const { return exchange_; }
  [[nodiscard]] Replicas& replicas() { return replicas_; }
  [[nodiscard]] const Replicas& replicas() const { return replicas_; }
  [[nodiscard]] std::uint32_t session() const { return session_; }
  /// Publishes a block with so many random voxels.
  Result<std::uint32_t> publish(BlockKey key, oracle::Random& random, int voxels);
  /// Of all that it holds, by its bytes, whatever the exchange says of it.
  [[nodiscard]] std::uint64_t content_digest() const;
  [[nodiscard]] std::uint64_t signature_checks() const { return key_.checks(); }

 private:
  std::uint32_t session_;
  ToySignatures key_;
  int components_;
  AlignedMemory memory_;
  Replicas replicas_;
  Exchange exchange_;
  BlockContent content_;
};

/// What a robot says within so long, nobody answering.
[[nodiscard]] std::vector<std::vector<std::byte>> said(Robot& robot, std::int64_t from_us,
                                                       std::int64_t for_us);
[[nodiscard]] DatagramKind kind_of(std::span<const std::byte> datagram);
/// Whether somebody does not hear a datagram.
using IsLost = std::function<bool(const Robot& to, std::span<const std::byte> datagram)>;
/// For so long each hears at once all that the others say, but for what is lost.
void talk(const std::vector<Robot*>& robots, std::int64_t& now_us, std::int64_t for_us,
          const IsLost& is_lost = {});

class Network {
 public:
  Network(int robots, const Link& link, std::uint64_t seed,
          ReplicasConfig replicas = default_replicas(), ExchangeConfig config = {},
          bool with_signatures = false, int classes = kClasses);
  [[nodiscard]] static ReplicasConfig default_replicas();

  [[nodiscard]] int size() const { return static_cast<int>(robots_.size()); }
  [[nodiscard]] Robot& robot(int i) { return *robots_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] oracle::Random& random() { return random_; }
  [[nodiscard]] std::int64_t now_us() const { return now_us_; }
  /// What a robot's own clock says: each was started on another day, and none is set by another.
  [[nodiscard]] static std::int64_t clock_us(int i, std::int64_t at_us) {
    return at_us + 86'400'000'000 * i;
  }
  /// Between all, or from one robot to another.
  void set_link(const Link& link);
  void set_link(int from, int to, const Link& link);
  /// Robots of different groups do not hear each other.
  void partition(std::vector<int> groups) { groups_ = std::move(groups); }
  void heal() { groups_.clear(); }
  /// Off: hears and says nothing.
  void switch_off(int i) { off_.insert(i); }
  void switch_on(int i) { off_.erase(i); }
  /// A new process with nothing in memory, in a session and an epoch of its own.
  void restart(int i);
  /// The same of a robot that states that only its epochs from floor on count.
  void restart(int i, std::uint32_t floor);
  /// A new process that lost its counter: it counts from 1 again.
  void restart_without_counter(int i);
  /// Runs on for so long.
  void run(std::int64_t duration_us);
  /// Runs until all that are on agree and lack nothing, or so long. True iff they do.
  bool settle(std::int64_t most_us);
  [[nodiscard]] bool agree() const;
  /// All bytes that were sent by anyone.
  [[nodiscard]] std::uint64_t sent_bytes() const;

 private:
  struct Arrival {
    std::int64_t at_us;
    std::uint64_t order;
    int to;
    std::shared_ptr<const std::vector<std::byte>> bytes;
    bool operator<(const Arrival& other) const {
      return std::tie(at_us, order) > std::tie(other.at_us, other.order);
    }
  };
  void tick();
  void send_from(int i);
  void deliver(int from, int to, const std::shared_ptr<const std::vector<std::byte>>& bytes);
  [[nodiscard]] bool hears(int from, int to) const;

  oracle::Random random_;
  [[nodiscard]] std::unique_ptr<Robot> new_robot(std::size_t i, std::uint32_t floor = 0) const;

  ReplicasConfig replicas_;
  ExchangeConfig config_;
  bool with_signatures_;
  int classes_;
  std::vector<std::unique_ptr<Robot>> robots_;
  std::vector<std::uint32_t> sessions_;
  std::uint32_t processes_ = 0;  ///< That were started after the first ones.
  std::vector<Link> links_;
  std::vector<int> bursts_;  ///< Datagrams that are still lost, by link.
  std::vector<int> groups_;
  std::set<int> off_;
  std::priority_queue<Arrival> on_their_way_;
  std::uint64_t order_ = 0;
  std::int64_t now_us_ = 0;
  std::uint64_t sent_before_ = 0;  ///< By processes that are gone.
};

}  // namespace tessera::network
