// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/robot/objections.hpp"

#include <algorithm>

#include "tessera/base/rigid.hpp"

namespace tessera {

Result<Objections> Objections::make(Arena& arena, std::uint32_t most, Exchange& exchange,
                                    const GlobalMap& global) noexcept {
  Objections made;
  if (most == 0) return made;
  made.exchange_ = &exchange;
  made.global_ = &global;
  made.moving_classes_ = global.map().classes().moving();
  made.made_ = arena.take<Made>(most);
  made.watches_ = arena.take<Watch>(kWatched);
  const std::span<Voxels> voxels = arena.take<Voxels>(1);
  made.packed_ = arena.take<std::byte>(most_packed_bytes(global.map().num_components()));
  const Result<BlockContent> content = BlockContent::make(arena, global.map().num_components());
  if (!content.ok() || made.made_.empty() || made.watches_.empty() || voxels.empty() ||
      made.packed_.empty())
    return Status::kResourceExhausted;
  made.voxels_ = voxels.data();
  made.content_ = *content;
  return made;
}

void Objections::begin_epoch() noexcept {
  for (Made& one : made_) one.used = false;
  for (Watch& one : watches_) one.number = 0;
  report_.objections = report_.watched_blocks = 0;
}

void Objections::tick(const Here& here) noexcept {
  if (made_.empty()) return;
  forget_frames(here);
  follow_watches(here);
  follow_made();
  hear_objections(here);
  look(here);
}

// --- What is watched ---

/// What was seen in another frame of this robot's was seen elsewhere.
void Objections::forget_frames(const Here& here) noexcept {
  if (has_frame_ && here.T_global_map != T_global_map_) {
    for (Watch& one : watches_) one.number = 0;
    for (Made& one : made_)
      if (one.used && one.holds) withdraw(one);
  }
  has_frame_ = true;
  T_global_map_ = here.T_global_map;
}

void Objections::follow_watches(const Here& here) noexcept {
  report_.watched_blocks = 0;
  bool has_answered = false;
  for (Watch& one : watches_) {
    if (one.number == 0) continue;
    const Result<Slot> slot = global_->replicas().find(one.heard.id);
    const Replicas::Replica* const record =
        slot.ok() ? global_->replicas().find(*slot, one.heard.key) : nullptr;
    const bool is_as_heard = record != nullptr && record->newest == one.heard.version &&
                             global_->replicas().contribution(*slot).frame() == one.frame;
    if (!is_as_heard || one.answers != (one.heard.id == here.own) || ++one.ticks > kMostTicks) {
      one.number = 0;
      continue;
    }
    if (one.answers) {
      // One in a tick, whatever others object to.
      if (one.is_hit && !has_answered) publish_again(one.heard);
      if (one.is_hit && !has_answered) one.number = 0;
      has_answered = has_answered || one.is_hit;
      continue;
    }
    ++report_.watched_blocks;
    if (!any_row(one.seen)) continue;
    if (any_row(one.asked) && ++one.gathering < kGatherTicks) continue;
    object(one);
  }
}

/// Of a local voxel, in the global frame, metres.
Point3d Objections::centre_of(const GridTransform& T_global_local,
                              const VoxelCoord& voxel) const noexcept {
  const std::array<double, 3> voxels = T_global_local.to_global(voxel);
  return Point3d(voxels[0], voxels[1], voxels[2]) * global_->config().map.resolution_m;
}

std::size_t Objections::place(const Matrix34d& T_map_global, std::int64_t moment,
                              std::span<WatchedPoint> into) noexcept {
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < watches_.size(); ++i) {
    Watch& one = watches_[(next_place_ + i) % kWatched];
    if (one.number == 0 || count == into.size()) continue;
    if (!one.is_asked) one.asked_at = moment;
    one.is_asked = true;
    for_rows(one.asked, [&](int row) {
      if (count == into.size()) return;
      const VoxelCoord voxel = voxel_of_row(unpack(one.heard.key), row);
      const Point3d p_global = centre_of(one.T_global_local, voxel);
      const Point3f p_map = round_to_float(apply(T_map_global, p_global));
      into[count++] = {.p_map = {p_map.x(), p_map.y(), p_map.z()},
                       .watch = one.number,
                       .row = static_cast<std::uint16_t>(row)};
    });
  }
  ++next_place_;  // where there is no room for all, others come first next time
  return count;
}

