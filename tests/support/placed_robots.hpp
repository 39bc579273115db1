// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What robots have said in worlds of their own, and where these are placed: by fusing it anew in a
// map that knows of no places, an oracle for one that does.
#pragma once

#include <catch2/catch.hpp>
#include <map>
#include <optional>
#include <vector>

#include "support/team.hpp"

namespace tessera::oracle {

inline constexpr double kResolution_m = 0.1;
/// Here, what a robot states to be a little further on is out of the grid.
inline constexpr double kEdgeOfGrid_m = kBlockLimit * kResolution_m;

/// Of a map of few blocks, with caps that are reached and diffusion.
[[nodiscard]] inline GlobalMapConfig places_config(bool place_robots) {
  GlobalMapConfig config = team_config();
  config.place_robots = place_robots;
  config.map.storage_bytes = config.staged_bytes = std::size_t{4} << 20U;
  config.blocks = 1U << 12U;
  config.max_evidence = 4.0F;  // reached by many
  config.diffusion.edge = EdgeTerm::kConfidence;
  config.diffusion.length_m = 0.2F;
  return config;
}

[[nodiscard]] inline GridTransform grid_of(const Matrix34d& T) {
  return *GridTransform::make(T, kResolution_m);
}

[[nodiscard]] inline Matrix34d shift_of(double x_m) {
  Matrix34d T = Matrix34d::Identity();
  T(0, 3) = x_m;
  return T;
}

/// What robots have said, and where they are placed.
struct Said {
  struct One {
    Matrix34d T_world_local = Matrix34d::Identity();
    std::uint32_t revision = 0;
    MapSession session{};
    std::map<std::uint64_t, std::pair<std::uint32_t, std::vector<std::byte>>> blocks;
  };
  std::map<ContributionId, One> contributions;
  std::map<std::uint32_t, Matrix34d> places;

  [[nodiscard]] std::optional<GridTransform> place_of(const ContributionId& id) const {
    const auto place = places.find(id.robot);
    if (place == places.end()) return std::nullopt;
    if (Objection::is(id.submap)) return GridTransform();
    const Result<GridTransform> placed = GridTransform::compose(
        place->second, grid_of(contributions.at(id).T_world_local), kResolution_m);
    return placed.ok() ? std::optional(*placed) : std::nullopt;
  }
  /// Fuses what has a place, in a map that knows of no places.
  void fuse(Team& team) const {
    for (const auto& [id, one] : contributions) {
      const std::optional<GridTransform> frame = place_of(id);
      if (!frame) continue;
      const GlobalMap::Slot slot = *team.global().open(id, *frame);
      if (one.revision != 0)
        REQUIRE(team.global().set_frame(slot, *frame, one.revision, one.session) ==
                Replicas::Change::kTaken);
      for (const auto& [key, block] : one.blocks)
        REQUIRE(team.global().put(slot, BlockKey{key}, block.first, block.second).ok());
    }
    team.settle();
  }
  [[nodiscard]] std::uint64_t out_of_grid() const {
    std::uint64_t count = 0;
    for (const auto& [id, one] : contributions)
      count += places.count(id.robot) != 0 && !place_of(id) ? 1U : 0U;
    return count;
  }
};

}  // namespace tessera::oracle
