// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a map says of obstacles: along a ray, around a point, in the directions around the robot.
// Then the map is saved and loaded again. docs/tasks/embedding.md quotes the functions.
#include <cstdio>
#include <vector>

#include "files.hpp"
#include "tessera/inference/integrator.hpp"
#include "tessera/map/nearest_occupied.hpp"
#include "tessera/map/obstacle_sectors.hpp"
#include "tessera/map/queries.hpp"

using namespace tessera;

namespace {

constexpr MapConfig kMap{
    .resolution_m = 0.2, .label_votes = true, .storage_bytes = std::size_t{4} << 20U};
constexpr InferenceConfig kInference{.thinning_m = 0.2};
constexpr ScanCapacity kScan{.points = 4096, .tiles = 2048, .ray_blocks = 2048};
constexpr int kComponents = 3;  // one class, unlabelled, free
constexpr std::size_t kSectorBytes = std::size_t{64} << 10U;
constexpr std::size_t kBytes =
    2 * required_bytes(kMap) + Integrator::required_bytes(kScan, kInference) + kSectorBytes;
alignas(kArenaAlignment) std::byte memory[kBytes];
KeyedIndex workspace[2 * max_blocks(kMap)];  // for saving and digests
MapFileBuffer buffer;

const Point3f kRobot(0.1F, 0.1F, 1.1F);

/// A wall 2 m high, 8 m ahead of where the robot began.
void map_wall(Integrator& integrator, LocalMap& map, float way_m) {
  std::vector<float> points;
  for (int i = -20; i <= 20; ++i)
    for (int k = 0; k <= 10; ++k)
      points.insert(points.end(), {8.1F - way_m, 0.2F * static_cast<float>(i),
                                   0.2F * static_cast<float>(k) - 1.0F});
  const std::vector<std::uint8_t> labels(points.size() / 3, 1);
  ScanView scan{.points = points.data(),
                .stride_floats = 3,
                .count = labels.size(),
                .components = labels.data()};
  scan.T_map_sensor.col(3) = Point3d(static_cast<double>(way_m) + 0.1, 0.1, 1.1);
  integrator.integrate(map, scan);
}

void ask_ray(const LocalMap& map) {
  const bool stop_at_unknown = true;
  const RayHit hit = cast_ray(map, kRobot, {1, 0, 0}, 20.0, stop_at_unknown);
  std::printf("ray ahead: %s at %.1f m\n", to_string(hit.end), hit.distance_m);
}

void ask_nearest(const LocalMap& map) {
  MapReader reader(map);  // one for each thread; the map may be written to meanwhile
  alignas(8) std::byte block[MapReader::most_snapshot_bytes(kComponents)];
  const auto nearest = nearest_occupied(reader, map.lattice(), map.reading(),
                                        {.p_map = kRobot, .radius_m = 10.0}, block);
  if (!nearest.ok()) return;
  std::printf("nearest obstacle: %s, %.1f m; certain within %.1f m\n",
              nearest->found ? "found" : "none", nearest->distance_m, nearest->searched_m);
}

bool ask_sectors(const LocalMap& map, Arena& arena) {
  auto sectors = ObstacleSectors::make({.count = 8, .max_range_m = 10.0}, map, arena);
  Matrix34d T_map_body = Matrix34d::Identity();
  T_map_body.col(3) = kRobot.cast<double>();
  if (!sectors.ok() || sectors->begin(T_map_body, 0) != Status::kOk) return false;
  MapReader reader(map);
  constexpr std::uint32_t kBlocks = 64;  // of work a step; a controller takes one step a cycle
  while (!sectors->step(reader, kBlocks)) continue;
  const ObstacleSector& ahead = sectors->latest().sectors[0];
  std::printf("sector ahead: %s, %.1f m; free up to %.1f m\n",
              ahead.occupied ? "an obstacle" : "no obstacle", ahead.distance_m, ahead.free_up_to_m);
  return true;
}

bool save_to(const char* path, const LocalMap& map) {
  std::FILE* const file = std::fopen(path, "wb");
  if (file == nullptr) return false;
  const MapFileStatus saved = save(map, {.robot = 1}, workspace, buffer, to_file(file));
  const bool closed = std::fclose(file) == 0;
  if (!saved.ok()) std::printf("%s: %s\n", path, saved.what);
  return saved.ok() && closed;
}

/// A map in memory from the arena. The file's own storage_bytes would leave no room for more scans.
Result<LocalMap> load_from(const char* path, Arena& arena) {
  std::FILE* const file = std::fopen(path, "rb");
  if (file == nullptr) return Status::kIo;
  MapFileHeader header;
  MapFileStatus read = load_header(from_file(file), buffer, header);
  header.config.storage_bytes = kMap.storage_bytes;
  Result<LocalMap> map = read.ok() ? LocalMap::make(arena, header.config, header.classes)
                                   : Result<LocalMap>(read.status);
  if (map.ok()) read = load_blocks(from_file(file), header, buffer, *map);
  std::fclose(file);
  if (!read.ok()) return read.status;
  return map;
}

}  // namespace

int main(int argc, char** argv) {
  const char* const path = argc > 1 ? argv[1] : "obstacles.tsm";
  ClassTable classes;
  if (classes.add("wall", {}) != Status::kOk) return 1;
  Arena arena(memory);
  auto map = LocalMap::make(arena, kMap, classes);
  auto integrator = Integrator::make(arena, kInference, kScan);
  if (!map.ok() || !integrator.ok()) return 1;
  for (int step = 0; step < 5; ++step) map_wall(*integrator, *map, 0.1F * static_cast<float>(step));

  ask_ray(*map);
  ask_nearest(*map);
  if (!ask_sectors(*map, arena) || !save_to(path, *map)) return 1;
  const auto loaded = load_from(path, arena);
  if (!loaded.ok()) {
    std::printf("%s: %s\n", path, to_string(loaded.status()));
    return 1;
  }
  const bool same = digest(*map, workspace) == digest(*loaded, workspace);
  std::printf("the loaded map is %s\n", same ? "the same" : "another");
  return same ? 0 : 1;
}
