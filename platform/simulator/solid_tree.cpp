// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Median splits along the longest axis of the centres: the tree is balanced, so its depth (and the
// walk's stack) is bounded by the logarithm of the number of solids.
#include "simulator/solid_tree.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

namespace tessera::street {
namespace {

constexpr std::uint32_t kLeafSolids = 3;

void grow(Bounds& bounds, const Bounds& other) {
  bounds.low = bounds.low.cwiseMin(other.low);
  bounds.high = bounds.high.cwiseMax(other.high);
}

/// Distance along the ray at which it enters the box, or kNoHit.
double entry(const Bounds& bounds, const Eigen::Vector3d& origin, const Eigen::Vector3d& inverse) {
  const Eigen::Vector3d a = (bounds.low - origin).cwiseProduct(inverse);
  const Eigen::Vector3d b = (bounds.high - origin).cwiseProduct(inverse);
  const double enter = a.cwiseMin(b).maxCoeff();
  const double leave = a.cwiseMax(b).minCoeff();
  return (leave < 0.0 || enter > leave) ? kNoHit : std::max(enter, 0.0);
}

/// 1/x, finite: a zero component would turn 0 * infinity into NaN on a box's border.
double safe_inverse(double x) {
  constexpr double kTiny = 1e-12;
  if (x >= 0.0) return 1.0 / std::max(x, kTiny);
  return 1.0 / std::min(x, -kTiny);
}

}  // namespace

SolidTree::SolidTree(std::vector<Primitive> solids) : solids_(std::move(solids)) {
  if (solids_.empty()) return;
  std::vector<Bounds> bounds;
  bounds.reserve(solids_.size());
  for (const Primitive& solid : solids_) bounds.push_back(bounds_of(solid));
  nodes_.reserve(2 * solids_.size());
  nodes_.push_back({{}, 0, static_cast<std::uint32_t>(solids_.size())});
  for (std::uint32_t node = 0; node < nodes_.size(); ++node) split(node, bounds);
}

void SolidTree::split(std::uint32_t node, std::vector<Bounds>& bounds) {
  const std::uint32_t first = nodes_[node].first;
  const std::uint32_t count = nodes_[node].count;
  Bounds centres;
  for (std::uint32_t i = first; i < first + count; ++i) {
    grow(nodes_[node].bounds, bounds[i]);
    const Eigen::Vector3d centre = 0.5 * (bounds[i].low + bounds[i].high);
    grow(centres, {centre, centre});
  }
  if (count <= kLeafSolids) return;
  Eigen::Index axis = 0;
  (centres.high - centres.low).maxCoeff(&axis);

  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), first);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const double at_a = bounds[a].low[axis] + bounds[a].high[axis];
    const double at_b = bounds[b].low[axis] + bounds[b].high[axis];
    return std::pair(at_a, a) < std::pair(at_b, b);
  });
  std::vector<Primitive> sorted_solids;
  std::vector<Bounds> sorted_bounds;
  for (const std::uint32_t i : order) {
    sorted_solids.push_back(solids_[i]);
    sorted_bounds.push_back(bounds[i]);
  }
  std::copy(sorted_solids.begin(), sorted_solids.end(), solids_.begin() + first);
  std::copy(sorted_bounds.begin(), sorted_bounds.end(), bounds.begin() + first);

  const std::uint32_t left = count / 2;
  nodes_[node].first = static_cast<std::uint32_t>(nodes_.size());
  nodes_[node].count = 0;
  nodes_.push_back({{}, first, left});
  nodes_.push_back({{}, first + left, count - left});
}

void SolidTree::meet(const Ray& ray, Hit& nearest) const {
  if (nodes_.empty()) return;
  const Eigen::Vector3d inverse = ray.direction.unaryExpr([](double x) { return safe_inverse(x); });
  struct Pending {
    std::uint32_t node;
    double enter_m;
  };
  std::array<Pending, 64> stack;
  std::size_t depth = 0;
  stack[depth++] = {0, entry(nodes_[0].bounds, ray.origin, inverse)};
  while (depth > 0) {
    const Pending top = stack[--depth];
    if (top.enter_m >= nearest.range_m) continue;
    const Node& node = nodes_[top.node];
    if (node.count > 0) {
      for (std::uint32_t i = 0; i < node.count; ++i) {
        street::meet(solids_[node.first + i], ray, nearest);
      }
      continue;
    }
    Pending near{node.first, entry(nodes_[node.first].bounds, ray.origin, inverse)};
    Pending far{node.first + 1, entry(nodes_[node.first + 1].bounds, ray.origin, inverse)};
    if (far.enter_m < near.enter_m) std::swap(near, far);
    if (far.enter_m < nearest.range_m) stack[depth++] = far;
    if (near.enter_m < nearest.range_m) stack[depth++] = near;
  }
}

}  // namespace tessera::street
