// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "soak/invariants.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "soak/recount.hpp"
#include "tessera/map/internal/packed_block.hpp"
#include "tessera/map/queries.hpp"

namespace tessera::soak {

namespace {

/// Counts are rounded on the wire, and frames that turn a map spread a voxel over two or none.
constexpr double kRounding = 1.1;
constexpr double kResampling = 1.25;

/// Blocks of the global grid where misplaced contributions have something: sorted, once all are in.
using Blocks = std::vector<std::uint64_t>;

/// Calls visit(record) for each part of a contribution.
template <class Visit>
void for_each_part(const Replicas& replicas, const Replicas::Contribution& contribution,
                   Visit&& visit) {
  for (std::uint32_t number = contribution.first_block; number != 0;) {
    const Replicas::Replica& part = replicas.record(number);
    visit(part);
    number = part.next;
  }
}

/// Layers of a part that a later one replaced do not count.
double evidence_of(std::span<const std::byte> packed, std::uint8_t live) {
  double sum = 0.0;
  unpack_block(
      packed,
      [&](int row, int, float count) {
        if ((unsigned{live} >> layer_of_row(row) & 1U) != 0) sum += static_cast<double>(count);
      },
      [](int, unsigned) {});
  return sum;
}

std::string name_of(const ContributionId& id) {
  return fmt::format("robot {} epoch {} submap {}", id.robot, id.epoch, id.submap);
}

/// Evidence of each contribution against what was integrated; which are misplaced.
void look_at_contributions(const Robot& robot, const Logbook& logbook, Truth& truth,
                           Blocks& misplaced, std::vector<std::string>& faults) {
  const Replicas& replicas = robot.global().replicas();
  const double resolution_m = robot.config().map.resolution_m;
  std::vector<std::byte> packed(most_packed_bytes(robot.map().num_components()));
  std::set<const MappedSubmap*> submaps;
  for (const Replicas::Slot slot : replicas.in_order()) {
    const Replicas::Contribution& contribution = replicas.contribution(slot);
    if (contribution.leaving || contribution.blocks == 0) continue;
    if (!has_blocks(contribution.id)) continue;  // no map
    const MappedSubmap* const mapped = logbook.find(contribution.id);
    if (mapped == nullptr) {
      faults.push_back(name_of(contribution.id) + " was never mapped");
      continue;
    }
    ++truth.contributions;
    if (submaps.insert(mapped).second) truth.mapped += mapped->evidence;
    const double off_m =
        Logbook::misplaced_m(*mapped, contribution.T_global_local, resolution_m, Truth::kReach_m);
    truth.worst_m = std::max(truth.worst_m, off_m);
    truth.misplaced += off_m > Truth::kPlaced_m ? 1U : 0U;
    double evidence = 0.0;
    for_each_part(replicas, contribution, [&](const Replicas::Replica& part) {
      evidence += evidence_of(replicas.read(part, packed), part.live);
      if (off_m <= Truth::kPlaced_m) return;
      const GridTransform::BlockRange range =
          contribution.T_global_local.global_blocks(unpack(BlockKey{part.key}));
      for (std::int32_t z = range.first.z; z <= range.last.z; ++z) {
        for (std::int32_t y = range.first.y; y <= range.last.y; ++y) {
          for (std::int32_t x = range.first.x; x <= range.last.x; ++x) {
            if (const Result<BlockKey> key = pack({x, y, z}); key.ok())
              misplaced.push_back(key->bits);
          }
        }
      }
    });
    const double ratio = evidence / std::max(1.0, mapped->evidence);
    truth.most_ratio = std::max(truth.most_ratio, ratio);
    if (ratio > kRounding)
      faults.push_back(fmt::format("{} has evidence {:.0f}, and {:.0f} points were integrated",
                                   name_of(contribution.id), evidence, mapped->evidence));
  }
  std::sort(misplaced.begin(), misplaced.end());
  misplaced.erase(std::unique(misplaced.begin(), misplaced.end()), misplaced.end());
}

}  // namespace

void Truth::take(const Truth& other) {
  const Truth before = *this;
  if (other.occupied > occupied) *this = other;
  most_ratio = std::max(before.most_ratio, other.most_ratio);
  most_miscounted = std::max(before.most_miscounted, other.most_miscounted);
  worst_false = std::max(before.worst_false, other.worst_false);
  recounted = before.recounted + other.recounted;
}

MemoryUse check_memory(const Robot& robot, std::vector<std::string>& faults) {
  const auto check = [&](const char* what, std::uint64_t used, std::uint64_t given) {
    if (used > given)
      faults.push_back(fmt::format("robot {}: {} holds {} of {}", robot.config().exchange.robot,
                                   what, used, given));
  };
  const MapUsage map = robot.map().usage();
  const MapUsage global = robot.global().map().usage();
  const GlobalMapReport report = robot.global().report();
  const RobotConfig& config = robot.config();
  check("the local map", map.used_bytes, map.capacity_bytes);
  check("the global map", global.used_bytes, global.capacity_bytes);
  check("the table of contributions", report.replicas.contributions,
        config.global.replicas.contributions);
  check("the table of records", report.replicas.replica_blocks, config.global.replicas.blocks);
  check("the segments of replicas", report.replicas.segments, config.global.replicas.segments);
  check("the publisher", robot.publisher().blocks(), config.publisher.blocks);
  check("the robot", robot.used_bytes(), robot.memory_bytes());
  return {robot.memory_bytes(), robot.used_bytes()};
}

Digests digests_of(const Robot& robot) {
  const LocalMap& map = robot.global().map();
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  return {robot.exchange().digest(), digest(map, workspace)};
}

Truth check_truth(const Robot& robot, const Logbook& logbook, const street::StreetGrid& grid,
                  std::vector<std::string>& faults) {
  Truth truth;
  Blocks misplaced;
  look_at_contributions(robot, logbook, truth, misplaced, faults);
  const LocalMap& map = robot.global().map();
  const double resolution_m = map.config().resolution_m;
  const double near_m = Truth::near_m(resolution_m);
  Recount recount(robot);
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  for_each_observed(map, workspace, [&](const VoxelCoord& voxel, const VoxelEvidence& evidence) {
    const double labels = evidence.total() - static_cast<double>(evidence.sigma[0]);
    truth.evidence += labels;
    if (!(labels > 0.0) || estimate(evidence, map.config().prior).state != VoxelState::kOccupied)
      return;
    ++truth.occupied;
    if (truth.occupied % Truth::kRecountOneIn == 0) {
      if (const std::optional<double> again = recount.labels(voxel)) {
        ++truth.recounted;
        truth.most_miscounted =
            std::max(truth.most_miscounted, std::abs(labels - *again) / std::max(*again, 1.0));
      }
    }
    const Eigen::Vector3d p =
        resolution_m * Eigen::Vector3d(voxel.x + 0.5, voxel.y + 0.5, voxel.z + 0.5);
    if (grid.distance_m(p, near_m) < near_m) return;
    ++truth.far;
    const bool is_explained =
        std::binary_search(misplaced.begin(), misplaced.end(), pack(block_of(voxel))->bits);
    truth.explained += is_explained ? 1U : 0U;
    truth.false_voxels += is_explained ? 0U : 1U;
  });
  truth.worst_false = static_cast<double>(truth.false_voxels) /
                      static_cast<double>(std::max<std::uint64_t>(1, truth.occupied));
  if (truth.worst_false > Truth::kMostFalse)
    faults.push_back(fmt::format("robot {}: {} of {} occupied voxels are false",
                                 robot.config().exchange.robot, truth.false_voxels,
                                 truth.occupied));
  if (truth.most_miscounted > Truth::kMostMiscounted)
    faults.push_back(
        fmt::format("robot {}: a voxel's evidence is off by {:.3f} of what its "
                    "replicas have",
                    robot.config().exchange.robot, truth.most_miscounted));
  if (truth.evidence > kResampling * truth.mapped)
    faults.push_back(
        fmt::format("robot {}: the global map has evidence {:.0f}, and {:.0f} points "
                    "were integrated",
                    robot.config().exchange.robot, truth.evidence, truth.mapped));
  return truth;
}

}  // namespace tessera::soak
