// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "oracle/fusion_oracle.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <tuple>

namespace tessera::oracle {

namespace {

using Matrix = Eigen::MatrixXd;

Voxel block_of(const Voxel& v) {
  const auto floor8 = [](std::int64_t x) { return x >= 0 ? x / 8 : -((7 - x) / 8); };
  return {floor8(v[0]), floor8(v[1]), floor8(v[2])};
}

bool has_class(const OracleCounts& counts) {
  for (std::size_t l = 1; l + 1 < counts.size(); ++l) {
    if (counts[l] > 0.0) return true;
  }
  return false;
}

struct Sums {
  OracleVoxels voxels;
  std::map<Voxel, int> observers;                   ///< Local voxels that went there.
  std::map<Voxel, std::set<std::uint32_t>> robots;  ///< By block.
};

/// What one submap of a robot says of a voxel.
struct Said {
  OracleCounts counts;
  int observers = 0;
  void add(const OracleCounts& more, int times) {
    counts.resize(more.size());
    for (std::size_t l = 0; l < more.size(); ++l) counts[l] += more[l];
    observers += times;
  }
};

/// No more than the cap, unless rounding can have made it so much: an eighth of it.
void hold(OracleCounts& counts, const OracleCap& cap) {
  double labels = 0.0;
  for (std::size_t l = 1; l < counts.size(); ++l) labels += counts[l];
  for (std::size_t l = 1; labels > cap.max_evidence * 1.125 + 0x1p-10 && l < counts.size(); ++l)
    counts[l] *= cap.max_evidence / labels;
  const double passes =
      std::clamp(std::floor(cap.max_evidence / cap.free_weight + 1e-4), 1.0, 255.0);
  if (counts[0] > passes + std::floor(passes / 8.0)) counts[0] = passes;
}

/// Of each robot what says something of the voxel and has no newer epoch's submap of its number in
/// its place; held under the cap.
Sums add_up(const std::vector<OracleContribution>& contributions, double omega, double resolution_m,
            const OracleCap& cap) {
  using OfSubmaps = std::map<std::pair<std::uint32_t, std::uint32_t>, Said>;  // epoch, submap
  std::map<std::uint32_t, std::map<Voxel, OfSubmaps>> robots;
  for (const OracleContribution& contribution : contributions) {
    if (MapSession::is(contribution.id.submap)) continue;
    for (const auto& [voxel, given] : resampled(contribution, resolution_m)) {
      robots[contribution.id.robot][voxel][{contribution.id.epoch, contribution.id.submap}].add(
          given.counts, given.observers);
    }
  }
  Sums sums;
  for (auto& [robot, voxels] : robots) {
    for (auto& [voxel, submaps] : voxels) {
      Said said;
      for (const auto& item : submaps) {
        const auto& name = item.first;
        const bool has_gone = std::any_of(submaps.begin(), submaps.end(), [&](const auto& other) {
          return other.first.first > name.first && other.first.second == name.second;
        });
        if (!has_gone) said.add(item.second.counts, item.second.observers);
      }
      hold(said.counts, cap);
      OracleCounts& here = sums.voxels[voxel];
      here.resize(said.counts.size());
      for (std::size_t l = 0; l < here.size(); ++l) here[l] += omega * said.counts[l];
      sums.observers[voxel] += said.observers;
      if (has_class(said.counts)) sums.robots[block_of(voxel)].insert(robot);
    }
  }
  return sums;
}

/// What one contribution to a session says of a voxel.
using OfSession = std::map<std::tuple<std::uint64_t, std::uint32_t, std::int64_t, std::uint32_t>,
                           std::pair<OracleCounts, double>>;

/// Of each name the first that says something: of the lowest robot, its newest epoch, its lowest
/// submap. All together are held to a quarter of the cap; no prior is counted for them.
void add_sessions(const std::vector<OracleContribution>& contributions, double omega,
                  double resolution_m, const OracleCap& cap, Sums& sums) {
  std::map<Voxel, OfSession> voxels;
  for (const OracleContribution& one : contributions) {
    if (!MapSession::is(one.id.submap) || one.session.weight == 0) continue;
    const double weight = one.session.weight / 32768.0;
    for (const auto& [voxel, given] : resampled(one, resolution_m)) {
      const OracleCounts& counts = given.counts;
      auto& [said, by] = voxels[voxel][{one.session.digest, one.id.robot,
                                        -static_cast<std::int64_t>(one.id.epoch), one.id.submap}];
      said.resize(counts.size());
      by = weight;
      for (std::size_t l = 1; l < counts.size(); ++l) said[l] += weight * counts[l];
      if (counts[0] > 0.0) said[0] += std::max(1.0, std::floor(weight * counts[0]));
    }
  }
  for (const auto& [voxel, all] : voxels) {
    OracleCounts sum;
    std::optional<std::uint64_t> name;
    for (const auto& [key, said] : all) {
      if (name == std::get<0>(key)) continue;
      name = std::get<0>(key);
      sum.resize(said.first.size());
      for (std::size_t l = 0; l < sum.size(); ++l) sum[l] += said.first[l];
    }
    double evidence = cap.free_weight * sum[0];
    for (std::size_t l = 1; l < sum.size(); ++l) evidence += sum[l];
    const double scale = std::min(1.0, 0.25 * cap.max_evidence / evidence);
    OracleCounts& here = sums.voxels[voxel];
    here.resize(sum.size());
    for (std::size_t l = 1; l < sum.size(); ++l) here[l] += omega * scale * sum[l];
    here[0] += omega * std::floor(scale * sum[0] + 0x1p-10);
    constexpr std::uint32_t kAllSessions = ~0U;  // as one more robot
    if (has_class(sum)) sums.robots[block_of(voxel)].insert(kAllSessions);
  }
}

double row_norm(const Matrix& m) {
  return m.rows() == 0 ? 0.0 : m.cwiseAbs().rowwise().sum().maxCoeff();
}

/// k_0 between all pairs of nodes, nothing on the diagonal.
Matrix kernel_of(const std::vector<Voxel>& nodes, double length_m, double resolution_m) {
  const auto n = static_cast<Eigen::Index>(nodes.size());
  Matrix K = Matrix::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      if (i == j) continue;
      double squared = 0.0;
      for (std::size_t a = 0; a < 3; ++a) {
        const double d = static_cast<double>(nodes[static_cast<std::size_t>(i)][a] -
                                             nodes[static_cast<std::size_t>(j)][a]) *
                         resolution_m;
        squared += d * d;
      }
      const double weight = sparse_kernel(std::sqrt(squared) / length_m);
      K(i, j) = weight >= 0x1p-44 ? weight : 0.0;  // less is rounding
    }
  }
  return K;
}

