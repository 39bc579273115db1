// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/registration/pose_track.hpp"

#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

/// later - earlier, also where that does not fit a signed number.
std::uint64_t microseconds_between(std::int64_t earlier, std::int64_t later) noexcept {
  return static_cast<std::uint64_t>(later) - static_cast<std::uint64_t>(earlier);
}

}  // namespace

Result<PoseTrack> PoseTrack::make(std::size_t capacity, Arena& arena) noexcept {
  if (capacity < 1 || capacity > kMostPoses) return Status::kInvalidArgument;
  PoseTrack track;
  track.ring_ = arena.take<StampedPose>(capacity);
  if (track.ring_.empty()) return Status::kResourceExhausted;
  return track;
}

Status PoseTrack::add(const StampedPose& pose) noexcept {
  if (ring_.empty()) return Status::kResourceExhausted;
  if (check_rigid(pose.T_map_body) != Status::kOk) {
    ++report_.refused_not_rigid;
    return Status::kInvalidArgument;
  }
  if (size_ > 0 && pose.stamp_us <= latest_us()) {
    ++report_.refused_not_later;
    return Status::kMismatch;
  }
  if (size_ == ring_.size()) {
    first_ = first_ + 1 < ring_.size() ? first_ + 1 : 0;
    --size_;
    ++report_.overwritten;
  }
  const std::size_t place = first_ + size_;
  ring_[place < ring_.size() ? place : place - ring_.size()] = pose;
  ++size_;
  ++report_.added;
  return Status::kOk;
}

Result<Matrix34d> PoseTrack::at(std::int64_t stamp_us, std::int64_t max_gap_us) const noexcept {
  if (size_ == 0 || stamp_us < oldest_us() || stamp_us > latest_us()) return Status::kOutOfRange;
  // The last pose that is not later.
  std::size_t before = 0;
  std::size_t after = size_;
  while (after - before > 1) {
    const std::size_t middle = before + (after - before) / 2;
    ((*this)[middle].stamp_us <= stamp_us ? before : after) = middle;
  }
  const StampedPose& from = (*this)[before];
  if (from.stamp_us == stamp_us) return from.T_map_body;
  const StampedPose& to = (*this)[before + 1];
  const std::uint64_t gap_us = microseconds_between(from.stamp_us, to.stamp_us);
  if (max_gap_us < 0 || gap_us > static_cast<std::uint64_t>(max_gap_us)) return Status::kOutOfRange;
  const double share = static_cast<double>(microseconds_between(from.stamp_us, stamp_us)) /
                       static_cast<double>(gap_us);
  return interpolate(from.T_map_body, to.T_map_body, share);
}

}  // namespace tessera
