// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A global map in an arena.
#include "tessera/base/internal/put_in_place.hpp"
#include "tessera/fusion/global_map.hpp"

namespace tessera {

namespace {

bool in_range(const DiffusionConfig& config) noexcept {
  const int least = config.mode == DiffusionMode::kPaper ? 1 : 0;
  return config.mode <= DiffusionMode::kNone && config.edge <= EdgeTerm::kConfidence &&
         config.iterations >= least && config.iterations <= DiffusionConfig::kMostHalo &&
         config.length_m > 0.0F && config.length_m <= 1e6F && config.alpha > 0.0F &&
         config.alpha < 1.0F && config.omega >= 1e-6F && config.omega <= 1000.0F &&
         config.prior >= 0.0F && config.prior <= 1e6F;
}

int halo_of(const GlobalMapConfig& config) noexcept {
  const DiffusionStencil stencil(static_cast<double>(config.diffusion.length_m) /
                                 config.map.resolution_m);
  return DiffusionBrick::halo_of(config.diffusion, stencil.reach());
}

}  // namespace

Status GlobalMap::set_up(Arena& arena, const GlobalMapConfig& config, std::span<LocalMap> maps,
                         int components) noexcept {
  config_ = config;
  map_ = &maps.front();
  staged_ = &maps.back();
  Status status = put_in_place(
      replicas_, [&] { return Replicas::make(arena, config.replicas, config.map.hash_seed); });
  if (status == Status::kOk)
    status = put_in_place(sums_, [&] { return SegmentStore::make(arena, config.sum_segments); });
  if (status == Status::kOk)
    status = put_in_place(
        index_, [&] { return BlockIndex::make(arena, config.blocks, config.map.hash_seed); });
  if (status == Status::kOk)
    status = put_in_place(brick_, [&] {
      return DiffusionBrick::make(arena, config.diffusion, config.map.resolution_m, components);
    });
  if (status == Status::kOk)
    status = put_in_place(content_, [&] { return BlockContent::make(arena, components); });
  if (status == Status::kOk)
    status = put_in_place(share_, [&] {
      return RobotShare::make(arena, components, config.max_evidence, config.map.free_weight);
    });
  if (status != Status::kOk) return status;
  const std::span<std::byte> records = arena.take_untouched(arena_bytes<Record>(config.blocks));
  records_.all = {reinterpret_cast<Record*>(records.data()), config.blocks};
  moves_ = arena.take<Move>(config.replicas.contributions);
  box_blocks_ = arena.take<std::uint32_t>(cube(DiffusionBrick::kMostBlocks));
  near_blocks_ = arena.take<std::uint32_t>(cube(DiffusionBrick::kMostEdge / kBlockEdge));
  observers_ = arena.take<std::uint8_t>(kBlockVoxels);
  packed_ = arena.take<std::byte>(most_packed_bytes(components));
  const bool fits = !records.empty() && !moves_.empty() && !box_blocks_.empty() &&
                    !near_blocks_.empty() && !observers_.empty() && !packed_.empty();
  return fits ? Status::kOk : Status::kResourceExhausted;
}

Result<GlobalMap> GlobalMap::make(Arena& arena, const GlobalMapConfig& config,
                                  const ClassTable& classes) noexcept {
  const bool capped = config.max_evidence >= 0.0F && config.max_evidence <= 1e6F;
  if (!in_range(config.diffusion) || !tessera::in_range(config.map) || !capped ||
      halo_of(config) > DiffusionConfig::kMostHalo)
    return Status::kInvalidArgument;
  const std::span<LocalMap> maps = arena.take<LocalMap>(2);
  if (maps.empty()) return Status::kResourceExhausted;
  Status status = put_in_place(maps[0], [&] { return LocalMap::make(arena, config.map, classes); });
  if (status == Status::kOk)
    status = put_in_place(maps[1],
                          [&] { return LocalMap::make(arena, staged_config(config), classes); });
  if (status != Status::kOk) return status;
  return around(arena, config, maps, classes.num_components());
}

Result<GlobalMap> GlobalMap::around(Arena& arena, const GlobalMapConfig& config,
                                    std::span<LocalMap> maps, int components) noexcept {
  GlobalMap global;
  const Status status = global.set_up(arena, config, maps, components);
  if (status != Status::kOk) return status;
  return global;
}

}  // namespace tessera
