// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Probabilities of what counts are worth, against the formula of docs/design/theory.md,
// Probabilities, with pow in place of roots and products.
#include "tessera/semantics/reading.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "tessera/semantics/estimate.hpp"

namespace tessera {
namespace {

ClassTable street() {
  ClassTable classes;
  for (const char* name : {"road", "vegetation", "pole"})
    REQUIRE(classes.add(name, {}) == Status::kOk);
  return classes;
}

VoxelEvidence counts(const std::vector<float>& sigma, float rest = 0.0F) {
  VoxelEvidence evidence;
  evidence.num_components = static_cast<int>(sigma.size());
  for (std::size_t l = 0; l < sigma.size(); ++l) evidence.sigma[l] = sigma[l];
  evidence.rest = rest;
  return evidence;
}

Reading reading(double resolution_m = 0.1, double prior = 0.001, bool label_votes = false) {
  return {Probabilities::kEffective, prior, resolution_m, street(), label_votes};
}

/// N of docs/design/theory.md, Probabilities.
double effective_number(double total, double resolution_m) {
  const double d = std::pow(total * 0.1 / resolution_m, 0.75);
  return 4.2 * d / (1.0 + 0.28 * d);
}

/// The probabilities; the last one is of the rest.
std::vector<double> by_hand(const VoxelEvidence& evidence, double resolution_m, double prior,
                            double around) {
  constexpr double kWorth[] = {1.0, 1.0, 0.75, 0.375, 0.125, 0.125};
  const double total = evidence.total();
  const double n = effective_number(total + around, resolution_m);
  std::vector<double> weights;
  double sum = 0.0;
  for (std::size_t l = 0; l < 6; ++l) {
    const double count = static_cast<double>(l < 5 ? evidence.sigma[l] : evidence.rest);
    const double weight = std::pow(1.0 + n * kWorth[l] * count / total / 8.0, 8.0) - 1.0;
    weights.push_back(weight + (l < 5 ? 78.0 * prior : 0.0));
    sum += weights.back();
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

TEST_CASE("Reading: probabilities are those of the formula, and sum to one") {
  const bool label_votes = GENERATE(false, true);
  const double around = label_votes ? 0.9 : 0.0;
  for (const double resolution_m : {0.05, 0.1, 0.2, 1.0}) {
    for (const double prior : {0.0001, 0.001, 1.0}) {
      for (const VoxelEvidence& evidence :
           {counts({0.0F, 3.0F, 1.0F, 0.5F, 0.0F}), counts({0.4F, 0.0F, 2.5F, 2.0F, 1.0F}, 0.25F),
            counts({0.0F, 0.0F, 0.0F, 100.0F, 0.0F}), counts({0.0F, 0x1p-12F, 0.0F, 0.0F, 0.0F}),
            counts({0.8F, 30.0F, 60.0F, 5.0F, 4.0F}, 0.5F)}) {
        const Reading how = reading(resolution_m, prior, label_votes);
        const std::vector<double> expected = by_hand(evidence, resolution_m, prior, around);
        std::vector<double> found(5);
        summary_of(evidence).distribution(how, found);
        double sum = expected[5];
        for (std::size_t l = 0; l < 5; ++l) {
          CHECK(found[l] == Approx(expected[l]).epsilon(1e-9).margin(1e-15));
          sum += found[l];
        }
        CHECK(sum == Approx(1.0));
        const Estimate e = estimate(evidence, how);
        CHECK(e.probability == Approx(expected[static_cast<std::size_t>(e.label)]).epsilon(1e-9));
        const double n = effective_number(evidence.total() + around, resolution_m);
        CHECK(e.variance ==
              Approx(e.probability * (1.0 - e.probability) / (n + 5.0 * prior + 1.0)));
      }
    }
  }
}

TEST_CASE("Reading: where labels follow votes, a label of few counts is more probable") {
  CHECK(Reading().around() == 0.0);
  CHECK(reading().around() == 0.0);
  const Reading votes = reading(0.1, 0.001, true);
  CHECK(votes.around() == Reading::kAround);
  const VoxelEvidence few = counts({0, 0.05F, 0.01F, 0, 0});
  CHECK(estimate(few, votes).probability > 1.5 * estimate(few, reading()).probability);
  const VoxelEvidence many = counts({0, 50, 10, 0, 0});
  CHECK(estimate(many, votes).probability ==
        Approx(estimate(many, reading()).probability).epsilon(0.01));
  // Of free space nothing was said around.
  const VoxelEvidence free = counts({0.4F, 0, 0, 0, 0});
  std::vector<double> with(5);
  std::vector<double> without(5);
  summary_of(free).distribution(votes, with);
  summary_of(free).distribution(reading(), without);
  CHECK(with == without);
}

TEST_CASE("Reading: label, state, evidence and occupancy do not depend on it") {
  const VoxelEvidence evidence = counts({0.4F, 0.0F, 2.5F, 2.75F, 1.0F}, 0.25F);
  const Estimate plain = estimate(evidence, 0.001);
  const Estimate read = estimate(evidence, reading());
  CHECK(read.label == plain.label);
  CHECK(read.state == plain.state);
  CHECK(read.evidence == plain.evidence);
  CHECK(read.occupancy == plain.occupancy);
  CHECK(read.probability != plain.probability);
}

TEST_CASE("Reading: more that agrees is more probable, and never certain") {
  double last = 0.0;
  for (float count = 0.01F; count < 1e6F; count *= 3.0F) {
    const double probability = estimate(counts({0, count, 0, 0, 0}), reading()).probability;
    CHECK(probability > last);
    CHECK(probability < 1.0);
    last = probability;
  }
  CHECK(last > 0.99);
  // Equal shares of more evidence are told apart better.
  CHECK(estimate(counts({0, 7, 3, 0, 0}), reading()).probability <
        estimate(counts({0, 70, 30, 0, 0}), reading()).probability);
}

TEST_CASE("Reading: the same count is worth less in a larger voxel, and of a thin class") {
  const VoxelEvidence road = counts({0, 2, 0, 0, 0});
  CHECK(estimate(road, reading(0.2)).probability < estimate(road, reading(0.1)).probability);
  CHECK(estimate(counts({0, 0, 0, 2, 0}), reading()).probability <
        estimate(counts({0, 0, 2, 0, 0}), reading()).probability);
  CHECK(estimate(counts({0, 0, 2, 0, 0}), reading()).probability <
        estimate(road, reading()).probability);
  for (const char* name : {"Traffic-Sign", "traffic_sign", "TRAFFIC SIGN"})
    CHECK(Reading::worth_by_name(name) == Reading::kDoubtful);
  CHECK(Reading::worth_by_name("no such class") == Reading::kUsual);
}

TEST_CASE(
    "Reading: where shares are asked for, or there is no prior, it is eq. 8 to the last bit") {
  const VoxelEvidence evidence = counts({0.4F, 0.0F, 2.5F, 2.75F, 1.0F}, 0.25F);
  for (const double prior : {0.0, 0.001}) {
    const Estimate expected = estimate(evidence, prior);
    const auto of = prior > 0.0 ? Probabilities::kShares : Probabilities::kEffective;
    const Reading how(of, prior, 0.1, street());
    const Estimate found = estimate(evidence, how);
    CHECK(found.probability == expected.probability);
    CHECK(found.variance == expected.variance);
    std::vector<double> shares(5);
    summary_of(evidence).distribution(how, shares);
    for (int l = 0; l < 5; ++l)
      CHECK(shares[static_cast<std::size_t>(l)] == probability_of(evidence, l, prior));
  }
}

TEST_CASE("Reading: of nothing observed nothing is probable") {
  CHECK(estimate(counts({0, 0, 0, 0, 0}), reading()).probability == 0.0);
  std::vector<double> found(5);
  summary_of(counts({0, 0, 0, 0, 0})).distribution(reading(), found);
  for (const double probability : found) CHECK(probability == Approx(0.2));
}

}  // namespace
}  // namespace tessera
