// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "soak/recount.hpp"

#include <algorithm>
#include <tuple>

#include "tessera/map/internal/packed_block.hpp"

namespace tessera::soak {

Recount::Recount(const Robot& robot)
    : replicas_(robot.global().replicas()),
      cap_(static_cast<double>(robot.global().config().max_evidence)),
      packed_(most_packed_bytes(robot.map().num_components())) {
  for (const Replicas::Slot slot : replicas_.in_order()) {
    if (!replicas_.contribution(slot).leaving) slots_.push_back(slot);
  }
  const auto order = [this](Replicas::Slot slot) {
    const ContributionId& id = replicas_.contribution(slot).id;
    return std::tuple(id.robot, id.submap, UINT32_MAX - id.epoch);
  };
  std::sort(slots_.begin(), slots_.end(),
            [&](Replicas::Slot a, Replicas::Slot b) { return order(a) < order(b); });
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
        [&](int row, int, float count) {
          if (!is_live(row)) return;
          content.labels[static_cast<std::size_t>(row)] += count;
          content.observed[static_cast<std::size_t>(row)] = true;
        },
        [&](int row, unsigned) {
          if (is_live(row)) content.observed[static_cast<std::size_t>(row)] = true;
        });
  }
}

/// Of the local voxels around the one that the global voxel's centre is in, those that go to it.
Recount::Share Recount::share_of(Replicas::Slot slot, VoxelCoord global) {
  const Replicas::Contribution& contribution = replicas_.contribution(slot);
  const GridTransform& T_global_local = contribution.T_global_local;
  if (!contribution.may_have(T_global_local.local_blocks(block_of(global)))) return {};
  const VoxelCoord middle = T_global_local.to_local(global);
  Share share;
  std::optional<BlockCoord> read_block;
  for (std::int32_t z = middle.z - 1; z <= middle.z + 1; ++z) {
    for (std::int32_t y = middle.y - 1; y <= middle.y + 1; ++y) {
      for (std::int32_t x = middle.x - 1; x <= middle.x + 1; ++x) {
        const VoxelCoord local{x, y, z};
        bool goes = false;
        T_global_local.for_targets(local, [&](VoxelCoord to) { goes = goes || to == global; });
        if (!goes) continue;
        if (!read_block || !(*read_block == block_of(local))) {
          read_block = block_of(local);
          read(slot, *read_block, content_);
        }
        const auto row = static_cast<std::size_t>(row_order(local));
        share.labels += static_cast<double>(content_.labels[row]);
        share.observed = share.observed || content_.observed[row];
      }
    }
  }
  return share;
}

/// As docs/design/theory.md has it: an eighth over the cap is rounding.
double Recount::capped(double labels) const {
  return labels > 1.125 * cap_ + 0x1p-10 ? cap_ : labels;
}

double Recount::labels(VoxelCoord global) {
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
    const Share share = share_of(slot, global);
    of_robot += share.labels;
    is_hidden = share.observed;
  }
  return sum + capped(of_robot);
}

}  // namespace tessera::soak
