// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// From sums to the map that is read: blocks of the graph go through the diffusion.
#include <algorithm>

#include "tessera/fusion/global_map.hpp"

namespace tessera {

std::span<const std::byte> GlobalMap::read_sums(const Record& record) noexcept {
  const std::span<std::byte> bytes = packed_.first(record.sums_bytes);
  sums_.read(record.sums, bytes);
  return bytes;
}

/// Calls change(row, statistics) for the nodes of content_, and measures them before and after.
template <class Change>
GlobalMap::NodeStatistics GlobalMap::measure_nodes(Change&& change) noexcept {
  const auto fixed = [](double variance) { return static_cast<std::uint64_t>(variance * 0x1p40); };
  NodeStatistics statistics;
  const std::uint64_t unlabelled = std::uint64_t{1}
                                   << static_cast<unsigned>(map_->num_components() - 1);
  const std::uint64_t classes = content_.components() & ~unlabelled;
  for (std::uint64_t octets = content_.label_octets(); octets != 0; octets &= octets - 1) {
    const int corner = row_order_corner(std::countr_zero(octets));
    for (int v = 0; v < kOctetVoxels; ++v) {
      const int row = corner + row_order(0, v);
      bool node = false;
      for (std::uint64_t rest = classes; rest != 0 && !node; rest &= rest - 1)
        node = content_.count(std::countr_zero(rest), row) > 0.0F;
      if (!node) continue;
      ++statistics.nodes;
      statistics.variance_undiffused += fixed(estimate_at(row).variance);
      change(row, statistics);
      statistics.variance += fixed(estimate_at(row).variance);
    }
  }
  return statistics;
}

GlobalMap::NodeStatistics GlobalMap::measure_sums() noexcept {
  return measure_nodes([](int, NodeStatistics&) {});
}

/// The blocks of the graph in a box and as far around it as it depends on.
std::span<const std::uint32_t> GlobalMap::find_sums(const BlockBox& box,
                                                    std::uint64_t& classes) noexcept {
  const int reach = (brick_.halo() + kBlockEdge - 1) / kBlockEdge;
  std::size_t count = 0;
  for (int z = -reach; z < box.size[2] + reach; ++z) {
    for (int y = -reach; y < box.size[1] + reach; ++y) {
      for (int x = -reach; x < box.size[0] + reach; ++x) {
        const std::uint32_t number =
            find_record({box.first.x + x, box.first.y + y, box.first.z + z});
        if (number == 0 || records_.at(number).sums == 0) continue;
        near_blocks_[count++] = number;
        classes |= records_.at(number).classes;
      }
    }
  }
  return near_blocks_.first(count);
}

/// The nodes that a box of blocks depends on and their sums. False iff they are too many.
bool GlobalMap::gather(const BlockBox& box, std::uint64_t& work) noexcept {
  std::uint64_t classes = 0;
  const std::span<const std::uint32_t> found = find_sums(box, classes);
  work += near_blocks_.size();
  brick_.begin(box, classes);
  const auto for_sums = [&](auto&& visit) {
    for (const std::uint32_t number : found) {
      if (!brick_.fits()) return false;
      const Record& record = records_.at(number);
      const BlockCoord block = unpack(BlockKey{record.key});
      work += unpack_block(
          read_sums(record),
          [&](int row, int component, float sum) {
            if (((record.classes >> static_cast<unsigned>(component)) & 1U) == 0) return;
            const VoxelCoord voxel = voxel_of_row(block, row);
            if (brick_.contains(voxel)) visit(voxel, component, sum);
          },
          [](int, unsigned) {});
    }
    return brick_.fits();
  };
  if (!for_sums([&](VoxelCoord voxel, int, float) { brick_.mark(voxel); })) return false;
  brick_.number_nodes();
  return for_sums(
      [&](VoxelCoord voxel, int component, float sum) { brick_.set(voxel, component, sum); });
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

/// The box of those that wait for their output in the cube of so many blocks that a block is in:
/// they depend on much the same nodes.
BlockBox GlobalMap::waiting_around(BlockCoord block, int edge) const noexcept {
  const auto corner = [edge](std::int32_t x) {
    const std::int32_t remainder = x % edge;
    return x - remainder - (remainder < 0 ? edge : 0);
  };
  BlockCoord low = block;
  BlockCoord high = block;
  for_box({{corner(block.x), corner(block.y), corner(block.z)}, {edge, edge, edge}},
          [&](BlockCoord near) {
            const std::uint32_t number = find_record(near);
            if (number == 0 || !waits_for_output(records_.at(number))) return;
            low = {std::min(low.x, near.x), std::min(low.y, near.y), std::min(low.z, near.z)};
            high = {std::max(high.x, near.x), std::max(high.y, near.y), std::max(high.z, near.z)};
          });
  return {low, {high.x - low.x + 1, high.y - low.y + 1, high.z - low.z + 1}};
}

bool GlobalMap::waits_for_output(const Record& record) noexcept {
  return record.sums != 0 && record.link.list != 0 &&
         Agenda::work_of(record.link) == Agenda::kOutput;
}

/// Takes those that wait around a block off the agenda, to be brought up to date together.
std::uint64_t GlobalMap::begin_job(std::uint32_t number) noexcept {
  const BlockCoord block = unpack(BlockKey{records_.at(number).key});
  if (records_.at(number).sums == 0) {
    agenda_.remove(records_, number);
    moved(records_.at(number));
    return 1;
  }
  std::uint64_t work = box_blocks_.size();  // looked up
  BlockBox box = waiting_around(block, job_.edge);
  while (!gather(box, work)) {
    TESSERA_ASSERT(job_.edge > 1);
    job_.edge /= 2;
    box = waiting_around(block, job_.edge);
  }
  job_.first = job_.last = 0;
  for_box(box, [&](BlockCoord inner) {
    const std::uint32_t at = find_record(inner);
    if (at == 0 || !waits_for_output(records_.at(at))) return;
    agenda_.remove(records_, at);
    box_blocks_[job_.last++] = at;
  });
  job_.stage = Job::Stage::kLinking;
  return work;
}

/// The next quantum of the job.
std::uint64_t GlobalMap::go_on() noexcept {
  using Stage = Job::Stage;
  std::uint64_t work = 0;
  if (job_.stage == Stage::kLinking) {
    job_.stage = Stage::kIterating;
    if (brick_.start(work)) return work;
    // Too many edges: anew, in smaller parts.
    TESSERA_ASSERT(job_.edge > 1);
    job_.edge /= 2;
    job_.stage = Stage::kNone;
    const std::uint32_t again = box_blocks_[job_.first];
    while (job_.first != job_.last) mark(box_blocks_[job_.first++], Agenda::kOutput);
    // The same block first, for its box is the one that must be smaller.
    return waits_for_output(records_.at(again)) ? work + begin_job(again) : work;
  }
  if (job_.stage == Stage::kIterating) {
    if (!brick_.iterate(work)) job_.stage = Stage::kFinishing;
    return work + 1;
  }
  // Also if something arrived for it meanwhile: it is behind then, and will be due again, but a
  // block for which something always arrives must be seen.
  work += finish_block(records_.at(box_blocks_[job_.first++]));
  if (job_.first == job_.last) job_ = {};
  return work;
}

std::uint64_t GlobalMap::finish_block(Record& record) noexcept {
  const BlockCoord block = unpack(BlockKey{record.key});
  content_.clear();
  const std::uint32_t entries = unpack_block(
      read_sums(record),
      [&](int row, int component, float sum) {
        component == 0 ? content_.add_rest(row, sum) : content_.add(component, row, sum);
      },
      [&](int row, unsigned passes) { content_.add_passes(row, passes); });
  record.statistics = measure_nodes([&](int row, NodeStatistics& statistics) {
    diffuse_node(voxel_of_row(block, row), row, statistics);
  });
  write_content(record);
  moved(record);
  return entries;
}

void GlobalMap::diffuse_node(VoxelCoord node, int row, NodeStatistics& statistics) noexcept {
  const DiffusionBrick::NodeResult result = brick_.result(node);
  const std::span<const std::uint8_t> lanes = brick_.lanes();
  float total = 0.0F;
  for (std::size_t lane = 0; lane < lanes.size(); ++lane) total += result.z[lane];
  const bool keeps_evidence = config_.diffusion.mode == DiffusionMode::kContractive;
  const float scale = keeps_evidence ? result.sum / total : 1.0F;
  for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
    const float sigma = result.z[lane] * scale;
    if (sigma > 0.0F) content_.set(lanes[lane], row, sigma);
  }
  if (result.sum > statistics.largest_sum) statistics.largest_sum = result.sum;
  if (result.change > statistics.largest_change) statistics.largest_change = result.change;
}

Estimate GlobalMap::estimate_at(int row) const noexcept {
  const float free =
      static_cast<float>(content_.passes(row)) * config_.map.free_weight * config_.diffusion.omega;
  CountSummary summary(map_->num_components(), free);
  for (std::uint64_t rest = content_.components(); rest != 0; rest &= rest - 1) {
    const int component = std::countr_zero(rest);
    summary.add(component, content_.count(component, row));
  }
  summary.add_rest(content_.rest(row));
  return summary.estimate(config_.map.prior);
}

/// Passes are kept in a byte: where there are more, all of the voxel's evidence gives way in
/// proportion, as at a local map's cap.
void GlobalMap::scale_to_passes() noexcept {
  constexpr float kMost = 255.0F;
  const float omega = config_.diffusion.omega;
  for (std::uint64_t octets = content_.pass_octets(); octets != 0; octets &= octets - 1) {
    const int corner = row_order_corner(std::countr_zero(octets));
    for (int v = 0; v < kOctetVoxels; ++v) {
      const int row = corner + row_order(0, v);
      const unsigned counted = content_.passes(row);
      if (counted == 0) continue;
      const float passes = static_cast<float>(counted) * omega;
      if (passes <= kMost) {
        const auto rounded =
            static_cast<std::uint16_t>(floor_to_int(static_cast<double>(passes) + 0.5));
        content_.set_passes(row, rounded != 0 ? rounded : std::uint16_t{1});
        continue;
      }
      ++counted_.saturated_voxels;
      const float scale = kMost / passes;
      for (std::uint64_t rest = content_.components(); rest != 0; rest &= rest - 1) {
        const int component = std::countr_zero(rest);
        if (content_.count(component, row) > 0.0F)
          content_.set(component, row, content_.count(component, row) * scale);
      }
      if (content_.any_rest()) content_.set_rest(row, content_.rest(row) * scale);
      content_.set_passes(row, 255);
    }
  }
}

}  // namespace tessera
