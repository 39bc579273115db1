// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/fuse_setup.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <set>

#include "base/number_text.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

constexpr std::size_t kLeastStorageBytes = 4 * SlabPool::kPageBytes;

/// Number of blocks of the global grid that the maps' blocks may reach.
std::uint32_t count_global_blocks(const std::vector<FuseInput>& inputs) {
  std::vector<std::uint64_t> keys;
  for (const FuseInput& input : inputs) {
    std::vector<KeyedIndex> workspace = workspace_for(input.stored->map);
    for (const KeyedIndex& item : input.stored->map.blocks_in_order(workspace)) {
      const GridTransform::BlockRange range = input.frame.global_blocks(unpack(BlockKey{item.key}));
      for (std::int32_t z = range.first.z; z <= range.last.z; ++z) {
        for (std::int32_t y = range.first.y; y <= range.last.y; ++y) {
          for (std::int32_t x = range.first.x; x <= range.last.x; ++x) {
            if (const Result<BlockKey> key = pack({x, y, z}); key.ok()) keys.push_back(key->bits);
          }
        }
      }
    }
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  }
  return static_cast<std::uint32_t>(keys.size());
}

/// The largest of the maps' caps, so that no map is limited to less than its own.
float cap_of(const std::vector<FuseInput>& inputs) {
  float largest = 0.0F;
  for (const FuseInput& input : inputs) {
    if (!input.session) largest = std::max(largest, robot_max_evidence(input.stored->map.config()));
  }
  return largest;
}

/// Capacities with which nothing is refused.
GlobalMapConfig ample_config(const std::vector<FuseInput>& inputs, const FuseOptions& options,
                             const DiffusionConfig& diffusion, const ReplicaDemand& demand) {
  GlobalMapConfig config;
  config.diffusion = diffusion;
  config.map = inputs.front().stored->map.config();
  config.map.max_evidence = 0.0F;
  config.max_evidence = cap_of(inputs);
  const bool paper = diffusion.mode == DiffusionMode::kPaper;
  if (paper) config.map.prior = 0.0;
  if (std::any_of(inputs.begin(), inputs.end(), [](const FuseInput& input) {
        return input.stored->map.config().probabilities == Probabilities::kShares;
      }))
    config.map.probabilities = Probabilities::kShares;
  const bool all_dense = std::all_of(inputs.begin(), inputs.end(), [](const FuseInput& input) {
    return input.stored->map.config().tuple == TuplePolicy::kDense;
  });
  config.map.tuple =
      options.counts.value_or(paper || all_dense ? TuplePolicy::kDense : TuplePolicy::kCompact);
  config.replicas = {.segments = demand.segments,
                     .blocks = demand.blocks,
                     .contributions = static_cast<std::uint32_t>(inputs.size()),
                     .robot_segments = demand.segments};
  // A rotated block touches up to 27 of the grid; its voxels are spread over a third more octets.
  config.blocks = 27 * demand.blocks;
  config.sum_segments = 8 * demand.segments + 27 * demand.blocks;
  config.staged_bytes = kLeastStorageBytes;  // nothing moves
  std::size_t storage = std::size_t{1} << 24U;
  const std::size_t octet_bytes =
      TupleStore::octet_bytes(config.map.tuple, inputs.front().stored->map.num_components());
  for (const FuseInput& input : inputs) {
    const MapFileContent& content = input.stored->header.content;
    storage += 8 * (content.blocks * sizeof(Block) + 4 * content.label_pages * sizeof(LabelPage) +
                    4 * content.free_pages * sizeof(FreePage)) +
               4 * content.octets * octet_bytes;
  }
  config.map.storage_bytes =
      std::min(align_up(storage, SlabPool::kPageBytes), MapConfig::kMaxStorageBytes);
  return config;
}

/// A --memory with which the map has at least as much storage as the largest of the inputs.
std::size_t enough_bytes(const std::vector<FuseInput>& inputs, std::size_t without_map) {
  std::size_t largest = kLeastStorageBytes;
  for (const FuseInput& input : inputs)
    largest = std::max<std::size_t>(largest, input.stored->header.config.storage_bytes);
  // A quarter goes to the sums, and a few percent to the index.
  return without_map + largest + largest / 2;
}

}  // namespace

Outcome<void> check_number_of_maps(std::size_t maps, std::size_t sessions) {
  if (maps + sessions < 2) return Failure{"give at least two local maps to fuse"};
  if (maps + sessions > Replicas::kMostContributions) {
    return Failure{fmt::format("{} are too many for a global map; give at most {}",
                               counted(maps, "map"), Replicas::kMostContributions)};
  }
  return {};
}

Outcome<void> check_number_of_robots(const std::vector<FuseInput>& inputs) {
  std::set<std::uint32_t> robots;
  for (const FuseInput& input : inputs) robots.insert(input.id.robot);
  if (robots.size() <= Replicas::kMostRobots) return {};
  return Failure{
      fmt::format("the maps are of {}, too many for a global map; give maps of at most {}",
                  counted(robots.size(), "robot"), Replicas::kMostRobots)};
}

Outcome<GlobalMapConfig> config_for(const std::vector<FuseInput>& inputs,
                                    const FuseOptions& options, const DiffusionConfig& diffusion,
                                    const ReplicaDemand& demand) {
  GlobalMapConfig config = ample_config(inputs, options, diffusion, demand);
  if (!options.memory_bytes) return config;
  const std::size_t budget_bytes = *options.memory_bytes;
  const int components = inputs.front().stored->map.num_components();
  const auto without_map = [&] {
    return GlobalMap::required_bytes(config, components) - required_bytes(config.map);
  };
  config.blocks = count_global_blocks(inputs) + 1;
  const bool diffuses = diffusion.mode != DiffusionMode::kNone;
  // Without sums there are tallies: seldom more than two segments of a block.
  const std::uint32_t ample_segments = diffuses ? config.sum_segments : 2 * config.blocks;
  config.sum_segments = 1;
  const std::size_t least = without_map();
  if (least < budget_bytes) {
    const std::size_t quarter = (budget_bytes - least) / 4 / SegmentStore::kSegmentBytes;
    config.sum_segments =
        static_cast<std::uint32_t>(std::clamp<std::size_t>(quarter, 1, ample_segments));
    config.map = fit_to_budget(config.map, budget_bytes - without_map());
    config.map.storage_bytes = std::min(config.map.storage_bytes, MapConfig::kMaxStorageBytes);
  }
  if (least >= budget_bytes || config.map.storage_bytes < kLeastStorageBytes) {
    constexpr std::size_t kMiB = std::size_t{1} << 20U;
    return Failure{Message(kFuseSettings["--memory"]) + " " + bytes_text(budget_bytes) +
                   " is too little for a global map of these maps; give at least " +
                   bytes_text((enough_bytes(inputs, least) / kMiB + 1) * kMiB)};
  }
  return config;
}

}  // namespace tessera
