// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot with so little room that every limit is reached: replicas alone, or a global map around
// them.
#pragma once

#include <memory>

#include "fuzz/fuzz.hpp"
#include "network/simulated_network.hpp"
#include "tessera/fusion/global_map.hpp"

namespace tessera::fuzz {

class SmallRobot {
 public:
  static constexpr ReplicasConfig kReplicas{
      .segments = 256, .blocks = 64, .contributions = 6, .robot_segments = 128};
  static constexpr ExchangeConfig kExchange{.contributions = 6,
                                            .peers = 4,
                                            .answers = 4,
                                            .bytes_per_s = 100'000,
                                            .burst_bytes = 4 * kMostDatagramBytes};

  /// Opens contribution (number, session, 0). with_signatures: toy ones.
  SmallRobot(std::uint32_t number, std::uint32_t session, bool has_map, bool with_signatures);
  SmallRobot(const SmallRobot&) = delete;
  SmallRobot& operator=(const SmallRobot&) = delete;
  ~SmallRobot();
  [[nodiscard]] Exchange& exchange() { return exchange_; }
  [[nodiscard]] const Replicas& replicas() const {
    return has_map_ ? global_.replicas() : replicas_;
  }
  /// A block with so many random voxels.
  Result<std::uint32_t> publish(BlockKey key, oracle::Random& random, int voxels);
  /// Some of the work that waits, if there is a map.
  void fuse();
  /// All that it knows, beside the exchange itself.
  [[nodiscard]] std::span<const std::byte> memory() { return memory_->span(); }

 private:
  bool has_map_;
  network::ToySignatures key_;
  std::unique_ptr<AlignedMemory> memory_;
  Replicas replicas_;
  GlobalMap global_;
  Exchange exchange_;
  BlockContent content_;
};

}  // namespace tessera::fuzz
