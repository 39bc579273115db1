// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot takes over from its earlier starts.
#include <algorithm>

#include "tessera/base/rigid.hpp"
#include "tessera/exchange/internal/block_codec.hpp"
#include "tessera/map/internal/packed_block.hpp"
#include "tessera/robot/sharer.hpp"

namespace tessera {

Status Sharer::restore_frames(std::span<const SubmapFrame> frames, std::uint32_t revision,
                              bool are_known) noexcept {
  const std::uint32_t first = frames_.first() - submaps_before_;
  if (frames.size() <= submaps_before_) return Status::kInvalidArgument;
  const Result<Matrix34d> T_world_map = decode_rigid(frames[submaps_before_].frame);
  if (!T_world_map.ok()) return Status::kInvalidArgument;
  // In its place at once, as others have not heard of it.
  const Matrix34d T_global_map = product(T_global_world_, *T_world_map);
  if (!GridTransform::make(T_global_map, resolution_m_).ok()) return Status::kInvalidArgument;
  if (const Status status = frames_.restore(frames, first, revision); status != Status::kOk)
    return status;
  frame_ = T_global_map;
  submap_.revision = revision;
  continues_ = are_known;
  return exchange_.move(submap_.epoch, submap_.submap, T_global_map);
}

/// What earlier starts have published of the submaps arrives from others at any time, and lies
/// where they had it.
void Sharer::move_earlier() noexcept {
  for (std::uint32_t place = 0; place < exchange_.places(); ++place) {
    const std::optional<std::uint32_t> submap = exchange_.earlier_at(place);
    if (!submap || !frames_.has(*submap)) continue;
    const Matrix34d T_global_map = frame_of(*submap);
    if (GridTransform::make(T_global_map, resolution_m_).ok())
      static_cast<void>(exchange_.move_earlier(place, T_global_map));
  }
}

bool Sharer::is_missing(std::uint32_t submap) const noexcept {
  return submap < first_of_start_ && frames_.has(submap) && !exchange_.has_all_of(submap);
}

Result<std::size_t> Sharer::publish_earlier(std::uint32_t submap, const LocalMap& map,
                                            std::span<const KeyedIndex> blocks, std::size_t first,
                                            std::size_t count) noexcept {
  if (submap >= first_of_start_ || !frames_.has(submap)) return Status::kInvalidArgument;
  if (first == 0) {
    const Status opened = exchange_.open_earlier(submap, frame_of(submap));
    if (opened != Status::kOk) return opened;
  }
  const std::span<const KeyedIndex> left = blocks.subspan(std::min(first, blocks.size()));
  const std::size_t most = std::min(count, left.size());
  for (const KeyedIndex& item : left.first(most)) {
    earlier_.clear();
    add_block(map, map.block_at(item.index), earlier_);
    quantise(earlier_);
    // What finds no room is counted by the exchange.
    if (earlier_.any())
      static_cast<void>(exchange_.publish_earlier(submap, BlockKey{item.key}, earlier_));
  }
  return most;
}

}  // namespace tessera
