// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The library under test: a mapper in memory of exactly the size that it asks for, so that a
// sanitizer sees every byte beyond it.
#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "oracle/label_oracle.hpp"
#include "support/aligned_memory.hpp"
#include "support/cloud.hpp"
#include "tessera/robot/mapper.hpp"

namespace tessera::oracle {

/// Small enough for tests to make many: 20,000 points, 8192 tiles, 16384 ray blocks.
[[nodiscard]] constexpr ScanCapacity test_capacity() {
  return {.points = 20000, .tiles = 8192, .ray_blocks = 16384};
}

/// 16 MB of storage, no cap, 255 passes.
[[nodiscard]] MapConfig uncapped_map(double resolution_m);
[[nodiscard]] ClassTable numbered_classes(int count);

class Mapper {
 public:
  Mapper(const MapConfig& map, const InferenceConfig& inference, const ClassTable& classes,
         const ScanCapacity& capacity = test_capacity());
  Mapper(const MapConfig& map, const InferenceConfig& inference, int classes,
         const ScanCapacity& capacity = test_capacity())
      : Mapper(map, inference, numbered_classes(classes), capacity) {}
  ScanReport integrate(const Cloud& cloud, const Matrix34d& T_map_sensor = Matrix34d::Identity()) {
    return mapper_->integrate(cloud.view(T_map_sensor), 0);
  }
  [[nodiscard]] LocalMap& map() { return mapper_->map(); }
  [[nodiscard]] const LocalMap& map() const { return mapper_->map(); }
  [[nodiscard]] const Integrator& integrator() const { return mapper_->integrator(); }
  [[nodiscard]] Integrator& integrator() { return mapper_->integrator(); }
  /// The last scan's admitted points as the oracle takes them.
  [[nodiscard]] std::vector<OraclePoint> admitted() const;
  /// The last scan's admitted points and ray ends as a cloud for a mapper at the same place with
  /// the same orientation; ray ends are handed back at twice their distance from the origin, so
  /// that they are beyond the range again.
  [[nodiscard]] Cloud admitted_cloud() const;

 private:
  AlignedMemory memory_;
  tessera::Mapper* mapper_ = nullptr;
};

/// Every voxel with evidence.
[[nodiscard]] std::map<Voxel, VoxelEvidence> observed_voxels(const LocalMap& map);

/// True iff both maps have the same blocks and the same counts in them, bit for bit.
[[nodiscard]] bool same_content(const LocalMap& a, const LocalMap& b);

/// Blocks that hold no evidence at all.
[[nodiscard]] std::size_t empty_blocks(const LocalMap& map);

}  // namespace tessera::oracle
