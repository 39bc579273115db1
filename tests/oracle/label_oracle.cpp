// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "oracle/label_oracle.hpp"

#include <cmath>
#include <set>

namespace tessera::oracle {

namespace {

constexpr double kTwoPi = 6.283185307179586476925;
constexpr double kDoubt = 1e-6;

std::array<Voxel, 6> face_neighbours(const Voxel& b) {
  return {Voxel{b[0] - 1, b[1], b[2]}, Voxel{b[0] + 1, b[1], b[2]}, Voxel{b[0], b[1] - 1, b[2]},
          Voxel{b[0], b[1] + 1, b[2]}, Voxel{b[0], b[1], b[2] - 1}, Voxel{b[0], b[1], b[2] + 1}};
}

std::int64_t floor_divide(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(std::floor(static_cast<double>(a) / static_cast<double>(b)));
}

}  // namespace

double sparse_kernel(double r) {
  if (r >= 1.0) return 0.0;
  return (2.0 + std::cos(kTwoPi * r)) * (1.0 - r) / 3.0 + std::sin(kTwoPi * r) / kTwoPi;
}

Voxel cell_of(const std::array<double, 3>& p, double edge_m) {
  Voxel cell{};
  for (std::size_t i = 0; i < 3; ++i)
    cell[i] = static_cast<std::int64_t>(std::floor(p[i] / edge_m));
  return cell;
}

void LabelOracle::add_scan(const std::vector<OraclePoint>& points) {
  if (config_.mode == InferenceMode::kMultiEntropy) {
    Blocks blocks;
    for (const OraclePoint& point : points) {
      const Voxel v = cell_of(point.p, resolution_m_);
      const std::int64_t edge = config_.entropy.block_edge;
      blocks[{floor_divide(v[0], edge), floor_divide(v[1], edge), floor_divide(v[2], edge)}]
          .push_back(point);
    }
    infer_blocks(blocks);
    return;
  }
  for (const OraclePoint& point : points) {
    if (config_.mode == InferenceMode::kCounting) {
      count(point);
    } else {
      spread(point);
    }
  }
}

void LabelOracle::count(const OraclePoint& point) {
  if (!(point.weight > 0.0) || point.weight < static_cast<double>(config_.min_weight)) return;
  add(cell_of(point.p, resolution_m_), point, point.weight, true, false);
}

void LabelOracle::add(const Voxel& voxel, const OraclePoint& point, double amount, bool counts,
                      bool doubtful) {
  const std::map<int, double> all{{point.component, 1.0}};
  for (const auto& [component, share] : point.shares.empty() ? all : point.shares) {
    OracleCount& entry = voxels_[voxel][component];
    if (counts) entry.sum += share * amount;
    ++(doubtful ? entry.doubtful : entry.added);
  }
}

void LabelOracle::contribute(const Voxel& voxel, const OraclePoint& point, double length_m) {
  double square = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double d = (static_cast<double>(voxel[i]) + 0.5) * resolution_m_ - point.p[i];
    square += d * d;
  }
  const double r = std::sqrt(square) / length_m;
  const double lift = point.weight * static_cast<double>(config_.kernel_scale);
  const double cut = static_cast<double>(config_.min_weight);
  const double k = lift * sparse_kernel(r);
  const bool doubtful = lift > 0.0 && r < 1.0 + kDoubt && std::abs(k - cut) < kDoubt;
  const bool counts = k >= cut && k > 0.0;
  if (!doubtful && !counts) return;
  add(voxel, point, k, counts, doubtful);
}

void LabelOracle::spread(const OraclePoint& point) {
  const auto length_m = static_cast<double>(config_.kernel_length_m);
  const auto reach = static_cast<std::int64_t>(std::ceil(length_m / resolution_m_)) + 1;
  const Voxel at = cell_of(point.p, resolution_m_);
  for (std::int64_t z = at[2] - reach; z <= at[2] + reach; ++z) {
    for (std::int64_t y = at[1] - reach; y <= at[1] + reach; ++y) {
      for (std::int64_t x = at[0] - reach; x <= at[0] + reach; ++x)
        contribute({x, y, z}, point, length_m);
    }
  }
}

double LabelOracle::class_entropy(const std::vector<OraclePoint>& points) const {
  std::map<int, int> histogram;
  double n = 0.0;
  double most = 0.0;
  for (const OraclePoint& point : points) {
    if (point.component > num_classes_) continue;
    const int here = ++histogram[point.component];
    most = std::fmax(most, here);
    n += 1.0;
  }
  if (histogram.empty()) return 0.0;
  const double outcomes = num_classes_ + 1;
  const auto classes = static_cast<double>(histogram.size());
  return (1.0 - most / n) * (1.0 + (classes - 1.0) / ((outcomes - 1.0) * (outcomes - 1.0)));
}

bool LabelOracle::may_fill(const Voxel& block, const Blocks& blocks) const {
  int with_points = 0;
  std::set<int> labels;
  for (const Voxel& face : face_neighbours(block)) {
    const auto found = blocks.find(face);
    if (found == blocks.end()) continue;
    ++with_points;
    for (const OraclePoint& point : found->second) {
      if (point.component <= num_classes_) labels.insert(point.component);
    }
  }
  return with_points >= config_.entropy.fill_neighbours &&
         (!config_.entropy.fill_one_label || labels.size() <= 1);
}

void LabelOracle::infer_blocks(const Blocks& blocks) {
  const EntropyConfig& constants = config_.entropy;
  std::set<Voxel> empty;
  for (const auto& [block, points] : blocks) {
    const double entropy = class_entropy(points);
    const double length = static_cast<double>(constants.base_length) +
                          static_cast<double>(constants.entropy_length) * entropy;
    const bool smooth = entropy > static_cast<double>(constants.smooth_above);
    learn(block, blocks, true, smooth, length * resolution_m_);
    if (smooth) ++smoothed_;
    for (const Voxel& face : face_neighbours(block)) {
      if (blocks.find(face) == blocks.end()) empty.insert(face);
    }
  }
  for (const Voxel& block : empty) {
    if (!may_fill(block, blocks)) continue;
    learn(block, blocks, false, true, static_cast<double>(constants.fill_length) * resolution_m_);
    ++filled_;
  }
}

void LabelOracle::learn(const Voxel& block, const Blocks& blocks, bool own, bool neighbours,
                        double length_m) {
  std::vector<OraclePoint> teachers;
  const auto take = [&](const Voxel& from) {
    const auto found = blocks.find(from);
    if (found != blocks.end())
      teachers.insert(teachers.end(), found->second.begin(), found->second.end());
  };
  if (own) take(block);
  if (neighbours) {
    for (const Voxel& face : face_neighbours(block)) take(face);
  }
  const std::int64_t edge = config_.entropy.block_edge;
  for (std::int64_t i = 0; i < edge * edge * edge; ++i) {
    const Voxel voxel{block[0] * edge + i % edge, block[1] * edge + i / edge % edge,
                      block[2] * edge + i / edge / edge};
    for (const OraclePoint& point : teachers) contribute(voxel, point, length_m);
  }
}

}  // namespace tessera::oracle
