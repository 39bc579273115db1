// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/fused_block.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "tessera/base/internal/bits.hpp"
#include "tessera/base/internal/lanes.hpp"
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

namespace {

/// Eight voxels along x, by pairs.
using EightDoubles = std::array<Double2, 4>;

EightDoubles widen_eight(const float* from) noexcept {
  EightDoubles wide;
  for (std::size_t i = 0; i < wide.size(); ++i)
    wide[i] = Double2{static_cast<double>(from[2 * i]), static_cast<double>(from[2 * i + 1])};
  return wide;
}
/// A function of a block's content for each row of voxels along x.
class RowStatistics {
 public:
  /// unlabelled: the component of labels of no class.
  RowStatistics(const BlockContent& content, int unlabelled, double prior, float free_weight,
                float omega) noexcept
      : content_(content),
        labels_(content.labels()),
        unlabelled_(static_cast<std::size_t>(unlabelled)),
        prior_(prior),
        free_weight_(free_weight),
        omega_(omega) {}

  /// Which of the eight have evidence of a class, a bit each. row: the first one's row order.
  [[nodiscard]] unsigned nodes(std::size_t row) const noexcept {
    unsigned nodes = 0;
    for_counts(row, [&](std::size_t component, const float* counts) {
      if (component != unlabelled_) nodes |= bits_above(counts, 0.0F);
    });
    return nodes;
  }
  /// The variances of some of the eight that are nodes (CountSummary::estimate), in 2^-40, added
  /// up.
  [[nodiscard]] std::uint64_t variance(std::size_t row, unsigned nodes) const noexcept {
    std::array<float, 8> free;   // NOLINT: all of it is written
    std::array<float, 8> rests;  // NOLINT: all of it is written
    for (std::size_t i = 0; i < free.size(); ++i) {
      const int at = static_cast<int>(row + i);
      free[i] = static_cast<float>(content_.passes(at)) * free_weight_ * omega_;
      rests[i] = content_.rest(at);
    }
    EightDoubles total = widen_eight(free.data());
    const auto add = [&](const float* counts) {
      const EightDoubles wide = widen_eight(counts);
      for (std::size_t i = 0; i < total.size(); ++i) total[i] += wide[i];
    };
    std::array<float, 8> most{};
    for_counts(row, [&](std::size_t component, const float* counts) {
      add(counts);
      if (component == unlabelled_) return;
      for (std::size_t i = 0; i < most.size(); ++i)
        most[i] = counts[i] > most[i] ? counts[i] : most[i];
    });
    add(rests.data());
    const double none = static_cast<double>(unlabelled_ + 1) * prior_;
    const EightDoubles wide_most = widen_eight(most.data());
    std::array<double, 8> variances;  // NOLINT: all of it is written
    for (std::size_t i = 0; i < total.size(); ++i) {
      const Double2 concentration = Double2{none, none} + total[i];
      const Double2 probability = (Double2{prior_, prior_} + wide_most[i]) / concentration;
      const Double2 one{1.0, 1.0};
      const Double2 variance = probability * (one - probability) / (concentration + one);
      variances[2 * i] = variance[0] * 0x1p40;
      variances[2 * i + 1] = variance[1] * 0x1p40;
    }
    std::uint64_t sum = 0;
    for (; nodes != 0; nodes &= nodes - 1)
      sum += static_cast<std::uint64_t>(
          static_cast<std::int64_t>(variances[static_cast<std::size_t>(std::countr_zero(nodes))]));
    return sum;
  }

 private:
  /// Calls visit(component, counts of the eight) for the components that any of them may have, by
  /// ascending component.
  template <class Visit>
  void for_counts(std::size_t row, Visit&& visit) const noexcept {
    for (std::uint64_t rest = content_.components(); rest != 0; rest &= rest - 1) {
      const auto component = static_cast<std::size_t>(std::countr_zero(rest));
      if (((labels_.touched[component] >> (row / 8)) & 1U) != 0)
        visit(component, labels_.sums + component * labels_.component + row);
    }
  }

  const BlockContent& content_;
  BlockEvidence labels_;
  std::size_t unlabelled_;
  double prior_;
  float free_weight_;
  float omega_;
};

}  // namespace

NodeStatistics FusedBlock::measure() const noexcept {
  NodeStatistics statistics;
  const RowStatistics rows(content_, num_components_ - 1, prior_, free_weight_, omega_);
  for (std::size_t row = 0; row < kBlockVoxels; row += kBlockEdge) {
    const unsigned nodes = rows.nodes(row);
    if (nodes == 0) continue;
    statistics.nodes += static_cast<std::uint32_t>(count_ones(nodes));
    statistics.variance += rows.variance(row, nodes);
  }
  statistics.variance_undiffused = statistics.variance;
  return statistics;
}

NodeStatistics FusedBlock::diffuse(BlockCoord block, DiffusionBrick& brick,
                                   std::uint64_t& work) noexcept {
  NodeStatistics statistics;
  const RowStatistics rows(content_, num_components_ - 1, prior_, free_weight_, omega_);
  for (std::size_t row = 0; row < kBlockVoxels; row += kBlockEdge) {
    const unsigned nodes = rows.nodes(row);
    if (nodes == 0) continue;
    statistics.nodes += static_cast<std::uint32_t>(count_ones(nodes));
    statistics.variance_undiffused += rows.variance(row, nodes);
    diffuse_row(static_cast<int>(row), nodes, block, brick, work, statistics);
    statistics.variance += rows.variance(row, nodes);
  }
  return statistics;
}

/// The nodes of a row, a bit each.
void FusedBlock::diffuse_row(int row, unsigned nodes, BlockCoord block, DiffusionBrick& brick,
                             std::uint64_t& work, NodeStatistics& statistics) noexcept {
  std::array<const float*, kBlockEdge> sigma{};
  std::array<int, kBlockEdge> rows{};
  std::size_t count = 0;
  for (; nodes != 0; nodes &= nodes - 1, ++count) {
    rows[count] = row + std::countr_zero(nodes);
    const DiffusionBrick::NodeResult result = brick.result(voxel_of_row(block, rows[count]), work);
    sigma[count] = result.sigma;
    if (result.sum > statistics.largest_sum) statistics.largest_sum = result.sum;
    if (result.change > statistics.largest_change) statistics.largest_change = result.change;
  }
  const std::span<const std::uint8_t> lanes = brick.lanes();
  for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
    float most = 0.0F;
    for (std::size_t i = 0; i < count; ++i) most = std::max(most, sigma[i][lane]);
    if (!(most > 0.0F)) continue;
    // Where the others have nothing of the class they had nothing before.
    for (std::size_t i = 0; i < count; ++i) content_.set(lanes[lane], rows[i], sigma[i][lane]);
  }
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
