// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Every inference mode against the brute-force sums, on random clustered clouds: several scans,
// resolutions, lengths, weights, unlabelled points, negative coordinates. Thinning is off, so that
// both see the same float points.
#include <catch2/catch.hpp>

#include "oracle/agreement.hpp"

namespace tessera::oracle {
namespace {

struct Run {
  InferenceConfig config{};
  double resolution_m = 0.1;
  int scans = 2;
  CloudOptions cloud{};
  bool shares_labels = false;
};

InferenceConfig labels_only(InferenceMode mode) {
  InferenceConfig config;
  config.mode = mode;
  config.free_space.enabled = false;
  config.thinning_m = 0.0;
  config.min_range_m = 0.0F;
  return config;
}

/// A pose with nothing round in it; the oracle gets the registered points.
Matrix34d pose_of(int scan) {
  Matrix34d T = Matrix34d::Identity();
  const Eigen::AngleAxisd turn(0.3 * scan, Eigen::Vector3d(0.1, -0.2, 0.97).normalized());
  T.leftCols<3>() = turn.toRotationMatrix();
  T.col(3) = Eigen::Vector3d(-0.37, 0.21, 0.11) * scan;
  return T;
}

void check_agreement(const Run& run, std::uint64_t seed, LabelOracle& oracle) {
  Random random(announce_seed(seed));
  Mapper mapper(uncapped_map(run.resolution_m), run.config, run.cloud.classes);
  for (int scan = 0; scan < run.scans; ++scan) {
    Cloud cloud = random_cloud(random, run.cloud);
    if (run.shares_labels) share_labels(random, run.cloud.classes, cloud);
    const ScanReport report =
        mapper.integrate(cloud, run.cloud.on_borders ? pose_of(0) : pose_of(scan));
    REQUIRE(report.admitted == cloud.size());
    oracle.add_scan(mapper.admitted());
  }
  const Agreement agreement =
      compare(mapper.map(), oracle, static_cast<double>(run.config.min_weight));
  INFO(agreement.text());
  CHECK(agreement.holds());
}

void check_agreement(const Run& run, std::uint64_t seed) {
  LabelOracle oracle(run.config, run.resolution_m, run.cloud.classes);
  check_agreement(run, seed, oracle);
}

}  // namespace

TEST_CASE("counting: the counts are the points of each voxel") {
  const double resolution_m = GENERATE(0.05, 0.1, 0.3);
  Run run{
      .config = labels_only(InferenceMode::kCounting), .resolution_m = resolution_m, .scans = 3};
  SECTION("weight one") { check_agreement(run, 101); }
  SECTION("weighted") {
    run.cloud.weighted = true;
    check_agreement(run, 102);
  }
}

TEST_CASE("counting: a point on a border of voxels counts in the voxel that contains it") {
  Run run{.config = labels_only(InferenceMode::kCounting)};
  run.cloud.on_borders = true;
  check_agreement(run, 103);
}

TEST_CASE("kernel: the counts are the ideal sum over the ball") {
  const float length_m = GENERATE(0.15F, 0.2F, 0.33F, 0.5F, 0.8F, 1.3F);
  const float min_weight = GENERATE(1.0F / 4096.0F, 0.0F);
  CAPTURE(length_m, min_weight);
  Run run{.config = labels_only(InferenceMode::kKernel)};
  run.config.kernel_length_m = length_m;
  run.config.min_weight = min_weight;
  run.cloud.points = length_m > 0.6F ? 150 : 400;
  check_agreement(run, 201);
}

TEST_CASE("kernel: weights, scale and resolution") {
  Run run{.config = labels_only(InferenceMode::kKernel)};
  run.cloud.points = 300;
  SECTION("weights above and below one") {
    run.cloud.weighted = true;
    check_agreement(run, 202);
  }
  SECTION("kernel scale under one") {
    run.config.kernel_scale = 0.1F;
    check_agreement(run, 203);
  }
  SECTION("kernel scale over one") {
    run.config.kernel_scale = 7.0F;
    run.cloud.weighted = true;
    check_agreement(run, 204);
  }
  SECTION("coarse voxels, short kernel: some points reach no centre") {
    run.resolution_m = 0.4;
    run.config.kernel_length_m = 0.25F;
    check_agreement(run, 205);
  }
  SECTION("fine voxels") {
    run.resolution_m = 0.04;
    run.config.kernel_length_m = 0.21F;
    check_agreement(run, 206);
  }
  SECTION("points on borders of voxels") {
    run.cloud.on_borders = true;
    check_agreement(run, 207);
  }
}

TEST_CASE("multi-entropy: lengths, smoothing and filling follow the scan's entropies") {
  const int edge = GENERATE(1, 2, 4);
  const bool one_label = GENERATE(true, false);
  const float min_weight = GENERATE(1.0F / 4096.0F, 0.0F);
  CAPTURE(edge, one_label, min_weight);
  Run run{.config = labels_only(InferenceMode::kMultiEntropy), .scans = 3};
  run.config.entropy.block_edge = edge;
  run.config.entropy.fill_one_label = one_label;
  run.config.min_weight = min_weight;
  run.cloud.points = 1500;
  run.cloud.weighted = edge == 2;
  LabelOracle oracle(run.config, run.resolution_m, run.cloud.classes);
  check_agreement(run, 301, oracle);
  CHECK(oracle.filled() > 20);
  CHECK(oracle.smoothed() > 20);
}

TEST_CASE("labels with weights: each has its share of what the point contributes") {
  const auto mode =
      GENERATE(InferenceMode::kCounting, InferenceMode::kKernel, InferenceMode::kMultiEntropy);
  const int edge = mode == InferenceMode::kMultiEntropy ? GENERATE(1, 2, 4) : 2;
  const float min_weight = GENERATE(1.0F / 4096.0F, 0.0F);
  CAPTURE(to_string(mode), edge, min_weight);
  Run run{.config = labels_only(mode), .scans = 3, .shares_labels = true};
  run.config.entropy.block_edge = edge;
  run.config.min_weight = min_weight;
  run.cloud.points = mode == InferenceMode::kKernel ? 300 : 1200;
  run.cloud.weighted = edge == 2;
  check_agreement(run, 311);
}

TEST_CASE("multi-entropy: other constants") {
  Run run{.config = labels_only(InferenceMode::kMultiEntropy)};
  run.cloud.points = 1200;
  SECTION("one neighbour is enough to fill") {
    run.config.entropy.fill_neighbours = 1;
    check_agreement(run, 302);
  }
  SECTION("four neighbours") {
    run.config.entropy.fill_neighbours = 4;
    run.config.entropy.fill_one_label = false;
    check_agreement(run, 303);
  }
  SECTION("seven never fill") {
    run.config.entropy.fill_neighbours = 7;
    LabelOracle oracle(run.config, run.resolution_m, run.cloud.classes);
    check_agreement(run, 304, oracle);
    CHECK(oracle.filled() == 0);
  }
  SECTION("other lengths and threshold") {
    run.config.entropy.base_length = 1.3F;
    run.config.entropy.entropy_length = 6.5F;
    run.config.entropy.fill_length = 2.2F;
    run.config.entropy.smooth_above = 0.1F;
    run.config.kernel_scale = 0.5F;
    check_agreement(run, 305);
  }
  SECTION("all unlabelled: filled, in component C + 1") {
    run.cloud.unlabelled = 1.0;
    LabelOracle oracle(run.config, run.resolution_m, run.cloud.classes);
    check_agreement(run, 306, oracle);
    CHECK(oracle.filled() > 20);
  }
  SECTION("coarse voxels, many classes") {
    run.resolution_m = 0.3;
    run.cloud.classes = 19;
    check_agreement(run, 307);
  }
  SECTION("points on borders of voxels") {
    run.cloud.on_borders = true;
    check_agreement(run, 308);
  }
}

}  // namespace tessera::oracle
