// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Labels with weights: one label of weight one is the same map bit for bit, wrong ones lose
// nothing, and what labels share adds up.
#include <catch2/catch.hpp>
#include <cmath>

#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

InferenceConfig config_of(InferenceMode mode, double thinning_m) {
  InferenceConfig config;
  config.mode = mode;
  config.kernel_length_m = 0.3F;
  config.min_range_m = 0.0F;
  config.thinning_m = thinning_m;
  return config;
}

/// Each point's labels, written as others that mean the same: so many, at any place, the rest of
/// any class without a weight.
Cloud written_otherwise(const Cloud& cloud, std::size_t labels, Random& random, int classes) {
  Cloud same = cloud;
  same.labels_per_point = labels;
  same.components.clear();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto at = static_cast<std::size_t>(random.below(static_cast<int>(labels)));
    for (std::size_t j = 0; j < labels; ++j) {
      const auto any = static_cast<std::uint8_t>(random.below(classes + 3));
      same.components.push_back(j == at ? cloud.components[i] : any);
      same.label_weights.push_back(j == at ? kOneLabel : std::uint8_t{0});
    }
  }
  return same;
}

}  // namespace

TEST_CASE("weighted labels: one label of weight one gives the bits of a label without") {
  const auto mode = GENERATE(InferenceMode::kCounting, InferenceMode::kKernel,
                             InferenceMode::kMultiEntropy, InferenceMode::kLattice);
  const auto tuple = GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact);
  const double thinning_m = GENERATE(0.0, 0.1, 0.25);
  CAPTURE(to_string(mode), thinning_m);
  MapConfig map = uncapped_map(0.1);
  map.tuple = tuple;
  Random random(announce_seed(701));
  int with_rest = 0;
  for (std::size_t labels = 1; labels <= kMostLabels; ++labels) {
    const CloudOptions options{.points = 600, .weighted = labels == 2};
    Mapper plain(map, config_of(mode, thinning_m), options.classes);
    Mapper weighted(map, config_of(mode, thinning_m), options.classes);
    for (int scan = 0; scan < 2; ++scan) {
      const Cloud cloud = random_cloud(random, options);
      const ScanReport one = plain.integrate(cloud);
      const ScanReport other =
          weighted.integrate(written_otherwise(cloud, labels, random, options.classes));
      CHECK(other.unlabelled == one.unlabelled);
      CHECK(other.weighted_labels == 0);
      CHECK(other.wrong_labels == 0);
      CHECK(other.voxel_updates == one.voxel_updates);
      CHECK(other.evaluations == one.evaluations);
    }
    CHECK(same_content(plain.map(), weighted.map()));
    for (const auto& [voxel, evidence] : observed_voxels(plain.map()))
      with_rest += evidence.rest > 0.0F ? 1 : 0;
  }
  // A kernel spreads more classes than compact counts have slots for.
  if (tuple == TuplePolicy::kCompact && mode == InferenceMode::kKernel) CHECK(with_rest > 0);
}

TEST_CASE("weighted labels: wrong ones make returns unlabelled, counted, and lose none") {
  const auto mode =
      GENERATE(InferenceMode::kCounting, InferenceMode::kKernel, InferenceMode::kMultiEntropy);
  Random random(announce_seed(702));
  const CloudOptions options{.points = 600};
  Cloud wrong = random_cloud(random, options);
  Cloud bare = wrong;
  share_labels(random, options.classes, wrong);
  // In each, every third point has weights that sum to more than one.
  for (std::size_t i = 0; i < wrong.size(); i += 3) {
    wrong.label_weights[3 * i] = 255;
    wrong.label_weights[3 * i + 1] = 1;
  }
  Cloud repaired = wrong;
  for (std::size_t i = 0; i < wrong.size(); i += 3) {
    for (std::size_t j = 0; j < 3; ++j) repaired.label_weights[3 * i + j] = 0;
  }
  Mapper one(uncapped_map(0.1), config_of(mode, 0.1), options.classes);
  Mapper other(uncapped_map(0.1), config_of(mode, 0.1), options.classes);
  const ScanReport report = one.integrate(wrong);
  static_cast<void>(other.integrate(repaired));
  CHECK(report.wrong_labels == (wrong.size() + 2) / 3);
  CHECK(report.weighted_labels > wrong.size() / 4);
  CHECK(report.in_range == wrong.size());
  CHECK(same_content(one.map(), other.map()));

  bare.labels_per_point = 2;  // Two labels each, and no weights.
  Mapper third(uncapped_map(0.1), config_of(mode, 0.1), options.classes);
  CHECK(third.integrate(bare).wrong_labels == bare.size());
}

