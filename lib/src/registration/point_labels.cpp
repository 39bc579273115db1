// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/registration/point_labels.hpp"

namespace tessera {

namespace {

constexpr double kOne = kOneLabel;  ///< The whole weight of a point.

/// Shares of at most one in all, in 255ths, by the largest remainders: among equals the first gets
/// more. The result sums to the rounded sum.
void apportion(std::span<const double> shares, std::span<std::uint8_t> weights) noexcept {
  std::array<double, kMostLabels> remainder{};
  double sum = 0.0;
  int given = 0;
  for (std::size_t j = 0; j < shares.size(); ++j) {
    const double exact = shares[j] * kOne;
    const int whole = floor_to_int(exact);
    weights[j] = static_cast<std::uint8_t>(whole);
    remainder[j] = exact - static_cast<double>(whole);
    sum += exact;
    given += whole;
  }
  const int wanted = floor_to_int(sum + 0.5);
  for (int left = (wanted < kOneLabel ? wanted : kOneLabel) - given; left > 0; --left) {
    std::size_t most = 0;
    for (std::size_t j = 1; j < shares.size(); ++j) {
      if (remainder[j] > remainder[most]) most = j;
    }
    ++weights[most];
    remainder[most] = -1.0;
  }
}

/// Labels as they come, put in order; what has no weight is left out.
class LabelList {
 public:
  /// Keeps equals in their order. At most kMostLabels with a weight.
  void insert(std::uint8_t component, std::uint8_t weight) noexcept {
    if (weight == 0) return;
    std::size_t at = count_++;
    for (; at > 0 && weight > weights_[at - 1]; --at) {
      components_[at] = components_[at - 1];
      weights_[at] = weights_[at - 1];
    }
    components_[at] = component;
    weights_[at] = weight;
  }
  /// False: there are no labels.
  bool give(std::uint8_t unlabelled, ScanPoint& point) const noexcept {
    point.component = count_ > 0 ? components_[0] : unlabelled;
    point.second = components_[1];
    point.third = components_[2];
    point.label_weights = count_ > 0 ? weights_[0] : kOneLabel;
    for (std::size_t j = 1; j < kMostLabels; ++j)
      point.label_weights |= std::uint32_t{weights_[j]} << (8 * j);
    return count_ > 0;
  }

 private:
  std::array<std::uint8_t, kMostLabels> components_{};
  std::array<std::uint8_t, kMostLabels> weights_{};
  std::size_t count_ = 0;
};

}  // namespace

Status quantise_label_weights(std::span<const float> probabilities,
                              std::span<std::uint8_t> weights) noexcept {
  for (std::uint8_t& weight : weights) weight = 0;
  if (probabilities.size() > kMostLabels || probabilities.size() != weights.size())
    return Status::kInvalidArgument;
  std::array<double, kMostLabels> shares{};
  double sum = 0.0;
  for (std::size_t j = 0; j < probabilities.size(); ++j) {
    // Fails for NaN.
    if (!(probabilities[j] >= 0.0F && probabilities[j] <= 1.0F + kMostExcess))
      return Status::kInvalidArgument;
    shares[j] = static_cast<double>(probabilities[j]);
    sum += shares[j];
  }
  if (sum > 1.0 + static_cast<double>(kMostExcess)) return Status::kInvalidArgument;
  apportion(std::span(shares).first(probabilities.size()), weights);
  return Status::kOk;
}

PointLabeller::PointLabeller(const ScanView& scan, std::uint8_t unlabelled) noexcept
    : components_(scan.components),
      weights_(scan.label_weights),
      labels_(scan.labels_per_point),
      unlabelled_(unlabelled) {
  for (std::uint8_t c = 1; c < unlabelled; ++c) class_of_[c] = c;
  if (components_ == nullptr) {
    kind_ = Kind::kNone;
  } else if (weights_ == nullptr) {
    kind_ = labels_ == 1 ? Kind::kPlain : Kind::kWrong;
  } else {
    kind_ = labels_ >= 1 && labels_ <= kMostLabels ? Kind::kWeighted : Kind::kWrong;
  }
}

Labelling PointLabeller::label_weighted(std::size_t i, ScanPoint& point) const noexcept {
  const std::uint8_t* const components = components_ + i * labels_;
  const std::uint8_t* const weights = weights_ + i * labels_;
  unsigned sum = 0;
  for (std::size_t j = 0; j < labels_; ++j) sum += weights[j];
  if (sum > kOneLabel) return without_label(point, Labelling::kWrong);
  LabelList list;
  for (std::size_t j = 0; j < labels_; ++j) {
    const std::uint8_t label = class_of_[components[j]];
    if (label == 0) continue;
    // A class that is named twice is one label.
    unsigned weight = 0;
    bool named_before = false;
    for (std::size_t other = 0; other < labels_; ++other) {
      if (components[other] != components[j]) continue;
      weight += weights[other];
      named_before = named_before || other < j;
    }
    if (!named_before) list.insert(label, static_cast<std::uint8_t>(weight));
  }
  return list.give(unlabelled_, point) ? Labelling::kLabelled : Labelling::kUnlabelled;
}

}  // namespace tessera
