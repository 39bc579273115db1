// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "fuzz/small_robot.hpp"

#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace tessera::fuzz {

namespace {

constexpr int kComponents = network::kClasses + 2;

GlobalMapConfig map_config() {
  GlobalMapConfig config;
  config.map.max_evidence = 0.0F;
  config.map.storage_bytes = std::size_t{1} << 18U;
  config.replicas = SmallRobot::kReplicas;
  config.blocks = 128;
  config.sum_segments = 128;
  config.staged_bytes = std::size_t{1} << 16U;
  config.diffusion.iterations = 1;
  config.diffusion.length_m = 0.1F;
  return config;
}

std::size_t bytes_of(bool has_map, const ExchangeConfig& config) {
  return (has_map ? GlobalMap::required_bytes(map_config(), kComponents)
                  : Replicas::required_bytes(SmallRobot::kReplicas)) +
         Exchange::required_bytes(config, kComponents) + BlockContent::required_bytes(kComponents);
}

/// Of robots that are gone, for the next ones: fresh memory costs more than all else.
using Memories = std::vector<std::unique_ptr<AlignedMemory>>;
Memories& spare_memories(bool has_map) {
  static std::array<Memories, 2> spare;
  return spare[has_map ? 1 : 0];
}

std::unique_ptr<AlignedMemory> take_memory(bool has_map) {
  Memories& spare = spare_memories(has_map);
  if (spare.empty())
    return std::make_unique<AlignedMemory>(bytes_of(has_map, SmallRobot::kExchange));
  std::unique_ptr<AlignedMemory> memory = std::move(spare.back());
  spare.pop_back();
  return memory;
}

template <class T>
T made(Result<T> result) {
  require(result.ok(), "a small robot is not made");
  return std::move(*result);
}

}  // namespace

SmallRobot::SmallRobot(std::uint32_t number, std::uint32_t session, bool has_map,
                       bool with_signatures)
    : has_map_(has_map), key_(number), memory_(take_memory(has_map)) {
  Arena arena(memory_->span());
  ExchangeConfig config = kExchange;
  config.robot = number;
  config.session = std::uint64_t{session} << 32U;
  const ClassTable classes = oracle::numbered_classes(network::kClasses);
  if (has_map) {
    global_ = made(GlobalMap::make(arena, map_config(), classes));
  } else {
    replicas_ = made(Replicas::make(arena, kReplicas));
  }
  exchange_ = made(Exchange::make(arena, config, has_map ? store_of(global_) : store_of(replicas_),
                                  crc_authenticator(), classes,
                                  with_signatures ? key_.signatures() : Signatures{}));
  content_ = made(BlockContent::make(arena, kComponents));
  require(exchange_.open(session, 0, Matrix34d::Identity()) == Status::kOk, "open");
}

SmallRobot::~SmallRobot() { spare_memories(has_map_).push_back(std::move(memory_)); }

Result<std::uint32_t> SmallRobot::publish(BlockKey key, oracle::Random& random, int voxels) {
  content_.clear();
  network::add_random_voxels(content_, random, voxels);
  return exchange_.publish(key, content_);
}

void SmallRobot::fuse() {
  if (!has_map_) return;
  static_cast<void>(global_.step(20'000));
  require(std::isfinite(global_.report().mean_variance), "a map without numbers");
}

}  // namespace tessera::fuzz
