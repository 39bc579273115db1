// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The lattice mode against its definition in docs/design/theory.md, by brute force in double
// precision: how much evidence is that of the multi-entropy oracle; of which classes it is follows
// from a map of all votes, cell by cell, without blocks, windows or slots.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

/// A cell of 4 x 4 x 2 voxels, or an octet of 2 x 2 x 2, by division of a voxel's coordinates.
Voxel part_of(const Voxel& voxel, const std::array<std::int64_t, 3>& edges) {
  Voxel part{};
  for (std::size_t i = 0; i < 3; ++i)
    part[i] = static_cast<std::int64_t>(
        std::floor(static_cast<double>(voxel[i]) / static_cast<double>(edges[i])));
  return part;
}
constexpr std::array<std::int64_t, 3> kCell{4, 4, 2};
constexpr std::array<std::int64_t, 3> kOctet{2, 2, 2};

class LatticeOracle {
 public:
  LatticeOracle(const InferenceConfig& config, double resolution_m, const ClassTable& table)
      : config_(config), resolution_m_(resolution_m), classes_(table.num_classes()), table_(table) {
    config_.mode = InferenceMode::kMultiEntropy;
  }

  void add_scan(const std::vector<OraclePoint>& points) {
    for (const OraclePoint& point : points) {
      const std::map<int, double> alone{{point.component, 1.0}};
      for (const auto& [label, share] : point.shares.empty() ? alone : point.shares) {
        if (label == 0 || label > classes_) continue;
        double& votes = votes_[part_of(cell_of(point.p, resolution_m_), kCell)][label];
        votes += std::floor(point.weight * share * 8.0 + 0.5);
      }
    }
    LabelOracle mass(config_, resolution_m_, classes_);
    mass.add_scan(points);
    for (const auto& [voxel, counts] : mass.voxels()) add(voxel, counts);
  }

  struct Content {
    std::map<int, double> counts;
    bool doubtful = false;  ///< A class that is dropped or kept by a hair, or a doubtful mass.
  };
  [[nodiscard]] const std::map<Voxel, Content>& voxels() const { return voxels_; }
  [[nodiscard]] double most_votes() const {
    double most = 0.0;
    for (const auto& [cell, votes] : votes_) {
      double sum = 0.0;
      for (const auto& [label, count] : votes) sum += count;
      most = std::max(most, sum);
    }
    return most;
  }
  /// Octets whose voxels have more than one class.
  [[nodiscard]] int mixed() const { return mixed_; }

 private:
  void add(const Voxel& voxel, const std::map<int, OracleCount>& counts) {
    Content& content = voxels_[voxel];
    double classes = 0.0;
    for (const auto& [label, count] : content.counts) classes += label <= classes_ ? count : 0.0;
    for (const auto& [label, count] : counts) {
      content.doubtful = content.doubtful || count.doubtful > 0;
      if (label > classes_)
        content.counts[label] += count.sum;
      else
        classes += count.sum;
    }
    const std::map<int, double> shares = shares_of(part_of(voxel, kOctet), content.doubtful);
    if (shares.empty()) {
      for (const auto& [label, count] : counts)
        if (label <= classes_) content.counts[label] += count.sum;
      return;
    }
    mixed_ += shares.size() > 1 ? 1 : 0;
    for (int label = 1; label <= classes_; ++label) content.counts.erase(label);
    for (const auto& [label, share] : shares) content.counts[label] = classes * share;
  }

  /// What a cell's votes on a class count for an octet, by the distances of their middles on each
  /// axis.
  [[nodiscard]] double weight(const Voxel& cell, const Voxel& octet, int label) const {
    const bool by_class = config_.lattice.reach_m == 0.0F;
    const ClassKernel kernel = by_class
                                   ? table_.kernel(label)
                                   : ClassKernel{config_.lattice.reach_m, config_.lattice.height_m};
    double product = 1.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double of_cell = (static_cast<double>(cell[i]) + 0.5) * static_cast<double>(kCell[i]);
      const double of_octet = (static_cast<double>(octet[i]) + 0.5) * 2.0;
      const double d = std::fabs(of_cell - of_octet) * resolution_m_;
      if (i == 2 && d > 2.5 * resolution_m_) return 0.0;  // beyond the next layer
      const double reach = std::clamp(static_cast<double>(kernel.reach_m), 1.5 * resolution_m_,
                                      11.0 * resolution_m_);
      const double length = i == 2 ? static_cast<double>(kernel.height_m) : reach;
      product *= std::max(0.0, 1.0 - d / length);
    }
    return product;
  }

  std::map<int, double> shares_of(const Voxel& octet, bool& doubtful) const {
    std::map<int, double> sums;
    for (const auto& [cell, votes] : votes_) {
      for (const auto& [label, count] : votes) {
        const double w = weight(cell, octet, label);
        if (w * count > 0.0) sums[label] += w * count;
      }
    }
    std::vector<std::pair<double, int>> order;
    for (const auto& [label, sum] : sums) order.emplace_back(-sum, label);
    std::sort(order.begin(), order.end());
    double kept = 0.0;
    std::map<int, double> shares;
    for (std::size_t i = 0; i < order.size(); ++i) {
      const double share = order[i].first / order[0].first;
      if (std::fabs(share - 1.0 / 16.0) < 1e-4) doubtful = true;
      if (i == 3 && share > 0.999 * order[2].first / order[0].first) doubtful = true;
      if (i >= 3 || share < 1.0 / 16.0) continue;
      shares[order[i].second] = share;
      kept += share;
    }
    for (auto& [label, share] : shares) share /= kept;
    return shares;
  }

  InferenceConfig config_;
  double resolution_m_;
  int classes_;
  ClassTable table_;
  std::map<Voxel, std::map<int, double>> votes_;
  std::map<Voxel, Content> voxels_;
  int mixed_ = 0;
};

