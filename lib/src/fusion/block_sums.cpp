// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/block_sums.hpp"

#include <bit>
#include <cstring>

#include "tessera/base/internal/put_in_place.hpp"

namespace tessera {

namespace {

/// The voxels of one block that the voxel of a row goes to, without those where the robot has newer
/// evidence. Entries of a voxel follow each other, so the last answer is mostly the next.
class RowTargets {
 public:
  /// layers: others have no targets.
  RowTargets(const GridTransform& T_global_local, BlockCoord local, unsigned layers,
             BlockCoord global, const RobotShare& share) noexcept
      : frame_(T_global_local), local_(local), layers_(layers), global_(global), share_(share) {}
  [[nodiscard]] std::span<const int> of(int row) noexcept {
    if (row != row_) {
      row_ = row;
      count_ = 0;
      if (((layers_ >> layer_of_row(row)) & 1U) != 0) find(voxel_of_row(local_, row));
    }
    return std::span(rows_).first(count_);
  }

 private:
  void find(VoxelCoord local) noexcept {
    if (!frame_.shift_only()) {
      // Mostly not even near.
      const std::array<double, 3> center = frame_.to_global(local);
      const std::array<std::int32_t, 3> block{global_.x, global_.y, global_.z};
      for (std::size_t i = 0; i < 3; ++i) {
        const double from = block[i] * kBlockEdge - 1.0;
        if (center[i] < from || center[i] > from + kBlockEdge + 2.0) return;
      }
    }
    frame_.for_targets(local, [this](VoxelCoord target) {
      const int row = row_order(target);
      if (block_of(target) == global_ && !share_.hides(row)) rows_[count_++] = row;
    });
  }

