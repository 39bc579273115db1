// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/contributors.hpp"

#include <algorithm>
#include <filesystem>
#include <tuple>
#include <utility>

#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

/// A local voxel with a label, and the voxel that its evidence goes to.
struct Hit {
  std::uint32_t voxel = 0;
  std::uint32_t input = 0;
  VoxelCoord local;
};

using Place = std::pair<std::uint64_t, int>;

Place place_of(VoxelCoord voxel) {
  return {pack_in_grid(block_of(voxel)).bits,
          octet_in_block(voxel) * kOctetVoxels + voxel_in_octet(voxel)};
}

class Finder {
 public:
  explicit Finder(const std::vector<VoxelCoord>& voxels) {
    places_.reserve(voxels.size());
    for (const VoxelCoord& voxel : voxels) places_.push_back(place_of(voxel));
  }
  /// Index of that voxel among the requested ones; their number if it is not among them.
  [[nodiscard]] std::size_t find(VoxelCoord voxel) const {
    if (!in_grid(voxel)) return places_.size();
    const Place place = place_of(voxel);
    const auto at = std::lower_bound(places_.begin(), places_.end(), place);
    if (at == places_.end() || *at != place) return places_.size();
    return static_cast<std::size_t>(at - places_.begin());
  }
  [[nodiscard]] std::size_t size() const { return places_.size(); }

 private:
  std::vector<Place> places_;
};

void add_hits(const FuseInput& input, std::uint32_t number, const Finder& finder,
              std::vector<Hit>& hits) {
  const LocalMap& map = input.stored->map;
  std::vector<KeyedIndex> workspace = workspace_for(map);
  for_each_observed(map, workspace, [&](const VoxelCoord& local, const VoxelEvidence& evidence) {
    if (estimate(evidence, map.config().prior).label == 0) return;
    input.frame.for_targets(local, [&](VoxelCoord target) {
      const std::size_t voxel = finder.find(target);
      if (voxel < finder.size()) hits.push_back({static_cast<std::uint32_t>(voxel), number, local});
    });
  });
}

/// The label of the summed evidence of all hits, which belong to one voxel.
int label_of(const std::vector<FuseInput>& inputs, std::span<const Hit> hits) {
  VoxelEvidence sum;
  for (const Hit& hit : hits) {
    const VoxelEvidence evidence = inputs[hit.input].stored->map.evidence(hit.local);
    sum.num_components = evidence.num_components;
    for (std::size_t l = 0; l < sum.sigma.size(); ++l) sum.sigma[l] += evidence.sigma[l];
  }
  return estimate(sum, 0.0).label;
}

/// hits: of one robot, grouped by voxel.
void add_robot(const std::vector<FuseInput>& inputs, const std::vector<Hit>& hits,
               std::uint64_t robot_bit, Contributors& result) {
  for (std::size_t first = 0, next = 0; first < hits.size(); first = next) {
    next = first;
    while (next < hits.size() && hits[next].voxel == hits[first].voxel) {
      if (next == first || hits[next].input != hits[next - 1].input)
        ++result.of_maps[hits[next].input];
      ++next;
    }
    const int label = label_of(inputs, std::span(hits).subspan(first, next - first));
    RobotLabels& voxel = result.voxels[hits[first].voxel];
    if (voxel.robots == 0) voxel.label = static_cast<std::uint8_t>(label);
    voxel.differ = voxel.differ || label != voxel.label;
    voxel.robots |= robot_bit;
  }
}

/// The file's name, with its folder if others have the same name.
std::string name_of(const std::vector<FuseInput>& inputs, const FuseInput& input) {
  const auto name = [](const FuseInput& of) {
    return std::filesystem::path(of.path).filename().string();
  };
  const bool ambiguous = std::any_of(inputs.begin(), inputs.end(), [&](const FuseInput& other) {
    return other.path != input.path && name(other) == name(input);
  });
  return ambiguous ? input.path : name(input);
}

}  // namespace

Contributors find_contributors(const std::vector<FuseInput>& inputs,
                               const std::vector<VoxelCoord>& voxels) {
  Contributors result;
  result.voxels.resize(voxels.size());
  result.of_maps.resize(inputs.size());
  const Finder finder(voxels);
  std::vector<bool> done(inputs.size(), false);
  for (std::size_t first = 0; first < inputs.size(); ++first) {
    if (done[first]) continue;
    std::vector<Hit> hits;
    Contributors::Robot robot{inputs[first].id.robot, {}};
    for (std::size_t i = first; i < inputs.size(); ++i) {
      if (inputs[i].id.robot != robot.number) continue;
      done[i] = true;
      // Submaps of one file follow each other.
      if (i == first || inputs[i].path != inputs[i - 1].path)
        robot.maps += (robot.maps.empty() ? "" : " + ") + name_of(inputs, inputs[i]);
      add_hits(inputs[i], static_cast<std::uint32_t>(i), finder, hits);
    }
    std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
      return std::tie(a.voxel, a.input) < std::tie(b.voxel, b.input);
    });
    add_robot(inputs, hits, std::uint64_t{1} << result.robots.size(), result);
    result.robots.push_back(std::move(robot));
  }
  return result;
}

}  // namespace tessera
