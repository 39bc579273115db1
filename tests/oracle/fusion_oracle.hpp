// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The global map by brute force, from the specification alone: Phi by trying every voxel, the graph
// as dense matrices, double precision. It shares no code with the library's fusion.
#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "oracle/label_oracle.hpp"
#include "tessera/fusion/diffusion_config.hpp"
#include "tessera/replica/replicas.hpp"

namespace tessera::oracle {

/// Counts of one voxel by component, the last one unlabelled; component 0 in passes.
using OracleCounts = std::vector<double>;
using OracleVoxels = std::map<Voxel, OracleCounts>;
/// In which sixth of a voxel its returns are, on each axis; of voxels with labels.
using OracleCentroids = std::map<Voxel, std::array<int, 3>>;

/// What one contribution holds, in its own frame.
struct OracleContribution {
  ContributionId id;
  Matrix34d T_global_local = Matrix34d::Identity();
  OracleVoxels voxels;
  MapSession session{};  ///< If it is one.
  OracleCentroids centroids{};
};

/// A node of the graph: the edges' other ends are found by position.
struct OracleNode {
  OracleCounts sums;      ///< B, or A of the paper mode: classes only.
  OracleCounts diffused;  ///< Z_n
};

struct OracleMap {
  OracleVoxels voxels;
  std::map<Voxel, OracleNode> nodes;
  double residual = 0.0;        ///< |Z_n - Z_{n-1}| / |B|
  std::size_t kept_labels = 0;  ///< Nodes where Z had another label than B, and the rule kept it.
  /// Nodes whose label is one or the other by less than what float sums can tell.
  std::vector<Voxel> undecided;
};

/// The cap of the robots' maps.
struct OracleCap {
  double max_evidence = 100.0;
  double free_weight = 0.5;
};

/// The voxels that get the evidence of a local voxel of which no centroid is known, by trying all
/// within two voxels of its image.
[[nodiscard]] std::vector<Voxel> phi(const Matrix34d& T_global_local, double resolution_m,
                                     const Voxel& local);

/// The voxels whose centre is in a local one, likewise.
[[nodiscard]] std::vector<Voxel> takers_of(const Matrix34d& T_global_local, double resolution_m,
                                           const Voxel& local);

/// What one contribution gives to a global voxel.
struct OracleGiven {
  OracleCounts counts;
  int observers = 0;
  double share = 0.0;       ///< Of boxes.
  double of_surface = 0.0;  ///< Passes of the voxels that these come from.

  void add(const OracleCounts& more, double part, bool takes) {
    counts.resize(more.size());
    for (std::size_t l = 1; l < more.size(); ++l) counts[l] += part * more[l];
    if (takes) counts[0] += more[0];
    ++observers;
  }
};

/// In a turned frame a voxel whose returns are known gives its labels to where they are, and an
/// eighth of them to those that take it and are not there; where surfaces are three tenths or more
/// of a voxel, it has no more passes than these bring.
[[nodiscard]] std::map<Voxel, OracleGiven> resampled(const OracleContribution& one,
                                                     double resolution_m);

/// config.edge must be kNone. num_classes: C.
[[nodiscard]] OracleMap fuse(const std::vector<OracleContribution>& contributions,
                             const DiffusionConfig& config, double resolution_m, int num_classes,
                             const OracleCap& cap = {});

}  // namespace tessera::oracle
