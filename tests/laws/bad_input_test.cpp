// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a scan must not contain is refused, counted by reason, and leaves no trace.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

const std::array kModes{InferenceMode::kCounting, InferenceMode::kKernel,
                        InferenceMode::kMultiEntropy, InferenceMode::kLattice};

InferenceConfig plain(InferenceMode mode) {
  InferenceConfig config;
  config.mode = mode;
  config.kernel_length_m = 0.3F;
  config.max_range_m = 10.0F;
  return config;
}

/// A mapper that has seen a scan, and one more that saw the same.
struct Pair {
  explicit Pair(const InferenceConfig& config)
      : mapper(uncapped_map(0.1), config, 5), reference(uncapped_map(0.1), config, 5) {
    Random random(31);
    const Cloud cloud = random_cloud(random, {.points = 300});
    static_cast<void>(mapper.integrate(cloud));
    static_cast<void>(reference.integrate(cloud));
  }
  [[nodiscard]] bool unchanged() const { return same_content(mapper.map(), reference.map()); }
  Mapper mapper;
  Mapper reference;
};

using Count = std::uint32_t ScanReport::*;

struct BadPoint {
  const char* what;
  std::array<double, 3> p;
  double weight;
  Count counter;
};

const std::vector<BadPoint> kBadPoints{
    {"NaN x", {kNan, 1, 1}, 1, &ScanReport::non_finite},
    {"NaN y", {1, kNan, 1}, 1, &ScanReport::non_finite},
    {"NaN z", {1, 1, kNan}, 1, &ScanReport::non_finite},
    {"infinite x", {kInf, 1, 1}, 1, &ScanReport::non_finite},
    {"infinite z", {1, 1, -kInf}, 1, &ScanReport::non_finite},
    {"NaN weight", {1, 1, 1}, kNan, &ScanReport::non_finite},
    {"infinite weight", {1, 1, 1}, kInf, &ScanReport::non_finite},
    {"negative weight", {1, 1, 1}, -0.001, &ScanReport::non_finite},
    {"too near", {0.2, 0.2, 0.2}, 1, &ScanReport::too_near},
    {"at the sensor", {0, 0, 0}, 1, &ScanReport::too_near},
};

}  // namespace

TEST_CASE("bad input: a bad return is counted by its reason and leaves no trace") {
  const InferenceMode mode = GENERATE(from_range(kModes));
  for (const BadPoint& bad : kBadPoints) {
    CAPTURE(bad.what, static_cast<int>(mode));
    Pair pair(plain(mode));
    Cloud cloud;
    cloud.add(bad.p[0], bad.p[1], bad.p[2], 1, bad.weight);
    const ScanReport report = pair.mapper.integrate(cloud);
    CHECK(report.*bad.counter == 1);
    CHECK(report.points == 1);
    CHECK(report.non_finite + report.too_near + report.out_of_grid == 1);
    CHECK(report.admitted == 0);
    CHECK(report.rays == 0);
    CHECK(pair.unchanged());
  }
}

TEST_CASE("bad input: bad returns among good ones change nothing that the good ones do") {
  const InferenceMode mode = GENERATE(from_range(kModes));
  CAPTURE(static_cast<int>(mode));
  Pair pair(plain(mode));
  Random random(32);
  const Cloud good = random_cloud(random, {.points = 200, .weighted = true});
  Cloud mixed;
  for (std::size_t i = 0; i < good.size(); ++i) {
    const BadPoint& bad = kBadPoints[i % kBadPoints.size()];
    mixed.add(bad.p[0], bad.p[1], bad.p[2], 1, bad.weight);
    const auto at = [&](std::size_t axis) { return static_cast<double>(good.xyz[3 * i + axis]); };
    mixed.add(at(0), at(1), at(2), good.components[i], static_cast<double>(good.weights[i]));
  }
  static_cast<void>(pair.reference.integrate(good));
  const ScanReport report = pair.mapper.integrate(mixed);
  CHECK(report.non_finite == 8 * good.size() / 10);
  CHECK(pair.unchanged());
}

TEST_CASE("bad input: points outside the grid are counted and leave no trace") {
  const InferenceMode mode = GENERATE(from_range(kModes));
  InferenceConfig config = plain(mode);
  config.max_range_m = 0.0F;
  config.free_space.enabled = GENERATE(true, false);
  for (const double far_m : {9e5, 1e9, 1e20, 3e38}) {
    CAPTURE(static_cast<int>(mode), far_m);
    Pair pair(config);
    Cloud cloud;
    cloud.add(far_m, 0, 0, 1);
    cloud.add(0, -far_m, 0, 1);
    cloud.add(far_m, -far_m, far_m, 1);
    const ScanReport report = pair.mapper.integrate(cloud);
    CHECK(report.out_of_grid == 3);
    CHECK(report.admitted == 0);
    CHECK(pair.unchanged());
  }
}

