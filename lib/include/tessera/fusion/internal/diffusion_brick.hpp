// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Label diffusion over the nodes of a box of blocks and of as much around it as they depend on. A
// node's result is a pure function of the sums B within its halo, always computed in the same
// order: it is the same whichever brick it is computed in.
#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/internal/lanes.hpp"
#include "tessera/fusion/diffusion_config.hpp"
#include "tessera/fusion/internal/diffusion_links.hpp"
#include "tessera/fusion/internal/diffusion_spread.hpp"
#include "tessera/fusion/internal/diffusion_stencil.hpp"
#include "tessera/grid/lattice.hpp"
#include "tessera/map/map_config.hpp"
#include "tessera/semantics/class_table.hpp"

namespace tessera {

/// A box of blocks.
struct BlockBox {
  BlockCoord first;
  std::array<int, 3> size{1, 1, 1};
};

class DiffusionBrick {
 public:
  /// Of the box that is computed, on an axis. The more, the less is done twice.
  static constexpr int kMostBlocks = 8;
  /// Voxels of an axis, with all that they depend on: a row is two words.
  static constexpr int kMostEdge = kMostBlocks * kBlockEdge + 2 * DiffusionConfig::kMostHalo;

  /// Memory for all nodes that one block may depend on, with all classes and edges, and for
  /// 40,000 with 12 classes and 16 edges each where that is more.
  [[nodiscard]] static constexpr std::size_t required_bytes(const DiffusionConfig& config,
                                                            double resolution_m,
                                                            int num_components) noexcept;
  /// Fails with kInvalidArgument iff iterations and length reach over kMostHalo voxels;
  /// kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<DiffusionBrick> make(Arena& arena, const DiffusionConfig& config,
                                                   double resolution_m,
                                                   int num_components) noexcept;
  DiffusionBrick() noexcept = default;

  /// How far a voxel's dependencies reach, in voxels.
  [[nodiscard]] static constexpr int halo_of(const DiffusionConfig& config,
                                             const DiffusionStencil& stencil) noexcept;
  [[nodiscard]] int halo() const noexcept { return halo_; }

  /// Starts with a box of blocks, 1 .. kMostBlocks on an axis; classes: of its nodes, a bit each.
  /// O(edge^2).
  void begin(const BlockBox& box, std::uint64_t classes) noexcept;
  /// The voxels of a block that are in the box or near enough to matter to it.
  [[nodiscard]] VoxelMask contained(BlockCoord block) const noexcept;
  /// Marks voxels of a block as nodes, which the brick contains; each block once. O(64).
  void mark(BlockCoord block, const VoxelMask& nodes) noexcept;
  /// Whether there is memory for all nodes that are marked so far.
  [[nodiscard]] bool fits() const noexcept {
    return node_count_ <= nodes_.size() && 3 * node_count_ * stride_ <= floats_.size();
  }
  /// Numbers the nodes, all with sums zero. They must fit: those of one block always do.
  /// O(edge^2 + rows with nodes * edge + nodes * classes).
  void number_nodes() noexcept;
  /// B of a node, by lanes, to be set.
  [[nodiscard]] float* sums_of(VoxelCoord node) noexcept { return sums_ + node_at(node) * stride_; }
  /// component: one of the classes.
  [[nodiscard]] std::size_t lane_of(int component) const noexcept {
    return lane_of_[static_cast<std::size_t>(component)];
  }
  /// Links the nodes, once all sums are set. False iff there are more edges than memory holds, as
  /// above. work: what was visited is added. O(nodes * (edges + classes)).
  [[nodiscard]] bool start(std::uint64_t& work) noexcept;
  /// The next iteration, if any is left. False after the last: the results are there. O(nodes *
  /// edges * classes).
  [[nodiscard]] bool iterate(std::uint64_t& work) noexcept;

  /// A node of the box after the last iteration.
  struct NodeResult {
    const float* sigma = nullptr;  ///< What it has in the map, by lane.
    float sum = 0.0F;              ///< |B|
    float change = 0.0F;           ///< |Z_n - Z_{n-1}|
  };
  /// In the contractive mode its label is that of B, unless two thirds of its witnesses' evidence
  /// are of other classes, and two fifths of the one that leads in Z. O(classes), or O(witnesses +
  /// classes^2) where Z has another label. work: witnesses that were heard are added.
  [[nodiscard]] NodeResult result(VoxelCoord node, std::uint64_t& work) noexcept;
  /// Classes of the lanes, ascending.
  [[nodiscard]] std::span<const std::uint8_t> lanes() const noexcept {
    return std::span(components_).first(lanes_);
  }

