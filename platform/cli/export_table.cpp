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

bool is_exported(const ExportOptions& options, const Estimate& estimate) {
  if (!options.passes_limits(estimate)) return false;
  return estimate.state == VoxelState::kOccupied ||
         (estimate.state == VoxelState::kFree && options.voxels == "observed");
}

/// Voxels that wait for their colours.
class Chunk {
 public:
  Chunk(const ExportOptions& options, const StoredMap& stored)
      : options_(options),
        stored_(stored),
        of_robots_(!options.layer.of.empty()),
        most_(of_robots_ ? std::numeric_limits<std::size_t>::max() : kChunk) {}

  [[nodiscard]] bool of_robots() const { return of_robots_; }
  [[nodiscard]] bool is_full() const { return voxels_.places.size() >= most_; }
  void add(const VoxelCoord& voxel, const Estimate& estimate) {
    const Point3f p_map = round_to_float(stored_.map.lattice().center_of(voxel));
    voxels_.places.push_back(voxel);
    voxels_.voxels.push_back({.x = p_map.x(),
                              .y = p_map.y(),
                              .z = p_map.z(),
                              .color = {},
                              .label = static_cast<std::uint8_t>(estimate.label),
                              .probability = static_cast<float>(estimate.probability),
                              .variance = static_cast<float>(estimate.variance),
                              .evidence = static_cast<float>(estimate.evidence)});
  }
  /// Writes the rows. table: opened before, with everything that may fail.
  Outcome<void> write(VoxelTable& table, Json& counts) {
    const Outcome<Layer> layer = color_voxels(options_.layer, stored_, options_.map, voxels_);
    if (!layer.ok()) return layer.failure();
    counts = layer->counts;
    const LocalMap& map = stored_.map;
    for (std::size_t i = 0; i < voxels_.places.size(); ++i) {
      const VoxelEvidence evidence = map.evidence(voxels_.places[i]);
      table.put({.p_map = map.lattice().center_of(voxels_.places[i]),
                 .estimate = estimate(evidence, map.config().prior),
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

Outcome<TableReport> write_table(const ExportOptions& options, const StoredMap& stored) {
  const LocalMap& map = stored.map;
  std::vector<KeyedIndex> workspace = workspace_for(map);
  const std::span<const KeyedIndex> blocks = map.blocks_in_order(workspace);
  const double prior = map.config().prior;
  TableReport report;
  for (const KeyedIndex& item : blocks) {
    for_each_observed(map, map.block_at(item.index),
                      [&](const VoxelCoord&, const VoxelEvidence& evidence) {
                        report.voxels += is_exported(options, estimate(evidence, prior)) ? 1U : 0U;
                      });
  }
  Chunk chunk(options, stored);
  const std::vector<std::string> names = label_names(map.classes());
  Outcome<VoxelTable> table = VoxelTable::open({.format = format_of(options),
                                                .rows = report.voxels,
                                                .num_components = map.num_components(),
                                                .with_robots = chunk.of_robots(),
                                                .label_names = names},
                                               options.out);
  if (!table.ok()) return table.failure();
  Progress progress("exporting", blocks.size());
  std::uint64_t done = 0;
  for (const KeyedIndex& item : blocks) {
    for_each_observed(map, map.block_at(item.index),
                      [&](const VoxelCoord& voxel, const VoxelEvidence& evidence) {
                        const Estimate e = estimate(evidence, prior);
                        if (is_exported(options, e)) chunk.add(voxel, e);
                      });
    ++done;
    if (!chunk.is_full() && done < blocks.size()) continue;
    const Outcome<void> written = chunk.write(*table, report.counts);
    if (!written.ok()) return written.failure();
    progress.update(done);
  }
  progress.finish();
  const Outcome<void> committed = table->commit();
  if (!committed.ok()) return committed.failure();
  return report;
}

}  // namespace tessera
