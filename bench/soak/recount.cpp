// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "soak/recount.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "tessera/map/internal/packed_block.hpp"

namespace tessera::soak {

Recount::Recount(const Robot& robot)
    : replicas_(robot.global().replicas()),
      cap_(static_cast<double>(robot.global().config().max_evidence)),
      free_weight_(robot.global().config().map.free_weight),
      packed_(most_packed_bytes(robot.map().num_components())) {
  for (const Replicas::Slot slot : replicas_.in_order()) {
    const Replicas::Contribution& one = replicas_.contribution(slot);
    if (one.leaving) continue;
    if (FrameStatements::is(one.id.submap)) continue;
    if (has_blocks(one.id)) {
      slots_.push_back(slot);
      continue;
    }
    for (std::uint32_t number = one.first_block; number != 0;) {
      const Replicas::Replica& record = replicas_.record(number);
      number = record.next;
      Objection objection;
      if (read_objection(replicas_, &record, objection))
        objections_[{objection.against, objection.key.bits}].push_back({one.id.robot, objection});
    }
  }
  const auto order = [this](Replicas::Slot slot) {
    const ContributionId& id = replicas_.contribution(slot).id;
    return std::tuple(id.robot, id.submap, UINT32_MAX - id.epoch);
  };
  std::sort(slots_.begin(), slots_.end(),
            [&](Replicas::Slot a, Replicas::Slot b) { return order(a) < order(b); });
}

bool Recount::BlockOrder::operator()(const Block& a, const Block& b) const noexcept {
  const auto order = [](const Block& block) {
    const ContributionId& id = block.first;
    return std::tuple(id.robot, id.epoch, id.submap, block.second);
  };
  return order(a) < order(b);
}

void Recount::read(Replicas::Slot slot, BlockCoord block, Content& content) {
  content = {};
  const Result<BlockKey> key = pack(block);
  if (!key.ok()) return;
  for (const Replicas::Replica* part = replicas_.find(slot, *key); part != nullptr;
       part = replicas_.next_part(*part)) {
    const auto is_live = [&](int row) {
      return (unsigned{part->live} >> layer_of_row(row) & 1U) != 0;
    };
    unpack_block(
        replicas_.read(*part, packed_),
        [&](int row, Centroid centroid) {
          if (is_live(row)) content.centroids[static_cast<std::size_t>(row)] = centroid;
        },
        [&](int row, int, float count) {
          if (!is_live(row)) return;
          const auto at = static_cast<std::size_t>(row);
          content.labels[at] += count;
          content.observed[at] = true;
          content.first[at] = part->version - part->part;
        },
        [&](int row, unsigned passes) {
          if (!is_live(row)) return;
          const auto at = static_cast<std::size_t>(row);
          content.passes[at] += static_cast<float>(passes);
          content.observed[at] = true;
        });
  }
}

/// Robots that object to a voxel of a block as content_ has it.
int Recount::objectors(const ContributionId& id, BlockCoord block, int row) const {
  const auto found = objections_.find({id, pack(block)->bits});
  if (found == objections_.end()) return 0;
  std::set<std::uint32_t> robots;
  for (const Objected& one : found->second) {
    if (one.objection.version == content_.first[static_cast<std::size_t>(row)] &&
        has_row(one.objection.voxels, row))
      robots.insert(one.robot);
  }
  return static_cast<int>(robots.size());
}

/// Of the local voxels around the one that the global voxel's centre is in, those that go to it, in
/// whole or in part.
Recount::Share Recount::share_of(Replicas::Slot slot, VoxelCoord global, int holders) {
  const Replicas::Contribution& contribution = replicas_.contribution(slot);
  const GridTransform& T_global_local = contribution.T_global_local;
  if (!contribution.may_have(T_global_local.local_blocks(block_of(global)))) return {};
  const VoxelCoord middle = T_global_local.to_local(global);
  Share share;
  double passes = 0.0;
  double boxes = 0.0;
  double of_surface = 0.0;
  std::optional<BlockCoord> read_block;
  for (std::int32_t z = middle.z - 1; z <= middle.z + 1; ++z) {
    for (std::int32_t y = middle.y - 1; y <= middle.y + 1; ++y) {
      for (std::int32_t x = middle.x - 1; x <= middle.x + 1; ++x) {
        const VoxelCoord local{x, y, z};
        if (!read_block || !(*read_block == block_of(local))) {
          read_block = block_of(local);
          read(slot, *read_block, content_);
        }
        const auto row = static_cast<std::size_t>(row_order(local));
        double part = 0.0;
        const Centroid centroid = content_.centroids[row];
        if (centroid.known() && !T_global_local.shift_only()) {
          bool takes = false;
          T_global_local.for_targets(local, [&](VoxelCoord to) { takes = takes || to == global; });
          T_global_local.for_box_corners(
              local, centroid, [&](VoxelCoord to) { part += to == global ? 0.125 : 0.0; });
          boxes += part;
          of_surface += part * static_cast<double>(content_.passes[row]);
          if (takes) passes += static_cast<double>(content_.passes[row]);
          if (part == 0.0 && local == middle) part = 0.125;
          if (part == 0.0 && takes) share.observed = share.observed || content_.passes[row] > 0.0F;
        } else {
          T_global_local.for_targets(local,
                                     [&](VoxelCoord to) { part += to == global ? 1.0 : 0.0; });
          passes += part * static_cast<double>(content_.passes[row]);
        }
        if (part == 0.0) continue;
        const double labels = part * static_cast<double>(content_.labels[row]);
        share.evidence += labels;
        share.observed = share.observed || content_.observed[row];
        const int objecting = objectors(contribution.id, *read_block, row_order(local));
        if (objecting == 0 || objecting < holders) share.labels += labels;
      }
    }
  }
  if (boxes >= 0.3) passes = std::min(passes, std::floor(of_surface + 0.5));
  share.evidence -= static_cast<double>(free_weight_) * passes;
  return share;
}

/// As docs/design/theory.md has it: an eighth over the cap is rounding.
double Recount::capped(double labels) const {
  return labels > 1.125 * cap_ + 0x1p-10 ? cap_ : labels;
}

/// Robots that have the voxel occupied, by all that they have said of it; nothing where rounding
/// decides.
std::optional<int> Recount::holders(VoxelCoord global) {
  constexpr double kRounding = 1e-4;
  std::map<std::uint32_t, double> evidence;
  for (const Replicas::Slot slot : slots_)
    evidence[replicas_.contribution(slot).id.robot] += share_of(slot, global, 0).evidence;
  int count = 0;
  for (const auto& [robot, sum] : evidence) {
    if (sum != 0.0 && std::abs(sum) < kRounding) return std::nullopt;
    count += sum > 0.0 ? 1 : 0;
  }
  return count;
}

std::optional<double> Recount::labels(VoxelCoord global) {
  const std::optional<int> holding = objections_.empty() ? 0 : holders(global);
  if (!holding) return std::nullopt;
  double sum = 0.0;
  double of_robot = 0.0;
  const ContributionId* last = nullptr;
  bool is_hidden = false;
  for (const Replicas::Slot slot : slots_) {
    const ContributionId& id = replicas_.contribution(slot).id;
    if (last != nullptr && last->robot != id.robot) {
      sum += capped(of_robot);
      of_robot = 0.0;
    }
    if (last == nullptr || last->robot != id.robot || last->submap != id.submap) is_hidden = false;
    last = &id;
    if (is_hidden) continue;
    const Share share = share_of(slot, global, *holding);
    of_robot += share.labels;
    is_hidden = share.observed;
  }
  return sum + capped(of_robot);
}

}  // namespace tessera::soak
