// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Who objects to what is added up.
#include <algorithm>

#include "tessera/fusion/internal/block_sums.hpp"
#include "tessera/replica/contribution_kind.hpp"

namespace tessera {

/// Each robot once, whatever its earlier starts have said.
void BlockSums::count_objectors(const Source& source, const Replicas::Replica& replica) noexcept {
  std::fill(objectors_.begin(), objectors_.end(), std::uint8_t{0});
  VoxelMask of_robot{};
  const std::span<const Slot> all = source.replicas.objections();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Replicas::Contribution& one = source.replicas.contribution(all[i]);
    Objection objection;
    const bool objects = one.counts() &&
                         find_objection(source.replicas, all[i], source.contribution.id,
                                        BlockKey{replica.key}, objection) &&
                         replica.version - replica.part == objection.version;
    for (std::size_t z = 0; objects && z < of_robot.size(); ++z) of_robot[z] |= objection.voxels[z];
    if (i + 1 < all.size() && source.replicas.contribution(all[i + 1]).id.robot == one.id.robot)
      continue;
    for_rows(of_robot, [this](int row) { ++objectors_[static_cast<std::size_t>(row)]; });
    of_robot = {};
  }
}

bool BlockSums::is_objected(int row, int target) noexcept {
  const std::uint8_t objectors = objectors_[static_cast<std::size_t>(row)];
  if (objectors == 0) return false;
  const bool is_objected = objectors >= holders_[static_cast<std::size_t>(target)];
  add_row(is_objected ? objected_ : disputed_, target);
  return is_objected;
}

std::uint64_t BlockSums::look_for_objections(const Source& source, Slot slot, bool& any) noexcept {
  const Replicas::Contribution& one = source.contribution;
  if (any || !one.counts() || !has_blocks(one.id)) return 0;
  const GridTransform::BlockRange range = one.T_global_local.local_blocks(source.block);
  if (!one.may_have(range)) return 0;
  std::uint64_t work = 0;
  Objection objection;
  for (std::int32_t z = range.first.z; z <= range.last.z; ++z)
    for (std::int32_t y = range.first.y; y <= range.last.y; ++y)
      for (std::int32_t x = range.first.x; x <= range.last.x; ++x) {
        const Result<BlockKey> key = pack({x, y, z});
        ++work;
        if (any || !key.ok() || source.replicas.find(slot, *key) == nullptr) continue;
        for (const Slot objections : source.replicas.objections()) {
          ++work;
          any = any || (!source.replicas.contribution(objections).hidden &&
                        find_objection(source.replicas, objections, one.id, *key, objection));
        }
      }
  return work;
}

}  // namespace tessera
