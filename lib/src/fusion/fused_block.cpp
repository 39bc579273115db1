// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/fused_block.hpp"

#include <bit>

#include "tessera/base/internal/put_in_place.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace tessera {

Result<FusedBlock> FusedBlock::make(Arena& arena, const GlobalMapConfig& config,
                                    int num_components) noexcept {
  FusedBlock made;
  const Status status =
      put_in_place(made.content_, [&] { return BlockContent::make(arena, num_components); });
  if (status != Status::kOk) return status;
  made.num_components_ = num_components;
  made.omega_ = config.diffusion.omega;
  made.free_weight_ = config.map.free_weight;
  made.prior_ = config.map.prior;
  return made;
}

std::uint32_t FusedBlock::take(std::span<const std::byte> sums) noexcept {
  content_.clear();
  return unpack_block(
      sums,
      [&](int row, int component, float sum) {
        component == 0 ? content_.add_rest(row, sum) : content_.add(component, row, sum);
      },
      [&](int row, unsigned passes) { content_.add_passes(row, passes); });
}

/// Rows of voxels that have evidence of a class.
template <class Visit>
void FusedBlock::for_nodes(Visit&& visit) const noexcept {
  const std::uint64_t unlabelled = std::uint64_t{1} << static_cast<unsigned>(num_components_ - 1);
  const std::uint64_t classes = content_.components() & ~unlabelled;
  for (std::uint64_t octets = content_.label_octets(); octets != 0; octets &= octets - 1) {
    const int corner = row_order_corner(std::countr_zero(octets));
    for (int v = 0; v < kOctetVoxels; ++v) {
      const int row = corner + row_order(0, v);
      bool node = false;
      for (std::uint64_t rest = classes; rest != 0 && !node; rest &= rest - 1)
        node = content_.count(std::countr_zero(rest), row) > 0.0F;
      if (node) visit(row);
    }
  }
}

NodeStatistics FusedBlock::measure() const noexcept {
  NodeStatistics statistics;
  for_nodes([&](int row) {
    ++statistics.nodes;
    statistics.variance += variance_at(row);
  });
  statistics.variance_undiffused = statistics.variance;
  return statistics;
}

NodeStatistics FusedBlock::diffuse(BlockCoord block, DiffusionBrick& brick,
                                   std::uint64_t& work) noexcept {
  NodeStatistics statistics;
  for_nodes([&](int row) {
    ++statistics.nodes;
    statistics.variance_undiffused += variance_at(row);
    diffuse_node(row, brick.result(voxel_of_row(block, row), work), brick.lanes(), statistics);
    statistics.variance += variance_at(row);
  });
  return statistics;
}

void FusedBlock::diffuse_node(int row, const DiffusionBrick::NodeResult& result,
                              std::span<const std::uint8_t> lanes,
                              NodeStatistics& statistics) noexcept {
  for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
    const float sigma = result.sigma[lane];
    if (sigma > 0.0F) content_.set(lanes[lane], row, sigma);
  }
  if (result.sum > statistics.largest_sum) statistics.largest_sum = result.sum;
  if (result.change > statistics.largest_change) statistics.largest_change = result.change;
}

/// In 2^-40.
std::uint64_t FusedBlock::variance_at(int row) const noexcept {
  const float free = static_cast<float>(content_.passes(row)) * free_weight_ * omega_;
  CountSummary summary(num_components_, free);
  for (std::uint64_t rest = content_.components(); rest != 0; rest &= rest - 1) {
    const int component = std::countr_zero(rest);
    summary.add(component, content_.count(component, row));
  }
  summary.add_rest(content_.rest(row));
  const double variance = summary.estimate(prior_).variance;
  return static_cast<std::uint64_t>(variance * 0x1p40);
}

std::uint64_t FusedBlock::scale_to_passes() noexcept {
  constexpr float kMost = 255.0F;
  std::uint64_t saturated = 0;
  for (std::uint64_t octets = content_.pass_octets(); octets != 0; octets &= octets - 1) {
    const int corner = row_order_corner(std::countr_zero(octets));
    for (int v = 0; v < kOctetVoxels; ++v) {
      const int row = corner + row_order(0, v);
      const unsigned counted = content_.passes(row);
      if (counted == 0) continue;
      const float passes = static_cast<float>(counted) * omega_;
      if (passes <= kMost) {
        const auto rounded =
            static_cast<std::uint16_t>(floor_to_int(static_cast<double>(passes) + 0.5));
        content_.set_passes(row, rounded != 0 ? rounded : std::uint16_t{1});
        continue;
      }
      ++saturated;
      scale(row, kMost / passes);
      content_.set_passes(row, 255);
    }
  }
  return saturated;
}

void FusedBlock::scale(int row, float factor) noexcept {
  for (std::uint64_t rest = content_.components(); rest != 0; rest &= rest - 1) {
    const int component = std::countr_zero(rest);
    if (content_.count(component, row) > 0.0F)
      content_.set(component, row, content_.count(component, row) * factor);
  }
  if (content_.any_rest()) content_.set_rest(row, content_.rest(row) * factor);
}

}  // namespace tessera
