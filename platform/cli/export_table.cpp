// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/export_table.hpp"

#include <limits>
#include <optional>

#include "base/progress.hpp"
#include "pictures/voxel_table.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

constexpr std::size_t kChunk = std::size_t{1} << 16U;

TableFormat format_of(const ExportOptions& options) {
  if (options.format == "pcd") return TableFormat::kPcd;
  return options.format == "npy" ? TableFormat::kNpy : TableFormat::kCsv;
}

/// Voxels that wait for their colours.
class Chunk {
 public:
  Chunk(const ExportOptions& options, const Coloring& coloring, const StoredMap& stored)
      : options_(options),
        coloring_(coloring),
        stored_(stored),
        of_robots_(!options.layer.of.empty()),
        // What a layer counts, it counts over all voxels.
        most_(of_robots_ || options.layer.shows_moved() ? std::numeric_limits<std::size_t>::max()
                                                        : kChunk) {}

  [[nodiscard]] bool of_robots() const { return of_robots_; }
  [[nodiscard]] bool is_full() const { return voxels_.places.size() >= most_; }
  void add(const VoxelCoord& voxel, const Estimate& estimate) {
    voxels_.add(stored_.map.lattice(), voxel, estimate);
  }
  /// Writes the rows. table: opened before, with everything that may fail.
  Outcome<void> write(VoxelTable& table, Json& counts) {
    TESSERA_TRY_ASSIGN(const Layer layer,
                       color_voxels(options_.layer, coloring_, stored_, options_.map, voxels_));
    counts = layer.counts;
    const LocalMap& map = stored_.map;
    for (std::size_t i = 0; i < voxels_.places.size(); ++i) {
      const VoxelEvidence evidence = map.evidence(voxels_.places[i]);
      table.put({.p_map = map.lattice().center_of(voxels_.places[i]),
                 .estimate = estimate(evidence, map.reading()),
                 .evidence = &evidence,
                 .color = voxels_.voxels[i].color,
                 .robots = voxels_.voxels[i].robots});
    }
    voxels_.voxels.clear();
    voxels_.places.clear();
    return {};
  }

 private:
  const ExportOptions& options_;
  const Coloring& coloring_;
  const StoredMap& stored_;
  bool of_robots_;
  std::size_t most_;
  ExportedVoxels voxels_;
};

}  // namespace

std::vector<std::string> label_names(const ClassTable& classes) {
  std::vector<std::string> names(1);
  for (int label = 1; label <= classes.num_classes(); ++label)
    names.emplace_back(classes[label].name_view());
  return names;
}

Selection select_voxels(const ExportOptions& options, const LocalMap& map) {
  Selection selection;
  ColoringChoice choice(options.layer.show);
  std::vector<KeyedIndex> workspace = workspace_for(map);
  for_each_observed(map, workspace, [&](const VoxelCoord& voxel, const VoxelEvidence& evidence) {
    const Estimate e = estimate(evidence, map.reading());
    if (!options.is_exported(e)) return;
    ++selection.voxels;
    if (options.has_colors())
      choice.add(round_to_float(map.lattice().center_of(voxel)).z(), e.label);
  });
  if (options.has_colors()) {
    selection.coloring = choice.take();
  } else {
    selection.coloring.show = options.layer.show_or_class();
  }
  return selection;
}

Outcome<Json> write_table(const ExportOptions& options, const Selection& selection,
                          const StoredMap& stored) {
  const LocalMap& map = stored.map;
  std::vector<KeyedIndex> workspace = workspace_for(map);
  const std::span<const KeyedIndex> blocks = map.blocks_in_order(workspace);
  Chunk chunk(options, selection.coloring, stored);
  Json counts = Json::object();
  const std::vector<std::string> names = label_names(map.classes());
  TESSERA_TRY_ASSIGN(VoxelTable table, VoxelTable::open({.format = format_of(options),
                                                         .rows = selection.voxels,
                                                         .num_components = map.num_components(),
                                                         .with_robots = chunk.of_robots(),
                                                         .label_names = names},
                                                        options.out));
  Progress progress("exporting", blocks.size());
  std::uint64_t done = 0;
  for (const KeyedIndex& item : blocks) {
    for_each_observed(map, map.block_at(item.index),
                      [&](const VoxelCoord& voxel, const VoxelEvidence& evidence) {
                        const Estimate e = estimate(evidence, map.reading());
                        if (options.is_exported(e)) chunk.add(voxel, e);
                      });
    ++done;
    if (!chunk.is_full() && done < blocks.size()) continue;
    TESSERA_TRY(chunk.write(table, counts));
    progress.update(done);
  }
  progress.finish();
  TESSERA_TRY(table.commit());
  return counts;
}

}  // namespace tessera
