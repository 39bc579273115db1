// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A planner in the robot's process: its own thread reads the local and the global map while another
// one goes on mapping and fusing. Neither waits for the other. A read may find a voxel in the
// middle of a change, and says so: a planner asks again in its next cycle.
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <optional>
#include <thread>
#include <vector>

#include "tessera/fusion/global_reader.hpp"
#include "tessera/robot/robot.hpp"

using namespace tessera;

namespace {

constexpr double kVoxel_m = 0.2;
constexpr RobotSettings kSettings{
    .map = {.resolution_m = kVoxel_m, .storage_bytes = 8U << 20U},
    .inference = {.thinning_m = kVoxel_m},
    .scan = {.points = 8192, .tiles = 4096, .ray_blocks = 4096},
    .exchange = {.robot = 1, .resolution_m = kVoxel_m},
    .global = {.map = {.resolution_m = kVoxel_m, .max_evidence = 0.0F, .storage_bytes = 8U << 20U},
               .diffusion = {.iterations = 2, .length_m = 0.4F},
               .staged_bytes = 1U << 20U}};

alignas(kArenaAlignment) std::byte memory[Robot::required_bytes(kSettings, 3)];

/// What the planner's thread asks, all of it bounded. Points: metres, global frame.
class Planner {
 public:
  explicit Planner(const Robot& robot) : local_(robot.map()), global_(robot.global()) {}

  /// Occupied voxels of a box, all of one generation of the global map; none while it changes.
  std::optional<std::vector<VoxelCoord>> occupied(VoxelCoord low, VoxelCoord high) {
    std::vector<VoxelCoord> voxels;
    for (int z = low.z; z <= high.z; ++z)
      for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x) voxels.push_back({x, y, z});
    std::vector<Estimate> estimates(voxels.size());
    if (global_.query(voxels, estimates) != Status::kOk) return std::nullopt;
    std::vector<VoxelCoord> found;
    for (std::size_t i = 0; i < voxels.size(); ++i)
      if (estimates[i].state == VoxelState::kOccupied) found.push_back(voxels[i]);
    return found;
  }
  /// How far the way from p along direction (of length 1) is known to be free of obstacles.
  std::optional<double> free_way_m(const Point3f& p, const Point3f& direction, double most_m) {
    for (double way_m = 0.0; way_m < most_m; way_m += kVoxel_m / 2) {
      const Result<Estimate> here = global_.query(p + direction * static_cast<float>(way_m));
      if (!here.ok()) return std::nullopt;
      if (here->state == VoxelState::kOccupied) return way_m;
    }
    return most_m;
  }
  /// Distance to the nearest obstacle's centre within a cube of 2 reach_m around p.
  std::optional<double> nearest_m(const Point3f& p, double reach_m) {
    const Lattice lattice(kVoxel_m);
    const Point3f reach = Point3f::Constant(static_cast<float>(reach_m));
    const auto low = lattice.voxel_of(p - reach);
    const auto high = lattice.voxel_of(p + reach);
    if (!low.ok() || !high.ok()) return std::nullopt;
    const auto found = occupied(*low, *high);
    if (!found) return std::nullopt;
    double nearest = reach_m;
    for (const VoxelCoord& voxel : *found)
      nearest = std::min(nearest, norm(lattice.center_of(voxel) - p.cast<double>()));
    return nearest;
  }
  /// What only this robot has seen, as fresh as its last scan.
  std::optional<VoxelState> own_state(const Point3f& p_map) {
    const Result<Estimate> here = local_.query(p_map);
    return here.ok() ? std::optional(here->state) : std::nullopt;
  }

 private:
  MapReader local_;
  GlobalReader global_;
};

/// A wall ahead, 2 m high, from a sensor that moves towards it.
void map_wall(Robot& robot, int step) {
  std::vector<float> points;
  for (int i = -20; i <= 20; ++i)
    for (int k = 0; k <= 10; ++k)
      points.insert(points.end(), {8.0F - 0.05F * static_cast<float>(step),
                                   0.2F * static_cast<float>(i), 0.2F * static_cast<float>(k)});
  const std::vector<std::uint8_t> labels(points.size() / 3, 1);
  ScanView scan{.points = points.data(),
                .stride_floats = 3,
                .count = labels.size(),
                .components = labels.data()};
  scan.T_map_sensor(0, 3) = 0.05 * step;
  robot.integrate(scan, 0);
}

}  // namespace

int main() {
  ClassTable classes;
  if (classes.add("wall", {}) != Status::kOk) return 1;
  Arena arena(memory);
  const auto robot = Robot::make(arena, RobotConfig{kSettings}, classes, {}, {});
  if (!robot.ok()) return 1;

  std::atomic<bool> done{false};
  int answers = 0;
  std::thread planning([&] {
    Planner planner(**robot);
    // At least once more after all is there.
    for (bool last = false; !last || answers == 0; std::this_thread::yield()) {
      last = done.load();
      const auto way_m = planner.free_way_m({0.1F, 0.1F, 1.1F}, {1, 0, 0}, 20.0);
      const auto nearest_m = planner.nearest_m({6.0F, 0.1F, 1.1F}, 3.0);
      const auto own = planner.own_state({4.1F, 0.1F, 1.1F});
      if (!way_m || !nearest_m || !own) continue;  // busy: in the next cycle
      ++answers;
      if (last)
        std::printf("free for %.1f m; nearest obstacle %.1f m off; 4 m ahead: %s\n", *way_m,
                    *nearest_m, to_string(*own));
    }
  });
  for (int step = 0; step < 40; ++step) {
    map_wall(**robot, step);
    (*robot)->tick(50'000 * step);
    (*robot)->fuse();
  }
  (*robot)->finish();
  done.store(true);
  planning.join();
  std::printf("%d answers while mapping\n", answers);
  return answers > 0 ? 0 : 1;
}
