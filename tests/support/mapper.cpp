// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "support/mapper.hpp"

#include <array>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>

namespace tessera::oracle {

MapConfig uncapped_map(double resolution_m) {
  return {.resolution_m = resolution_m,
          .max_evidence = 0.0F,
          .tuple = TuplePolicy::kDense,
          .storage_bytes = std::size_t{16} << 20U};
}

ClassTable numbered_classes(int count) {
  ClassTable table;
  for (int i = 1; i <= count; ++i) {
    if (table.add("class " + std::to_string(i), {}) != Status::kOk)
      throw std::logic_error("too many classes");
  }
  return table;
}

namespace {

RobotConfig config_of(const MapConfig& map, const InferenceConfig& inference,
                      const ScanCapacity& capacity) {
  RobotConfig config;
  config.map = map;
  config.inference = inference;
  config.scan = capacity;
  return config;
}

}  // namespace

Mapper::Mapper(const MapConfig& map, const InferenceConfig& inference, const ClassTable& classes,
               const ScanCapacity& capacity)
    : memory_(tessera::Mapper::required_bytes(config_of(map, inference, capacity))) {
  Arena arena(memory_.span());
  const Result<tessera::Mapper*> made =
      tessera::Mapper::make(arena, config_of(map, inference, capacity), classes, {});
  if (!made.ok()) throw std::logic_error(std::string("mapper: ") + to_string(made.status()));
  mapper_ = *made;
}

std::vector<OraclePoint> Mapper::admitted() const {
  std::vector<OraclePoint> points;
  for (const ScanPoint& point : integrator().admitted()) {
    const Point3d p = point.p_map.cast<double>();
    points.push_back({{p.x(), p.y(), p.z()}, static_cast<double>(point.weight), point.component});
    if (point.has_one_label()) continue;
    std::map<int, double>& shares = points.back().shares;
    double left = 1.0;
    const std::array<int, 3> labels{point.component, point.second, point.third};
    for (std::size_t j = 0; j < labels.size(); ++j) {
      const double share = ((point.label_weights >> (8 * j)) & 0xffU) / 255.0;
      if (share == 0.0) continue;
      shares[labels[j]] += share;
      left -= share;
    }
    if (left > 1e-9) shares[map().classes().unlabelled()] += left;
  }
  return points;
}

Cloud Mapper::admitted_cloud() const {
  Cloud cloud;
  for (const ScanPoint& point : integrator().admitted()) {
    const Point3d p = point.p_map.cast<double>();
    cloud.add(p.x(), p.y(), p.z(), point.component, static_cast<double>(point.weight));
  }
  for (const ScanPoint& ray : integrator().admitted_rays()) {
    const Point3d p = 2.0 * ray.p_map.cast<double>();
    cloud.add(p.x(), p.y(), p.z(), 1, 1.0);
  }
  return cloud;
}

std::map<Voxel, VoxelEvidence> observed_voxels(const LocalMap& map) {
  std::map<Voxel, VoxelEvidence> voxels;
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
    const BlockCoord coord = unpack(BlockKey{item.key});
    for (int i = 0; i < kBlockVoxels; ++i) {
      const VoxelEvidence evidence =
          map.evidence(map.block_at(item.index), i / kOctetVoxels, i % kOctetVoxels);
      if (!(evidence.total() > 0.0)) continue;
      const VoxelCoord v = voxel_at(coord, i / kOctetVoxels, i % kOctetVoxels);
      voxels.emplace(Voxel{v.x, v.y, v.z}, evidence);
    }
  }
  return voxels;
}

bool same_content(const LocalMap& a, const LocalMap& b) {
  std::vector<KeyedIndex> workspace_a(2 * a.block_count());
  std::vector<KeyedIndex> workspace_b(2 * b.block_count());
  const std::span<const KeyedIndex> blocks_a = a.blocks_in_order(workspace_a);
  const std::span<const KeyedIndex> blocks_b = b.blocks_in_order(workspace_b);
  if (blocks_a.size() != blocks_b.size()) return false;
  for (std::size_t i = 0; i < blocks_a.size(); ++i) {
    if (blocks_a[i].key != blocks_b[i].key) return false;
    for (int v = 0; v < kBlockVoxels; ++v) {
      const VoxelEvidence x =
          a.evidence(a.block_at(blocks_a[i].index), v / kOctetVoxels, v % kOctetVoxels);
      const VoxelEvidence y =
          b.evidence(b.block_at(blocks_b[i].index), v / kOctetVoxels, v % kOctetVoxels);
      if (std::memcmp(x.sigma.data(), y.sigma.data(), sizeof(x.sigma)) != 0) return false;
    }
  }
  return true;
}

std::size_t empty_blocks(const LocalMap& map) {
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  std::size_t empty = 0;
  for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
    double total = 0.0;
    for (int i = 0; i < kBlockVoxels; ++i) {
      total += map.evidence(map.block_at(item.index), i / kOctetVoxels, i % kOctetVoxels).total();
    }
    if (!(total > 0.0)) ++empty;
  }
  return empty;
}

}  // namespace tessera::oracle
