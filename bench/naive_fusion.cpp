// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "naive_fusion.hpp"

#include <cmath>

#include "tessera/map/internal/packed_block.hpp"

namespace tessera::bench {

namespace {

constexpr std::uint32_t kNone = ~std::uint32_t{0};

std::uint64_t name_of(VoxelCoord v) {
  const auto part = [](std::int32_t x) { return static_cast<std::uint64_t>(x + (1 << 20)); };
  return part(v.x) | part(v.y) << 21U | part(v.z) << 42U;
}

}  // namespace

NaiveFusion::NaiveFusion(const DiffusionConfig& config, double resolution_m, int num_components)
    : config_(config), classes_(static_cast<std::size_t>(num_components - 2)) {
  const double length = static_cast<double>(config.length_m) / resolution_m;
  const int reach = static_cast<int>(std::ceil(length));
  for (int z = -reach; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const double d = std::sqrt(x * x + y * y + z * z) / length;
        if (d == 0.0 || d >= 1.0) continue;
        const double turn = 2.0 * 3.14159265358979323846 * d;
        const double k = (2.0 + std::cos(turn)) * (1.0 - d) / 3.0 +
                         std::sin(turn) / (2.0 * 3.14159265358979323846);
        offsets_.push_back({{x, y, z}, static_cast<float>(k)});
      }
    }
  }
}

void NaiveFusion::add(const Contribution& robot, std::uint8_t bit) {
  for (const PublishedBlock& block : robot.blocks) {
    const BlockCoord at = unpack(block.key);
    unpack_block(
        block.bytes,
        [&](int row, int component, float count) {
          if (component == 0 || component > static_cast<int>(classes_)) return;
          const VoxelCoord voxel = voxel_of_row(at, row);
          const auto [entry, inserted] =
              rows_.try_emplace(name_of(voxel), static_cast<std::uint32_t>(voxels_.size()));
          if (inserted) {
            voxels_.push_back(voxel);
            counts_.resize(counts_.size() + classes_);
          }
          counts_[entry->second * classes_ + static_cast<std::size_t>(component - 1)] += count;
          robots_[block.key.bits] |= bit;
        },
        [](int, unsigned) {});
  }
}

void NaiveFusion::find_nodes() {
  for (std::uint32_t i = 0; i < voxels_.size(); ++i) {
    const Result<BlockKey> key = pack(block_of(voxels_[i]));
    if (key.ok() && robots_[key->bits] == 3) nodes_.push_back(i);
  }
}

void NaiveFusion::diffuse() {
  struct Edge {
    std::uint32_t row;
    float weight;
  };
  std::vector<std::uint8_t> is_node(voxels_.size());
  for (const std::uint32_t node : nodes_) is_node[node] = 1;
  std::vector<std::vector<Edge>> edges(nodes_.size());
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    float sum = 0.0F;
    for (const Offset& offset : offsets_) {
      const VoxelCoord at = voxels_[nodes_[n]];
      const auto found =
          rows_.find(name_of({at.x + offset.by.x, at.y + offset.by.y, at.z + offset.by.z}));
      if (found == rows_.end() || is_node[found->second] == 0) continue;
      edges[n].push_back({found->second, offset.weight});
      sum += offset.weight;
    }
    for (Edge& edge : edges[n]) edge.weight *= config_.alpha / sum;
  }
  const std::vector<float> b = counts_;
  std::vector<float> next = counts_;
  for (int i = 0; i < config_.iterations; ++i) {
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      float* const to = &next[nodes_[n] * classes_];
      const float* const own = &b[nodes_[n] * classes_];
      for (std::size_t c = 0; c < classes_; ++c) to[c] = own[c];
      for (const Edge& edge : edges[n]) {
        const float* const from = &counts_[edge.row * classes_];
        for (std::size_t c = 0; c < classes_; ++c) to[c] += edge.weight * from[c];
      }
    }
    counts_.swap(next);
  }
}

std::size_t NaiveFusion::fuse(const Team& team) {
  rows_.clear();
  robots_.clear();
  voxels_.clear();
  counts_.clear();
  nodes_.clear();
  for (std::size_t r = 0; r < team.robots.size(); ++r)
    add(team.robots[r], static_cast<std::uint8_t>(1U << r));
  find_nodes();
  diffuse();
  return nodes_.size();
}

}  // namespace tessera::bench
