// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "soak/logbook.hpp"

#include <algorithm>
#include <array>

namespace tessera::soak {

namespace {

/// A frame as a matrix again, metres.
Matrix34d matrix_of(const GridTransform& T_global_local, double resolution_m) {
  constexpr std::int32_t kFar = 10'000;
  const std::array<double, 3> origin = T_global_local.to_global({0, 0, 0});
  const std::array<std::array<double, 3>, 3> ends{T_global_local.to_global({kFar, 0, 0}),
                                                  T_global_local.to_global({0, kFar, 0}),
                                                  T_global_local.to_global({0, 0, kFar})};
  Matrix34d T;
  for (int row = 0; row < 3; ++row) {
    const auto r = static_cast<std::size_t>(row);
    double half = 0.0;
    for (int column = 0; column < 3; ++column) {
      T(row, column) = (ends[static_cast<std::size_t>(column)][r] - origin[r]) / kFar;
      half += 0.5 * T(row, column);
    }
    T(row, 3) = (origin[r] - half) * resolution_m;
  }
  return T;
}

}  // namespace

void Logbook::begin_map(std::uint32_t robot, std::uint32_t first_epoch) {
  std::vector<MappedMap>& maps = maps_[robot];
  maps.push_back({.first_epoch = first_epoch});
  if (maps.size() > kMostMaps) maps.erase(maps.begin());
}

const MappedSubmap* Logbook::find(const ContributionId& id) const {
  if (id.robot >= maps_.size()) return nullptr;
  const std::vector<MappedMap>& maps = maps_[id.robot];
  const auto map = std::find_if(maps.rbegin(), maps.rend(),
                                [&](const MappedMap& one) { return one.first_epoch <= id.epoch; });
  if (map == maps.rend()) return nullptr;
  const auto found = map->submaps.find(id.submap);
  return found == map->submaps.end() ? nullptr : &found->second;
}

double Logbook::misplaced_m(const MappedSubmap& submap, const GridTransform& T_global_local,
                            double resolution_m, double reach_m) {
  const Matrix34d T_global_map = matrix_of(T_global_local, resolution_m);
  double most_m = 0.0;
  for (const MappedScan& scan : submap.scans) {
    const Matrix34d T_map_sensor = soak::matrix_of(scan.T_map_sensor);
    const Matrix34d T_world_sensor = soak::matrix_of(scan.T_world_sensor);
    for (const Point3d& p_sensor :
         {Point3d(0.0, 0.0, 0.0), Point3d(reach_m, 0.0, 0.0), Point3d(0.0, reach_m, 0.0)}) {
      const Point3d p_global = apply(T_global_map, apply(T_map_sensor, p_sensor));
      most_m = std::max(most_m, (p_global - apply(T_world_sensor, p_sensor)).norm());
    }
  }
  return most_m;
}

Json Logbook::state() const {
  Json robots = Json::array();
  for (const std::vector<MappedMap>& maps : maps_) {
    Json all = Json::array();
    for (const MappedMap& map : maps) {
      Json submaps = Json::array();
      for (const auto& [number, submap] : map.submaps) {
        Json scans = Json::array();
        for (const MappedScan& scan : submap.scans)
          scans.push_back(
              {scan.stamp_us, json_of(scan.T_map_sensor), json_of(scan.T_world_sensor)});
        submaps.push_back({number, submap.evidence, std::move(scans)});
      }
      all.push_back({{"first_epoch", map.first_epoch}, {"submaps", std::move(submaps)}});
    }
    robots.push_back(std::move(all));
  }
  return robots;
}

void Logbook::restore(const Json& state) {
  maps_.assign(state.size(), {});
  for (std::size_t robot = 0; robot < state.size(); ++robot) {
    for (const Json& from : state[robot]) {
      MappedMap map{.first_epoch = from.at("first_epoch")};
      for (const Json& row : from.at("submaps")) {
        MappedSubmap& submap = map.submaps[row.at(0)];
        submap.evidence = row.at(1);
        for (const Json& scan : row.at(2))
          submap.scans.push_back({scan.at(0), pose_in(scan.at(1)), pose_in(scan.at(2))});
      }
      maps_[robot].push_back(std::move(map));
    }
  }
}

}  // namespace tessera::soak
