// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "support/digest_by_rows.hpp"

#include <algorithm>
#include <tuple>
#include <vector>

#include "tessera/base/internal/digest.hpp"
#include "tessera/map/queries.hpp"

namespace tessera::oracle {

namespace {

struct Observed {
  VoxelCoord voxel;
  VoxelEvidence evidence;
};

void add_settings(const LocalMap& map, Digest& digest) {
  digest.add(std::bit_cast<std::uint64_t>(map.config().resolution_m));
  digest.add(std::bit_cast<std::uint64_t>(map.config().prior));
  digest.add(static_cast<std::uint64_t>(map.config().tuple));
  digest.add(static_cast<std::uint64_t>(map.classes().num_classes()));
  for (int label = 1; label <= map.classes().num_classes(); ++label) {
    const SemanticClass& c = map.classes()[label];
    for (const char letter : c.name) digest.add(static_cast<unsigned char>(letter));
    digest.add((std::uint64_t{c.color.r} << 16U) | (std::uint64_t{c.color.g} << 8U) | c.color.b);
  }
}

void add_voxel(const Observed& one, Digest& digest) {
  digest.add((std::uint64_t{static_cast<std::uint32_t>(one.voxel.z)} << 32U) |
             static_cast<std::uint32_t>(one.voxel.y));
  digest.add(static_cast<std::uint32_t>(one.voxel.x));
  const VoxelEvidence& evidence = one.evidence;
  for (std::size_t l = 0; l < static_cast<std::size_t>(evidence.num_components); ++l) {
    if (evidence.sigma[l] <= 0.0F) continue;
    digest.add(l);
    digest.add_float(evidence.sigma[l]);
  }
  if (evidence.rest <= 0.0F) return;
  digest.add(kMaxComponents);
  digest.add_float(evidence.rest);
}

}  // namespace

std::uint64_t digest_by_rows(const LocalMap& map) {
  std::vector<Observed> all;
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  for_each_observed(map, workspace, [&](const VoxelCoord& voxel, const VoxelEvidence& evidence) {
    all.push_back({voxel, evidence});
  });
  std::sort(all.begin(), all.end(), [](const Observed& a, const Observed& b) {
    return std::tie(a.voxel.z, a.voxel.y, a.voxel.x) < std::tie(b.voxel.z, b.voxel.y, b.voxel.x);
  });
  Digest digest;
  add_settings(map, digest);
  for (const Observed& one : all) add_voxel(one, digest);
  return digest.value();
}

}  // namespace tessera::oracle
