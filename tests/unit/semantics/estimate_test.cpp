// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What counts say about a voxel, against figures worked out by hand.
#include "tessera/semantics/estimate.hpp"

#include <catch2/catch.hpp>
#include <string>

#include "support/random.hpp"

namespace tessera {
namespace {

VoxelEvidence counts(std::initializer_list<float> sigma) {
  VoxelEvidence evidence;
  for (const float count : sigma) {
    evidence.sigma[static_cast<std::size_t>(evidence.num_components++)] = count;
  }
  return evidence;
}

// Three classes, so five components; prior 1/2. Sum of counts 8.5, concentration 5 / 2 + 8.5 = 11.
const VoxelEvidence kExample = counts({1.0F, 4.0F, 0.0F, 2.5F, 1.0F});
constexpr double kExamplePrior = 0.5;

TEST_CASE("probability_of: eq. 8 by hand") {
  CHECK(probability_of(kExample, 0, kExamplePrior) == Approx(1.5 / 11.0));
  CHECK(probability_of(kExample, 1, kExamplePrior) == Approx(4.5 / 11.0));
  CHECK(probability_of(kExample, 2, kExamplePrior) == Approx(0.5 / 11.0));
  CHECK(probability_of(kExample, 3, kExamplePrior) == Approx(3.0 / 11.0));
  CHECK(probability_of(kExample, 4, kExamplePrior) == Approx(1.5 / 11.0));
}

TEST_CASE("probability_of: sums to one over the components") {
  constexpr std::uint64_t kSeed = 61;
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  for (int round = 0; round < 500; ++round) {
    VoxelEvidence evidence;
    evidence.num_components = 3 + random.below(kMaxComponents - 2);
    for (int l = 0; l < evidence.num_components; ++l) {
      evidence.sigma[static_cast<std::size_t>(l)] = static_cast<float>(random.uniform(0.0, 50.0));
    }
    double sum = 0.0;
    for (int l = 0; l < evidence.num_components; ++l) sum += probability_of(evidence, l, 0.01);
    REQUIRE(sum == Approx(1.0).epsilon(1e-12));
  }
}

TEST_CASE("estimate: label, eq. 8 and eq. 17 by hand") {
  const Estimate result = estimate(kExample, kExamplePrior);
  CHECK(result.label == 1);
  CHECK(result.probability == Approx(4.5 / 11.0).epsilon(1e-12));
  CHECK(result.variance == Approx(29.25 / 1452.0).epsilon(1e-12));  // (4.5/11) (6.5/11) / 12
  CHECK(result.evidence == 8.5);
  CHECK(result.occupancy == Approx(9.5 / 11.0).epsilon(1e-12));
  CHECK(result.state == VoxelState::kOccupied);
}

TEST_CASE("estimate: no evidence is unknown, with and without a prior") {
  for (const double prior : {0.0, 0.001, 1.0}) {
    const Estimate result = estimate(counts({0.0F, 0.0F, 0.0F, 0.0F}), prior);
    CHECK(result.state == VoxelState::kUnknown);
    CHECK(result.label == 0);
    CHECK(result.probability == 0.0);
    CHECK(result.variance == 0.0);
    CHECK(result.evidence == 0.0);
  }
}

TEST_CASE("estimate: the occupancy of an unknown voxel is the prior's, and 0 where there is none") {
  CHECK(estimate(counts({0.0F, 0.0F, 0.0F, 0.0F}), 0.001).occupancy == Approx(0.75));
  CHECK(estimate(counts({0.0F, 0.0F, 0.0F, 0.0F}), 0.0).occupancy == 0.0);
}

TEST_CASE("estimate: free evidence alone is free and has no label") {
  const Estimate result = estimate(counts({2.0F, 0.0F, 0.0F, 0.0F}), 0.001);
  CHECK(result.state == VoxelState::kFree);
  CHECK(result.label == 0);
  CHECK(result.probability == 0.0);
  CHECK(result.variance == 0.0);
  CHECK(result.occupancy == Approx(1.0 - 2.001 / 2.004).epsilon(1e-12));
}

TEST_CASE("estimate: occupied iff occupancy is over a half, exactly a half is free") {
  CHECK(estimate(counts({1.0F, 1.0F, 0.0F}), 0.0).state == VoxelState::kFree);
  CHECK(estimate(counts({1.0F, 1.0F + 0x1p-23F, 0.0F}), 0.0).state == VoxelState::kOccupied);
  CHECK(estimate(counts({1.0F + 0x1p-23F, 1.0F, 0.0F}), 0.0).state == VoxelState::kFree);
}

TEST_CASE("estimate: a free voxel still names the class it has most evidence of") {
  const Estimate result = estimate(counts({5.0F, 0.0F, 1.0F, 0.0F}), 0.0);
  CHECK(result.state == VoxelState::kFree);
  CHECK(result.label == 2);
  CHECK(result.probability == Approx(1.0 / 6.0));
}

TEST_CASE("estimate: ties go to the lowest class") {
  CHECK(estimate(counts({0.0F, 1.0F, 3.0F, 3.0F, 3.0F, 0.0F}), 0.001).label == 2);
  CHECK(estimate(counts({0.0F, 2.0F, 2.0F, 0.0F}), 0.001).label == 1);
}

TEST_CASE("estimate: unlabelled evidence alone makes a voxel occupied with label 0") {
  const Estimate result = estimate(counts({0.0F, 0.0F, 0.0F, 3.0F}), 0.001);
  CHECK(result.state == VoxelState::kOccupied);
  CHECK(result.label == 0);
  CHECK(result.probability == 0.0);
  CHECK(result.variance == 0.0);
  CHECK(result.evidence == 3.0);
}

TEST_CASE("estimate: unlabelled evidence never wins over a class, however much there is") {
  const Estimate result = estimate(counts({0.0F, 0.0F, 0.5F, 30.0F}), 0.001);
  CHECK(result.label == 2);
  CHECK(result.probability == Approx(0.501 / 30.504).epsilon(1e-7));
}

TEST_CASE("estimate: without a prior one observation is certain, with variance zero") {
  const Estimate result = estimate(counts({0.0F, 0.0F, 1.0F, 0.0F}), 0.0);
  CHECK(result.label == 2);
  CHECK(result.probability == 1.0);
  CHECK(result.variance == 0.0);
}

TEST_CASE("estimate: the variance falls as the same evidence is seen again") {
  double last = 1.0;
  for (int times = 1; times <= 20; ++times) {
    const auto n = static_cast<float>(times);
    const double variance = estimate(counts({0.0F, 2.0F * n, n, 0.0F}), 0.001).variance;
    CHECK(variance < last);
    last = variance;
  }
}

TEST_CASE("estimate: the last class counts, the unlabelled component behind it is not a class") {
  VoxelEvidence evidence;
  evidence.num_components = kMaxComponents;
  evidence.sigma[kMaxClasses] = 2.0F;
  evidence.sigma[kMaxClasses + 1] = 3.0F;
  CHECK(estimate(evidence, 0.001).label == kMaxClasses);
}

TEST_CASE("to_string: names the three states as the contract has them") {
  CHECK(std::string(to_string(VoxelState::kUnknown)) == "unknown");
  CHECK(std::string(to_string(VoxelState::kFree)) == "free");
  CHECK(std::string(to_string(VoxelState::kOccupied)) == "occupied");
}

}  // namespace
}  // namespace tessera
