// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/diffusion_brick.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "tessera/base/internal/bits.hpp"
#include "tessera/semantics/evidence.hpp"

namespace tessera {

namespace {

/// Evidence at which a node is half sure of its label.
constexpr float kHalfSure = 4.0F;
/// Evidence at which a node's own weight counts half: what was seen often does not drown the rest.
constexpr float kLoud = 10.0F;
// Sums come from packed blocks, and a node has one at least: its inverse is finite, and what it is
// multiplied with, a sum of all lanes at most, leaves it finite.
static_assert(1.0F / kLeastCount * (kLargestCount * static_cast<float>(kMaxComponents)) <
              std::numeric_limits<float>::max());

}  // namespace

Result<DiffusionBrick> DiffusionBrick::make(Arena& arena, const DiffusionConfig& config,
                                            double resolution_m, int num_components) noexcept {
  DiffusionBrick brick;
  brick.config_ = config;
  const DiffusionStencil stencil(static_cast<double>(config.length_m) / resolution_m);
  for (std::size_t i = 0; i < brick.spread_.size(); ++i)
    brick.spread_[i] = spread_lanes(i + 1, LaneWidth::kWidest);
  brick.halo_ = halo_of(config, stencil);
  brick.reach_ = stencil.reach();
  if (brick.halo_ > DiffusionConfig::kMostHalo) return Status::kInvalidArgument;
  const Capacity capacity = capacity_of(config, stencil, num_components);
  brick.rows_ = arena.take<Row>(kRows);
  brick.first_ = arena.take<std::uint32_t>(kRows);
  brick.offsets_ = arena.take<Offset>(capacity.offsets);
  brick.witnesses_ = arena.take<WitnessRow>(capacity.witnesses);
  const auto take = [&arena]<class T>(std::span<T>& span, std::size_t count) {
    const std::span<std::byte> bytes = arena.take_untouched(arena_bytes<T>(count));
    if (!bytes.empty()) span = {reinterpret_cast<T*>(bytes.data()), count};
    return !bytes.empty();
  };
  const bool fits = take(brick.node_of_cell_, capacity.cells) &&
                    take(brick.floats_, capacity.floats) && take(brick.nodes_, capacity.nodes) &&
                    take(brick.voices_, capacity.nodes) && take(brick.edges_, capacity.edges);
  if (fits) std::memset(brick.node_of_cell_.data(), 0xff, brick.node_of_cell_.size_bytes());
  if (!fits || brick.rows_.empty() || brick.first_.empty() || brick.offsets_.empty() ||
      brick.witnesses_.empty())
    return Status::kResourceExhausted;
  std::size_t count = 0;
  stencil.for_edges([&](int dx, int dy, int dz, float weight) {
    brick.offsets_[count++] = {static_cast<std::int8_t>(dx), static_cast<std::int8_t>(dy),
                               static_cast<std::int8_t>(dz), weight, 0};
  });
  brick.offsets_ = brick.offsets_.first(count);
  count = 0;
  stencil.for_witnesses([&](int dy, int dz, int width) {
    brick.witnesses_[count++] = {
        static_cast<std::int8_t>(dy), static_cast<std::int8_t>(dz),
        static_cast<std::uint8_t>(width), 0,
        (std::uint64_t{1} << (2U * static_cast<unsigned>(width) + 1U)) - 1};
  });
  brick.witnesses_ = brick.witnesses_.first(count);
  return brick;
}

/// Sets what the cells of marked voxels say, in the order of (z, y, x).
template <class Number>
void DiffusionBrick::number_cells(Number&& number) noexcept {
  const auto rows = static_cast<std::size_t>(edge_[1] * edge_[2]);
  for (std::size_t i = 0; i < rows; ++i) {
    std::uint32_t* const row = node_of_cell_.data() + i * static_cast<std::size_t>(edge_[0]);
    for (std::size_t word = 0; word < rows_[i].size(); ++word) {
      for (std::uint64_t bits = rows_[i][word]; bits != 0; bits &= bits - 1)
        row[64 * word + static_cast<std::size_t>(std::countr_zero(bits))] = number();
    }
  }
}

void DiffusionBrick::begin(const BlockBox& box, std::uint64_t classes) noexcept {
  // Cells without a node say so from one box to the next: there are many more of them.
  if (numbered_) number_cells([] { return kNoNode; });
  numbered_ = false;
  const VoxelCoord corner = voxel_at(box.first, 0, 0);
  origin_ = {corner.x - halo_, corner.y - halo_, corner.z - halo_};
  for (std::size_t i = 0; i < 3; ++i) edge_[i] = box.size[i] * kBlockEdge + 2 * halo_;
  std::memset(rows_.data(), 0, static_cast<std::size_t>(edge_[1] * edge_[2]) * sizeof(rows_[0]));
  for (Offset& offset : offsets_)
    offset.cells = (offset.dz * edge_[1] + offset.dy) * edge_[0] + offset.dx;
  for (WitnessRow& row : witnesses_) row.rows = row.dz * edge_[1] + row.dy;
  node_count_ = 0;
  lanes_ = 0;
  for (std::uint64_t rest = classes; rest != 0; rest &= rest - 1) {
    const auto component = static_cast<std::size_t>(std::countr_zero(rest));
    lane_of_[component] = static_cast<std::uint8_t>(lanes_);
    components_[lanes_++] = static_cast<std::uint8_t>(component);
  }
  stride_ = align_up(lanes_, 4);
}

void DiffusionBrick::number_nodes() noexcept {
  TESSERA_ASSERT(fits());
  const auto rows = static_cast<std::size_t>(edge_[1] * edge_[2]);
  node_count_ = 0;
  for (std::size_t i = 0; i < rows; ++i) {
    first_[i] = static_cast<std::uint32_t>(node_count_);
    for (const std::uint64_t word : rows_[i])
      node_count_ += static_cast<std::size_t>(count_ones(word));
  }
  const std::size_t floats = node_count_ * stride_;
  sums_ = floats_.data();
  z_ = sums_ + floats;
  other_z_ = z_ + floats;
  std::memset(sums_, 0, floats * sizeof(float));
  std::uint32_t node = 0;
  number_cells([&node] { return node++; });
  numbered_ = true;
}

/// Sums go from lane to lane, so that lanes of classes that a node does not have change nothing.
void DiffusionBrick::describe_nodes() noexcept {
  for (std::size_t i = 0; i < node_count_; ++i) {
    const float* const b = sums_ + i * stride_;
    Voice voice{};
    float sum = 0.0F;
    float most = 0.0F;
    for (std::size_t lane = 0; lane < lanes_; ++lane) {
      sum += b[lane];
      if (b[lane] > most) {
        most = b[lane];
        voice.label = static_cast<std::uint32_t>(lane);
      }
    }
    voice.inverse = 1.0F / sum;
    voice.sure = sum / (sum + kHalfSure);
    voice.loudness = kLoud / (kLoud + sum);
    voices_[i] = voice;
    nodes_[i] = {};
    nodes_[i].sum = sum;
  }
}

namespace {

/// The bits of a word from one number to before another; of those that it has.
constexpr std::uint64_t bits_within(int from, int to) noexcept {
  const auto below = [](int bits) {
    if (bits <= 0) return std::uint64_t{0};
    return bits < 64 ? (std::uint64_t{1} << static_cast<unsigned>(bits)) - 1 : ~std::uint64_t{0};
  };
  return below(to) & ~below(from);
}

}  // namespace

/// Calls visit(node, x, y, z) for the nodes that are at least margin from the brick's border, while
/// it returns true.
template <class Visit>
void DiffusionBrick::for_nodes(int margin, Visit&& visit) const noexcept {
  const Row inside{bits_within(margin, edge_[0] - margin),
                   bits_within(margin - 64, edge_[0] - margin - 64)};
  for (int z = margin; z < edge_[2] - margin; ++z) {
    for (int y = margin; y < edge_[1] - margin; ++y) {
      const std::size_t row = row_at(y, z);
      std::size_t before = first_[row];
      for (std::size_t word = 0; word < inside.size(); ++word) {
        const std::uint64_t all = rows_[row][word];
        std::uint64_t bits = all & inside[word];
        // Those left out at this end come before all others of the word.
        std::size_t node = before;
        if (bits != 0)
          node += static_cast<std::size_t>(count_ones(all & ((bits & (0 - bits)) - 1)));
        for (; bits != 0; bits &= bits - 1, ++node) {
          const int x = static_cast<int>(64 * word) + std::countr_zero(bits);
          if (!visit(node, x, y, z)) return;
        }
        before += static_cast<std::size_t>(count_ones(all));
      }
    }
  }
}

bool DiffusionBrick::link_nodes() noexcept {
  edge_count_ = 0;
  bool fits = true;
  for_nodes(reach_, [&](std::size_t node, int x, int y, int z) {
    fits = link(node, cell_at(x, y, z));
    return fits;
  });
  return fits;
}

/// Calls visit(first, last) for each row's nodes that are at least margin from the brick's border.
template <class Visit>
void DiffusionBrick::for_runs(int margin, Visit&& visit) const noexcept {
  const Row before{bits_within(0, margin), bits_within(-64, margin - 64)};
  const Row inside{bits_within(margin, edge_[0] - margin),
                   bits_within(margin - 64, edge_[0] - margin - 64)};
  const auto count = [](const Row& row, const Row& mask) {
    return static_cast<std::size_t>(count_ones(row[0] & mask[0]) + count_ones(row[1] & mask[1]));
  };
  for (int z = margin; z < edge_[2] - margin; ++z) {
    for (int y = margin; y < edge_[1] - margin; ++y) {
      const std::size_t row = row_at(y, z);
      const Row& bits = rows_[row];
      if (((bits[0] & inside[0]) | (bits[1] & inside[1])) == 0) continue;
      const std::size_t first = first_[row] + count(bits, before);
      visit(first, first + count(bits, inside));
    }
  }
}

/// Z of the nodes at least margin from the border, from that of nodes reach nearer to it: eq. (15),
/// or Z <- B + alpha P Z.
// NOLINTNEXTLINE(readability-non-const-parameter): a run writes to it
std::uint64_t DiffusionBrick::step(const float* from, float* to, int margin) noexcept {
  constexpr std::size_t kMostLanes = 16;
  std::uint64_t visited = 0;
  for_runs(margin, [&](std::size_t first, std::size_t last) {
    const DiffusionRun run{.nodes = nodes_.data(),
                           .edges = edges_.data(),
                           .from = from,
                           .sums = sums_,
                           .to = to,
                           .stride = stride_,
                           .first = first,
                           .last = last,
                           .adds_own = config_.mode == DiffusionMode::kPaper};
    for (std::size_t lane = 0; lane < stride_; lane += kMostLanes)
      spread_[(std::min(stride_ - lane, kMostLanes) - 1) / 4](run, lane);
    const Node& end = nodes_[last - 1];
    visited += end.first_edge + end.edges - nodes_[first].first_edge + (last - first);
  });
  return visited;
}

void DiffusionBrick::note_changes(const float* before, const float* after, int margin) noexcept {
  for_runs(margin, [&](std::size_t first, std::size_t last) {
    for (std::size_t at = first; at < last; ++at) {
      float change = 0.0F;
      for (std::size_t lane = at * stride_; lane < at * stride_ + lanes_; ++lane)
        change += std::fabs(after[lane] - before[lane]);
      nodes_[at].change = change;
    }
  });
}

int DiffusionBrick::iterations() const noexcept {
  if (config_.mode == DiffusionMode::kNone) return 0;
  return config_.iterations - (config_.mode == DiffusionMode::kPaper ? 1 : 0);
}

bool DiffusionBrick::start(std::uint64_t& work) noexcept {
  describe_nodes();
  work += node_count_ + static_cast<std::uint64_t>(edge_[1] * edge_[2]) / 16;
  result_ = sums_;
  iterated_ = 0;
  if (iterations() == 0) return true;
  const bool linked = link_nodes();
  work += edge_count_;
  return linked;
}

bool DiffusionBrick::iterate(std::uint64_t& work) noexcept {
  if (iterated_ == iterations()) return false;
  ++iterated_;
  work += static_cast<std::uint64_t>(edge_[1] * edge_[2]) / 16;  // rows without nodes
  const float* const before = result_;
  work += step(before, z_, iterated_ * reach_);
  result_ = z_;
  std::swap(z_, other_z_);
  if (iterated_ < iterations()) return true;
  note_changes(before, result_, halo_);
  return false;
}

}  // namespace tessera
