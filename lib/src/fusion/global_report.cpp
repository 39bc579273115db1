// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How a global map stands.
#include <algorithm>

#include "tessera/fusion/global_map.hpp"
#include "tessera/replica/contribution_kind.hpp"

namespace tessera {

std::uint32_t GlobalMap::fullness() const noexcept {
  const MapUsage map = maps_.map().usage();
  const auto with_waiting = [&](std::uint64_t bytes) {
    const std::uint64_t blocks = std::max<std::uint64_t>(map.blocks, 1);
    return bytes +
           bytes * std::min<std::uint64_t>(waiting() - records_.waiting_again(), blocks) / blocks;
  };
  const std::uint64_t sum_bytes = SegmentStore::kSegmentBytes * std::uint64_t{config_.sum_segments};
  return std::max({replicas_.fullness(), share_in_1024(records_.size(), config_.blocks),
                   share_in_1024(with_waiting(sums_.used_bytes()), sum_bytes),
                   share_in_1024(with_waiting(map.used_bytes), map.capacity_bytes)});
}

Result<std::uint8_t> GlobalMap::bit_of(std::uint32_t robot) const noexcept {
  for (const Slot slot : replicas_.in_order()) {
    const Replicas::Contribution& one = replicas_.contribution(slot);
    if (one.id.robot == robot && is_map(one.id) && !one.hidden) return one.robot_bit;
  }
  return Status::kOutOfRange;
}

Result<RobotReliability> GlobalMap::reliability(std::uint32_t robot) const noexcept {
  const Result<std::uint8_t> bit = bit_of(robot);
  if (!bit.ok()) return bit.status();
  RobotReliability report = weights_.report(*bit);
  report.robot = robot;
  return report;
}

Result<ClassReliability> GlobalMap::reliability(std::uint32_t robot, int label) const noexcept {
  const Result<std::uint8_t> bit = bit_of(robot);
  if (!bit.ok()) return bit.status();
  if (label < 1 || label > maps_.map().num_components() - 2) return Status::kOutOfRange;
  return weights_.report(*bit, label);
}

GlobalMapReport GlobalMap::counters() const noexcept {
  GlobalMapReport report = counted_;
  report.refused_blocks = records_.refused();
  return report;
}

GlobalMapReport GlobalMap::report() const noexcept {
  GlobalMapReport report = counters();
  report.blocks = records_.size();
  report.waiting = waiting();
  report.replicas = replicas_.usage();
  report.sum_bytes = sums_.used_bytes();
  report.used_bytes = scratch_bytes(config_, maps_.map().num_components()) +
                      arena_bytes<LocalMap>(2) + maps_.used_bytes() +
                      report.replicas.replica_bytes + report.sum_bytes + records_.used_bytes();
  for (const Slot slot : replicas_.in_order()) {
    const Replicas::Contribution& one = replicas_.contribution(slot);
    report.out_of_grid += one.hidden && one.place != 0 ? 1U : 0U;
  }
  NodeStatistics all;
  records_.for_each([&](const GlobalRecord& record) {
    report.objected_voxels += record.objected;
    report.disputed_voxels += record.disputed;
    if (record.statistics.nodes == 0) return;
    ++report.overlap_blocks;
    all.add(record.statistics);
  });
  report.nodes = all.nodes;
  if (all.nodes != 0) {
    const double unit = 0x1p-40 / static_cast<double>(all.nodes);
    report.mean_variance = static_cast<double>(all.variance) * unit;
    report.mean_variance_undiffused = static_cast<double>(all.variance_undiffused) * unit;
    report.residual = all.largest_sum > 0.0F ? static_cast<double>(all.largest_change) /
                                                   static_cast<double>(all.largest_sum)
                                             : 0.0;
  }
  return report;
}

}  // namespace tessera