 private:
  using Node = DiffusionNode;
  /// Voxels along x around a node.
  struct WitnessRow {
    std::int8_t dy = 0;
    std::int8_t dz = 0;
    std::uint8_t width = 0;
    std::int32_t rows = 0;   ///< From the node's own row.
    std::uint64_t mask = 0;  ///< 2 width + 1 bits.
  };
  /// Nodes of a row along x, a bit each.
  using Row = std::array<std::uint64_t, (kMostEdge + 63) / 64>;
  /// One more than there are, as a word of a row may be read from any of its bytes on.
  static constexpr std::size_t kRows = std::size_t{kMostEdge} * kMostEdge + 1;
  /// Behind the last node, as nodes are read four at a time.
  static constexpr std::size_t kBehindNodes = 3;
  static constexpr std::size_t kBehindFloats = kBehindNodes * kMaxComponents;
  struct Capacity {
    std::size_t cells = 0;
    std::size_t nodes = 0;
    std::size_t floats = 0;
    std::size_t edges = 0;
    std::size_t links = 0;      ///< Groups of cells.
    std::size_t witnesses = 0;  ///< Rows.
  };
  /// Cells of a row and one more, in whole bytes of its bits.
  [[nodiscard]] static constexpr std::size_t width_of(std::size_t edge) noexcept {
    return align_up(edge + 1, 8);
  }
  [[nodiscard]] static constexpr Capacity capacity_of(const DiffusionConfig& config,
                                                      const DiffusionStencil& stencil,
                                                      int num_components) noexcept;
  [[nodiscard]] std::size_t row_at(std::int32_t y, std::int32_t z) const noexcept {
    return static_cast<std::size_t>(z * edge_[1] + y);
  }
  [[nodiscard]] bool has_nodes(std::size_t row) const noexcept {
    return (rows_[row][0] | rows_[row][1]) != 0;
  }
  /// Nodes before a cell of a row that has nodes.
  [[nodiscard]] std::size_t nodes_before(std::size_t row, std::int32_t x) const noexcept {
    return first_[row] + ranks_[row * width_ + static_cast<std::size_t>(x)];
  }
  [[nodiscard]] std::size_t node_at(VoxelCoord voxel) const noexcept {
    const VoxelCoord v = voxel - origin_;
    return nodes_before(row_at(v.y, v.z), v.x);
  }
  std::size_t rank_row(std::size_t row) noexcept;
  void describe_nodes() noexcept;
  template <class Term>
  void describe_by(Term&& term) noexcept;
  [[nodiscard]] int iterations() const noexcept;
  [[nodiscard]] bool link_nodes() noexcept;
  [[nodiscard]] bool link_row(LinkTask& task, std::int32_t y, std::int32_t z,
                              LinkEnd& end) noexcept;
  [[nodiscard]] static Row cells_within(int from, int to) noexcept;
  template <class Visit>
  void for_runs(int margin, Visit&& visit) const noexcept;
  std::uint64_t step(const float* from, float* to, int margin) noexcept;
  [[nodiscard]] static std::uint64_t nodes_from(const Row& row, std::int32_t x) noexcept;
  void keep_label(std::size_t at, VoxelCoord v, std::uint64_t& work) noexcept;
  [[nodiscard]] bool is_outvoted(VoxelCoord v, std::size_t lane, std::size_t by,
                                 std::uint64_t& work) const noexcept;
  void conclude(const float* before, float* after) noexcept;
  void conclude_four(const float* before, float* after, std::size_t nodes,
                     Node* into) const noexcept;

