// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/global_reader.hpp"

#include "tessera/base/internal/shared_words.hpp"

namespace tessera {

/// False iff a block was in the middle of a change all the time.
bool GlobalReader::read(VoxelCoord voxel, bool staged, VoxelEvidence& into) noexcept {
  using Outcome = MapReader::Outcome;
  // A block that is staged no more is in the map since before it left.
  const Outcome first = staged ? staged_.read_evidence(voxel, into) : Outcome::kAbsent;
  if (first != Outcome::kAbsent) return first == Outcome::kRead;
  return map_.read_evidence(voxel, into) != Outcome::kTorn;
}

/// read(staged) reads it all, and says whether it could.
template <class Read>
bool GlobalReader::read_one_generation(Read&& read) noexcept {
  for (int attempt = 0; attempt < kMaxAttempts; ++attempt) {
    const std::uint64_t view = load_shared(maps_->view(), std::memory_order_acquire);
    if (!read(view % 2 != 0)) break;
    std::atomic_thread_fence(std::memory_order_acquire);
    if (load_shared(maps_->view()) == view) {
      generation_ = view / 2;
      return true;
    }
    ++retries_;
  }
  ++busy_;
  return false;
}

Estimate GlobalReader::estimate_of(const VoxelEvidence& evidence) const noexcept {
  return estimate(evidence, maps_->map().reading());
}

Result<VoxelEvidence> GlobalReader::evidence(VoxelCoord voxel) noexcept {
  VoxelEvidence result;
  if (!read_one_generation([&](bool staged) { return read(voxel, staged, result); }))
    return Status::kBusy;
  return result;
}

Result<Estimate> GlobalReader::query(VoxelCoord voxel) noexcept {
  const Result<VoxelEvidence> found = evidence(voxel);
  if (!found.ok()) return found.status();
  return estimate_of(*found);
}

Result<VoxelEvidence> GlobalReader::evidence(const Point3f& p_global) noexcept {
  const Result<VoxelCoord> voxel = maps_->map().lattice().voxel_of(p_global);
  if (voxel.ok()) return evidence(*voxel);
  VoxelEvidence nothing;
  nothing.num_components = maps_->map().num_components();
  return nothing;
}

Result<Estimate> GlobalReader::query(const Point3f& p_global) noexcept {
  const Result<VoxelEvidence> found = evidence(p_global);
  if (!found.ok()) return found.status();
  return estimate_of(*found);
}

Status GlobalReader::query(std::span<const VoxelCoord> voxels, std::span<Estimate> into) noexcept {
  if (into.size() < voxels.size()) return Status::kInvalidArgument;
  VoxelEvidence evidence;
  const bool found = read_one_generation([&](bool staged) {
    for (std::size_t i = 0; i < voxels.size(); ++i) {
      if (!read(voxels[i], staged, evidence)) return false;
      into[i] = estimate_of(evidence);
    }
    return true;
  });
  return found ? Status::kOk : Status::kBusy;
}

Result<BlockSnapshot> GlobalReader::snapshot(BlockCoord block,
                                             std::span<std::byte> workspace) noexcept {
  Result<BlockSnapshot> found = Status::kBusy;
  const bool done = read_one_generation([&](bool staged) {
    found = staged ? staged_.snapshot(block, workspace) : BlockSnapshot{};
    // A block that is staged no more is in the map since before it left.
    if (found.ok() && found->empty()) found = map_.snapshot(block, workspace);
    // Only of kBusy will another try make something else.
    return found.status() != Status::kBusy;
  });
  if (!done) return Status::kBusy;
  return found;
}

}  // namespace tessera