/// Of equal ones the first.
Eigen::Index leading(const Matrix& counts, Eigen::Index node) {
  Eigen::Index most = 0;
  for (Eigen::Index l = 1; l < counts.cols(); ++l)
    if (counts(node, l) > counts(node, most)) most = l;
  return most;
}

/// Evidence within 2.5 D, the node's own included, at most 2 of each, of which not two thirds are
/// of other classes, or not two fifths of the one that would follow. None: too near to tell.
std::optional<bool> keeps_label(const std::vector<Voxel>& nodes, const Matrix& B, Eigen::Index node,
                                Eigen::Index follows, double length) {
  double same = 0.0;
  double other = 0.0;
  double all = 0.0;
  for (Eigen::Index j = 0; j < B.rows(); ++j) {
    int squared = 0;
    bool near = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto d = static_cast<int>(nodes[static_cast<std::size_t>(node)][axis] -
                                      nodes[static_cast<std::size_t>(j)][axis]);
      near = near && std::abs(d) <= DiffusionConfig::kMostReach;
      squared += d * d;
    }
    if (!near || std::sqrt(squared) >= 2.5 * length * (1.0 - 1e-6)) continue;
    const double part = std::min(1.0, 2.0 / B.row(j).sum());
    same += part * B(j, leading(B, node));
    other += part * B(j, follows);
    all += part * B.row(j).sum();
  }
  const double few = 3.0 * same - all;
  const double many = 2.0 * all - 5.0 * other;
  const double least = 1e-6 * all;
  if (few > least || many > least) return true;
  if (few < -least && many < -least) return false;
  return std::nullopt;
}