TEST_CASE("bad input: at the grid's border nothing outside is written") {
  const InferenceMode mode = GENERATE(from_range(kModes));
  const int edge = mode == InferenceMode::kLattice ? 2 : GENERATE(1, 2, 4);
  InferenceConfig config = plain(mode);
  config.entropy.block_edge = edge;
  config.min_range_m = 0.0F;
  // Tiles of single-voxel units number half as far as blocks, so this mode ends at half the grid.
  const bool half = mode == InferenceMode::kMultiEntropy && edge == 1;
  const double border_m = 0.125 * kVoxelLimit * (half ? 0.5 : 1.0);
  for (const double side : {-1.0, 1.0}) {
    CAPTURE(static_cast<int>(mode), edge, side);
    Matrix34d T = Matrix34d::Identity();
    T.col(3) = Eigen::Vector3d::Constant(side * (border_m - 2.0));
    Mapper mapper(uncapped_map(0.125), config, 5);
    Random random(33);
    const ScanReport report = mapper.integrate(random_cloud(random, {.points = 600}), T);
    CHECK(report.pose == Status::kOk);
    CHECK(report.out_of_grid > 0);
    CHECK(report.admitted > 0);
    CHECK(report.left_out() == 0);
    CHECK(empty_blocks(mapper.map()) == 0);
  }
}

TEST_CASE("bad input: a pose that is not rigid or not in the grid changes nothing") {
  Pair pair(plain(InferenceMode::kMultiEntropy));
  const std::uint32_t revision = pair.mapper.map().revision();
  std::vector<Matrix34d> poses(9, Matrix34d::Identity());
  poses[0](0, 3) = kNan;
  poses[1](1, 1) = kInf;
  poses[2].leftCols<3>() *= 1.01;
  poses[3].leftCols<3>().setZero();
  poses[4](2, 2) = -1.0;  // a reflection
  poses[5](0, 3) = 1e9;
  poses[6](2, 3) = -1e300;
  poses[7](0, 1) = 0.01;
  poses[8](1, 3) = -kInf;
  Random random(34);
  const Cloud cloud = random_cloud(random, {.points = 100});
  for (std::size_t i = 0; i < poses.size(); ++i) {
    CAPTURE(i);
    const ScanReport report = pair.mapper.integrate(cloud, poses[i]);
    CHECK(report.pose == Status::kInvalidArgument);
    CHECK(report.points == cloud.size());
    CHECK(report.admitted == 0);
    CHECK(pair.mapper.integrator().admitted().empty());
    CHECK(pair.unchanged());
  }
  CHECK(pair.mapper.map().revision() == revision);
}

TEST_CASE("bad input: a scan without points is a scan") {
  const InferenceMode mode = GENERATE(from_range(kModes));
  Pair pair(plain(mode));
  const ScanReport report = pair.mapper.integrate(Cloud{});
  CHECK(report.pose == Status::kOk);
  CHECK(report.points == 0);
  CHECK(report.left_out() == 0);
  CHECK(pair.unchanged());
  Mapper fresh(uncapped_map(0.1), plain(mode), 5);
  static_cast<void>(fresh.integrate(Cloud{}));
  CHECK(fresh.map().block_count() == 0);
}

TEST_CASE("bad input: a component that is no class counts as unlabelled") {
  InferenceConfig config = plain(InferenceMode::kCounting);
  Mapper mapper(uncapped_map(0.1), config, 5);
  Cloud cloud;
  for (const int component : {0, 6, 7, 63, 64, 254, 255})
    cloud.add(1.0 + component * 0.01, 1.0, 0.0, component);
  const ScanReport report = mapper.integrate(cloud);
  CHECK(report.unlabelled == 7);
  for (const OraclePoint& point : mapper.admitted()) CHECK(point.component == 6);
}

TEST_CASE(
    "bad input: weights under the least count leave no label evidence, even without a cut-off") {
  for (const InferenceMode mode : kModes) {
    InferenceConfig config = plain(mode);
    config.min_weight = 0.0F;
    config.free_space.enabled = false;
    Mapper mapper(uncapped_map(0.1), config, 5);
    Cloud cloud;
    for (int i = 0; i < 20; ++i) cloud.add(2.0 + 0.3 * i, 1.0, 1.0, 1, i % 2 == 0 ? 1e-39 : 1e-20);
    static_cast<void>(mapper.integrate(cloud));
    CHECK(mapper.map().usage().label_voxels == 0);
  }
}

TEST_CASE("bad input: weight zero leaves no label evidence") {
  const InferenceMode mode = GENERATE(from_range(kModes));
  InferenceConfig config = plain(mode);
  config.free_space.enabled = false;
  Mapper mapper(uncapped_map(0.1), config, 5);
  Cloud cloud;
  for (int i = 0; i < 20; ++i) cloud.add(1.0 + 0.1 * i, 1.0, 0.0, 1, 0.0);
  static_cast<void>(mapper.integrate(cloud));
  CHECK(mapper.map().block_count() == 0);
}

TEST_CASE(
    "determinism: the same scans twice give the same content, whatever the integrator saw before") {
  const InferenceMode mode = GENERATE(from_range(kModes));
  const InferenceConfig config = plain(mode);
  Random random(announce_seed(35));
  std::vector<Cloud> scans;
  for (int i = 0; i < 4; ++i)
    scans.push_back(random_cloud(random, {.points = 500, .weighted = true}));
  Mapper a(uncapped_map(0.1), config, 5);
  Mapper b(uncapped_map(0.1), config, 5);
  static_cast<void>(b.integrate(random_cloud(random, {.points = 900})));
  b.map().clear();
  for (const Cloud& scan : scans) {
    static_cast<void>(a.integrate(scan));
    static_cast<void>(b.integrate(scan));
  }
  CHECK(same_content(a.map(), b.map()));
}

}  // namespace tessera::oracle
