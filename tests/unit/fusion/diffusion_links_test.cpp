// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Edges of nodes in random rows, four at a time, against one after the other: the same edges in the
// same order, with the same bits.
#include "tessera/fusion/internal/diffusion_links.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "support/random.hpp"
#include "tessera/fusion/internal/diffusion_stencil.hpp"

namespace tessera {
namespace {

constexpr std::size_t kLanes = 5;
constexpr std::size_t kFloats = 8;
constexpr float kAlpha = 0.98F;
constexpr std::uint32_t kNone = ~std::uint32_t{0};

/// Nodes of a cube of cells, numbered in the order of (z, y, x), with what edges depend on.
struct RandomNodes {
  RandomNodes(int cells, double part, std::uint64_t seed) : edge(cells) {
    oracle::Random random(seed);
    const auto rows = static_cast<std::size_t>(edge * edge);
    words.resize(2 * rows + 2);
    ranks.resize(rows * 128);
    for (std::size_t row = 0; row < rows; ++row) {
      first.push_back(nodes);
      std::uint8_t before = 0;
      for (std::size_t x = 0; x < static_cast<std::size_t>(edge); ++x) {
        ranks[128 * row + x] = before;
        const bool is_node = random.uniform(0.0, 1.0) < part;
        numbers.push_back(is_node ? nodes++ : kNone);
        before = static_cast<std::uint8_t>(before + (is_node ? 1 : 0));
        words[2 * row + x / 64] |= std::uint64_t{is_node ? 1U : 0U} << (x % 64);
      }
    }
    const std::size_t behind = nodes + 3;
    const auto number = [&] { return static_cast<float>(random.uniform(0.0, 1.0)); };
    for (std::size_t i = 0; i < behind; ++i) {
      sure.push_back(number());
      loudness.push_back(number());
      labels.push_back(static_cast<std::uint32_t>(random.below(static_cast<int>(kLanes))));
    }
    for (std::size_t i = 0; i < behind * kLanes; ++i) terms.push_back(number());
  }
  [[nodiscard]] std::size_t row(int y, int z) const {
    return static_cast<std::size_t>(z * edge + y);
  }
  [[nodiscard]] std::uint32_t number(int x, int y, int z) const {
    return numbers[row(y, z) * static_cast<std::size_t>(edge) + static_cast<std::size_t>(x)];
  }

  int edge;
  std::uint32_t nodes = 0;
  std::vector<std::uint64_t> words;
  std::vector<std::uint8_t> ranks;
  std::vector<std::uint32_t> first;
  std::vector<std::uint32_t> numbers;
  std::vector<float> sure;
  std::vector<float> loudness;
  std::vector<std::uint32_t> labels;
  std::vector<float> terms;
};

void check_links(const RandomNodes& nodes, const DiffusionStencil& stencil, bool confidence) {
  const int reach = stencil.reach();
  std::vector<LinkCells> links;
  std::vector<LinkWeights> packed;
  stencil.for_links([&](const LinkCells& cells) {
    links.push_back(cells);
    packed.push_back(pack_weights(cells));
  });
  const auto most = static_cast<std::size_t>(stencil.edges()) + 3 + LinkTask::kBehind;
  std::vector<std::uint32_t> edges(most);
  std::vector<float> weights(most);
  std::vector<DiffusionNode> linked(nodes.nodes);
  const std::size_t stride = nodes.nodes + 3;
  LinkTask task{.rows = {},
                .reach = reach,
                .sure = nodes.sure.data(),
                .loudness = nodes.loudness.data(),
                .labels = nodes.labels.data(),
                .terms = nodes.terms.data(),
                .lane_stride = stride,
                .confidence = confidence,
                .floats = kFloats,
                .alpha = kAlpha,
                .edges = edges.data(),
                .weights = weights.data(),
                .nodes = linked.data()};
  const auto check_node = [&](int x, int y, int z) {
    const std::uint32_t own = nodes.number(x, y, z);
    LinkEnd end{0, 77};
    link_node(task, own, x, end);
    std::uint32_t count = 0;
    float sum = 0.0F;
    stencil.for_edges([&](int dx, int dy, int dz, float k_0) {
      const std::uint32_t other = nodes.number(x + dx, y + dy, z + dz);
      if (other == kNone) return;
      const float term = nodes.terms[nodes.labels[own] * stride + other];
      const float g =
          confidence ? (1.0F - nodes.sure[own] * nodes.sure[other] * term) * nodes.loudness[other]
                     : term;
      REQUIRE(edges[count] == other * kFloats);
      REQUIRE(weights[count] == k_0 * g);
      sum += weights[count++];
    });
    REQUIRE(linked[own].first_edge == 0);
    REQUIRE(linked[own].edges == count);
    REQUIRE(linked[own].edges_before == 77);
    REQUIRE(linked[own].share == (count != 0 ? kAlpha / sum : 0.0F));
    REQUIRE(end.counted == 77 + count);
    REQUIRE(end.edge % 4 == 0);
    REQUIRE(end.edge - count < 4);
    for (; count < end.edge; ++count) {
      REQUIRE(weights[count] == 0.0F);
      REQUIRE(edges[count] == own * kFloats);
    }
  };
  for (int z = reach; z < nodes.edge - reach; ++z) {
    for (int y = reach; y < nodes.edge - reach; ++y) {
      std::vector<LinkRow> rows;
      for (std::size_t i = 0; i < links.size(); ++i) {
        const std::size_t at = nodes.row(y + links[i].dy, z + links[i].dz);
        const auto shift = static_cast<std::size_t>(reach + links[i].dx);
        rows.push_back({.nodes = reinterpret_cast<const std::byte*>(&nodes.words[2 * at]),
                        .ranks = &nodes.ranks[128 * at + shift],
                        .weights = &packed[i],
                        .first = nodes.first[at],
                        .shift = static_cast<std::uint8_t>(shift),
                        .mask = static_cast<std::uint8_t>((1U << links[i].cells) - 1U)});
      }
      task.rows = rows;
      for (int x = reach; x < nodes.edge - reach; ++x)
        if (nodes.number(x, y, z) != kNone) check_node(x, y, z);
    }
  }
}

}  // namespace

TEST_CASE("diffusion links: as the edges one after the other, whatever D and the nodes") {
  for (const double length : {1.2, 2.0, 3.5, 5.0}) {
    const DiffusionStencil stencil(length);
    for (const double part : {0.05, 0.5, 1.0}) {
      CAPTURE(length, part);
      const RandomNodes nodes(2 * stencil.reach() + 9, part, 5);
      check_links(nodes, stencil, true);
      check_links(nodes, stencil, false);
    }
  }
}

TEST_CASE("diffusion links: in rows of two words") {
  const RandomNodes nodes(75, 0.3, 9);
  check_links(nodes, DiffusionStencil(2.0), true);
}

}  // namespace tessera
