// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "oracle/thinning_oracle.hpp"

namespace tessera::oracle {

namespace {

OraclePoint merge(const std::vector<OraclePoint>& members, int unlabelled, ThinningWeight rule) {
  OraclePoint result;
  std::map<int, std::vector<double>> weights;
  for (const OraclePoint& member : members) {
    for (std::size_t i = 0; i < 3; ++i) {
      result.p[i] += member.p[i] / static_cast<double>(members.size());
    }
    weights[member.component].push_back(member.weight);
  }
  if (weights.size() > 1) weights.erase(unlabelled);
  double most = -1.0;
  for (const auto& [component, list] : weights) {
    double sum = 0.0;
    for (const double weight : list) sum += weight;
    if (sum <= most) continue;
    most = sum;
    result.component = component;
    result.weight = rule == ThinningWeight::kSum ? sum : sum / static_cast<double>(list.size());
  }
  return result;
}

}  // namespace

std::map<Voxel, OraclePoint> thin_by_cell(const std::vector<OraclePoint>& points, double cell_m,
                                          int unlabelled, ThinningWeight rule) {
  std::map<Voxel, std::vector<OraclePoint>> cells;
  for (const OraclePoint& point : points) cells[cell_of(point.p, cell_m)].push_back(point);
  std::map<Voxel, OraclePoint> result;
  for (const auto& [cell, members] : cells) {
    result[cell] = merge(members, unlabelled, rule);
    for (const OraclePoint& member : members) {
      if (member.component != result[cell].component) continue;
      result[cell].shares = member.shares;
      break;
    }
  }
  return result;
}

}  // namespace tessera::oracle
