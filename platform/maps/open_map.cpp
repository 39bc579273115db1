// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/open_map.hpp"

#include <algorithm>

#include "maps/fusion_run.hpp"
#include "maps/submaps.hpp"
#include "tessera/map/stored_block.hpp"

namespace tessera {

namespace {

/// A copy in as much memory as it takes.
Outcome<std::unique_ptr<StoredMap>> compact(const LocalMap& map, const MapFileHeader& header) {
  auto stored = std::make_unique<StoredMap>();
  stored->header = header;
  stored->header.identity.kind = MapKind::kLocal;
  MapConfig& config = stored->header.config;
  config = map.config();
  // Pages that are not full anywhere else may be so here, and the other way round.
  config.storage_bytes =
      std::min(map.usage().used_bytes + 64 * SlabPool::kPageBytes, MapConfig::kMaxStorageBytes);
  TESSERA_TRY_ASSIGN(ArenaMemory memory, ArenaMemory::allocate(required_bytes(config)));
  stored->memory = std::move(memory);
  Arena arena(stored->memory.span());
  Result<LocalMap> copy = LocalMap::make(arena, config, map.classes());
  if (!copy.ok())
    return Failure{std::string("the map cannot be made: ") + to_string(copy.status())};
  stored->map = std::move(*copy);
  stored->map.restore_revision(map.revision());
  std::vector<std::byte> block(most_block_bytes(map.num_components()));
  std::vector<KeyedIndex> workspace = workspace_for(map);
  for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
    const std::size_t bytes = save_block(map, map.block_at(item.index), block);
    if (bytes != 0 && !restore_block(std::span(block).first(bytes), stored->map).ok())
      return Failure{"the sum of the submaps does not fit", FailureKind::kFailure};
  }
  stored->header.summary = summarize(stored->map, workspace);
  stored->header.content.blocks = stored->map.block_count();
  return stored;
}

}  // namespace

Outcome<std::unique_ptr<StoredMap>> open_map(const std::string& path) {
  TESSERA_TRY_ASSIGN(const MapFileHeader header, load_map_header(path));
  if (header.identity.kind != MapKind::kSubmaps) return load_map(path);
  std::vector<Message> warnings;
  TESSERA_TRY_ASSIGN(std::vector<FuseInput> inputs, load_submap_inputs(path, header));
  // In the robot's own frame, whatever that is in the global one.
  for (FuseInput& input : inputs) input.T_global_map = Matrix34d::Identity();
  if (inputs.empty()) return Failure{path + " has no submap"};
  TESSERA_TRY_ASSIGN(inputs, arrange_inputs(std::move(inputs), warnings));
  FuseOptions options;
  options.counts = header.config.tuple;
  options.diffusion.mode = DiffusionMode::kNone;
  TESSERA_TRY_ASSIGN(const DiffusionConfig diffusion,
                     diffusion_of(options.diffusion, inputs.front().stored->map.config()));
  TESSERA_TRY_ASSIGN(const std::unique_ptr<FusionRun> sum,
                     FusionRun::prepare(inputs, options, diffusion));
  TESSERA_TRY(sum->fuse(inputs, {}));
  inputs.clear();
  return compact(sum->map(), header);
}

}  // namespace tessera