/// The kept class and those that are ahead of it share what they have, by the one level at which
/// that is so: found by halving. The kept one is then a sixteenth of it ahead of each.
void put_first(Matrix& Z, Eigen::Index node, Eigen::Index kept) {
  const double sum = Z.row(node).sum();
  double low = Z(node, kept);
  double high = Z.row(node).maxCoeff();
  for (int i = 0; i < 100; ++i) {
    const double level = (low + high) / 2.0;
    double cut = 0.0;
    for (Eigen::Index l = 0; l < Z.cols(); ++l) cut += std::max(0.0, Z(node, l) - level);
    (cut > level - Z(node, kept) ? low : high) = level;
  }
  for (Eigen::Index l = 0; l < Z.cols(); ++l)
    if (l != kept && Z(node, l) > low * (1.0 + 1e-9)) Z(node, l) = low * 15.0 / 16.0;
  Z(node, kept) += sum - Z.row(node).sum();
}

}  // namespace

OracleMap fuse(const std::vector<OracleContribution>& contributions, const DiffusionConfig& config,
               double resolution_m, int num_classes, const OracleCap& cap) {
  const auto omega = static_cast<double>(config.omega);
  Sums sums = add_up(contributions, omega, resolution_m, cap);
  add_sessions(contributions, omega, resolution_m, cap, sums);
  OracleMap result;
  result.voxels = sums.voxels;
  std::vector<Voxel> nodes;
  for (const auto& [voxel, counts] : sums.voxels) {
    const std::size_t needed = config.whole_map ? 1 : 2;
    if (has_class(counts) && sums.robots[block_of(voxel)].size() >= needed) nodes.push_back(voxel);
  }
  const auto n = static_cast<Eigen::Index>(nodes.size());
  const bool paper = config.mode == DiffusionMode::kPaper;
  Matrix B = Matrix::Zero(n, num_classes);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Voxel& voxel = nodes[static_cast<std::size_t>(i)];
    for (int l = 1; l <= num_classes; ++l) {
      B(i, l - 1) = sums.voxels[voxel][static_cast<std::size_t>(l)];
      // Eq. (10) by eq. (8): S_i lambda_i = sigma_i and the prior.
      if (paper) B(i, l - 1) += omega * static_cast<double>(config.prior) * sums.observers[voxel];
    }
  }
  const Matrix K = kernel_of(nodes, static_cast<double>(config.length_m), resolution_m);
  Matrix Z = paper ? Matrix::Zero(n, num_classes) : B;
  Matrix before = Z;
  Matrix step = K;
  if (paper) {
    step += Matrix::Identity(n, n);
  } else {
    for (Eigen::Index i = 0; i < n; ++i) {
      const double weights = K.row(i).sum();
      if (weights > 0.0) step.row(i) *= static_cast<double>(config.alpha) / weights;
    }
  }
  for (int i = 0; config.mode != DiffusionMode::kNone && i < config.iterations; ++i) {
    before = Z;
    Z = step * Z + B;  // Eq. (15)
  }
  result.residual = n == 0 ? 0.0 : row_norm(Z - before) / row_norm(B);
  if (config.mode == DiffusionMode::kContractive) {
    const double length = static_cast<double>(config.length_m) / resolution_m;
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Index leads = leading(Z, i);
      const Eigen::Index own = leading(B, i);
      std::optional<bool> keeps;
      if (leads != own) keeps = keeps_label(nodes, B, i, leads, length);
      // Of classes that have the same, rounding decides which leads.
      bool is_open = leads != own && !keeps;
      for (Eigen::Index l = 0; l < Z.cols(); ++l) {
        is_open = is_open || (l != own && B(i, l) >= B(i, own) - 1e-5 * B.row(i).sum());
        if (leads != own && Z(i, l) >= Z(i, leads) - 1e-6 * Z.row(i).sum())
          is_open = is_open || keeps_label(nodes, B, i, l, length) != keeps;
      }
      if (is_open) result.undecided.push_back(nodes[static_cast<std::size_t>(i)]);
      if (leads == own || is_open || !*keeps) continue;
      put_first(Z, i, own);
      ++result.kept_labels;
    }
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    const Voxel& voxel = nodes[static_cast<std::size_t>(i)];
    OracleNode node{OracleCounts(B.row(i).begin(), B.row(i).end()),
                    OracleCounts(Z.row(i).begin(), Z.row(i).end())};
    const double scale =
        config.mode == DiffusionMode::kContractive ? B.row(i).sum() / Z.row(i).sum() : 1.0;
    for (int l = 1; l <= num_classes; ++l)
      result.voxels[voxel][static_cast<std::size_t>(l)] = Z(i, l - 1) * scale;
    result.nodes.emplace(voxel, std::move(node));
  }
  return result;
}

}  // namespace tessera::oracle
