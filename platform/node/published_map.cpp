// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/published_map.hpp"

#include <algorithm>
#include <bit>
#include <utility>
#include <vector>

namespace tessera {

namespace {

/// Keys of the blocks of the contribution that this robot publishes.
std::vector<std::uint64_t> published_blocks(const Robot& robot) {
  const Replicas& replicas = robot.global().replicas();
  std::vector<std::uint64_t> keys;
  const std::optional<ContributionId> id = robot.exchange().publishing();
  if (!id) return keys;
  const Result<Replicas::Slot> slot = replicas.find(*id);
  if (!slot.ok()) return keys;
  std::uint32_t at = replicas.contribution(*slot).first_block;
  for (; at != 0; at = replicas.record(at).next) keys.push_back(replicas.record(at).key);
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

}  // namespace

Outcome<std::unique_ptr<PublishedMap>> published_map(const Robot& robot) {
  const int components = robot.map().num_components();
  TESSERA_TRY_ASSIGN(const ArenaMemory scratch,
                     ArenaMemory::allocate(BlockContent::required_bytes(components)));
  Arena scratch_arena(scratch.span());
  BlockContent content = *BlockContent::make(scratch_arena, components);
  const std::vector<std::uint64_t> keys = published_blocks(robot);
  const auto read = [&](std::uint64_t key) {
    content.clear();
    return robot.exchange().read_published(BlockKey{key}, content) && content.any();
  };
  std::size_t octets = 0;
  for (const std::uint64_t key : keys)
    octets += read(key) ? static_cast<std::size_t>(std::popcount(content.label_octets())) : 0;
  MapConfig config = robot.map().config();
  config.tuple = TuplePolicy::kCompact;
  config.label_votes = false;
  const std::size_t of_block =
      sizeof(Block) + kBlockLayers * (sizeof(LabelPage) + sizeof(FreePage));
  const std::size_t octet_bytes = TupleStore::octet_bytes(config.tuple, components);
  // Items do not cross pages, so a page may be only a little more than half full.
  config.storage_bytes =
      align_up(2 * (keys.size() * of_block + octets * octet_bytes) + 16 * SlabPool::kPageBytes,
               SlabPool::kPageBytes);
  auto published = std::make_unique<PublishedMap>();
  TESSERA_TRY_ASSIGN(ArenaMemory memory, ArenaMemory::allocate(required_bytes(config)));
  published->memory = std::move(memory);
  Arena arena(published->memory.span());
  Result<LocalMap> map = LocalMap::make(arena, config, robot.map().classes());
  if (!map.ok())
    return Failure{
        std::string("the map of the contribution cannot be made: ") + to_string(map.status()),
        FailureKind::kFailure};
  published->map = std::move(*map);
  for (const std::uint64_t key : keys) {
    if (!read(key)) continue;
    const Result<SlabHandle> block = published->map.open_block(unpack(BlockKey{key}));
    if (!block.ok() || published->map.replace(*block, content) != Status::kOk)
      return Failure{"there is no room for a block of the contribution", FailureKind::kFailure};
  }
  return published;
}

}  // namespace tessera
