// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A planner in the robot's process: its own thread reads the local and the global map while another
// one maps and fuses. Neither waits for the other. A read may find a voxel during a change, and
// reports that: a planner tries again in its next cycle.
#include <array>
#include <atomic>
#include <cstdio>
#include <optional>
#include <thread>
#include <vector>

#include "tessera/fusion/global_reader.hpp"
#include "tessera/map/nearest_occupied.hpp"
#include "tessera/map/reader_ray.hpp"
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

constexpr int kComponents = 3;  // one class, unlabelled, free
alignas(kArenaAlignment) std::byte memory[Robot::required_bytes(kSettings, kComponents)];

/// Queries of the planner's thread, all with bounded work, in its own memory. Points: metres,
/// global frame. Empty: the map was changed during every try, or the work was used up.
class Planner {
 public:
  explicit Planner(const Robot& robot)
      : local_(robot.map()), global_(robot.global()), map_(robot.global().map()) {}

  /// Distance from p along direction that is known to be free: up to occupied or unknown space.
  std::optional<double> free_way_m(const Point3f& p, const Point3f& direction, double most_m) {
    constexpr int kMostVoxels = 1000;
    const ReaderRay ray =
        cast_ray(global_, map_.lattice(), p, direction, most_m, true, kMostVoxels);
    if (ray.busy || ray.hit.end == RayHit::End::kInvalid) return std::nullopt;
    return ray.hit.distance_m;
  }
  /// The nearest obstacle; found false: there is none within reach_m.
  std::optional<NearestOccupied> nearest(const Point3f& p, double reach_m) {
    const NearestQuery query{.p_map = p, .radius_m = reach_m, .max_work = 4096};
    const auto found =
        nearest_occupied(global_, map_.lattice(), map_.reading(), query,
                         std::as_writable_bytes(std::span<std::uint64_t>(workspace_)));
    return found.ok() && found->complete ? std::optional(*found) : std::nullopt;
  }
  /// The state in this robot's own map, which includes its last scan.
  std::optional<VoxelState> own_state(const Point3f& p_map) {
    const Result<Estimate> here = local_.query(p_map);
    return here.ok() ? std::optional(here->state) : std::nullopt;
  }

 private:
  MapReader local_;
  GlobalReader global_;
  const LocalMap& map_;  ///< For constants: its lattice and settings.
  std::array<std::uint64_t, MapReader::most_snapshot_bytes(kComponents) / 8 + 1> workspace_{};
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
    // At least once more after everything is fused.
    for (bool last = false; !last || answers == 0; std::this_thread::yield()) {
      last = done.load();
      const auto way_m = planner.free_way_m({2.1F, 0.1F, 0.1F}, {1, 0, 0}, 20.0);
      const auto nearest = planner.nearest({6.0F, 0.1F, 1.1F}, 3.0);
      const auto own = planner.own_state({4.1F, 0.1F, 1.1F});
      if (!way_m || !nearest || !own) continue;  // busy: try again in the next cycle
      ++answers;
      if (last)
        std::printf("free for %.1f m; nearest obstacle %s %.1f m off; 4 m ahead: %s\n", *way_m,
                    nearest->found ? "is" : "is more than", nearest->searched_m, to_string(*own));
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
