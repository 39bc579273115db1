// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A point has an error if a standard normal field is below the quantile of its class's error
// probability. The field is smooth in space (patches of about a metre, as measured from a real
// network) and in the distance driven; part of it is the same for all robots (some objects look
// unusual from everywhere), most of it is specific to a robot.
#include "simulator/label_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "simulator/confusion.hpp"
#include "simulator/mixture.hpp"
#include "simulator/random.hpp"
#include "simulator/smooth_noise.hpp"

namespace tessera::street {
namespace {

constexpr double kViewLength_m = 12.0;  ///< Metres of driving over which an error lasts.
constexpr double kSharedShare =
    0.3;  ///< Share of the field's variance that all robots have in common.
constexpr double kSaltShare = 0.008;  ///< Share of single points with an error.
constexpr double kUnlabelledShare = 0.008;
constexpr int kBleedColumns = 4;
constexpr int kBleedRows = 1;
constexpr double kLeastSureness =
    0.25;  ///< Of a field whose errors are as common as right answers.
/// Of what an answer leaves of one: to what it is confused with, and to another answer.
constexpr double kSecondShare = 0.7;
constexpr double kThirdShare = 0.2;
constexpr double kTruthSecond = 0.7;  ///< How often an error's second answer is the truth.
/// Near borders: of the label that is used, and of those half as far and half as far again.
constexpr std::array<double, 3> kBlend{0.6, 0.2, 0.2};
constexpr double kSaltSureness = 0.5;

class Predictor {
 public:
  Predictor(std::uint64_t seed, const Viewpoint& viewpoint, const EchoImage& image)
      : seed_(seed),
        viewpoint_(viewpoint),
        image_(image),
        view_(viewpoint.driven_m / kViewLength_m) {}

  std::vector<std::uint16_t> predict() {
    std::vector<std::uint16_t> inner(image_.echoes.size(), 0);
    for (std::size_t i = 0; i < inner.size(); ++i) {
      if (image_.echoes[i].returned()) inner[i] = without_borders(image_.echoes[i]).said;
    }
    std::vector<std::uint16_t> said(inner.size(), 0);
    for_returns([&](int row, int column, std::size_t pixel) {
      said[pixel] = salted(pixel, inner[bleed_source(row, column, pixel, 1.0)]);
    });
    return said;
  }

  std::vector<Belief> believe() {
    std::vector<Belief> inner(image_.echoes.size());
    for (std::size_t i = 0; i < inner.size(); ++i) {
      if (image_.echoes[i].returned()) inner[i] = belief_of(image_.echoes[i]);
    }
    std::vector<Belief> held(inner.size());
    for_returns([&](int row, int column, std::size_t pixel) {
      const Belief& used = inner[bleed_source(row, column, pixel, 1.0)];
      const std::uint16_t said = salted(pixel, used.ids[0]);
      Mixture mixture;
      const double left = said == used.ids[0] ? 1.0 : 1.0 - kSaltSureness;
      if (left < 1.0) mixture.add(said, kSaltSureness);
      constexpr std::array<double, 3> kSteps{1.0, 0.5, 1.5};
      for (std::size_t step = 0; step < kSteps.size(); ++step)
        mixture.add(inner[bleed_source(row, column, pixel, kSteps[step])], left * kBlend[step]);
      held[pixel] = mixture.belief(said);
    });
    return held;
  }

 private:
  /// The answer away from borders, and how far the field is from the quantile where errors begin.
  struct Answered {
    std::uint16_t said = 0;
    bool mistaken = false;
    double field_share = 0.0;  ///< Of the normal distribution below the field.
    double probability = 0.0;  ///< Of an error.
  };

  template <class Visit>
  void for_returns(Visit&& visit) const {
    std::size_t pixel = 0;
    for (int row = 0; row < image_.rows; ++row) {
      for (int column = 0; column < image_.columns; ++column, ++pixel) {
        if (image_.echoes[pixel].returned()) visit(row, column, pixel);
      }
    }
  }

