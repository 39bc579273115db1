// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/contributors.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <tuple>
#include <utility>

#include "base/number_text.hpp"
#include "maps/fuse_sessions.hpp"
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
    const std::size_t first = hits.size();
    const auto hit = [&](VoxelCoord target) {
      const std::size_t voxel = finder.find(target);
      const bool is_known = std::any_of(hits.begin() + static_cast<std::ptrdiff_t>(first),
                                        hits.end(), [&](const Hit& h) { return h.voxel == voxel; });
      if (voxel < finder.size() && !is_known)
        hits.push_back({static_cast<std::uint32_t>(voxel), number, local});
    };
    input.frame.for_targets(local, hit);
    if (evidence.centroid.known() && !input.frame.shift_only())
      input.frame.for_box_corners(local, evidence.centroid, hit);
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

/// hits: of one contributor, grouped by voxel.
void add_hits_of_one(const std::vector<FuseInput>& inputs, const std::vector<Hit>& hits,
                     std::uint64_t bit, Contributors& result) {
  for (std::size_t first = 0, next = 0; first < hits.size(); first = next) {
    next = first;
    while (next < hits.size() && hits[next].voxel == hits[first].voxel) {
      if (next == first || hits[next].input != hits[next - 1].input)
        ++result.of_maps[hits[next].input];
      ++next;
    }
    const int label = label_of(inputs, std::span(hits).subspan(first, next - first));
    VoxelLabels& voxel = result.voxels[hits[first].voxel];
    if (voxel.from == 0) voxel.label = static_cast<std::uint8_t>(label);
    voxel.differ = voxel.differ || label != voxel.label;
    voxel.from |= bit;
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

/// Of maps that are of one contributor: a robot has one share, each session has its own.
std::pair<std::uint32_t, std::uint32_t> share_of(const FuseInput& input) {
  return {input.id.robot, input.session ? input.id.submap : 0};
}

}  // namespace

Outcome<std::vector<FuseInput>> load_contributors(const std::vector<std::string>& paths,
                                                  const std::vector<std::string>& sessions,
                                                  std::vector<std::string> transforms,
                                                  std::vector<Message>& warnings) {
  TESSERA_TRY_ASSIGN(const std::vector<SessionOptions> earlier,
                     parse_sessions(sessions, transforms));
  TESSERA_TRY_ASSIGN(std::vector<FuseInput> inputs, load_inputs(paths, transforms, warnings));
  TESSERA_TRY(add_sessions(earlier, inputs, warnings));
  std::set<std::pair<std::uint32_t, std::uint32_t>> shares;
  for (const FuseInput& input : inputs) shares.insert(share_of(input));
  if (shares.size() <= Replicas::kMostRobots) return inputs;
  return Failure{
      fmt::format("the maps are of {}, sessions included, too many to tell apart; give "
                  "maps of at most {}",
                  counted(shares.size(), "robot"), Replicas::kMostRobots)};
}

std::string name_of_session(const std::string& name, const MapSession& session) {
  constexpr std::size_t kDay = 10;
  return name + " of " + date_text(session.date_s).substr(0, kDay);
}

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
    const FuseInput& input = inputs[first];
    Contributors::One one{
        input.session ? std::string("session") : fmt::format("robot {}", input.id.robot), {}};
    if (input.session) {
      result.noun = "robot or session";
      result.plural = "robots or sessions";
    }
    for (std::size_t i = first; i < inputs.size(); ++i) {
      if (share_of(inputs[i]) != share_of(input)) continue;
      done[i] = true;
      // Submaps of one file follow each other.
      if (i == first || inputs[i].path != inputs[i - 1].path)
        one.maps += (one.maps.empty() ? "" : " + ") + name_of(inputs, inputs[i]);
      add_hits(inputs[i], static_cast<std::uint32_t>(i), finder, hits);
    }
    std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
      return std::tie(a.voxel, a.input) < std::tie(b.voxel, b.input);
    });
    if (input.session) one.maps = name_of_session(one.maps, *input.session);
    add_hits_of_one(inputs, hits, std::uint64_t{1} << result.all.size(), result);
    result.all.push_back(std::move(one));
  }
  return result;
}

}  // namespace tessera
