// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// B of a block: what all robots say of it, added up in the order of their numbers.
#include <bit>
#include <cstring>

#include "tessera/fusion/global_map.hpp"

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

/// labelled: set if a class has evidence here.
std::uint64_t GlobalMap::add_replica(const Replicas::Contribution& contribution,
                                     const Replicas::Replica& replica, BlockCoord block,
                                     bool& labelled) noexcept {
  const float omega = config_.diffusion.omega;
  const int last_class = map_->num_components() - 2;
  RowTargets targets(contribution.T_global_local, unpack(BlockKey{replica.key}), replica.live,
                     block, share_);
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
      replicas_.read(replica, packed_),
      [&](int row, int component, float count) {
        observe(row);
        for (const int target : targets.of(row)) {
          share_.add_labels(target, count);
          if (component == 0) {
            content_.add_rest(target, omega * count);
          } else {
            content_.add(component, target, omega * count);
            labelled = labelled || component <= last_class;
          }
        }
      },
      [&](int row, unsigned passes) {
        observe(row);
        for (const int target : targets.of(row)) {
          share_.add_passes(target, passes);
          content_.add_passes(target, passes);
        }
      });
}

/// Parts in the order of their lowest layers, which is no matter of when they came.
std::uint64_t GlobalMap::add_local_block(const Replicas::Contribution& contribution, Slot slot,
                                         BlockCoord local, BlockCoord block,
                                         bool& labelled) noexcept {
  std::uint64_t work = 1;
  const Result<BlockKey> key = pack(local);
  const Replicas::Replica* const first = key.ok() ? replicas_.find(slot, *key) : nullptr;
  if (first == nullptr) return work;
  share_.enter(content_);
  for (int layer = 0; layer < kBlockLayers; ++layer) {
    for (const Replicas::Replica* part = first; part != nullptr; part = replicas_.next_part(*part))
      if (part->bytes != 0 && std::countr_zero(part->live) == layer)
        work += add_replica(contribution, *part, block, labelled);
  }
  return work;
}

std::uint64_t GlobalMap::add_contribution(Slot slot, BlockCoord block, bool& labelled) noexcept {
  std::uint64_t work = 0;
  const Replicas::Contribution& contribution = replicas_.contribution(slot);
  if (contribution.leaving) return work;
  const GridTransform::BlockRange range = contribution.T_global_local.local_blocks(block);
  for (std::int32_t z = range.first.z; z <= range.last.z; ++z)
    for (std::int32_t y = range.first.y; y <= range.last.y; ++y)
      for (std::int32_t x = range.first.x; x <= range.last.x; ++x)
        work += add_local_block(contribution, slot, {x, y, z}, block, labelled);
  return work;
}

/// contributions: all of one robot, by ascending id. Its newest epoch comes first.
std::uint64_t GlobalMap::add_robot(std::span<const Slot> contributions, BlockCoord block,
                                   std::uint64_t& robots) noexcept {
  const auto id = [&](std::size_t at) { return replicas_.contribution(contributions[at]).id; };
  std::uint64_t work = 0;
  bool labelled = false;
  share_.begin_robot();
  for (std::size_t last = contributions.size(); last != 0;) {
    std::size_t first = last - 1;
    while (first != 0 && id(first - 1).epoch == id(first).epoch) --first;
    share_.begin_epoch();
    for (const Slot slot : contributions.subspan(first, last - first))
      work += add_contribution(slot, block, labelled);
    last = first;
  }
  const unsigned bit = replicas_.contribution(contributions.front()).robot_bit;
  robots |= std::uint64_t{labelled ? 1U : 0U} << bit;
  return work + share_.end_robot(content_);
}

std::uint64_t GlobalMap::add_contributions(BlockCoord block, std::uint64_t& robots) noexcept {
  const std::span<const Slot> all = replicas_.in_order();
  std::uint64_t work = 0;
  for (std::size_t first = 0, next = 0; first < all.size(); first = next) {
    const std::uint32_t robot = replicas_.contribution(all[first]).id.robot;
    while (next < all.size() && replicas_.contribution(all[next]).id.robot == robot) ++next;
    work += add_robot(all.subspan(first, next - first), block, robots);
  }
  return work;
}

/// Eq. (10): S_i lambda_i of every local voxel counts the prior too.
void GlobalMap::add_priors() noexcept {
  const auto prior = config_.diffusion.prior * config_.diffusion.omega;
  const int last_class = map_->num_components() - 2;
  for (int row = 0; row < kBlockVoxels; ++row) {
    const auto observers = static_cast<float>(observers_[static_cast<std::size_t>(row)]);
    bool node = false;
    for (int l = 1; l <= last_class; ++l) node = node || content_.count(l, row) > 0.0F;
    for (int l = 1; node && l <= last_class; ++l) content_.add(l, row, prior * observers);
  }
}

bool GlobalMap::belongs_to_graph(std::uint64_t robots) const noexcept {
  return config_.diffusion.whole_map ? robots != 0 : (robots & (robots - 1)) != 0;
}

GlobalMap::Stored GlobalMap::store_sums(Record& record) noexcept {
  const std::span<const std::byte> bytes = packed_.first(pack_block(content_, packed_));
  if (record.sums != 0 && record.sums_bytes == bytes.size() && sums_.equals(record.sums, bytes))
    return Stored::kAsBefore;
  const std::uint32_t held = SegmentStore::segments_of(record.sums_bytes);
  if (SegmentStore::segments_of(bytes.size()) > held + sums_.free_segments()) {
    ++counted_.refused_sums;
    return Stored::kNoRoom;
  }
  sums_.release(record.sums);
  record.sums = *sums_.write(bytes);
  record.sums_bytes = static_cast<std::uint32_t>(bytes.size());
  return Stored::kAnew;
}

/// Whether there were any.
bool GlobalMap::drop_sums(Record& record) noexcept {
  const bool any = record.sums != 0;
  sums_.release(record.sums);
  record.sums = 0;
  record.sums_bytes = 0;
  record.classes = 0;
  record.statistics = {};
  return any;
}

std::uint64_t GlobalMap::update_sums(std::uint32_t number) noexcept {
  Record& record = records_.at(number);
  agenda_.remove(records_, number);
  const BlockCoord block = unpack(BlockKey{record.key});
  content_.clear();
  std::memset(observers_.data(), 0, observers_.size());
  record.robots = 0;
  const std::uint64_t work = add_contributions(block, record.robots) + 1;
  const bool graph = belongs_to_graph(record.robots);
  const bool diffused = graph && config_.diffusion.mode != DiffusionMode::kNone;
  if (diffused) {
    if (config_.diffusion.mode == DiffusionMode::kPaper) add_priors();
    const std::uint64_t classes =
        (std::uint64_t{1} << static_cast<unsigned>(map_->num_components() - 1)) - 2;
    record.classes = content_.components() & classes;
    const Stored stored = store_sums(record);
    if (stored == Stored::kAnew) mark_halo(block, part_of(record));
    if (stored == Stored::kAsBefore)
      record.output_due ? mark(number, Agenda::kOutput) : moved(record);
    record.output_due = false;
    if (stored != Stored::kNoRoom) return work;
  }
  record.output_due = false;
  if (drop_sums(record)) mark_halo(block, part_of(record));
  if (graph && config_.diffusion.mode == DiffusionMode::kNone) record.statistics = measure_sums();
  const bool empty = !content_.any();
  write_content(record);
  moved(record);
  if (empty) close_record(number);
  return work + kBlockOctets;
}

}  // namespace tessera