  [[nodiscard]] std::uint64_t own(Stream stream) const {
    return hash_of(seed_, stream, 1 + viewpoint_.robot);
  }
  [[nodiscard]] std::uint64_t shared(Stream stream) const { return hash_of(seed_, stream, 0); }

  /// Over patches of the given length.
  [[nodiscard]] double patch(std::uint64_t hash, const Eigen::Vector3d& p, double length_m) const {
    return smooth_normal<4>(hash, {p.x() / length_m, p.y() / length_m, p.z() / length_m, view_});
  }

  /// One value for the object as a whole.
  [[nodiscard]] double whole(std::uint64_t hash, std::uint32_t object) const {
    return smooth_normal<1>(mix(hash ^ object), {view_});
  }

  /// Standard normal; low where the network has errors.
  [[nodiscard]] double confidence(const Echo& echo, Stream stream, bool thing) const {
    const double coarse_share = thing ? 0.3 : 0.62;
    const double fine_share = thing ? 0.15 : 0.38;
    const double own_share = 1.0 - kSharedShare;
    double field = std::sqrt(own_share * coarse_share) * patch(own(stream), echo.p_street, 1.9) +
                   std::sqrt(fine_share) * patch(mix(own(stream)), echo.p_street, 0.8);
    if (thing) {
      const double object_share = 1.0 - coarse_share - fine_share;
      field += std::sqrt(own_share * object_share) * whole(own(stream), echo.object) +
               std::sqrt(kSharedShare * (object_share + coarse_share)) *
                   whole(shared(stream), echo.object);
    } else {
      field += std::sqrt(kSharedShare * coarse_share) * patch(shared(stream), echo.p_street, 2.5);
    }
    return field;
  }

  [[nodiscard]] std::uint16_t answer(const Echo& echo, RawId learned) const {
    return mistaken_for(learned, answer_share(echo, is_thing(learned)));
  }

  /// Choice of the wrong answer: one for an object as a whole, one for some metres of a surface.
  [[nodiscard]] double answer_share(const Echo& echo, bool thing) const {
    const std::uint64_t hash = own(Stream::kMistakeClass);
    const double normal = thing ? whole(hash, echo.object) : patch(hash, echo.p_street, 2.5);
    return std::min(normal_share(normal), 0.999999);
  }

  [[nodiscard]] Answered without_borders(const Echo& echo) const {
    const RawId learned = learned_id(echo.id);
    Answered answered{.probability =
                          mistake_probability(learned, echo.range_m, echo.cos_incidence)};
    answered.field_share = normal_share(confidence(echo, Stream::kMistake, is_thing(learned)));
    answered.mistaken = answered.field_share < answered.probability;
    answered.said = answered.mistaken ? answer(echo, learned) : static_cast<std::uint16_t>(learned);
    return answered;
  }

  /// A normal distribution's quantile, by the logistic one that is closest to it.
  [[nodiscard]] static double quantile(double share) {
    const double inside = std::clamp(share, 1e-6, 1.0 - 1e-6);
    return std::log(inside / (1.0 - inside)) / 1.702;
  }

  [[nodiscard]] Belief belief_of(const Echo& echo) const {
    const Answered answered = without_borders(echo);
    const RawId learned = learned_id(echo.id);
    const auto truth = static_cast<std::uint16_t>(learned);
    const double from = quantile(answered.probability);
    const double margin = std::abs(quantile(answered.field_share) - from);
    const double sureness = std::max(-2.0 * from, kLeastSureness) * kOverconfidence;
    const double sure = 1.0 / (1.0 + std::exp(-sureness * margin));
    // What else it may be: for an object as a whole, or for some metres of a surface.
    const bool thing = is_thing(learned);
    const std::uint64_t hash = own(Stream::kBelief);
    const double draw =
        normal_share(thing ? whole(hash, echo.object) : patch(hash, echo.p_street, 2.5));
    const std::uint16_t other =
        mistaken_for(static_cast<RawId>(answered.said), std::min(draw, 0.999999));
    const bool truth_second = answered.mistaken && draw < kTruthSecond;
    const std::uint16_t confused = answered.mistaken ? truth : answer(echo, learned);
    Mixture mixture;
    mixture.add(answered.said, sure);
    const bool swap = answered.mistaken && !truth_second;
    mixture.add(confused, (1.0 - sure) * (swap ? kThirdShare : kSecondShare));
    mixture.add(other, (1.0 - sure) * (swap ? kSecondShare : kThirdShare));
    return mixture.belief(answered.said);
  }