  DiffusionConfig config_{};
  int halo_ = 0;
  int reach_ = 0;  ///< Of an iteration.
  std::span<Row> rows_;
  std::span<std::uint8_t> ranks_;   ///< Nodes of its row before each cell, where it has any.
  std::size_t width_ = 0;           ///< Of a row of them.
  std::span<std::uint32_t> first_;  ///< Nodes before the row.
  std::span<LinkCells> links_;
  std::span<LinkWeights> link_weights_;
  std::span<LinkRow> linked_rows_;  ///< Of the row whose nodes are linked.
  std::span<WitnessRow> witnesses_;
  std::span<float> floats_;
  std::span<Node> nodes_;
  std::span<float> sure_;            ///< How sure a node's label is, 0 to 1.
  std::span<float> loudness_;        ///< What it gives of its evidence, 0 to 1.
  std::span<std::uint32_t> labels_;  ///< Of B; lanes.
  std::span<std::uint32_t> edges_;   ///< As DiffusionRun has them.
  std::span<float> weights_;
  std::size_t most_edges_ = 0;  ///< Of a node, in fours.
  std::size_t node_count_ = 0;
  std::size_t edge_count_ = 0;
  float* sums_ = nullptr;  ///< B, then the two Z in turn: by node and lane.
  float* z_ = nullptr;
  float* other_z_ = nullptr;
  float* result_ = nullptr;
  int iterated_ = 0;
  std::size_t stride_ = 4;
  std::size_t lanes_ = 0;
  std::array<SpreadLanes, 4> spread_{};  ///< Of 4, 8, 12 and 16 lanes.
  VoxelCoord origin_{};
  std::array<int, 3> edge_{};
  std::array<std::uint8_t, kMaxComponents> lane_of_{};
  std::array<std::uint8_t, kMaxComponents> components_{};
};

constexpr int DiffusionBrick::halo_of(const DiffusionConfig& config,
                                      const DiffusionStencil& stencil) noexcept {
  if (config.mode == DiffusionMode::kNone || config.iterations == 0) return 0;
  if (config.mode == DiffusionMode::kPaper) return (config.iterations - 1) * stencil.reach();
  return std::max(config.iterations * stencil.reach(), stencil.witness_reach());
}

constexpr DiffusionBrick::Capacity DiffusionBrick::capacity_of(const DiffusionConfig& config,
                                                               const DiffusionStencil& stencil,
                                                               int num_components) noexcept {
  const int halo = halo_of(config, stencil);
  const auto edge = static_cast<std::size_t>(kBlockEdge + 2 * halo);
  Capacity capacity;
  // A block alone always fits; what is mostly there, surfaces with few classes, in larger boxes.
  constexpr std::size_t kNodes = 40000;
  constexpr std::size_t kLanes = 12;
  constexpr std::size_t kEdges = 16;
  const std::size_t cube = edge * edge * edge;
  const std::size_t lanes = align_up(static_cast<std::size_t>(num_components - 2), 4);
  const std::size_t most_edges =
      align_up(static_cast<std::size_t>(halo > 0 ? stencil.edges() : 0), 4);
  const auto most_edge = static_cast<std::size_t>(kMostBlocks * kBlockEdge + 2 * halo);
  capacity.cells = width_of(most_edge) * most_edge * most_edge;
  capacity.nodes = std::max(cube, kNodes);
  capacity.floats = 3 * std::max(cube * lanes, kNodes * std::min(lanes, kLanes));
  capacity.links = 1;
  stencil.for_links([&](const LinkCells&) { ++capacity.links; });
  capacity.witnesses = 1;
  stencil.for_witnesses([&](int, int, int) { ++capacity.witnesses; });
  capacity.edges =
      std::max(cube * most_edges, kNodes * std::min(most_edges, kEdges)) + LinkTask::kBehind;
  return capacity;
}

constexpr std::size_t DiffusionBrick::required_bytes(const DiffusionConfig& config,
                                                     double resolution_m,
                                                     int num_components) noexcept {
  const DiffusionStencil stencil(static_cast<double>(config.length_m) / resolution_m);
  const Capacity capacity = capacity_of(config, stencil, num_components);
  return arena_bytes<Row>(kRows) + arena_bytes<std::uint32_t>(kRows) +
         arena_bytes<std::uint8_t>(capacity.cells) + arena_bytes<LinkCells>(capacity.links) +
         arena_bytes<LinkWeights>(capacity.links) + arena_bytes<LinkRow>(capacity.links) +
         arena_bytes<WitnessRow>(capacity.witnesses) +
         arena_bytes<float>(capacity.floats + kBehindFloats) + arena_bytes<Node>(capacity.nodes) +
         2 * arena_bytes<float>(capacity.nodes + kBehindNodes) +
         arena_bytes<std::uint32_t>(capacity.nodes + kBehindNodes) +
         arena_bytes<std::uint32_t>(capacity.edges) + arena_bytes<float>(capacity.edges);
}

}  // namespace tessera