TEST_CASE("weighted labels: all of a point's labels together weigh what one would") {
  const auto mode =
      GENERATE(InferenceMode::kCounting, InferenceMode::kKernel, InferenceMode::kMultiEntropy);
  Random random(announce_seed(703));
  const CloudOptions options{.points = 600, .unlabelled = 0.0, .weighted = true};
  Cloud one = random_cloud(random, options);
  // All points agree on the best label, so that no entropy differs.
  for (std::uint8_t& component : one.components) component = 2;
  Cloud shared = one;
  shared.labels_per_point = 3;
  shared.components.clear();
  for (std::size_t i = 0; i < one.size(); ++i) {
    const auto second = static_cast<std::uint8_t>(random.below(100));
    shared.components.insert(shared.components.end(), {2, 4, 5});
    shared.label_weights.insert(
        shared.label_weights.end(),
        {128, second, static_cast<std::uint8_t>(random.below(127 - second))});
  }
  Mapper whole(uncapped_map(0.1), config_of(mode, 0.0), options.classes);
  Mapper parts(uncapped_map(0.1), config_of(mode, 0.0), options.classes);
  static_cast<void>(whole.integrate(one));
  static_cast<void>(parts.integrate(shared));
  const std::map<Voxel, VoxelEvidence> wanted = observed_voxels(whole.map());
  const std::map<Voxel, VoxelEvidence> found = observed_voxels(parts.map());
  REQUIRE(found.size() == wanted.size());
  for (const auto& [voxel, evidence] : wanted) {
    const VoxelEvidence& other = found.at(voxel);
    REQUIRE(other.total() == Approx(evidence.total()).epsilon(1e-5));
    if (evidence.sigma[2] == 0.0F) continue;
    REQUIRE(static_cast<double>(other.sigma[2]) ==
            Approx(static_cast<double>(evidence.sigma[2]) * 128.0 / 255.0).epsilon(1e-5));
    REQUIRE(other.sigma[4] + other.sigma[5] > 0.0F);
  }
}

TEST_CASE("weighted labels: in compact counts what is small goes to the rest, and none is lost") {
  const auto mode =
      GENERATE(InferenceMode::kCounting, InferenceMode::kKernel, InferenceMode::kMultiEntropy);
  MapConfig compact = uncapped_map(0.1);
  compact.tuple = TuplePolicy::kCompact;
  Cloud cloud;
  cloud.add(2.05, 0.05, 0.05, 1);
  cloud.labels_per_point = 3;
  cloud.components = {2, 4, 5};
  const int second = GENERATE(15, 16);
  cloud.label_weights = {200, static_cast<std::uint8_t>(second), 15};
  Mapper dense(uncapped_map(0.1), config_of(mode, 0.0), 5);
  Mapper small(compact, config_of(mode, 0.0), 5);
  static_cast<void>(dense.integrate(cloud));
  static_cast<void>(small.integrate(cloud));
  const Point3f p(2.05F, 0.05F, 0.05F);
  const VoxelEvidence all = dense.map().evidence(p);
  const VoxelEvidence kept = small.map().evidence(p);
  const auto of_point = [](int weight) { return static_cast<float>(weight) / 255.0F; };
  constexpr double kQuantum = 1.0 / 4096.0;
  const auto is = [](float value, float wanted) {
    return std::abs(static_cast<double>(value) - static_cast<double>(wanted)) <= kQuantum;
  };
  CHECK(is(all.sigma[4], of_point(second)));
  CHECK(is(all.sigma[5], of_point(15)));
  CHECK(is(all.sigma[6], of_point(40 - second)));
  CHECK(all.rest == 0.0F);
  CHECK(is(kept.sigma[2], of_point(200)));
  CHECK(is(kept.sigma[4], second == 16 ? of_point(16) : 0.0F));
  CHECK(kept.sigma[5] == 0.0F);
  CHECK(kept.sigma[6] == 0.0F);
  CHECK(is(kept.rest, of_point(second == 16 ? 39 : 55)));
  CHECK(kept.total() == Approx(all.total()).margin(3 * kQuantum));

  // The best label stays, however little it has.
  cloud.label_weights = {1, 0, 0};
  Mapper faint(compact, config_of(mode, 0.0), 5);
  Mapper faint_dense(uncapped_map(0.1), config_of(mode, 0.0), 5);
  static_cast<void>(faint.integrate(cloud));
  static_cast<void>(faint_dense.integrate(cloud));
  for (Mapper* const mapper : {&faint, &faint_dense}) CHECK(mapper->map().query(p).label == 2);
}

TEST_CASE("weighted labels: compact counts have the sums of the dense ones") {
  const auto mode =
      GENERATE(InferenceMode::kCounting, InferenceMode::kKernel, InferenceMode::kMultiEntropy);
  Random random(announce_seed(704));
  const CloudOptions options{.points = 600};
  MapConfig compact = uncapped_map(0.1);
  compact.tuple = TuplePolicy::kCompact;
  InferenceConfig config = config_of(mode, 0.1);
  config.free_space.enabled = false;
  Mapper dense(uncapped_map(0.1), config, options.classes);
  Mapper small(compact, config, options.classes);
  for (int scan = 0; scan < 3; ++scan) {
    Cloud cloud = random_cloud(random, options);
    share_labels(random, options.classes, cloud);
    static_cast<void>(dense.integrate(cloud));
    static_cast<void>(small.integrate(cloud));
  }
  const std::map<Voxel, VoxelEvidence> found = observed_voxels(small.map());
  double rests = 0.0;
  std::size_t checked = 0;
  for (const auto& [voxel, evidence] : observed_voxels(dense.map())) {
    const auto other = found.find(voxel);
    if (other == found.end()) {
      CHECK(evidence.total() < 0.01);  // Less than half a quantum of each class.
      continue;
    }
    // Half a quantum for each class of each scan.
    REQUIRE(other->second.total() == Approx(evidence.total()).margin(3 * 7 * 0.5 / 4096.0));
    rests += static_cast<double>(other->second.rest);
    ++checked;
  }
  CHECK(checked > 500);
  CHECK(rests > 10.0);
}

}  // namespace tessera::oracle
