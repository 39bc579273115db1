// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The same scans in OctoMap, which keeps occupancy alone: what it takes to insert a scan with its
// free space, and to search a voxel.
#include <octomap/octomap.h>

#include "scenes.hpp"

namespace tessera::bench {

namespace {

octomap::Pointcloud cloud_of(const Scan& scan) {
  octomap::Pointcloud cloud;
  for (std::size_t i = 0; i < scan.components.size(); ++i) {
    const Point3f p_map = transform(scan.T_map_sensor, &scan.points_xyzi[4 * i]);
    cloud.push_back(p_map.x(), p_map.y(), p_map.z());
  }
  return cloud;
}

Outcome<Json> measure(const Options& options, Records&) {
  TESSERA_TRY_ASSIGN(const Scene scene, load_scene(options));
  octomap::OcTree tree(options.resolution_m);
  std::vector<double> insert_ms;
  for (const Scan& scan : scene.scans) {
    const octomap::Pointcloud cloud = cloud_of(scan);
    const Point3f origin = scan.origin_map();
    insert_ms.push_back(1e3 * seconds_of([&] {
                          tree.insertPointCloud(cloud, {origin.x(), origin.y(), origin.z()});
                        }));
  }
  const octomap::Pointcloud asked = cloud_of(scene.scans.back());
  std::vector<double> search_ns;
  std::size_t occupied = 0;
  for (int i = 0; i < options.repetitions; ++i) {
    const double seconds = seconds_of([&] {
      for (const octomap::point3d& point : asked) {
        const octomap::OcTreeNode* const node = tree.search(point);
        occupied += node != nullptr && tree.isNodeOccupied(node) ? 1U : 0U;
      }
    });
    search_ns.push_back(1e9 * seconds / static_cast<double>(asked.size()));
  }
  if (occupied == 0) return Failure{"OctoMap holds nothing", FailureKind::kFailure};
  return Json{{"insert_ms", statistics(insert_ms)},
              {"search_ns_per_voxel", statistics(search_ns)},
              {"memory_bytes", tree.memoryUsage()}};
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  return tessera::bench::run(argc, argv, "octomap", tessera::bench::measure);
}
