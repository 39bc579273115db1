// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One iteration of the diffusion over random graphs: what the formula says, lane by lane, and the
// same bits in both widths.
#include "tessera/fusion/internal/diffusion_spread.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstring>
#include <vector>

#include "support/random.hpp"

namespace tessera {
namespace {

constexpr std::size_t kNodes = 70;
constexpr float kUnset = -1.0F;

struct RandomGraph {
  RandomGraph(std::size_t floats_a_node, std::uint64_t seed) : stride(floats_a_node) {
    oracle::Random random(seed);
    for (DiffusionNode& node : nodes) {
      node.first_edge = static_cast<std::uint32_t>(edges.size());
      node.edges = static_cast<std::uint32_t>(random.below(20));
      node.share = static_cast<float>(random.uniform(0.0, 1.0));
      for (std::uint32_t i = 0; i < node.edges || edges.size() % 4 != 0; ++i) {
        const auto other = static_cast<std::size_t>(random.below(static_cast<int>(kNodes)));
        edges.push_back(static_cast<std::uint32_t>(other * stride));
        weights.push_back(i < node.edges ? static_cast<float>(random.uniform(0.0, 1.0)) : 0.0F);
      }
    }
    for (std::size_t i = 0; i < kNodes * stride; ++i) {
      z.push_back(static_cast<float>(random.uniform(0.0, 50.0)));
      sums.push_back(static_cast<float>(random.uniform(0.0, 50.0)));
    }
  }
  /// The lanes of all vectors, of nodes from 5 to 59.
  [[nodiscard]] std::vector<float> spread(LaneWidth width, bool adds_own) const {
    std::vector<float> to(kNodes * stride, kUnset);
    const DiffusionRun run{.nodes = nodes.data(),
                           .edges = edges.data(),
                           .weights = weights.data(),
                           .from = z.data(),
                           .sums = sums.data(),
                           .to = to.data(),
                           .stride = stride,
                           .first = 5,
                           .last = 60,
                           .adds_own = adds_own};
    for (std::size_t lane = 0; lane < stride; lane += 16)
      spread_lanes(std::min<std::size_t>(stride - lane, 16) / 4, width)(run, lane);
    return to;
  }

  std::size_t stride;
  std::vector<DiffusionNode> nodes = std::vector<DiffusionNode>(kNodes);
  std::vector<std::uint32_t> edges;
  std::vector<float> weights;
  std::vector<float> z;
  std::vector<float> sums;
};

}  // namespace

TEST_CASE("diffusion spread: a node gets its share of its neighbours, in the order of its edges") {
  for (const std::size_t stride : {4U, 8U, 12U, 16U, 20U, 36U}) {
    for (const bool adds_own : {false, true}) {
      const RandomGraph graph(stride, 3 + stride);
      const std::vector<float> to = graph.spread(LaneWidth::kFour, adds_own);
      for (std::size_t at = 0; at < kNodes; ++at) {
        for (std::size_t lane = 0; lane < stride; ++lane) {
          const std::size_t i = at * stride + lane;
          const DiffusionNode& node = graph.nodes[at];
          float sum = 0.0F;
          for (std::uint32_t e = node.first_edge; e < node.first_edge + node.edges; ++e)
            sum += graph.weights[e] * graph.z[graph.edges[e] + lane];
          const float spread = node.share * sum;
          const float expected = graph.sums[i] + (adds_own ? graph.z[i] + spread : spread);
          CHECK(to[i] == (at >= 5 && at < 60 ? expected : kUnset));
        }
      }
    }
  }
}

TEST_CASE("diffusion spread: both widths give the same bits") {
  for (const std::size_t stride : {4U, 8U, 12U, 16U, 20U, 64U}) {
    for (const bool adds_own : {false, true}) {
      const RandomGraph graph(stride, 40 + stride);
      const std::vector<float> wide = graph.spread(LaneWidth::kWidest, adds_own);
      const std::vector<float> narrow = graph.spread(LaneWidth::kFour, adds_own);
      CHECK(std::memcmp(wide.data(), narrow.data(), wide.size() * sizeof(float)) == 0);
    }
  }
}

}  // namespace tessera