struct LatticeRun {
  InferenceConfig config{};
  double resolution_m = 0.1;
  TuplePolicy tuple = TuplePolicy::kDense;
  CloudOptions cloud{};
  bool shares_labels = false;
  std::vector<ClassKernel> kernels{};  ///< Of the first classes.
};

LatticeRun lattice_run() {
  LatticeRun run;
  run.config.mode = InferenceMode::kLattice;
  run.config.lattice.reach_m = 0.8F;
  run.config.free_space.enabled = false;
  run.config.thinning_m = 0.0;
  run.config.min_range_m = 0.0F;
  run.cloud.points = 500;
  run.cloud.classes = 5;
  return run;
}

void check_lattice(const LatticeRun& run, std::uint64_t seed) {
  Random random(announce_seed(seed));
  MapConfig config = uncapped_map(run.resolution_m);
  config.tuple = run.tuple;
  ClassTable classes = numbered_classes(run.cloud.classes);
  for (std::size_t i = 0; i < run.kernels.size(); ++i)
    REQUIRE(classes.set_kernel(static_cast<int>(i) + 1, run.kernels[i]) == Status::kOk);
  Mapper mapper(config, run.config, classes);
  LatticeOracle oracle(run.config, run.resolution_m, classes);
  for (int scan = 0; scan < 3; ++scan) {
    Cloud cloud = random_cloud(random, run.cloud);
    if (run.shares_labels) share_labels(random, run.cloud.classes, cloud);
    Matrix34d T = Matrix34d::Identity();
    T.col(3) = Eigen::Vector3d(-0.37, 0.21, 0.11) * scan;
    REQUIRE(mapper.integrate(cloud, T).admitted == cloud.size());
    oracle.add_scan(mapper.admitted());
  }
  REQUIRE(oracle.most_votes() < 8192.0);
  CHECK(oracle.mixed() > 100);
  const bool compact = run.tuple == TuplePolicy::kCompact;
  const std::map<Voxel, VoxelEvidence> found = observed_voxels(mapper.map());
  int compared = 0;
  int wrong = 0;
  for (const auto& [voxel, content] : oracle.voxels()) {
    if (content.doubtful) continue;
    const auto at = found.find(voxel);
    double total = 0.0;
    for (const auto& [label, count] : content.counts) total += count;
    if (total < 1e-3) continue;
    ++compared;
    if (at == found.end()) {
      ++wrong;
      continue;
    }
    // A compact tuple rounds each of a scan's contributions and each share.
    const double most = compact ? 1e-2 * total + 0.01 : 1e-4 * total + 1e-6;
    double has_all = static_cast<double>(at->second.rest);
    for (const float count : at->second.sigma) has_all += static_cast<double>(count);
    if (std::fabs(has_all - total) > (compact ? 2e-3 : 1e-5 * total)) ++wrong;
    for (int label = 1; label <= run.cloud.classes + 1; ++label) {
      const auto count = content.counts.find(label);
      const double expected = count == content.counts.end() ? 0.0 : count->second;
      const auto has = static_cast<double>(at->second.sigma[static_cast<std::size_t>(label)]);
      if (std::fabs(has - expected) > most) ++wrong;
    }
  }
  for (const auto& [voxel, evidence] : found) wrong += oracle.voxels().count(voxel) == 0 ? 1 : 0;
  CHECK(compared > 500);
  CHECK(wrong == 0);
}

}  // namespace

TEST_CASE("lattice: as much evidence as multi-entropy's, of the classes that points around name") {
  LatticeRun run = lattice_run();
  SECTION("weight one") { check_lattice(run, 401); }
  SECTION("weights") {
    run.cloud.weighted = true;
    check_lattice(run, 402);
  }
  SECTION("unlabelled points have no vote, and their evidence stays") {
    run.cloud.unlabelled = 0.4;
    check_lattice(run, 403);
  }
  SECTION("points with several labels vote for each") {
    run.shares_labels = true;
    check_lattice(run, 404);
  }
  SECTION("another reach, coarse voxels") {
    run.resolution_m = 0.2;
    run.config.lattice.reach_m = 1.7F;
    run.config.lattice.height_m = 0.9F;
    check_lattice(run, 405);
  }
  SECTION("a reach beyond the window ends at 11 voxels") {
    run.config.lattice.reach_m = 30.0F;
    check_lattice(run, 406);
  }
  SECTION("kernels by class: small, flat, upright, far, and one that was not set") {
    run.config.lattice.reach_m = 0.0F;
    run.kernels = {{0.25F, 2.0F}, {1.1F, 0.2F}, {0.5F, 1e3F}, {2.0F, 0.4F}};
    check_lattice(run, 408);
  }
  SECTION("a reach under a cell: its own cell alone") {
    run.config.lattice.reach_m = 0.05F;
    run.config.lattice.height_m = 0.05F;
    run.resolution_m = 0.04;
    check_lattice(run, 407);
  }
}

TEST_CASE("lattice: compact counts agree but for their rounding") {
  LatticeRun run = lattice_run();
  run.tuple = TuplePolicy::kCompact;
  run.cloud.unlabelled = 0.0;  // beside it there is room for two classes
  check_lattice(run, 411);
}

}  // namespace tessera::oracle
