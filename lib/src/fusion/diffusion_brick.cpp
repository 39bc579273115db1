// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/diffusion_brick.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "four_nodes.hpp"
#include "tessera/base/internal/bits.hpp"

namespace tessera {

Result<DiffusionBrick> DiffusionBrick::make(Arena& arena, const DiffusionConfig& config,
                                            double resolution_m, int num_components) noexcept {
  DiffusionBrick brick;
  brick.config_ = config;
  const DiffusionStencil stencil(static_cast<double>(config.length_m) / resolution_m);
  for (std::size_t i = 0; i < brick.spread_.size(); ++i)
    brick.spread_[i] = spread_lanes(i + 1, LaneWidth::kWidest);
  brick.most_edges_ = align_up(static_cast<std::size_t>(stencil.edges()), 4);
  brick.halo_ = halo_of(config, stencil);
  brick.reach_ = stencil.reach();
  if (brick.halo_ > DiffusionConfig::kMostHalo) return Status::kInvalidArgument;
  const Capacity capacity = capacity_of(config, stencil, num_components);
  brick.rows_ = arena.take<Row>(kRows);
  brick.first_ = arena.take<std::uint32_t>(kRows);
  brick.links_ = arena.take<LinkCells>(capacity.links);
  brick.link_weights_ = arena.take<LinkWeights>(capacity.links);
  brick.linked_rows_ = arena.take<LinkRow>(capacity.links);
  brick.witnesses_ = arena.take<WitnessRow>(capacity.witnesses);
  const auto take = [&arena]<class T>(std::span<T>& span, std::size_t count) {
    const std::span<std::byte> bytes = arena.take_untouched(arena_bytes<T>(count));
    if (!bytes.empty()) span = {reinterpret_cast<T*>(bytes.data()), count};
    return !bytes.empty();
  };
  const std::size_t described = capacity.nodes + kBehindNodes;
  const bool fits = take(brick.ranks_, capacity.cells) &&
                    take(brick.floats_, capacity.floats + kBehindFloats) &&
                    take(brick.nodes_, capacity.nodes) && take(brick.sure_, described) &&
                    take(brick.loudness_, described) && take(brick.labels_, described) &&
                    take(brick.edges_, capacity.edges) && take(brick.weights_, capacity.edges);
  if (!fits || brick.rows_.empty() || brick.first_.empty() || brick.links_.empty() ||
      brick.link_weights_.empty() || brick.linked_rows_.empty() || brick.witnesses_.empty())
    return Status::kResourceExhausted;
  brick.floats_ = brick.floats_.first(capacity.floats);
  std::size_t count = 0;
  stencil.for_links([&](const LinkCells& cells) {
    brick.links_[count] = cells;
    brick.link_weights_[count++] = pack_weights(cells);
  });
  brick.links_ = brick.links_.first(count);
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

void DiffusionBrick::begin(const BlockBox& box, std::uint64_t classes) noexcept {
  const VoxelCoord corner = voxel_at(box.first, 0, 0);
  origin_ = {corner.x - halo_, corner.y - halo_, corner.z - halo_};
  for (std::size_t i = 0; i < 3; ++i) edge_[i] = box.size[i] * kBlockEdge + 2 * halo_;
  std::memset(rows_.data(), 0, static_cast<std::size_t>(edge_[1] * edge_[2]) * sizeof(rows_[0]));
  width_ = width_of(static_cast<std::size_t>(edge_[0]));
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

VoxelMask DiffusionBrick::contained(BlockCoord block) const noexcept {
  const VoxelCoord last{origin_.x + edge_[0] - 1, origin_.y + edge_[1] - 1,
                        origin_.z + edge_[2] - 1};
  return voxels_within(block, origin_, last);
}

void DiffusionBrick::mark(BlockCoord block, const VoxelMask& nodes) noexcept {
  const VoxelCoord corner = voxel_at(block, 0, 0) - origin_;
  for (std::int32_t z = 0; z < kBlockEdge; ++z) {
    std::uint64_t slice = nodes[static_cast<std::size_t>(z)];
    node_count_ += static_cast<std::size_t>(count_ones(slice));
    for (std::int32_t y = corner.y; slice != 0; ++y, slice >>= 8U) {
      std::uint64_t bits = slice & 0xffU;
      if (bits == 0) continue;
      // Those of a block that begins before the brick are farther to the right.
      bits >>= corner.x < 0 ? static_cast<unsigned>(-corner.x) : 0U;
      const auto x = static_cast<unsigned>(std::max<std::int32_t>(corner.x, 0));
      Row& row = rows_[row_at(y, corner.z + z)];
      row[x / 64] |= bits << (x % 64);
      if (x % 64 > 56) row[x / 64 + 1] |= bits >> (64 - x % 64);
    }
  }
}

/// Counts the nodes before each cell of a row, eight cells at a time. Returns how many it has.
std::size_t DiffusionBrick::rank_row(std::size_t row) noexcept {
  constexpr std::uint64_t kEach = 0x0101010101010101U;
  std::uint8_t* const ranks = &ranks_[row * width_];
  std::uint64_t before = 0;
  for (std::size_t at = 0; at < width_; at += 8) {
    const std::uint64_t bits = (rows_[row][at / 64] >> (at % 64)) & 0xffU;
    // A byte for each bit, one or zero; then the sum of it and all lower ones.
    const std::uint64_t apart = (bits * kEach) & 0x8040201008040201U;
    const std::uint64_t ones = ((apart + 0x7f7f7f7f7f7f7f7fU) >> 7U) & kEach;
    const std::uint64_t sums = ones * kEach;
    const std::uint64_t counts = sums - ones + before * kEach;
    std::memcpy(ranks + at, &counts, sizeof(counts));
    before += sums >> 56U;
  }
  return static_cast<std::size_t>(before);
}

void DiffusionBrick::number_nodes() noexcept {
  TESSERA_ASSERT(fits());
  const auto rows = static_cast<std::size_t>(edge_[1] * edge_[2]);
  node_count_ = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    first_[row] = static_cast<std::uint32_t>(node_count_);
    if (has_nodes(row)) node_count_ += rank_row(row);
  }
  const std::size_t floats = node_count_ * stride_;
  sums_ = floats_.data();
  z_ = sums_ + floats;
  other_z_ = z_ + floats;
  std::memset(sums_, 0, floats * sizeof(float));
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

DiffusionBrick::Row DiffusionBrick::cells_within(int from, int to) noexcept {
  return {bits_within(from, to), bits_within(from - 64, to - 64)};
}

/// Calls visit(first, last) for each row's nodes that are at least margin from the brick's border.
template <class Visit>
void DiffusionBrick::for_runs(int margin, Visit&& visit) const noexcept {
  for (int z = margin; z < edge_[2] - margin; ++z) {
    for (int y = margin; y < edge_[1] - margin; ++y) {
      const std::size_t row = row_at(y, z);
      if (!has_nodes(row)) continue;
      const std::size_t first = nodes_before(row, margin);
      const std::size_t last = nodes_before(row, edge_[0] - margin);
      if (first != last) visit(first, last);
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
                           .weights = weights_.data(),
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
    visited += end.edges_before + end.edges - nodes_[first].edges_before + (last - first);
  });
  return visited;
}

/// Of up to four nodes, one after the other: how much the last iteration changed of each, and what
/// it has in the map, but where another label than that of B is ahead.
void DiffusionBrick::conclude_four(const float* before, float* after, std::size_t nodes,
                                   Node* into) const noexcept {
  const auto z = [&](std::size_t node, std::size_t lane) {
    return load4(after + node * stride_ + lane);
  };
  const auto apart = [&](std::size_t node, std::size_t lane) {
    constexpr std::int32_t kWithoutSign = 0x7fffffff;
    const Float4 change = z(node, lane) - load4(before + node * stride_ + lane);
    return keep(Int4{kWithoutSign, kWithoutSign, kWithoutSign, kWithoutSign}, change);
  };
  FourNodes four;
  Float4 changes{};
  for_lanes(stride_, z, [&](std::size_t lane, const Float4& counts) { four.add(lane, counts); });
  for_lanes(stride_, apart, [&](std::size_t, const Float4& change) { changes += change; });
  const bool keeps_evidence = config_.mode == DiffusionMode::kContractive;
  for (std::size_t k = 0; k < nodes; ++k) {
    into[k].change = changes[k];
    if (!keeps_evidence) continue;
    const auto leader = static_cast<std::uint32_t>(four.leader[k]);
    const bool is_same = leader == into[k].leader;
    into[k].leader = leader;
    const Float4 scale = all_lanes(into[k].sum / four.sum[k]);
    float* const sigma = after + k * stride_;
    for (std::size_t lane = 0; lane < stride_ && is_same; lane += 4)
      store4(sigma + lane, load4(sigma + lane) * scale);
  }
}

void DiffusionBrick::conclude(const float* before, float* after) noexcept {
  for_runs(halo_, [&](std::size_t first, std::size_t last) {
    for (std::size_t at = first; at < last; at += 4)
      conclude_four(before + at * stride_, after + at * stride_,
                    std::min<std::size_t>(4, last - at), &nodes_[at]);
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
  conclude(before, result_);
  return false;
}

}  // namespace tessera
