// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/view_maps.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <filesystem>
#include <set>

#include "base/number_text.hpp"
#include "cli/command.hpp"
#include "cli/contributors.hpp"
#include "maps/fuse_sessions.hpp"
#include "maps/open_map.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

using One = ViewedMaps::One;

VoxelMark mark_of(const VoxelLabels& labels) {
  VoxelMark mark;
  mark.disagreement = labels.differ;
  const int count = std::popcount(labels.from);
  if (count == 1) mark.contributor = static_cast<std::uint8_t>(std::countr_zero(labels.from));
  if (count == 2) mark.contributor = VoxelMark::kTwo;
  if (count > 2) mark.contributor = VoxelMark::kMore;
  return mark;
}

void mark_contributors(const std::vector<FuseInput>& inputs, One& global) {
  const LocalMap& map = global.stored->map;
  std::vector<VoxelCoord> places;
  std::vector<KeyedIndex> workspace = workspace_for(map);
  for_each_observed(map, workspace, [&](const VoxelCoord& voxel, const VoxelEvidence& evidence) {
    if (estimate(evidence, map.config().prior).state != VoxelState::kOccupied) return;
    places.push_back(voxel);
    global.keys.push_back(pack_in_grid(block_of(voxel)).bits);
    global.rows.push_back(static_cast<std::uint16_t>(row_order(voxel)));
  });
  const Contributors contributors = find_contributors(inputs, places);
  for (const VoxelLabels& labels : contributors.voxels) global.marks.push_back(mark_of(labels));
  for (const Contributors::One& one : contributors.all)
    global.contributors.push_back(one.name + " (" + one.maps + ")");
}

Outcome<void> check_alike(const One& global, const FuseInput& input) {
  const LocalMap& ours = global.stored->map;
  const LocalMap& theirs = input.stored->map;
  if (ours.config().resolution_m == theirs.config().resolution_m &&
      ours.classes() == theirs.classes())
    return {};
  return Failure{input.path + " has another resolution or other classes than " + global.path +
                 "; give the maps that it was made of, or view it alone"};
}

/// Fails iff a map is given twice, even by different paths.
Outcome<void> check_paths(const std::vector<std::string>& paths) {
  std::set<std::string> seen;
  for (const std::string& path : paths) {
    std::error_code error;
    const std::string one = std::filesystem::weakly_canonical(path, error).string();
    if (!seen.insert(error ? path : one).second)
      return Failure{path + " is a duplicate; name each map once"};
  }
  return {};
}

}  // namespace

Outcome<ViewedMaps> load_viewed_maps(const std::vector<std::string>& paths,
                                     const std::vector<std::string>& sessions,
                                     const std::vector<std::string>& transforms) {
  TESSERA_TRY(check_paths(paths));
  std::vector<std::shared_ptr<One>> all;
  std::vector<std::string> locals;
  std::shared_ptr<One> global;
  std::size_t globals = 0;
  for (const std::string& path : paths) {
    TESSERA_TRY_ASSIGN(const MapFileHeader header, load_map_header(path));
    all.push_back(std::make_shared<One>());
    all.back()->path = path;
    all.back()->in_submaps = header.identity.kind == MapKind::kSubmaps;
    if (header.identity.kind != MapKind::kGlobal) {
      locals.push_back(path);
      continue;
    }
    ++globals;
    global = all.back();
  }
  if (globals > 1 && !locals.empty())
    return Failure{
        "local maps cannot be assigned to several global maps; give one "
        "global map with its local ones, or only global maps"};
  const bool together = globals == 1 && !locals.empty();
  if (!together && !transforms.empty())
    return Failure{"--transform needs a global map and the local ones that it was made of"};
  if (!together && !sessions.empty())
    return Failure{Message(kSessionSetting) +
                   " needs a global map and the local ones that it was made of too"};
  std::vector<FuseInput> inputs;
  if (together) {
    std::vector<Message> warnings;
    Outcome<std::vector<FuseInput>> loaded =
        load_contributors(locals, sessions, transforms, warnings);
    for (const Message& warning : warnings) warn(warning);
    if (!loaded.ok()) return loaded.failure();
    inputs = std::move(*loaded);
  }
  for (const auto& one : all) {
    const auto input = std::find_if(inputs.begin(), inputs.end(),
                                    [&one](const FuseInput& of) { return of.path == one->path; });
    if (input != inputs.end()) one->T_global_map = input->T_global_map;
    // Its submaps are the inputs.
    if (input != inputs.end() && !one->in_submaps) continue;
    TESSERA_TRY_ASSIGN(std::unique_ptr<StoredMap> stored, open_map(one->path));
    one->stored = std::move(stored);
    if (input == inputs.end() && one->stored->header.identity.has_T_global_map)
      one->T_global_map = one->stored->header.identity.T_global_map;
  }
  if (together) {
    TESSERA_TRY(check_alike(*global, inputs.front()));
    mark_contributors(inputs, *global);
  }
  ViewedMaps viewed;
  for (const auto& one : all) {
    for (FuseInput& input : inputs) {
      if (input.path == one->path && !one->in_submaps) one->stored = std::move(input.stored);
    }
    const MapIdentity& identity = one->stored->header.identity;
    if (identity.kind == MapKind::kLocal)
      one->contributors = {fmt::format("robot {}", identity.robot)};
    viewed.maps.push_back(one);
  }
  return viewed;
}

std::vector<std::unique_ptr<ViewMap>> view_maps_of(const ViewedMaps& viewed) {
  std::vector<std::unique_ptr<ViewMap>> maps;
  for (const std::shared_ptr<const One>& one : viewed.maps) {
    ViewMapInfo info;
    info.name = std::filesystem::path(one->path).filename().string();
    info.global = one->stored->header.identity.kind == MapKind::kGlobal;
    info.robot = one->stored->header.identity.robot;
    info.T_global_map = one->T_global_map;
    info.contributors = one->contributors;
    if (!one->marks.empty()) {
      info.marks = [one](const BlockSnapshot& block, BlockMarks& marks) {
        marks.fill({});
        const std::uint64_t key = pack_in_grid(block.coord()).bits;
        const auto [first, last] = std::equal_range(one->keys.begin(), one->keys.end(), key);
        for (auto at = first; at != last; ++at) {
          const auto i = static_cast<std::size_t>(at - one->keys.begin());
          marks[one->rows[i]] = one->marks[i];
        }
      };
    }
    maps.push_back(std::make_unique<ViewMap>(one->stored->map, std::move(info)));
  }
  return maps;
}

}  // namespace tessera
