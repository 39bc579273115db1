// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The counts of eq. 7 by brute force, from the specification alone: double precision, std::cos and
// std::sin, a sorted map of voxels, no tiles, no tables. It shares no code with the library, only
// the names of the modes.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "tessera/inference/inference_config.hpp"

namespace tessera::oracle {

using Voxel = std::array<std::int64_t, 3>;

struct OraclePoint {
  std::array<double, 3> p{};
  double weight = 1.0;
  int component = 0;  ///< The best of its labels.
  /// What each component has of the weight, 1 in all; empty: component has all of it.
  std::map<int, double> shares{};
};

/// k_0 for eps_0 = 1, r = d / D.
[[nodiscard]] double sparse_kernel(double r);

/// The cell of a grid of cubes, corner at the origin, that holds p.
[[nodiscard]] Voxel cell_of(const std::array<double, 3>& p, double edge_m);

/// One component of a voxel.
struct OracleCount {
  double sum = 0.0;
  int added = 0;     ///< Contributions in the sum that are clear of the cut-off.
  int doubtful = 0;  ///< Contributions within 1e-6 of the cut-off, added or not.
};

class LabelOracle {
 public:
  LabelOracle(const InferenceConfig& config, double resolution_m, int num_classes)
      : config_(config), resolution_m_(resolution_m), num_classes_(num_classes) {}

  void add_scan(const std::vector<OraclePoint>& points);
  [[nodiscard]] const std::map<Voxel, std::map<int, OracleCount>>& voxels() const {
    return voxels_;
  }
  /// How many blocks were filled, and how many learnt from their neighbours: for tests to see that
  /// they cover both.
  [[nodiscard]] int filled() const { return filled_; }
  [[nodiscard]] int smoothed() const { return smoothed_; }

 private:
  using Blocks = std::map<Voxel, std::vector<OraclePoint>>;
  /// Adds a contribution of a point to all that its labels name.
  void add(const Voxel& voxel, const OraclePoint& point, double amount, bool counts, bool doubtful);
  void count(const OraclePoint& point);
  void spread(const OraclePoint& point);
  void infer_blocks(const Blocks& blocks);
  void learn(const Voxel& block, const Blocks& blocks, bool own, bool neighbours, double length_m);
  void contribute(const Voxel& voxel, const OraclePoint& point, double length_m);
  [[nodiscard]] double class_entropy(const std::vector<OraclePoint>& points) const;
  [[nodiscard]] bool may_fill(const Voxel& block, const Blocks& blocks) const;

  InferenceConfig config_;
  double resolution_m_;
  int num_classes_;
  std::map<Voxel, std::map<int, OracleCount>> voxels_;
  int filled_ = 0;
  int smoothed_ = 0;
};

}  // namespace tessera::oracle
