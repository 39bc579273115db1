// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "support/team.hpp"

#include <cmath>
#include <stdexcept>

#include "tessera/map/queries.hpp"

namespace tessera::oracle {

GlobalMapConfig team_config(TuplePolicy tuple) {
  GlobalMapConfig config;
  config.map.tuple = tuple;
  config.map.max_evidence = 0.0F;
  config.map.free_weight = 0.5F;
  config.map.storage_bytes = std::size_t{8} << 20U;
  config.replicas = {
      .segments = 1U << 14U, .blocks = 1U << 12U, .contributions = 32, .robot_segments = 1U << 14U};
  config.blocks = 1U << 13U;
  config.sum_segments = 1U << 14U;
  config.staged_bytes = std::size_t{8} << 20U;
  config.diffusion.edge = EdgeTerm::kNone;
  return config;
}

PackedBlocks pack_voxels(const OracleVoxels& voxels, const OracleCentroids& centroids) {
  AlignedMemory memory(BlockContent::required_bytes(kTeamClasses + 2));
  std::map<std::uint64_t, std::vector<std::pair<VoxelCoord, const OracleCounts*>>> blocks;
  for (const auto& [voxel, counts] : voxels) {
    const VoxelCoord at{static_cast<std::int32_t>(voxel[0]), static_cast<std::int32_t>(voxel[1]),
                        static_cast<std::int32_t>(voxel[2])};
    blocks[pack(tessera::block_of(at))->bits].emplace_back(at, &counts);
  }
  Arena arena(memory.span());
  BlockContent content = *BlockContent::make(arena, kTeamClasses + 2);
  std::vector<std::byte> bytes(most_packed_bytes(kTeamClasses + 2));
  PackedBlocks packed;
  for (const auto& [key, of_block] : blocks) {
    content.clear();
    for (const auto& [at, counts] : of_block) {
      for (int l = 1; l <= kTeamClasses + 1; ++l) {
        const auto count = static_cast<float>((*counts)[static_cast<std::size_t>(l)]);
        if (count > 0.0F) content.add(l, row_order(at), count);
      }
      if ((*counts)[0] > 0.0)
        content.add_passes(row_order(at), static_cast<unsigned>((*counts)[0]));
      const auto centroid = centroids.find({at.x, at.y, at.z});
      if (centroid != centroids.end())
        content.set_centroid(row_order(at), Centroid::of_levels(centroid->second));
    }
    const std::size_t size = pack_block(content, bytes);
    packed[key].assign(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
  }
  return packed;
}

OracleVoxels random_voxels(Random& random, int count, const Voxel& around) {
  OracleVoxels voxels;
  while (static_cast<int>(voxels.size()) < count) {
    Voxel corner = around;
    for (std::int64_t& x : corner) x += random.below(25) - 12;
    const int label = 1 + random.below(kTeamClasses);
    for (int i = 0; i < 12; ++i) {
      Voxel voxel = corner;
      for (std::int64_t& x : voxel) x += random.below(4);
      OracleCounts& counts = voxels[voxel];
      counts.resize(kTeamClasses + 2);
      const int kind = random.below(10);
      if (kind < 2) counts[0] += 1 + random.below(3);
      if (kind == 2) counts.back() += 0.5;
      if (kind < 2 || kind == 2) continue;
      const int component = kind < 9 ? label : 1 + random.below(kTeamClasses);
      counts[static_cast<std::size_t>(component)] += (1 + random.below(400)) / 64.0;
    }
  }
  return voxels;
}

OracleCentroids random_centroids(Random& random, const OracleVoxels& voxels) {
  OracleCentroids centroids;
  for (const auto& [voxel, counts] : voxels) {
    bool labelled = false;
    for (std::size_t l = 1; l < counts.size(); ++l) labelled = labelled || counts[l] > 0.0;
    if (!labelled || random.below(3) == 0) continue;
    std::array<int, 3>& levels = centroids[voxel];
    for (int& level : levels) level = random.below(6);
  }
  return centroids;
}

Matrix34d random_transform(Random& random, double degrees, double shift_m) {
  const double azimuth = random.uniform(0.0, 6.28);
  const double height = random.uniform(-1.0, 1.0);
  const double flat = std::sqrt(1.0 - height * height);
  const Eigen::Vector3d axis(flat * std::cos(azimuth), flat * std::sin(azimuth), height);
  Matrix34d T;
  T.leftCols<3>() = Eigen::AngleAxisd(degrees * 3.14159265358979323846 / 180.0, axis.normalized())
                        .toRotationMatrix();
  for (Eigen::Index i = 0; i < 3; ++i) T(i, 3) = random.uniform(-shift_m, shift_m);
  return T;
}

Team::Team(const GlobalMapConfig& config)
    : memory_(GlobalMap::required_bytes(config, kTeamClasses + 2)) {
  Arena arena(memory_.span());
  Result<GlobalMap> made = GlobalMap::make(arena, config, numbered_classes(kTeamClasses));
  if (!made.ok()) throw std::runtime_error("no global map");
  global_ = std::move(*made);
}

void Team::publish(const OracleContribution& contribution, std::uint32_t version) {
  const Result<GridTransform> frame =
      GridTransform::make(contribution.T_global_local, global_.config().map.resolution_m);
  const Result<GlobalMap::Slot> slot = global_.open(contribution.id, *frame);
  if (!slot.ok()) throw std::runtime_error("no slot");
  if (MapSession::is(contribution.id.submap))
    static_cast<void>(global_.set_frame(*slot, *frame, version, contribution.session));
  for (const auto& [key, bytes] : pack_voxels(contribution.voxels, contribution.centroids)) {
    if (!global_.put(*slot, BlockKey{key}, version, bytes).ok())
      throw std::runtime_error("a block was refused");
  }
}

std::vector<OracleContribution> publish_random(Team& team, Random& random, int robots, int voxels) {
  std::vector<OracleContribution> contributions(static_cast<std::size_t>(robots));
  for (std::uint32_t i = 0; i < contributions.size(); ++i) {
    contributions[i].id = {i, 0, 0};
    contributions[i].voxels = random_voxels(random, voxels, {0, 0, 0});
    team.publish(contributions[i], 1);
  }
  team.settle();
  return contributions;
}

std::uint64_t Team::digest() const {
  std::vector<KeyedIndex> workspace(2 * global_.map().block_count());
  return tessera::digest(global_.map(), workspace);
}

OracleVoxels voxels_of(const LocalMap& map) {
  OracleVoxels voxels;
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  for_each_observed(map, workspace, [&](const VoxelCoord& voxel, const VoxelEvidence& evidence) {
    OracleCounts counts;
    for (int l = 0; l < evidence.num_components; ++l)
      counts.push_back(static_cast<double>(evidence.sigma[static_cast<std::size_t>(l)]));
    counts[0] /= static_cast<double>(map.config().free_weight);
    voxels[{voxel.x, voxel.y, voxel.z}] = counts;
  });
  return voxels;
}

OracleContribution striped_ground(std::uint32_t robot, Says says) {
  OracleContribution contribution;
  contribution.id = {robot, 0, 0};
  const auto put = [&](std::int64_t x, std::int64_t y) {
    OracleCounts counts(kTeamClasses + 2);
    counts[static_cast<std::size_t>(says(static_cast<int>(y / 16) + 1))] = 5.0 + robot;
    counts[0] = (x + y) % 3 == 0 ? 1.0 : 0.0;
    contribution.voxels[{x, y, 0}] = counts;
  };
  for (std::int64_t y = 0; y < 48; ++y) {
    for (std::int64_t x = 0; x < 64; ++x) put(x, y);
    for (std::int64_t x = 0; x < 8; ++x) put(100 * (std::int64_t{robot} + 1) + x, y);
  }
  return contribution;
}

}  // namespace tessera::oracle