  /// The column at this distance to the right; -1 outside of an image that does not close.
  [[nodiscard]] int beside(int column, int by) const {
    const int c = column + by;
    if (image_.closes) return (c + image_.columns) % image_.columns;
    return c < image_.columns ? std::max(c, -1) : -1;
  }

  [[nodiscard]] bool near_border(int row, int column, RawId learned) const {
    for (int dr = -kBleedRows; dr <= kBleedRows; ++dr) {
      const int r = row + dr;
      if (r < 0 || r >= image_.rows) continue;
      for (int dc = -kBleedColumns; dc <= kBleedColumns; ++dc) {
        const int c = beside(column, dc);
        if (c < 0) continue;
        const Echo& other = image_.at(r, c);
        if (other.returned() && learned_id(other.id) != learned) return true;
      }
    }
    return false;
  }

  /// The pixel whose label is used here; reach: how many times as far labels come from. Thin and
  /// distinct objects keep their own more often and spread over what is behind them, as in the
  /// measured predictions.
  [[nodiscard]] std::size_t bleed_source(int row, int column, std::size_t pixel,
                                         double reach) const {
    const Echo& echo = image_.echoes[pixel];
    const RawId learned = learned_id(echo.id);
    if (!near_border(row, column, learned)) return pixel;
    const double strength = is_thing(learned) ? 0.5 : 1.0;
    const double sideways =
        reach * 1.7 * strength * patch(own(Stream::kBleedColumn), echo.p_street, 0.8);
    const double upright =
        reach * 0.55 * strength * patch(own(Stream::kBleedRow), echo.p_street, 0.8);
    const int dc =
        std::clamp(static_cast<int>(std::lround(sideways)), -kBleedColumns, kBleedColumns);
    const int dr = std::clamp(static_cast<int>(std::lround(upright)), -kBleedRows, kBleedRows);
    const int r = row + dr;
    const int c = beside(column, dc);
    if (r < 0 || r >= image_.rows || c < 0) return pixel;
    const auto source = static_cast<std::size_t>(r) * static_cast<std::size_t>(image_.columns) +
                        static_cast<std::size_t>(c);
    return image_.echoes[source].returned() ? source : pixel;
  }

  [[nodiscard]] std::uint16_t salted(std::size_t pixel, std::uint16_t said) const {
    Random random(hash_of(own(Stream::kSalt), Stream::kSalt, viewpoint_.scan, pixel));
    if (!random.chance(kSaltShare)) return said;
    return stray_answer(learned_id(image_.echoes[pixel].id), random.uniform());
  }

  std::uint64_t seed_;
  Viewpoint viewpoint_;
  const EchoImage& image_;
  double view_;
};

}  // namespace

std::vector<std::uint16_t> predict_labels(std::uint64_t seed, const Viewpoint& viewpoint,
                                          const EchoImage& image) {
  return Predictor(seed, viewpoint, image).predict();
}

std::vector<Belief> predict_beliefs(std::uint64_t seed, const Viewpoint& viewpoint,
                                    const EchoImage& image) {
  return Predictor(seed, viewpoint, image).believe();
}

std::vector<std::uint16_t> true_labels(std::uint64_t seed, const Viewpoint& viewpoint,
                                       const EchoImage& image) {
  std::vector<std::uint16_t> labels(image.echoes.size(), 0);
  const std::uint64_t hash = hash_of(seed, Stream::kLabel, viewpoint.robot, viewpoint.scan);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const bool stray = unit_of(hash_of(hash, Stream::kLabel, i)) < kUnlabelledShare;
    if (!stray) labels[i] = static_cast<std::uint16_t>(image.echoes[i].id);
  }
  return labels;
}

}  // namespace tessera::street