void Objections::note(std::span<const WatchedPoint> watched, std::int64_t taken) noexcept {
  for (const WatchedPoint& point : watched) {
    if (watches_.empty() || point.watch == 0 || point.row >= kBlockVoxels) return;
    Watch& one = watches_[point.watch % kWatched];
    if (one.number != point.watch) continue;  // it is of a version before, or is done with
    const int row = point.row;
    if (!one.is_asked || taken <= one.asked_at || !has_row(one.asked, row)) continue;
    one.is_hit = one.is_hit || point.is_hit;
    if (one.answers || !point.is_seen_through) continue;
    one.ticks = 0;
    const unsigned enough = has_row(one.moving, row) ? kScansMoving : kScans;
    if (++one.times[point.row] < enough << one.lapses) continue;
    take_row(one.asked, row);
    add_row(one.seen, row);
  }
}

// --- What is said ---

Objections::Made* Objections::made_against(const ContributionId& id, BlockKey key) noexcept {
  const auto found = std::find_if(made_.begin(), made_.end(), [&](const Made& one) {
    return one.used && one.heard.id == id && one.heard.key == key;
  });
  return found == made_.end() ? nullptr : &*found;
}

/// What this robot has published against a block as it was heard.
bool Objections::find_own(const Heard& heard, Objection& into) const noexcept {
  const std::optional<ContributionId> own = exchange_->publishing();
  if (!own) return false;
  const Result<Slot> slot = global_->replicas().find({own->robot, own->epoch, Objection::kNumber});
  return slot.ok() && find_objection(global_->replicas(), *slot, heard.id, heard.key, into) &&
         into.version == heard.version;
}

/// Says the same of no version that there is.
void Objections::withdraw(Made& made) noexcept {
  Objection said;
  if (find_own(made.heard, said)) {
    said.version = 0;
    if (!exchange_->object(said).ok()) ++report_.refused_objections;
  }
  made.holds = false;
  --report_.objections;
}

void Objections::object(Watch& watch) noexcept {
  Made* made = made_against(watch.heard.id, watch.heard.key);
  VoxelMask voxels = watch.seen;
  if (Objection said; find_own(watch.heard, said))
    for (std::size_t z = 0; z < voxels.size(); ++z) voxels[z] |= said.voxels[z];
  const Objection objection{.against = watch.heard.id,
                            .key = watch.heard.key,
                            .version = watch.heard.version,
                            .voxels = voxels};
  if (!exchange_->object(objection).ok()) {
    ++report_.refused_objections;
    return;
  }
  // The one that has been kept longest is not followed any more.
  if (made == nullptr) {
    made = &made_[next_made_++ % made_.size()];
    report_.objections -= made->used && made->holds ? 1U : 0U;
    *made = {};
  }
  report_.objections += made->holds ? 0U : 1U;
  for_rows(watch.seen, [&](int) { ++report_.objected_voxels; });
  made->heard = watch.heard;
  made->frame = watch.frame;
  made->used = made->holds = true;
  watch.seen = {};
  watch.gathering = 0;
  if (!any_row(watch.asked)) watch.number = 0;
}

/// Whatever a block says later is not objected to.
void Objections::follow_made() noexcept {
  for (std::uint32_t i = 0; i < kFollowed && i < made_.size(); ++i) {
    Made& one = made_[next_followed_++ % made_.size()];
    if (!one.used || !one.holds) continue;
    const Result<Slot> slot = global_->replicas().find(one.heard.id);
    const Replicas::Replica* const record =
        slot.ok() ? global_->replicas().find(*slot, one.heard.key) : nullptr;
    Objection said;
    if (record != nullptr && record->newest == one.heard.version && find_own(one.heard, said)) {
      // What was seen through lay elsewhere.
      if (global_->replicas().contribution(*slot).frame() != one.frame) withdraw(one);
      continue;
    }
    one.holds = false;
    one.lapses = static_cast<std::uint8_t>(one.lapses + (one.lapses < kMostLapses ? 1 : 0));
    --report_.objections;
    ++report_.lapsed_objections;
  }
}

/// What is there after all is said once more, as a later version.
void Objections::publish_again(const Heard& heard) noexcept {
  content_.clear();
  if (!exchange_->read_published(heard.key, content_)) return;
  ++(exchange_->publish(heard.key, content_).ok() ? report_.answered_objections
                                                  : report_.refused_objections);
}

}  // namespace tessera
