// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/fusion_run.hpp"

#include <algorithm>
#include <array>

#include "base/monotonic_clock.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

/// Calls put(slot, key, version, packed) for every block of every map.
template <class Put>
void for_blocks(const std::vector<FuseInput>& inputs, Arena& arena, Put&& put) {
  const int components = inputs.front().stored->map.num_components();
  BlockContent content = *BlockContent::make(arena, components);
  const std::span<std::byte> packed = arena.take<std::byte>(most_packed_bytes(components));
  const std::span<KeyedIndex> workspace = arena.take<KeyedIndex>([&] {
    std::size_t most = 0;
    for (const FuseInput& input : inputs)
      most = std::max(most, 2 * input.stored->map.block_count());
    return most;
  }());
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const LocalMap& map = inputs[i].stored->map;
    for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
      const Block& block = map.block_at(item.index);
      content.clear();
      add_block(map, block, content);
      put(i, BlockKey{item.key}, block.revision + 1, packed.first(pack_block(content, packed)));
    }
  }
}

double ms_since(std::int64_t start_us) {
  return static_cast<double>(MonotonicClock::now_us() - start_us) / 1000.0;
}

}  // namespace

Outcome<std::unique_ptr<FusionRun>> FusionRun::prepare(const std::vector<FuseInput>& inputs,
                                                       const FuseOptions& options,
                                                       const DiffusionConfig& diffusion) {
  std::unique_ptr<FusionRun> fusion(new FusionRun());
  FuseRun& run = fusion->run_;
  ReplicaDemand demand{.blocks = 1, .segments = 1};
  std::size_t most_blocks = 0;
  for (const FuseInput& input : inputs) {
    most_blocks = std::max(most_blocks, input.stored->map.block_count());
    demand.blocks += static_cast<std::uint32_t>(input.stored->map.block_count());
    run.replica_voxels += input.stored->map.usage().label_voxels;
  }
  const LocalMap& first = inputs.front().stored->map;
  const int components = first.num_components();
  const std::size_t scratch_bytes = BlockContent::required_bytes(components) +
                                    arena_bytes<std::byte>(most_packed_bytes(components)) +
                                    arena_bytes<KeyedIndex>(2 * most_blocks);
  TESSERA_TRY_ASSIGN(ArenaMemory scratch, ArenaMemory::allocate(scratch_bytes));
  fusion->scratch_ = std::move(scratch);
  Arena counting(fusion->scratch_.span());
  for_blocks(inputs, counting,
             [&](std::size_t, BlockKey, std::uint32_t, std::span<const std::byte> packed) {
               demand.segments += SegmentStore::segments_of(packed.size());
             });
  TESSERA_TRY_ASSIGN(const GlobalMapConfig config, config_for(inputs, options, diffusion, demand));
  run.config = config;
  const std::size_t arena_size_bytes = GlobalMap::required_bytes(run.config, components);
  run.budget_bytes = options.memory_bytes.value_or(arena_size_bytes);
  TESSERA_TRY_ASSIGN(ArenaMemory memory,
                     ArenaMemory::allocate(arena_size_bytes,
                                           "give a smaller " + Message(kFuseSettings["--memory"])));
  fusion->memory_ = std::move(memory);
  Arena arena(fusion->memory_.span());
  Result<GlobalMap> global = GlobalMap::make(arena, run.config, first.classes());
  if (!global.ok())
    return Failure{std::string("the global map cannot be made: ") + to_string(global.status())};
  fusion->global_ = std::move(*global);
  return fusion;
}

Outcome<void> FusionRun::fuse(const std::vector<FuseInput>& inputs, const FuseProgress& progress) {
  std::int64_t start_us = MonotonicClock::now_us();
  std::array<GlobalMap::Slot, Replicas::kMostContributions> slots{};
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const FuseInput& input = inputs[i];
    const Result<GlobalMap::Slot> slot = global_.open(input.id, input.frame);
    if (!slot.ok()) return Failure{input.path + " has no place in the global map; give fewer maps"};
    slots[i] = *slot;
    if (input.session) static_cast<void>(global_.set_frame(*slot, input.frame, 1, *input.session));
  }
  Status status = Status::kOk;
  Arena scratch(scratch_.span());
  for_blocks(inputs, scratch,
             [&](std::size_t input, BlockKey key, std::uint32_t version,
                 std::span<const std::byte> packed) {
               const Result<Replicas::Change> put = global_.put(slots[input], key, version, packed);
               // What does not fit is counted there, and warned about at the end.
               if (!put.ok() && put.status() != Status::kResourceExhausted) status = put.status();
             });
  if (status != Status::kOk)
    return Failure{std::string("a block was refused: ") + to_string(status), FailureKind::kFailure};
  run_.publish_ms = ms_since(start_us);
  start_us = MonotonicClock::now_us();
  const std::uint32_t total = global_.waiting();
  std::uint32_t done = 0;
  while (global_.busy()) {
    run_.work += global_.step(1U << 20U);
    // Blocks of robots that are weighed otherwise wait again.
    done = std::max(done, total - std::min(total, global_.waiting()));
    if (progress) progress(done, total);
  }
  run_.fuse_ms = ms_since(start_us);
  return {};
}

void FusionRun::measure(std::optional<std::uint64_t> digest) {
  run_.report = global_.report();
  run_.robots = judge_robots(global_);
  run_.usage = global_.map().usage();
  run_.free_voxels = global_.map().count_free_voxels();
  std::vector<KeyedIndex> workspace = workspace_for(global_.map());
  run_.digest = digest ? *digest : tessera::digest(global_.map(), workspace);
}

}  // namespace tessera