  const GridTransform& frame_;
  BlockCoord local_;
  unsigned layers_;
  BlockCoord global_;
  const RobotShare& share_;
  int row_ = -1;
  std::size_t count_ = 0;
  std::array<int, 8> rows_{};
};

}  // namespace

Result<BlockSums> BlockSums::make(Arena& arena, const GlobalMapConfig& config, int num_components,
                                  std::span<std::byte> scratch) noexcept {
  BlockSums made;
  const Status status = put_in_place(made.share_, [&] {
    return RobotShare::make(arena, num_components, config.max_evidence, config.map.free_weight);
  });
  if (status != Status::kOk) return status;
  made.omega_ = config.diffusion.omega;
  made.prior_ = config.diffusion.prior;
  made.last_class_ = num_components - 2;
  made.observers_ = arena.take<std::uint8_t>(kBlockVoxels);
  made.scratch_ = scratch;
  if (made.observers_.empty()) return Status::kResourceExhausted;
  return made;
}

std::uint64_t BlockSums::add_replica(const Source& source,
                                     const Replicas::Replica& replica) noexcept {
  BlockContent& content = source.content;
  const float omega = omega_;
  const int last_class = last_class_;
  RowTargets targets(source.contribution.T_global_local, unpack(BlockKey{replica.key}),
                     replica.live, source.block, share_);
  VoxelMask observed{};
  const auto observe = [&](int row) {
    std::uint64_t& slice = observed[static_cast<std::size_t>(row >> 6)];
    const std::uint64_t bit = std::uint64_t{1} << static_cast<unsigned>(row & 63);
    if ((slice & bit) != 0) return;
    slice |= bit;
    for (const int target : targets.of(row)) {
      share_.observe(target);
      std::uint8_t& count = observers_[static_cast<std::size_t>(target)];
      count = static_cast<std::uint8_t>(count + (count < 255 ? 1 : 0));
    }
  };
  return unpack_block(
      source.replicas.read(replica, scratch_),
      [&](int row, int component, float count) {
        observe(row);
        for (const int target : targets.of(row)) {
          share_.add_labels(target, count);
          if (component == 0) {
            content.add_rest(target, omega * count);
          } else {
            content.add(component, target, omega * count);
            source.labelled = source.labelled || component <= last_class;
          }
        }
      },
      [&](int row, unsigned passes) {
        observe(row);
        for (const int target : targets.of(row)) {
          share_.add_passes(target, passes);
          content.add_passes(target, passes);
        }
      });
}

/// Parts in the order of their lowest layers, which is no matter of when they came.
std::uint64_t BlockSums::add_local_block(const Source& source, Slot slot,
                                         BlockCoord local) noexcept {
  std::uint64_t work = 1;
  const Result<BlockKey> key = pack(local);
  const Replicas::Replica* const first = key.ok() ? source.replicas.find(slot, *key) : nullptr;
  if (first == nullptr) return work;
  share_.enter(source.content);
  for (int layer = 0; layer < kBlockLayers; ++layer) {
    for (const Replicas::Replica* part = first; part != nullptr;
         part = source.replicas.next_part(*part))
      if (part->bytes != 0 && std::countr_zero(part->live) == layer)
        work += add_replica(source, *part);
  }
  return work;
}

std::uint64_t BlockSums::add_contribution(const Source& source, Slot slot) noexcept {
  std::uint64_t work = 0;
  if (source.contribution.leaving) return work;
  const GridTransform::BlockRange range =
      source.contribution.T_global_local.local_blocks(source.block);
  if (!source.contribution.may_have(range)) return 1;
  for (std::int32_t z = range.first.z; z <= range.last.z; ++z)
    for (std::int32_t y = range.first.y; y <= range.last.y; ++y)
      for (std::int32_t x = range.first.x; x <= range.last.x; ++x)
        work += add_local_block(source, slot, {x, y, z});
  return work;
}

/// contributions: all of one robot, by ascending id. Its newest epoch comes first.
std::uint64_t BlockSums::add_robot(const Replicas& replicas, std::span<const Slot> contributions,
                                   BlockCoord block, BlockContent& content,
                                   std::uint64_t& robots) noexcept {
  const auto id = [&](std::size_t at) { return replicas.contribution(contributions[at]).id; };
  std::uint64_t work = 0;
  bool labelled = false;
  share_.begin_robot();
  for (std::size_t last = contributions.size(); last != 0;) {
    std::size_t first = last - 1;
    while (first != 0 && id(first - 1).epoch == id(first).epoch) --first;
    share_.begin_epoch();
    for (const Slot slot : contributions.subspan(first, last - first))
      work +=
          add_contribution({replicas, replicas.contribution(slot), block, content, labelled}, slot);
    last = first;
  }
  const unsigned bit = replicas.contribution(contributions.front()).robot_bit;
  robots |= std::uint64_t{labelled ? 1U : 0U} << bit;
  return work + share_.end_robot(content);
}

BlockSums::Added BlockSums::add_up(const Replicas& replicas, BlockCoord block,
                                   BlockContent& content) noexcept {
  std::memset(observers_.data(), 0, observers_.size());
  const std::span<const Slot> all = replicas.in_order();
  Added added;
  for (std::size_t first = 0, next = 0; first < all.size(); first = next) {
    const std::uint32_t robot = replicas.contribution(all[first]).id.robot;
    while (next < all.size() && replicas.contribution(all[next]).id.robot == robot) ++next;
    added.work +=
        add_robot(replicas, all.subspan(first, next - first), block, content, added.robots);
  }
  return added;
}

void BlockSums::add_priors(BlockContent& content) const noexcept {
  const auto prior = prior_ * omega_;
  for (int row = 0; row < kBlockVoxels; ++row) {
    const auto observers = static_cast<float>(observers_[static_cast<std::size_t>(row)]);
    bool node = false;
    for (int l = 1; l <= last_class_; ++l) node = node || content.count(l, row) > 0.0F;
    for (int l = 1; node && l <= last_class_; ++l) content.add(l, row, prior * observers);
  }
}

}  // namespace tessera
