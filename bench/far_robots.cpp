// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "far_robots.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "tessera/base/internal/digest.hpp"

namespace tessera::bench {

namespace {

constexpr int kClasses = 19;
constexpr double kSubmap_m = 20.0;  ///< Of a road.
constexpr int kAcross = 20;         ///< Blocks of a submap across the road.
constexpr double kRoads_m = 500.0;  ///< From one road to the next.

/// Of a submap, in the order in which its blocks are published.
BlockKey key_of(std::uint32_t i) {
  constexpr int kLong = static_cast<int>(kSubmap_m / kFarBlock_m);
  const auto at = static_cast<std::int32_t>(i);
  return *pack({at % kLong, at / kLong % kAcross, at / (kLong * kAcross)});
}

std::uint64_t seed_of(std::uint32_t robot, std::uint32_t submap, std::uint32_t i) {
  return (std::uint64_t{robot} << 40U) + (std::uint64_t{submap} << 20U) + std::uint64_t{64} * i;
}

ArenaMemory memory_of(std::size_t bytes) {
  Outcome<ArenaMemory> memory = ArenaMemory::allocate(bytes);
  if (memory.ok()) return std::move(*memory);
  std::fprintf(stderr, "%s\n", memory.failure().text().c_str());
  std::exit(1);
}

ExchangeConfig exchange_config(std::uint32_t robot, std::uint32_t records) {
  ExchangeConfig config;
  config.robot = robot;
  config.resolution_m = kFarResolution_m;
  config.records = records;
  return config;
}

GlobalMapConfig global_config(std::uint32_t segments, std::uint32_t records,
                              std::uint32_t contributions, std::uint32_t blocks,
                              std::size_t map_bytes) {
  GlobalMapConfig config;
  config.map = {
      .resolution_m = kFarResolution_m, .tuple = TuplePolicy::kCompact, .storage_bytes = map_bytes};
  config.map.max_evidence = 0.0F;
  config.replicas = {.segments = segments,
                     .blocks = records,
                     .contributions = contributions,
                     .robot_segments = segments};
  config.blocks = blocks;
  config.sum_segments = segments / 2;
  config.staged_bytes = map_bytes / 4;
  return config;
}

}  // namespace

ClassTable far_classes() {
  ClassTable table;
  for (int i = 1; i <= kClasses; ++i) {
    const std::string name = "class " + std::to_string(i);
    if (table.add(name, {static_cast<std::uint8_t>(10 * i), 0, 0}) != Status::kOk) std::abort();
  }
  return table;
}

void fill_far(BlockContent& content, std::uint64_t seed) {
  content.clear();
  for (int j = 0; j < kBlockEdge; ++j) {
    for (int i = 0; i < kBlockEdge; ++i) {
      const std::uint64_t random = mix64(seed + static_cast<std::uint64_t>(8 * j + i));
      const int top = 4 + static_cast<int>(random % 2);
      for (int z = 3; z <= top; ++z) {
        const int row = (z * kBlockEdge + j) * kBlockEdge + i;
        for (unsigned k = 0; k < 3; ++k)
          content.add(1 + static_cast<int>((random >> (8 * k)) % kClasses), row,
                      0.5F + 0.25F * static_cast<float>(
                                         (random >> (7 * k + static_cast<unsigned>(z))) % 32));
      }
    }
  }
}

Matrix34d far_frame(std::uint32_t robot, std::uint32_t submap) {
  const double angle = 0.001 * (submap % 7) + 0.0005 * robot;
  Matrix34d T = Matrix34d::Identity();
  T(0, 0) = T(1, 1) = std::cos(angle);
  T(1, 0) = std::sin(angle);
  T(0, 1) = -T(1, 0);
  T(0, 3) = kSubmap_m * submap;
  T(1, 3) = kRoads_m * static_cast<double>((robot - 1) / 2);
  return T;
}

Point3d far_place(std::uint32_t robot, std::uint32_t submap) {
  return Point3d(far_frame(robot, submap).col(3)) + Point3d(kSubmap_m / 2, 8.0, 0.5);
}

FarOrigin::FarOrigin(std::uint32_t number, const FarOptions& options) {
  const std::uint32_t records = options.submaps * options.blocks + 64;
  const ReplicasConfig replicas_config{.segments = 40 * records,
                                       .blocks = records,
                                       .contributions = options.submaps + 1,
                                       .robot_segments = 40 * records};
  ExchangeConfig config = exchange_config(number, records);
  config.contributions = options.submaps + 1;
  config.own_contributions = options.submaps;
  const ClassTable table = far_classes();
  memory = memory_of(Replicas::required_bytes(replicas_config) +
                     Exchange::required_bytes(config, table.num_components()) +
                     BlockContent::required_bytes(table.num_components()));
  Arena arena(memory.span());
  replicas = made_or_end(Replicas::make(arena, replicas_config));
  exchange =
      made_or_end(Exchange::make(arena, config, store_of(replicas), crc_authenticator(), table));
  BlockContent content = made_or_end(BlockContent::make(arena, table.num_components()));
  for (std::uint32_t submap = 0; submap < options.submaps; ++submap) {
    if (exchange.open(1, submap, far_frame(number, submap)) != Status::kOk) std::exit(1);
    for (std::uint32_t i = 0; i < options.blocks; ++i) {
      fill_far(content, seed_of(number, submap, i));
      if (!exchange.publish(key_of(i), content).ok()) std::exit(1);
    }
  }
}

SmallRobot::SmallRobot(const FarOptions& options) {
  const ClassTable table = far_classes();
  const int components = table.num_components();
  ExchangeConfig config = exchange_config(kFarOthers + 1, 0);
  config.contributions = 192;
  config.contributions_per_robot = 128;
  config.far_contributions = 4096;
  GlobalMapConfig global{};
  // Two fifths of the memory for replicas, three tenths for the map, a fifth for sums.
  const auto fit = [&](std::size_t bytes) {
    const auto segments = static_cast<std::uint32_t>(bytes * 2 / 5 / SegmentStore::kSegmentBytes);
    global = global_config(segments, segments / 12, config.contributions, segments / 12,
                           bytes * 3 / 10 / SlabPool::kPageBytes * SlabPool::kPageBytes);
    global.sum_segments = segments / 2;
    config.records = global.replicas.blocks;
    return GlobalMap::required_bytes(global, components) +
           Exchange::required_bytes(config, components);
  };
  std::size_t bytes = options.memory;
  while (fit(bytes) > options.memory) bytes -= std::size_t{1} << 20U;
  memory = memory_of(fit(bytes));
  Arena arena(memory.span());
  map = made_or_end(GlobalMap::make(arena, global, table));
  exchange = made_or_end(Exchange::make(arena, config, store_of(map), crc_authenticator(), table));
  std::printf(
      "the robot: %.1f MiB, of these %.1f for replicas and %.1f for %u far contributions\n",
      static_cast<double>(memory.span().size()) / 0x1p20,
      static_cast<double>(Replicas::required_bytes(global.replicas)) / 0x1p20,
      static_cast<double>(FarContributions::required_bytes(config.far_contributions)) / 0x1p20,
      config.far_contributions);
}

FullRobot::FullRobot(std::uint32_t robot, std::uint32_t robots, const FarOptions& options)
    : number(robot) {
  const std::uint32_t contributions = robots * (options.submaps + 1);
  const std::uint32_t records = contributions * options.blocks;
  const GlobalMapConfig global = global_config(
      40 * records, records, contributions, records,
      std::min(MapConfig::kMaxStorageBytes, (std::size_t{4096} * records | 0xfffff) + 1));
  ExchangeConfig config = exchange_config(robot, records);
  config.contributions = contributions;
  config.contributions_per_robot = config.own_contributions = options.submaps + 1;
  const ClassTable table = far_classes();
  const int components = table.num_components();
  memory = memory_of(GlobalMap::required_bytes(global, components) +
                     Exchange::required_bytes(config, components) +
                     BlockContent::required_bytes(components));
  Arena arena(memory.span());
  map = made_or_end(GlobalMap::make(arena, global, table));
  exchange = made_or_end(Exchange::make(arena, config, store_of(map), crc_authenticator(), table));
  content = made_or_end(BlockContent::make(arena, components));
  for (std::uint32_t submap = 0; submap < options.submaps; ++submap) {
    open();
    publish(0, options.blocks);
  }
}

void FullRobot::open() {
  if (exchange.open(1, submaps, far_frame(number, submaps)) != Status::kOk) std::exit(1);
  ++submaps;
}

void FullRobot::publish(std::uint32_t first, std::uint32_t count) {
  for (std::uint32_t i = first; i < first + count; ++i) {
    fill_far(content, seed_of(number, submaps - 1, i));
    if (!exchange.publish(key_of(i), content).ok()) std::exit(1);
  }
}

MapOfAll::MapOfAll(const std::vector<std::unique_ptr<FarOrigin>>& others,
                   const FarOptions& options) {
  const ClassTable table = far_classes();
  const std::uint32_t records = kFarOthers * options.submaps * options.blocks;
  GlobalMapConfig config =
      global_config(40 * records, records, kFarOthers * options.submaps, records,
                    std::min(MapConfig::kMaxStorageBytes, std::size_t{4096} * records));
  config.staged_bytes = 4 * SlabPool::kPageBytes;
  memory = memory_of(GlobalMap::required_bytes(config, table.num_components()));
  Arena arena(memory.span());
  map = made_or_end(GlobalMap::make(arena, config, table));
  std::vector<std::byte> packed(most_packed_bytes(table.num_components()));
  for (const auto& other : others) {
    const Replicas& from = other->replicas;
    for (const Replicas::Slot slot : from.in_order()) {
      const Replicas::Contribution& one = from.contribution(slot);
      const Replicas::Slot into = made_or_end(map.open(one.id, one.T_global_local));
      for (std::uint32_t at = one.first_block; at != 0; at = from.record(at).next) {
        const Replicas::Replica& part = from.record(at);
        const PartVersion version{.number = part.version,
                                  .first = part.version - part.part,
                                  .layers = part.layers,
                                  .hash = part.hash};
        if (!map.put(into, BlockKey{part.key}, version, from.read(part, packed)).ok()) std::exit(1);
      }
    }
  }
  while (map.busy()) static_cast<void>(map.step(1'000'000));
  if (map.counters().refused_outputs != 0 || map.counters().refused_sums != 0) {
    std::fprintf(stderr, "the map of all has no room for everything\n");
    std::exit(1);
  }
}

}  // namespace tessera::bench
