// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/scores.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <span>

#include "base/number_text.hpp"
#include "maps/stored_map.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

/// O(observed voxels), less if there is one.
bool has_label(const LocalMap& map) {
  std::vector<KeyedIndex> workspace = workspace_for(map);
  for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
    bool found = false;
    for_each_observed(map, map.block_at(item.index),
                      [&](const VoxelCoord&, const VoxelEvidence& evidence) {
                        found = found || estimate(evidence, map.config().prior).label != 0;
                      });
    if (found) return true;
  }
  return false;
}

}  // namespace

bool Confusion::present(int label) const {
  const auto i = static_cast<std::size_t>(label);
  return true_positive_[i] + false_negative_[i] > 0;
}

double Confusion::iou(int label) const {
  const auto i = static_cast<std::size_t>(label);
  const std::uint64_t all = true_positive_[i] + false_positive_[i] + false_negative_[i];
  return all == 0 ? 0.0 : static_cast<double>(true_positive_[i]) / static_cast<double>(all);
}

double Confusion::mean_iou(int num_classes) const {
  double sum = 0.0;
  int count = 0;
  for (int label = 1; label <= num_classes; ++label) {
    if (!present(label)) continue;
    sum += iou(label);
    ++count;
  }
  return count == 0 ? 0.0 : sum / count;
}

Json Confusion::counts(const ClassTable& classes) const {
  Json json = Json::object();
  for (int label = 1; label <= classes.num_classes(); ++label) {
    const auto i = static_cast<std::size_t>(label);
    json[std::string(classes[label].name_view())] = {{"true_positives", true_positive_[i]},
                                                     {"false_positives", false_positive_[i]},
                                                     {"false_negatives", false_negative_[i]}};
  }
  return json;
}

void Reliability::add(bool correct, double probability, double square) {
  const auto part_of = [probability](std::size_t parts) {
    const auto at = static_cast<std::size_t>(probability * static_cast<double>(parts));
    return at < parts ? at : parts - 1;
  };
  Bin& bin = bins_[part_of(kBins)];
  ++bin.points;
  bin.correct += correct ? 1U : 0U;
  bin.probability += probability;
  if (ranks_.empty()) ranks_.resize(kRanks);
  Rank& rank = ranks_[part_of(kRanks)];
  ++rank.points;
  rank.wrong += correct ? 0U : 1U;
  ++points_;
  squares_ += square;
}

double Reliability::calibration_error() const {
  double error = 0.0;
  for (const Bin& bin : bins_)
    error += std::abs(static_cast<double>(bin.correct) - bin.probability);
  return points_ == 0 ? 0.0 : error / static_cast<double>(points_);
}

double Reliability::brier_score() const {
  return points_ == 0 ? 0.0 : squares_ / static_cast<double>(points_);
}

double Reliability::risk_coverage_area() const {
  double area = 0.0;
  double before = 0.0;  // points with more probable labels
  double wrong = 0.0;
  for (std::size_t i = ranks_.size(); i-- > 0;) {
    const Rank& rank = ranks_[i];
    if (rank.points == 0) continue;
    const double share = static_cast<double>(rank.wrong) / static_cast<double>(rank.points);
    for (std::uint64_t n = 1; n <= rank.points; ++n) {
      const auto more = static_cast<double>(n);
      area += (wrong + share * more) / (before + more);
    }
    before += static_cast<double>(rank.points);
    wrong += static_cast<double>(rank.wrong);
  }
  return points_ == 0 ? 0.0 : area / static_cast<double>(points_);
}

Json Reliability::json() const {
  return {{"points", points()},
          {"calibration_error", calibration_error()},
          {"brier_score", brier_score()},
          {"risk_coverage_area", risk_coverage_area()}};
}

namespace {

/// Reliability::add's square.
double square_off(const CountSummary& counts, int components, const Reading& reading, int truth) {
  std::array<double, kMaxComponents> probability;
  const std::span<double> known =
      std::span(probability).first(static_cast<std::size_t>(components));
  counts.distribution(reading, known);
  double sum = 0.0;
  double rest = 1.0;
  for (std::size_t l = 0; l < known.size(); ++l) {
    const double off = known[l] - (static_cast<int>(l) == truth ? 1.0 : 0.0);
    sum += off * off;
    rest -= known[l];
  }
  return sum + rest * rest;
}

}  // namespace

void Scores::add(int truth, const VoxelEvidence& evidence, const Reading& reading, int input) {
  const CountSummary counts = summary_of(evidence);
  const Estimate estimate = counts.estimate(reading);
  ++points_;
  const bool occupied = estimate.state == VoxelState::kOccupied;
  const int label = occupied ? estimate.label : 0;
  map_.add(truth, label);
  input_.add(truth, input);
  if (occupied) ++occupied_;
  if (label == 0) return;
  if (label == truth) ++correct_;
  const double square = square_off(counts, evidence.num_components, reading, truth);
  for (Reliability* const of : {&reliability_, &by_label_[static_cast<std::size_t>(label)]})
    of->add(label == truth, estimate.probability, square);
}

Json Scores::json(const ClassTable& classes, bool has_input) const {
  Json json;
  json["mean_iou"] = map_.mean_iou(classes.num_classes());
  json["iou"] = Json::object();
  json["input_mean_iou"] = has_input ? Json(input_.mean_iou(classes.num_classes())) : Json();
  json["input_iou"] = has_input ? Json::object() : Json();
  for (int label = 1; label <= classes.num_classes(); ++label) {
    if (!map_.present(label)) continue;
    const std::string name(classes[label].name_view());
    json["iou"][name] = map_.iou(label);
    if (has_input) json["input_iou"][name] = input_.iou(label);
  }
  json["coverage"] = coverage();
  json["coverage_any"] = coverage_any();
  json["accuracy"] = accuracy();
  json["calibration_error"] = reliability_.calibration_error();
  json["brier_score"] = reliability_.brier_score();
  json["risk_coverage_area"] = reliability_.risk_coverage_area();
  json["points"] = points();
  json["by_label"] = Json::object();
  for (int label = 1; label <= classes.num_classes(); ++label) {
    const Reliability& of = by_label_[static_cast<std::size_t>(label)];
    if (of.points() > 0) json["by_label"][std::string(classes[label].name_view())] = of.json();
  }
  json["counts"] = map_.counts(classes);
  json["input_counts"] = has_input ? input_.counts(classes) : Json();
  return json;
}

std::vector<Message> doubts_of(const Scores& scores, const LocalMap& map,
                               std::uint64_t non_finite) {
  constexpr double kLeastCoverage = 0.5;
  std::vector<Message> doubts;
  if (non_finite > 0)
    doubts.emplace_back(counted(non_finite, "point") +
                        " left out: coordinates that are not finite");
  if (scores.points() == 0) {
    doubts.emplace_back("no point has labelled truth in range; all figures are 0");
    return doubts;
  }
  if (scores.coverage() == 0.0 && !has_label(map))
    doubts.emplace_back("the map has no label, so that every point counts as wrong");
  if (scores.coverage_any() < kLeastCoverage) {
    doubts.emplace_back(fmt::format(
        "only {:.1f} % of the points are in occupied voxels of the map: check that it is "
        "of the same place, in the same frame (transform), and made with the same range",
        100.0 * scores.coverage_any()));
  }
  return doubts;
}

}  // namespace tessera
