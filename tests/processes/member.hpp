// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot of a team as a process of its own: a real clock, real datagrams, and blocks that hang on
// its seed alone, or those of a map.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "link/datagram_link.hpp"
#include "link/fleet_keys.hpp"
#include "network/map_blocks.hpp"
#include "support/mapper.hpp"
#include "support/random.hpp"
#include "tessera/exchange/exchange.hpp"

namespace tessera::processes {

struct MemberConfig {
  std::uint32_t robot = 0;
  std::uint32_t session = 1;  ///< Its epoch, too.
  LinkConfig link;
  KeyFiles keys;
  std::string map;  ///< A map file, whose blocks are published; empty: random ones.
  std::uint64_t seed = 1;
  int blocks = 200;                 ///< That are published in all, at most.
  int blocks_per_s = 400;           ///< From the start on.
  double resolution_m = 0.1;        ///< Without a map.
  std::uint32_t parts = 1U << 14U;  ///< Places for blocks of all robots.
  std::uint32_t robot_parts = 0;    ///< Of these for one robot's; 0: all.
  std::uint32_t floor = 0;          ///< Its lowest epoch that counts.
};

class Member {
 public:
  /// Throws std::runtime_error iff a setting, a file or the network is not usable.
  explicit Member(const MemberConfig& config);
  /// Publishes what is due, hears what arrived and says what is due. Sleeps until a datagram comes
  /// or a tick is over, 10 ms at most.
  void step();
  /// Tells the others that it is gone.
  void leave();
  /// One line of JSON: what it holds, what it did and what it took.
  [[nodiscard]] std::string report() const;

 private:
  static constexpr std::int64_t kTickUs = 10'000;

  void publish_due(std::int64_t now_us);
  bool publish_next();
  BlockKey random_block();
  /// Goes on in another epoch, as a node does, where something else was published in its name.
  void leave_epoch(std::int64_t now_us);
  void hear();
  void say();
  [[nodiscard]] int blocks_in_all() const;

  MemberConfig config_;
  std::unique_ptr<network::MapBlocks> map_;
  ClassTable classes_;
  std::optional<FleetKeys> keys_;
  std::unique_ptr<AlignedMemory> memory_;
  Replicas replicas_;
  Exchange exchange_;
  BlockContent content_;
  std::unique_ptr<DatagramLink> link_;
  oracle::Random random_;
  Matrix34d T_global_map_ = Matrix34d::Identity();
  std::uint32_t epoch_ = 0;
  std::int64_t start_us_ = 0;
  std::int64_t tick_us_ = 0;
  int published_ = 0;
  std::uint64_t published_bytes_ = 0;
  std::uint64_t digest_ = 0;
  std::int64_t published_us_ = 0;  ///< Last; so is the next.
  std::int64_t changed_us_ = 0;
};

}  // namespace tessera::processes
