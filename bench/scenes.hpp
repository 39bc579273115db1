// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is measured: scans in memory, and the settings that they are mapped with, those of the
// command at full range.
#pragma once

#include <array>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "harness.hpp"
#include "scans/dataset.hpp"
#include "tessera/map/local_map.hpp"
#include "tessera/map/queries.hpp"
#include "tessera/robot/mapper.hpp"

namespace tessera::bench {

struct Scan {
  std::vector<float> points_xyzi;  ///< Metres, sensor frame.
  std::vector<std::uint8_t> components;
  Matrix34d T_map_sensor = Matrix34d::Identity();

  [[nodiscard]] ScanView view() const;
  [[nodiscard]] Point3f origin_map() const { return T_map_sensor.col(3).cast<float>(); }
};

struct Scene {
  std::vector<Scan> scans;
  ClassTable classes;
  std::size_t max_points = 0;  ///< Of the largest scan.
};

/// The scans of a dataset. Fails as Dataset does, and with kUsage if they hold no point.
Outcome<Scene> load_scene(const std::string& dataset, const DatasetOptions& scans);
/// Those of the options' dataset.
Outcome<Scene> load_scene(const Options& options);
/// Names scans, labels, poses and resolution by their content.
Outcome<std::string> digest_of_input(const Options& options);

struct Mode {
  const char* name = "";
  const char* title = "";
  InferenceMode inference = InferenceMode::kMultiEntropy;
  bool free_space = false;
  TuplePolicy tuple = TuplePolicy::kCompact;
  std::size_t storage_bytes = std::size_t{256} << 20U;
  float max_range_m = 0.0F;  ///< 0: no limit.
  Carving carving = Carving::kImage;
};

inline constexpr Mode kKernelMode{"kernel", "kernel, D = 3 voxels", InferenceMode::kKernel,
                                  false,    TuplePolicy::kDense,    std::size_t{3} << 30U};
inline constexpr Mode kMultiEntropyMode{"multi_entropy", "multi-entropy"};
inline constexpr Mode kFreeSpaceMode{"multi_entropy_free_space", "multi-entropy, free space",
                                     InferenceMode::kMultiEntropy, true};
inline constexpr Mode kCountingMode{"counting", "counting", InferenceMode::kCounting};
inline constexpr std::array<Mode, 4> kModes{kKernelMode, kMultiEntropyMode, kFreeSpaceMode,
                                            kCountingMode};

/// A mapper in memory of its own.
class Mapper {
 public:
  /// None.
  Mapper() = default;
  static Outcome<Mapper> make(const Mode& mode, const Scene& scene, double resolution_m);

  [[nodiscard]] LocalMap& map() { return mapper_->map(); }
  [[nodiscard]] const LocalMap& map() const { return mapper_->map(); }
  [[nodiscard]] const Integrator& integrator() const { return mapper_->integrator(); }
  ScanReport integrate(const Scan& scan) { return mapper_->integrate(scan.view(), 0); }
  /// All scans of a scene. Fails with kFailure iff anything was left out.
  Outcome<void> integrate_all(const Scene& scene);
  [[nodiscard]] std::uint64_t digest_of_map();
  /// At least what iterating the map takes; grows when needed.
  [[nodiscard]] std::span<KeyedIndex> workspace();

 private:
  struct Free {
    void operator()(std::byte* bytes) const { std::free(bytes); }
  };
  std::unique_ptr<std::byte, Free> memory_;
  tessera::Mapper* mapper_ = nullptr;
  std::vector<KeyedIndex> workspace_;
};

/// Every observed voxel of a map in (z, y, x) order of blocks.
std::vector<VoxelCoord> observed_voxels(Mapper& mapper);

}  // namespace tessera::bench
