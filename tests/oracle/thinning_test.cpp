// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Thinning against its brute-force oracle.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "oracle/thinning_oracle.hpp"
#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

/// What the labels of a point make of it; without any use of the library.
void take_labels(const Cloud& cloud, std::size_t i, int unlabelled, OraclePoint& point) {
  std::map<int, double> shares;
  double left = 1.0;
  for (std::size_t j = 0; j < cloud.labels_per_point; ++j) {
    const int component = cloud.components[i * cloud.labels_per_point + j];
    const double share = cloud.label_weights[i * cloud.labels_per_point + j] / 255.0;
    if (share == 0.0 || component == unlabelled) continue;
    shares[component] += share;
    left -= share;
  }
  if (left > 1e-9) shares[unlabelled] += left;
  point.component = unlabelled;
  double most = 0.0;
  for (std::size_t j = 0; j < cloud.labels_per_point; ++j) {
    // Equals stay in their order.
    const int component = cloud.components[i * cloud.labels_per_point + j];
    if (component == unlabelled || shares.count(component) == 0 || shares[component] <= most + 1e-9)
      continue;
    most = shares[component];
    point.component = component;
  }
  if (shares.size() > 1) point.shares = shares;
}

bool same_shares(const OraclePoint& a, const OraclePoint& b) {
  return std::equal(a.shares.begin(), a.shares.end(), b.shares.begin(), b.shares.end(),
                    [](const auto& one, const auto& other) {
                      return one.first == other.first && std::abs(one.second - other.second) < 1e-9;
                    });
}

std::vector<OraclePoint> points_of(const Cloud& cloud, int unlabelled) {
  std::vector<OraclePoint> points;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto at = [&](std::size_t axis) { return static_cast<double>(cloud.xyz[3 * i + axis]); };
    const double weight = cloud.weights.empty() ? 1.0 : static_cast<double>(cloud.weights[i]);
    points.push_back({{at(0), at(1), at(2)}, weight, cloud.components[i]});
    if (cloud.labels_per_point > 1) take_labels(cloud, i, unlabelled, points.back());
  }
  return points;
}

void check_thinning(const CloudOptions& options, double cell_m, std::uint64_t seed,
                    ThinningWeight rule = ThinningWeight::kMean, bool shares = false) {
  Random random(announce_seed(seed));
  Cloud cloud = random_cloud(random, options);
  if (shares) share_labels(random, options.classes, cloud);
  InferenceConfig config{.mode = InferenceMode::kCounting,
                         .min_range_m = 0.0F,
                         .thinning_m = cell_m,
                         .thinning_weight = rule};
  config.free_space.enabled = false;
  Mapper mapper(uncapped_map(0.1), config, options.classes);
  const ScanReport report = mapper.integrate(cloud);
  const std::map<Voxel, OraclePoint> expected =
      thin_by_cell(points_of(cloud, options.classes + 1), cell_m, options.classes + 1, rule);
  CHECK(report.thinned == expected.size());
  REQUIRE(mapper.admitted().size() == expected.size());
  // Each expected point has one of the thinned ones within rounding of it; the order is not
  // compared.
  std::size_t unmatched = 0;
  for (const auto& [cell, point] : expected) {
    bool found = false;
    for (const OraclePoint& candidate : mapper.admitted()) {
      double off = 0.0;
      for (std::size_t i = 0; i < 3; ++i)
        off = std::max(off, std::abs(candidate.p[i] - point.p[i]));
      found = found || (off < 1e-6 && candidate.component == point.component &&
                        same_shares(candidate, point) &&
                        std::abs(candidate.weight - point.weight) < 1e-6 * (1.0 + point.weight));
    }
    if (!found) ++unmatched;
  }
  CHECK(unmatched == 0);
}

}  // namespace

TEST_CASE("thinning: one point a cell, at the centroid, with the majority label") {
  const double cell_m = GENERATE(0.07, 0.1, 0.25, 1.0);
  CAPTURE(cell_m);
  check_thinning({.points = 900}, cell_m, 401);
}

TEST_CASE("thinning: the label of the largest total weight wins and brings its mean weight") {
  check_thinning({.points = 900, .weighted = true}, 0.25, 402);
}

TEST_CASE("thinning: most points unlabelled") {
  check_thinning({.points = 600, .unlabelled = 0.9}, 0.25, 403);
}

TEST_CASE("thinning: with kSum the winning label brings the sum of its weights") {
  check_thinning({.points = 900}, 0.25, 404, ThinningWeight::kSum);
  check_thinning({.points = 900, .weighted = true}, 1.0, 405, ThinningWeight::kSum);
}

TEST_CASE(
    "thinning: of labels with weights, the majority of the best, with all that its first point "
    "says") {
  const double cell_m = GENERATE(0.07, 0.25, 1.0);
  const auto rule = GENERATE(ThinningWeight::kMean, ThinningWeight::kSum);
  check_thinning({.points = 900}, cell_m, 406, rule, true);
  check_thinning({.points = 900, .weighted = true}, cell_m, 407, rule, true);
  check_thinning({.points = 400, .unlabelled = 0.9}, cell_m, 408, rule, true);
}

TEST_CASE("thinning: three returns in a cell are one observation by the mean, three by the sum") {
  Cloud cloud;
  for (const double x : {2.01, 2.05, 2.08}) cloud.add(x, 0.05, 0.05, 1);
  cloud.add(2.03, 0.02, 0.05, 2);
  const bool sum = GENERATE(false, true);
  InferenceConfig config{.mode = InferenceMode::kCounting, .thinning_m = 0.1};
  config.thinning_weight = sum ? ThinningWeight::kSum : ThinningWeight::kMean;
  Mapper mapper(uncapped_map(0.1), config, 5);
  static_cast<void>(mapper.integrate(cloud));
  const VoxelEvidence evidence = mapper.map().evidence(Point3f(2.05F, 0.05F, 0.05F));
  CHECK(evidence.sigma[1] == (sum ? 3.0F : 1.0F));
  CHECK(evidence.sigma[2] == 0.0F);
}

}  // namespace tessera::oracle
