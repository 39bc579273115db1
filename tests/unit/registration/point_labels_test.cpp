// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Labels with weights: how probabilities become 255ths, and what a point has of its scan's labels.
#include "tessera/registration/point_labels.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <numeric>
#include <vector>

#include "support/random.hpp"

namespace tessera {
namespace {

using oracle::Random;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uint8_t kUnlabelled = 6;  ///< C = 5.
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

Bytes quantised(const std::vector<float>& probabilities) {
  Bytes weights(probabilities.size(), 77);
  REQUIRE(quantise_label_weights(probabilities, weights) == Status::kOk);
  return weights;
}
bool is_refused(const std::vector<float>& probabilities) {
  Bytes weights(probabilities.size(), 77);
  const Status status = quantise_label_weights(probabilities, weights);
  for (const std::uint8_t weight : weights) CHECK((status == Status::kOk || weight == 0));
  return status == Status::kInvalidArgument;
}

/// A point with labels, its components and weights side by side.
struct Labelled {
  Labelling labelling{};
  Bytes components{};
  Bytes weights{};
};
Labelled labelled(const Bytes& components, const Bytes& weights, std::size_t labels) {
  const ScanView view{.count = components.size() / labels,
                      .components = components.data(),
                      .labels_per_point = labels,
                      .label_weights = weights.empty() ? nullptr : weights.data()};
  const PointLabeller labeller(view, kUnlabelled);
  ScanPoint point;
  Labelled found{.labelling = labeller.label(0, point)};
  const Bytes named{point.component, point.second, point.third};
  std::uint32_t left = point.label_weights;
  for (std::size_t j = 0; j < named.size() && left != 0; ++j, left >>= 8U) {
    found.components.push_back(named[j]);
    found.weights.push_back(static_cast<std::uint8_t>(left));
  }
  CHECK(left == 0);
  CHECK(std::accumulate(found.weights.begin(), found.weights.end(), 0) <= kOneLabel);
  CHECK(point.has_one_label() == (found.weights == Bytes{kOneLabel}));
  if (labeller.weighted()) {
    ScanPoint best;
    CHECK(labeller.label_best(0, best) == found.labelling);
    CHECK(best.component == point.component);
    CHECK(best.has_one_label() == point.has_one_label());
  }
  return found;
}

}  // namespace

TEST_CASE("quantise_label_weights: the nearest 255ths whose sum is the rounded sum") {
  CHECK(quantised({}) == Bytes{});
  CHECK(quantised({1.0F}) == Bytes{255});
  CHECK(quantised({0.0F, 1.0F, 0.0F}) == Bytes{0, 255, 0});
  CHECK(quantised({1.0F / 3.0F, 1.0F / 3.0F, 1.0F / 3.0F}) == Bytes{85, 85, 85});
  CHECK(quantised({0.5F, 0.5F}) == Bytes{128, 127});  // Among equals the first.
  CHECK(quantised({0.9999F, 0.0001F}) == Bytes{255, 0});
  CHECK(quantised({0.6F, 0.2F, 0.1F}) == Bytes{153, 51, 26});
  Random random(5);
  for (int round = 0; round < 20000; ++round) {
    std::vector<float> p(1 + static_cast<std::size_t>(random.below(3)));
    double left = random.below(3) == 0 ? 1.0 : random.uniform(0.0, 1.0);
    for (float& one : p) {
      one = static_cast<float>(random.uniform(0.0, left));
      left -= static_cast<double>(one);
    }
    const Bytes weights = quantised(p);
    double sum = 0.0;
    int whole = 0;
    for (std::size_t j = 0; j < p.size(); ++j) {
      REQUIRE(std::abs(255.0 * static_cast<double>(p[j]) - weights[j]) < 1.0);
      sum += 255.0 * static_cast<double>(p[j]);
      whole += weights[j];
    }
    REQUIRE(std::abs(sum - whole) <= 0.5 + 1e-6);
    REQUIRE(whole <= kOneLabel);
  }
}

TEST_CASE("quantise_label_weights: what is no distribution is refused, and rounding is none") {
  for (const float bad : {-0.001F, kNan, kInf, -kInf, 1.1F})
    for (std::size_t at = 0; at < 3; ++at) {
      std::vector<float> p{0.1F, 0.1F, 0.1F};
      p[at] = bad;
      CHECK(is_refused(p));
    }
  CHECK(is_refused({0.6F, 0.5F}));
  CHECK(is_refused({0.1F, 0.1F, 0.1F, 0.1F}));  // More than kMostLabels.
  CHECK_FALSE(is_refused({-0.0F, 1.0F}));
  // As half-precision numbers sum.
  CHECK(quantised({0.7F, 0.2F, 0.1F + 0.9F * kMostExcess}) == Bytes{178, 51, 26});
  CHECK(quantised({0.5F, 0.5F + 0.9F * kMostExcess}) == Bytes{127, 128});
  CHECK(is_refused({0.7F, 0.2F, 0.1F + 1.1F * kMostExcess}));
  Bytes weights(2, 77);
  const std::array<float, 3> three{0.1F, 0.1F, 0.1F};
  CHECK(quantise_label_weights(three, weights) == Status::kInvalidArgument);
}

TEST_CASE("PointLabeller: one label as it is given") {
  CHECK(labelled({3}, {}, 1).components == Bytes{3});
  CHECK(labelled({3}, {255}, 1).components == Bytes{3});
  CHECK(labelled({3, 1, 2}, {255, 0, 0}, 3).components == Bytes{3});
  CHECK(labelled({1, 3, 2}, {0, 255, 0}, 3).components == Bytes{3});
  for (const std::uint8_t none :
       {std::uint8_t{0}, kUnlabelled, std::uint8_t{7}, std::uint8_t{255}}) {
    const Labelled given = labelled({none}, {}, 1);
    CHECK(given.labelling == Labelling::kUnlabelled);
    CHECK(given.components == Bytes{kUnlabelled});
    CHECK(labelled({none}, {255}, 1).components == Bytes{kUnlabelled});
  }
  ScanPoint point;
  CHECK(PointLabeller({}, kUnlabelled).label(0, point) == Labelling::kUnlabelled);
  CHECK(point.component == kUnlabelled);
}

TEST_CASE("PointLabeller: the heaviest first") {
  const Labelled three = labelled({1, 2, 3}, {10, 200, 30}, 3);
  CHECK(three.labelling == Labelling::kLabelled);
  CHECK(three.components == Bytes{2, 3, 1});
  CHECK(three.weights == Bytes{200, 30, 10});
  CHECK(labelled({4, 1, 2}, {85, 85, 85}, 3).components == Bytes{4, 1, 2});  // Equals as given.
  CHECK(labelled({5, 1}, {1, 2}, 2).components == Bytes{1, 5});
  CHECK(labelled({2}, {100}, 1).weights == Bytes{100});
}

TEST_CASE("PointLabeller: a class that is named twice is one label, and what is no class is none") {
  CHECK(labelled({2, 1, 2}, {60, 100, 95}, 3).weights == Bytes{155, 100});
  CHECK(labelled({2, 1, 2}, {60, 100, 95}, 3).components == Bytes{2, 1});
  CHECK(labelled({2, 2, 2}, {85, 85, 85}, 3).components == Bytes{2});
  CHECK(labelled({5, 5, 1}, {155, 100, 0}, 3).weights == Bytes{255});
  CHECK(labelled({5, 1, 5}, {150, 5, 100}, 3).weights == Bytes{250, 5});
  CHECK(labelled({1, 5, 5}, {100, 80, 75}, 3).components == Bytes{5, 1});
  const Labelled unknown = labelled({0, 1, 99}, {100, 50, 105}, 3);
  CHECK(unknown.components == Bytes{1});
  CHECK(unknown.weights == Bytes{50});
  CHECK(labelled({0, 99, 6}, {100, 100, 55}, 3).labelling == Labelling::kUnlabelled);
  CHECK(labelled({1, 2, 3}, {0, 0, 0}, 3).labelling == Labelling::kUnlabelled);
}

TEST_CASE("PointLabeller: wrong weights make a point unlabelled, and say so") {
  for (const Bytes& weights : {Bytes{255, 1, 0}, Bytes{128, 64, 64}, Bytes{255, 255, 255}}) {
    const Labelled wrong = labelled({1, 2, 3}, weights, 3);
    CHECK(wrong.labelling == Labelling::kWrong);
    CHECK(wrong.components == Bytes{kUnlabelled});
  }
  CHECK(labelled({1, 2}, {}, 2).labelling == Labelling::kWrong);  // None, of several labels.
  CHECK(labelled({1, 2, 3, 4}, {1, 1, 1, 1}, 4).labelling == Labelling::kWrong);
  const Bytes component{1};
  const ScanView none{.count = 1, .components = component.data(), .labels_per_point = 0};
  ScanPoint point;
  CHECK(PointLabeller(none, kUnlabelled).label(0, point) == Labelling::kWrong);
}

}  // namespace tessera
