// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What others say is occupied and this robot's map says is free.
#include <algorithm>

#include "tessera/base/rigid.hpp"
#include "tessera/replica/contribution_kind.hpp"
#include "tessera/robot/objections.hpp"

namespace tessera {

namespace {

/// This robot's map has the voxel free, and nothing beside it that the other may have a little
/// elsewhere: frames are not exact, and of what does not move it is worth more to keep both.
bool is_contested(MapReader& reader, VoxelCoord voxel, bool moves) noexcept {
  const auto state = [&](const VoxelCoord& at) {
    const Result<Estimate> estimate = reader.query(at);
    return estimate.ok() ? estimate->state : VoxelState::kUnknown;
  };
  // What may move is asked of scans wherever they have met nothing yet.
  const VoxelState own = state(voxel);
  if (own == VoxelState::kOccupied || (own != VoxelState::kFree && !moves)) return false;
  const std::int32_t most = moves ? 1 : 3;
  for (std::int32_t d = 1; d <= most; ++d) {
    for (const VoxelCoord& beside :
         {VoxelCoord{voxel.x - d, voxel.y, voxel.z}, VoxelCoord{voxel.x + d, voxel.y, voxel.z},
          VoxelCoord{voxel.x, voxel.y - d, voxel.z}, VoxelCoord{voxel.x, voxel.y + d, voxel.z},
          VoxelCoord{voxel.x, voxel.y, voxel.z - d}, VoxelCoord{voxel.x, voxel.y, voxel.z + d}}) {
      if (state(beside) == VoxelState::kOccupied) return false;
    }
  }
  return true;
}

}  // namespace

/// What the block's newest version holds as far as it is heard, in voxels_. False: no label
/// evidence.
bool Objections::hear(Slot slot, BlockKey key, Heard& heard) noexcept {
  const Replicas& replicas = global_->replicas();
  voxels_->labels.fill(0.0F);
  voxels_->moving.fill(0.0F);
  voxels_->passes.fill(0);
  heard = {.id = replicas.contribution(slot).id, .key = key};
  bool any = false;
  for (const Replicas::Replica* part = replicas.find(slot, key); part != nullptr;
       part = replicas.next_part(*part)) {
    heard.version = part->newest;
    if (part->version - part->part != part->newest) continue;
    const auto is_live = [part](int row) { return ((part->live >> layer_of_row(row)) & 1U) != 0; };
    unpack_block(
        replicas.read(*part, packed_),
        [&](int row, int component, float count) {
          if (!is_live(row)) return;
          any = true;
          const auto at = static_cast<std::size_t>(row);
          voxels_->labels[at] += count;
          if ((moving_classes_ >> static_cast<unsigned>(component) & 1U) != 0)
            voxels_->moving[at] += count;
        },
        [&](int row, unsigned passes) {
          if (is_live(row))
            voxels_->passes[static_cast<std::size_t>(row)] = static_cast<std::uint16_t>(passes);
        });
  }
  return any;
}

bool Objections::is_near(const Here& here, const Replicas::Contribution& one) const noexcept {
  if (!one.counts() || one.id == here.own || !has_blocks(one.id) || one.first_block == 0)
    return false;
  if (MapSession::is(one.id.submap) && one.session.weight == 0) return false;
  const double resolution_m = global_->config().map.resolution_m;
  const Point3d at = here.p_global / resolution_m;
  const BlockCoord block = block_of(one.T_global_local.to_local(
      {floor_to_int(at.x()), floor_to_int(at.y()), floor_to_int(at.z())}));
  const auto reach = static_cast<std::int32_t>(kReach_m / (kBlockEdge * resolution_m)) + 1;
  return one.extent.touches({{block.x - reach, block.y - reach, block.z - reach},
                             {block.x + reach, block.y + reach, block.z + reach}});
}

/// Contributions by ascending id, and the blocks of each, again and again.
void Objections::look(const Here& here) noexcept {
  const Replicas& replicas = global_->replicas();
  const std::span<const Slot> all = replicas.in_order();
  if (all.empty()) return;
  std::size_t at =
      static_cast<std::size_t>(std::lower_bound(all.begin(), all.end(), looking_at_,
                                                [&](Slot slot, const ContributionId& id) {
                                                  return replicas.contribution(slot).id < id;
                                                }) -
                               all.begin());
  std::uint32_t reads = 0;
  std::uint32_t looks = 0;
  for (std::size_t visited = 0; visited <= all.size(); ++visited, ++at) {
    if (at >= all.size()) at = 0;
    const Slot slot = all[at];
    const Replicas::Contribution& one = replicas.contribution(slot);
    if (one.id != looking_at_) next_key_.reset();
    looking_at_ = one.id;
    if (!is_near(here, one)) continue;
    const Replicas::Replica* record = next_key_ ? replicas.find(slot, *next_key_) : nullptr;
    if (record == nullptr) record = &replicas.record(one.first_block);
    for (;;) {
      if (looks == kLooks || reads == kReads) {
        next_key_ = BlockKey{record->key};
        return;
      }
      ++looks;
      const VoxelCoord middle = voxel_of_row(unpack(BlockKey{record->key}), kBlockVoxels / 2 + 36);
      const Point3d p = centre_of(one.T_global_local, middle);
      if (record->bytes != 0 && squared_norm(p - here.p_global) < kReach_m * kReach_m &&
          replicas.find(slot, BlockKey{record->key}) == record) {
        ++reads;
        look_at(here, slot, *record);
      }
      if (record->next == 0) break;
      record = &replicas.record(record->next);
    }
    next_key_.reset();
  }
}

void Objections::look_at(const Here& here, Slot slot, const Replicas::Replica& record) noexcept {
  Heard heard;
  if (hear(slot, BlockKey{record.key}, heard)) watch(here, slot, heard);
}

/// The watch of a block; one that is free or has waited longest for a voxel to be seen through.
Objections::Watch* Objections::watch_of(const Heard& heard) noexcept {
  Watch* found = nullptr;
  for (Watch& one : watches_) {
    if (one.number != 0 && one.heard == heard) return &one;
    const bool is_free = one.number == 0;
    if (!is_free && (one.ticks <= kMostTicks / 4 || any_row(one.seen))) continue;
    if (found == nullptr || (found->number != 0 && (is_free || one.ticks > found->ticks)))
      found = &one;
  }
  return found;
}

/// The same, begun if it is of another block. Null: there is none.
Objections::Watch* Objections::new_watch(const Heard& heard, Slot slot) noexcept {
  Watch* const one = watch_of(heard);
  if (one == nullptr || (one->number != 0 && one->heard == heard)) return one;
  const auto place = static_cast<std::uint32_t>(one - watches_.data());
  *one = {};
  one->heard = heard;
  one->number = ++numbers_ * kWatched + place;
  one->T_global_local = global_->replicas().contribution(slot).T_global_local;
  one->frame = global_->replicas().contribution(slot).frame();
  return one;
}

/// Watches what this robot has occupied of what another one objects to.
void Objections::answer(Slot own, const Objection& objection) noexcept {
  const auto answering = std::count_if(watches_.begin(), watches_.end(), [](const Watch& one) {
    return one.number != 0 && one.answers;
  });
  const Replicas::Replica* const block = global_->replicas().find(own, objection.key);
  Heard heard;
  if (answering >= kMostAnswers || block == nullptr || block->newest != objection.version ||
      !hear(own, objection.key, heard))
    return;
  VoxelMask asked{};
  const float free_weight = global_->config().map.free_weight;
  for_rows(objection.voxels, [&](int row) {
    const auto at = static_cast<std::size_t>(row);
    if (voxels_->labels[at] > free_weight * static_cast<float>(voxels_->passes[at]))
      add_row(asked, row);
  });
  Watch* const one = any_row(asked) ? new_watch(heard, own) : nullptr;
  if (one == nullptr) return;
  one->answers = true;
  for (std::size_t z = 0; z < asked.size(); ++z) one->asked[z] |= asked[z];
}

bool Objections::hear_objections_of(Slot slot, const Here& here, Slot own,
                                    std::uint32_t& looks) noexcept {
  const Replicas& replicas = global_->replicas();
  const Replicas::Replica* record = next_answer_ ? replicas.find(slot, *next_answer_) : nullptr;
  if (record == nullptr) record = &replicas.record(replicas.contribution(slot).first_block);
  for (;; record = &replicas.record(record->next)) {
    if (looks++ == kAnswers) {
      next_answer_ = BlockKey{record->key};
      return false;
    }
    Objection objection;
    if (read_objection(replicas, record, objection) && objection.against == here.own)
      answer(own, objection);
    if (record->next == 0) return true;
  }
}

/// Of others, to what this robot publishes.
void Objections::hear_objections(const Here& here) noexcept {
  const Replicas& replicas = global_->replicas();
  const Result<Slot> own = replicas.find(here.own);
  if (!own.ok()) return;
  std::uint32_t looks = 0;
  const std::span<const Slot> all = replicas.objections();
  std::size_t at =
      static_cast<std::size_t>(std::lower_bound(all.begin(), all.end(), answering_,
                                                [&](Slot slot, const ContributionId& id) {
                                                  return replicas.contribution(slot).id < id;
                                                }) -
                               all.begin());
  for (std::size_t visited = 0; visited <= all.size() && !all.empty(); ++visited, ++at) {
    if (at >= all.size()) at = 0;
    const Replicas::Contribution& one = replicas.contribution(all[at]);
    if (one.id != answering_) next_answer_.reset();
    answering_ = one.id;
    if (!one.counts() || one.id.robot == here.own.robot || one.first_block == 0) continue;
    if (!hear_objections_of(all[at], here, *own, looks)) return;
    next_answer_.reset();
  }
}

/// Watches what its contribution has occupied and this robot's map has free.
void Objections::watch(const Here& here, Slot slot, const Heard& heard) noexcept {
  const GridTransform& T_global_local = global_->replicas().contribution(slot).T_global_local;
  const float free_weight = global_->config().map.free_weight;
  const Matrix34d T_map_global = inverse(here.T_global_map);
  const Made* const made = made_against(heard.id, heard.key);
  Objection said;
  const bool has_said = find_own(heard, said);
  MapReader reader(here.map);
  VoxelMask asked{};
  VoxelMask moving{};
  for (int row = 0; row < kBlockVoxels; ++row) {
    const auto at = static_cast<std::size_t>(row);
    const float labels = voxels_->labels[at];
    if (!(labels > free_weight * static_cast<float>(voxels_->passes[at]))) continue;
    if (has_said && has_row(said.voxels, row)) continue;
    const VoxelCoord voxel = voxel_of_row(unpack(heard.key), row);
    const Point3d p_map = apply(T_map_global, centre_of(T_global_local, voxel));
    const Result<VoxelCoord> own = here.map.lattice().voxel_of(round_to_float(p_map));
    const bool moves = voxels_->moving[at] > 0.5F * labels;
    if (!own.ok() || !is_contested(reader, *own, moves)) continue;
    add_row(asked, row);
    if (moves) add_row(moving, row);
  }
  if (!any_row(asked)) return;
  Watch* const one = new_watch(heard, slot);
  if (one == nullptr) return;
  one->lapses = made == nullptr ? std::uint8_t{0} : made->lapses;
  for (std::size_t z = 0; z < asked.size(); ++z) {
    one->asked[z] |= asked[z] & ~one->seen[z];
    one->moving[z] |= moving[z];
  }
}

}  // namespace tessera
