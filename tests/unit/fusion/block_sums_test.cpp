// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// B of a block, and what becomes of it on its way to the map.
#include "tessera/fusion/internal/block_sums.hpp"

#include <catch2/catch.hpp>
#include <map>
#include <vector>

#include "support/sample_content.hpp"
#include "tessera/fusion/internal/fused_block.hpp"

namespace tessera {
namespace {

constexpr int kComponents = 6;
constexpr ReplicasConfig kReplicas{
    .segments = 4096, .blocks = 64, .contributions = 8, .robot_segments = 4096};

GridTransform shift_by(int x, int y, int z) {
  Matrix34d T = Matrix34d::Identity();
  T.col(3) = Point3d{0.1 * x, 0.1 * y, 0.1 * z};
  return *GridTransform::make(T, 0.1);
}

GlobalMapConfig config_with(float omega) {
  GlobalMapConfig config;
  config.diffusion.omega = omega;
  config.max_evidence = 0.0F;
  return config;
}

struct OwnSums {
  explicit OwnSums(const GlobalMapConfig& config)
      : memory(Replicas::required_bytes(kReplicas) +
               BlockSums::required_bytes(config, kComponents) +
               FusedBlock::required_bytes(kComponents) +
               RobotWeights::required_bytes(kReplicas.contributions, kComponents)),
        scratch(most_packed_bytes(kComponents)) {
    Arena arena = memory.arena();
    replicas = *Replicas::make(arena, kReplicas);
    sums = *BlockSums::make(arena, config, kComponents, scratch);
    fused = *FusedBlock::make(arena, config, kComponents);
    weights = *RobotWeights::make(arena, kReplicas.contributions, kComponents, config.diffusion);
  }
  BlockSums::Added add_up(BlockContent& content) {
    content.clear();
    return sums.add_up(replicas, weights, {0, 0, 0}, content);
  }
  void put(const ContributionId& id, const GridTransform& frame, BlockCoord block,
           const BlockContent& content) {
    const Replicas::Slot slot = *replicas.open(id);
    replicas.set_frame(slot, frame, 1);
    std::vector<std::byte> packed(most_packed_bytes(kComponents));
    packed.resize(pack_block(content, packed));
    REQUIRE(replicas.put(slot, *pack(block), 1, packed).ok());
  }

  AlignedMemory memory;
  std::vector<std::byte> scratch;
  Replicas replicas;
  BlockSums sums;
  FusedBlock fused;
  RobotWeights weights;
};

}  // namespace

TEST_CASE("BlockSums: every voxel is the sum over robots of what their frames bring there") {
  const float omega = GENERATE(1.0F, 0.5F);
  OwnSums own(config_with(omega));
  oracle::Random random(11);
  const std::array<VoxelCoord, 2> shift{{{3, -5, 0}, {-8, 1, 2}}};
  std::map<std::pair<int, int>, double> expected;  // by row and component
  std::map<int, unsigned> passes;
  for (std::uint32_t robot = 1; robot <= 2; ++robot) {
    const VoxelCoord& by = shift[robot - 1];
    for (const BlockCoord block : {BlockCoord{0, 0, 0}, {1, 0, 0}, {0, 0, -1}, {-1, 1, 0}}) {
      OwnContent content(kComponents);
      for (int n = 0; n < 200; ++n) {
        const int row = random.below(kBlockVoxels);
        content->add(1 + random.below(kComponents - 1), row,
                     static_cast<float>(random.uniform(0.1, 20.0)));
        if (n % 4 == 0) content->add_passes(row, 3);
      }
      own.put({robot, 1, 0}, shift_by(by.x, by.y, by.z), block, *content);
      for (int row = 0; row < kBlockVoxels; ++row) {
        const VoxelCoord v = voxel_of_row(block, row);
        const VoxelCoord to{v.x + by.x, v.y + by.y, v.z + by.z};
        if (!(block_of(to) == BlockCoord{0, 0, 0})) continue;
        for (int c = 1; c < kComponents; ++c)
          expected[{row_order(to), c}] += static_cast<double>(omega * content->count(c, row));
        passes[row_order(to)] += content->passes(row);
      }
    }
  }
  BlockContent& content = own.fused.content();
  const BlockSums::Added added = own.add_up(content);
  CHECK(added.robots != 0);
  for (int row = 0; row < kBlockVoxels; ++row) {
    for (int c = 1; c < kComponents; ++c)
      REQUIRE(static_cast<double>(content.count(c, row)) ==
              Approx(expected[{row, c}]).epsilon(1e-5));
    REQUIRE(content.passes(row) == passes[row]);
  }
}

TEST_CASE("BlockSums: robots with labels are told apart from those that only saw free space") {
  OwnSums own(config_with(1.0F));
  OwnContent labels(kComponents);
  labels->add(1, 0, 2.0F);
  OwnContent free(kComponents);
  free->add_passes(0, 3);
  OwnContent unlabelled(kComponents);
  unlabelled->add(kComponents - 1, 0, 2.0F);
  own.put({1, 1, 0}, shift_by(0, 0, 0), {0, 0, 0}, *labels);
  own.put({2, 1, 0}, shift_by(0, 0, 0), {0, 0, 0}, *free);
  own.put({3, 1, 0}, shift_by(0, 0, 0), {0, 0, 0}, *unlabelled);
  const BlockSums::Added added = own.add_up(own.fused.content());
  const unsigned bit = own.replicas.contribution(*own.replicas.find({1, 1, 0})).robot_bit;
  CHECK(added.robots == std::uint64_t{1} << bit);
}

TEST_CASE("FusedBlock: passes that do not fit a byte take the voxel's labels with them") {
  OwnSums own(config_with(2.0F));
  BlockContent& content = own.fused.content();
  content.clear();
  content.add(1, 7, 10.0F);
  content.add_rest(7, 4.0F);
  content.add_passes(7, 255);  // times omega: 510
  content.add(2, 8, 10.0F);
  content.add_passes(8, 100);
  CHECK(own.fused.scale_to_passes() == 1);
  CHECK(content.passes(7) == 255);
  CHECK(content.count(1, 7) == 5.0F);
  CHECK(content.rest(7) == 2.0F);
  CHECK(content.passes(8) == 200);
  CHECK(content.count(2, 8) == 10.0F);
}

TEST_CASE("FusedBlock: statistics are of voxels with evidence of a class, and of no others") {
  OwnSums own(config_with(1.0F));
  BlockContent& content = own.fused.content();
  content.clear();
  content.add(1, 0, 5.0F);
  content.add(2, 1, 5.0F);
  content.add(3, 1, 5.0F);
  content.add(kComponents - 1, 2, 5.0F);
  content.add_passes(3, 9);
  const NodeStatistics statistics = own.fused.measure();
  CHECK(statistics.nodes == 2);
  CHECK(statistics.variance == statistics.variance_undiffused);
  CHECK(statistics.variance > 0);
}

}  // namespace tessera
