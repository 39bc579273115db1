// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/output_job.hpp"

#include <algorithm>

#include "tessera/base/internal/put_in_place.hpp"

namespace tessera {

Result<OutputJob> OutputJob::make(Arena& arena, const DiffusionConfig& config, double resolution_m,
                                  int num_components) noexcept {
  OutputJob made;
  const Status status = put_in_place(made.brick_, [&] {
    return DiffusionBrick::make(arena, config, resolution_m, num_components);
  });
  if (status != Status::kOk) return status;
  made.blocks_ = arena.take<std::uint32_t>(cube(DiffusionBrick::kMostBlocks));
  made.near_ = arena.take<std::uint32_t>(cube(DiffusionBrick::kMostEdge / kBlockEdge));
  if (made.blocks_.empty() || made.near_.empty()) return Status::kResourceExhausted;
  return made;
}

/// The blocks of the graph in a box and as far around it as it depends on.
std::span<const std::uint32_t> OutputJob::find_sums(const GlobalRecords& records,
                                                    const BlockBox& box,
                                                    std::uint64_t& classes) noexcept {
  const int r = reach();
  std::size_t count = 0;
  for (int z = -r; z < box.size[2] + r; ++z) {
    for (int y = -r; y < box.size[1] + r; ++y) {
      for (int x = -r; x < box.size[0] + r; ++x) {
        const std::uint32_t number =
            records.find_with_sums({box.first.x + x, box.first.y + y, box.first.z + z});
        if (number == 0) continue;
        near_[count++] = number;
        classes |= records.at(number).sums.classes;
      }
    }
  }
  return near_.first(count);
}

/// The nodes that a box of blocks depends on and their sums. False iff they are too many.
bool OutputJob::gather(const GlobalRecords& records, SumStore& sums, const BlockBox& box,
                       std::uint64_t& work) noexcept {
  std::uint64_t classes = 0;
  const std::span<const std::uint32_t> found = find_sums(records, box, classes);
  work += near_.size();
  brick_.begin(box, classes);
  // Calls begin(block, its sums) for each block, label(row, component, sum) for its voxels'
  // classes, and end().
  const auto for_sums = [&](auto&& begin, auto&& label, auto&& end) {
    for (const std::uint32_t number : found) {
      if (!brick_.fits()) return false;
      const StoredSums& stored = records.at(number).sums;
      begin(records.block_of(number));
      work += unpack_block(
          sums.read(stored),
          [&](int row, int component, float sum) {
            if (((stored.classes >> static_cast<unsigned>(component)) & 1U) != 0)
              label(row, component, sum);
          },
          [](int, unsigned) {});
      end();
    }
    return brick_.fits();
  };
  BlockCoord block;
  VoxelMask contained{};
  VoxelMask nodes{};
  const auto begin_marking = [&](BlockCoord next) {
    block = next;
    nodes = {};
  };
  const auto mark = [&](int row, int, float) { add_row(nodes, row); };
  const auto end_marking = [&] {
    contained = brick_.contained(block);
    for (std::size_t z = 0; z < nodes.size(); ++z) nodes[z] &= contained[z];
    brick_.mark(block, nodes);
  };
  if (!for_sums(begin_marking, mark, end_marking)) return false;
  brick_.number_nodes();
  int last_row = -1;
  float* lanes = nullptr;
  const auto begin_setting = [&](BlockCoord next) {
    block = next;
    contained = brick_.contained(block);
    last_row = -1;
  };
  const auto set = [&](int row, int component, float sum) {
    if (!has_row(contained, row)) return;
    if (row != last_row) lanes = brick_.sums_of(voxel_of_row(block, row));
    last_row = row;
    lanes[brick_.lane_of(component)] = sum;
  };
  return for_sums(begin_setting, set, [] {});
}

namespace {

template <class Visit>
void for_box(const BlockBox& box, Visit&& visit) noexcept {
  for (int z = 0; z < box.size[2]; ++z) {
    for (int y = 0; y < box.size[1]; ++y) {
      for (int x = 0; x < box.size[0]; ++x)
        visit(BlockCoord{box.first.x + x, box.first.y + y, box.first.z + z});
    }
  }
}

}  // namespace

/// The box of those that wait for their output in the cube of so many blocks that a block is in.
BlockBox OutputJob::waiting_around(const GlobalRecords& records, BlockCoord block,
                                   int edge) noexcept {
  const auto corner = [edge](std::int32_t x) {
    const std::int32_t remainder = x % edge;
    return x - remainder - (remainder < 0 ? edge : 0);
  };
  BlockCoord low = block;
  BlockCoord high = block;
  for_box({{corner(block.x), corner(block.y), corner(block.z)}, {edge, edge, edge}},
          [&](BlockCoord near) {
            if (records.find_waiting_for_output(near) == 0) return;
            low = {std::min(low.x, near.x), std::min(low.y, near.y), std::min(low.z, near.z)};
            high = {std::max(high.x, near.x), std::max(high.y, near.y), std::max(high.z, near.z)};
          });
  return {low, {high.x - low.x + 1, high.y - low.y + 1, high.z - low.z + 1}};
}

std::uint64_t OutputJob::begin(GlobalRecords& records, SumStore& sums,
                               std::uint32_t number) noexcept {
  const BlockCoord block = records.block_of(number);
  std::uint64_t work = blocks_.size();  // looked up
  BlockBox box = waiting_around(records, block, edge_);
  while (!gather(records, sums, box, work)) {
    TESSERA_ASSERT(edge_ > 1);
    edge_ /= 2;
    box = waiting_around(records, block, edge_);
  }
  first_ = last_ = 0;
  for_box(box, [&](BlockCoord inner) {
    const std::uint32_t at = records.find_waiting_for_output(inner);
    if (at == 0) return;
    records.take_off(at);
    blocks_[last_++] = at;
  });
  stage_ = Stage::kLinking;
  return work;
}

/// Too many edges: anew, in smaller parts.
std::uint64_t OutputJob::begin_smaller(GlobalRecords& records, SumStore& sums) noexcept {
  TESSERA_ASSERT(edge_ > 1);
  edge_ /= 2;
  stage_ = Stage::kNone;
  const std::uint32_t again = blocks_[first_];
  while (first_ != last_) records.mark(blocks_[first_++], Agenda::kOutput);
  // The same block first, for its box is the one that must be smaller.
  return records.waits_for_output(again) ? begin(records, sums, again) : 0;
}

std::uint64_t OutputJob::work_on(GlobalRecords& records, SumStore& sums) noexcept {
  std::uint64_t work = 0;
  if (stage_ == Stage::kLinking) {
    stage_ = Stage::kIterating;
    if (brick_.start(work)) return work;
    return work + begin_smaller(records, sums);
  }
  if (!brick_.iterate(work)) stage_ = Stage::kFinishing;
  return work + 1;
}

void OutputJob::done() noexcept {
  if (++first_ != last_) return;
  stage_ = Stage::kNone;
  edge_ = DiffusionBrick::kMostBlocks;
  first_ = last_ = 0;
}

}  // namespace tessera
