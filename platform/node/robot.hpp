// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot from scan to global map: its local map, what it publishes of it, what it exchanges, and
// the map of all. In one piece of memory that is taken at the start; without threads, sockets or a
// clock: scans, datagrams and times are handed in.
#pragma once

#include <memory>
#include <span>

#include "mapping/stored_map.hpp"
#include "posix/outcome.hpp"
#include "tessera/exchange/exchange.hpp"
#include "tessera/exchange/publisher.hpp"
#include "tessera/fusion/global_map.hpp"
#include "tessera/inference/integrator.hpp"

namespace tessera {

struct RobotConfig {
  MapConfig map{};
  InferenceConfig inference{};
  ScanCapacity scan{};
  PublisherConfig publisher{};
  PublisherBudget budget{};  ///< Of a tick.
  ExchangeConfig exchange{};
  GlobalMapConfig global{};
  std::uint64_t work_per_tick = 300'000;  ///< Of GlobalMap::step.
  std::int64_t deadline_us = 0;           ///< For a scan; 0: none.
  bool near_first = false;  ///< The global map is brought up to date around the robot first.
  std::uint32_t epoch = 1;
  Matrix34d T_global_map = Matrix34d::Identity();

  [[nodiscard]] std::size_t required_bytes(int num_components) const noexcept;
};

/// How it tags and signs what it sends, and checks what it hears.
struct RobotKeys {
  Authenticator authenticator = crc_authenticator();
  Signatures signatures{};
};

/// For one thread. Nothing uses the heap after make().
class Robot {
 public:
  /// clock: for deadlines. Fails with kUsage iff a setting is out of its range; kFailure iff the
  /// system does not give the memory. What keys name must outlive it.
  static Outcome<std::unique_ptr<Robot>> make(const RobotConfig& config, const ClassTable& classes,
                                              const RobotKeys& keys, const Clock& clock);
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  /// now_us: as of config's clock.
  ScanReport integrate(const ScanView& scan, std::int64_t now_us) noexcept;
  /// What arrived, from anybody.
  void receive(std::span<const std::byte> datagram, std::int64_t now_us) noexcept {
    exchange_.receive(datagram, now_us);
  }
  /// Publishes what has changed, and goes on with the global map. To be called at an even pace.
  PublisherReport tick(std::int64_t now_us) noexcept;
  /// Goes on with the global map, as far as this tick's work is not spent: what has arrived is seen
  /// before the next tick then.
  void fuse() noexcept;
  /// The same beside what a tick may do, in a small piece: some milliseconds. False: nothing waits.
  bool fuse_in_spare_time() noexcept;
  /// Brings the global map up to date with all that has arrived, however long it takes.
  void finish() noexcept {
    while (fuse_in_spare_time()) {
    }
  }
  /// The next datagram to send, as Exchange::send.
  [[nodiscard]] std::size_t send(std::int64_t now_us, std::span<std::byte> into) noexcept {
    return exchange_.send(now_us, into);
  }
  /// Nothing waits to be published or fused.
  [[nodiscard]] bool idle() const noexcept {
    return publisher_.waiting() == 0 && !global_.busy() && ticks_since_scan_ > 2;
  }

  [[nodiscard]] Exchange& exchange() noexcept { return exchange_; }
  [[nodiscard]] const Exchange& exchange() const noexcept { return exchange_; }
  [[nodiscard]] const LocalMap& map() const noexcept { return map_; }
  [[nodiscard]] const GlobalMap& global() const noexcept { return global_; }
  [[nodiscard]] const Publisher& publisher() const noexcept { return publisher_; }
  /// Work that was done on the global map.
  [[nodiscard]] std::uint64_t fusion_work() const noexcept { return fusion_work_; }
  [[nodiscard]] const RobotConfig& config() const noexcept { return config_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return memory_.span().size(); }
  /// Of memory_bytes(), what holds something, and what is scratch.
  [[nodiscard]] std::size_t used_bytes() const noexcept;

 private:
  static constexpr std::int64_t kNone = INT64_MIN;
  static constexpr std::uint64_t kSpareWork = 50'000;

  Robot(const RobotConfig& config, const Clock& clock) : config_(config), deadline_(clock) {}
  Status set_up(Arena& arena, const ClassTable& classes, const RobotKeys& keys);

  RobotConfig config_;
  ArenaMemory memory_;
  LocalMap map_;
  Integrator integrator_;
  Publisher publisher_;
  GlobalMap global_;
  Exchange exchange_;
  Deadline deadline_;
  std::uint64_t work_left_ = 0;
  std::uint64_t fusion_work_ = 0;
  std::int64_t first_tick_us_ = kNone;
  std::uint32_t ticks_since_scan_ = 0;
};

}  // namespace tessera
