// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scenes.hpp"

#include <bit>

#include "scans/dataset.hpp"

namespace tessera::bench {

namespace {

InferenceConfig inference_of(const Mode& mode, double resolution_m) {
  InferenceConfig config;
  config.mode = mode.inference;
  config.kernel_length_m = static_cast<float>(3.0 * resolution_m);
  config.free_space.enabled = mode.free_space;
  config.free_space.carving = mode.carving;
  config.max_range_m = mode.max_range_m;
  config.thinning_m = resolution_m;
  if (mode.inference == InferenceMode::kKernel) config.thinning_weight = ThinningWeight::kSum;
  return config;
}

MapConfig map_of(const Mode& mode, double resolution_m) {
  MapConfig config;
  config.resolution_m = resolution_m;
  config.tuple = mode.tuple;
  config.storage_bytes = mode.storage_bytes;
  if (mode.inference == InferenceMode::kKernel) {
    config.max_evidence = 250.0F;
    config.free_weight = 1.0F;
  }
  return config;
}

}  // namespace

ScanView Scan::view() const {
  return {.T_map_sensor = T_map_sensor,
          .points = points_xyzi.data(),
          .stride_floats = 4,
          .count = components.size(),
          .components = components.data()};
}

Outcome<Scene> load_scene(const std::string& folder, const DatasetOptions& scans) {
  TESSERA_TRY_ASSIGN(const Dataset dataset, Dataset::open(folder, scans));
  Scene scene;
  scene.classes = dataset.classes().table();
  scene.max_points = dataset.max_points();
  if (scene.max_points == 0) return Failure{folder + " has no points; choose other scans"};
  TESSERA_TRY_ASSIGN(ScanReader reader, ScanReader::make(dataset));
  for (std::size_t i = 0; i < dataset.num_scans(); ++i) {
    TESSERA_TRY_ASSIGN(const ScanView scan, reader.read(i));
    scene.scans.push_back({{scan.points, scan.points + scan.stride_floats * scan.count},
                           {scan.components, scan.components + scan.count},
                           scan.T_map_sensor});
  }
  return scene;
}

Outcome<Scene> load_scene(const Options& options) {
  return load_scene(options.dataset, {.first = options.first, .last = options.last});
}

Outcome<std::string> digest_of_input(const Options& options) {
  TESSERA_TRY_ASSIGN(const Scene scene, load_scene(options));
  Digest digest;
  digest.add(std::bit_cast<std::uint64_t>(options.resolution_m));
  for (const Scan& scan : scene.scans) {
    for (const float value : scan.points_xyzi) digest.add_float(value);
    for (const std::uint8_t component : scan.components) digest.add(component);
    for (int i = 0; i < 12; ++i)
      digest.add(std::bit_cast<std::uint64_t>(scan.T_map_sensor(i / 4, i % 4)));
  }
  return hex64(digest.value());
}

Outcome<Mapper> Mapper::make(const Mode& mode, const Scene& scene, double resolution_m) {
  RobotConfig config;
  config.map = map_of(mode, resolution_m);
  config.inference = inference_of(mode, resolution_m);
  config.scan = {.points = static_cast<std::uint32_t>(scene.max_points),
                 .tiles = 131072,
                 .ray_blocks = 131072};
  const std::size_t bytes = tessera::Mapper::required_bytes(config);
  Mapper mapper;
  mapper.memory_.reset(static_cast<std::byte*>(
      std::aligned_alloc(kArenaAlignment, align_up(bytes, kArenaAlignment))));
  if (mapper.memory_ == nullptr)
    return Failure{"the system does not give the memory for a map", FailureKind::kFailure};
  Arena arena(std::span<std::byte>(mapper.memory_.get(), bytes));
  const Result<tessera::Mapper*> made = tessera::Mapper::make(arena, config, scene.classes, {});
  if (!made.ok())
    return Failure{std::string("cannot make a map for ") + mode.name, FailureKind::kFailure};
  mapper.mapper_ = *made;
  return mapper;
}

Outcome<void> Mapper::integrate_all(const Scene& scene) {
  for (const Scan& scan : scene.scans) {
    const ScanReport report = integrate(scan);
    if (report.pose != Status::kOk || report.left_out() > 0)
      return Failure{"a scan did not fit as a whole", FailureKind::kFailure};
  }
  return {};
}

std::span<KeyedIndex> Mapper::workspace() {
  workspace_.resize(std::max(workspace_.size(), 2 * map().block_count()));
  return workspace_;
}

std::uint64_t Mapper::digest_of_map() { return tessera::digest(map(), workspace()); }

std::vector<VoxelCoord> observed_voxels(Mapper& mapper) {
  std::vector<VoxelCoord> voxels;
  for_each_observed(
      mapper.map(), mapper.workspace(),
      [&](const VoxelCoord& voxel, const VoxelEvidence&) { voxels.push_back(voxel); });
  return voxels;
}

}  // namespace tessera::bench
