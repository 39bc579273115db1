// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Weights of random confusions, compared with the formulas.
#include <map>
#include <set>

#include "judged_blocks.hpp"

namespace tessera {
namespace {

/// The formulas of docs/design/theory.md, from the sums of all tallies.
class TheoryOfWeights {
 public:
  explicit TheoryOfWeights(const std::vector<std::vector<LabelTally>>& blocks) {
    for (const std::vector<LabelTally>& block : blocks) {
      std::set<std::pair<unsigned, unsigned>> present;
      for (const LabelTally tally : block) {
        units[tally.robot()][tally.label()][tally.said()] += tally.units();
        present.insert({tally.robot(), tally.label()});
      }
      for (const auto& [robot, label] : present) ++blocks_with[robot][label];
    }
  }
  double weight(unsigned r, unsigned k) const {
    const double q = agreement(r);
    return std::min(u(right(r, k, is_judged(r, k) ? part(r, k, k) : q)),
                    std::clamp((q - 0.55) / 0.2, 0.0, 1.0));
  }

 private:
  using Units = std::map<unsigned, std::map<unsigned, std::map<unsigned, double>>>;
  static double u(double e) { return std::clamp((e - 0.2) / 0.5, 0.0, 1.0); }
  double in(unsigned r, unsigned c, unsigned k) const {
    const auto robot = units.find(r);
    if (robot == units.end() || !robot->second.contains(c) || !robot->second.at(c).contains(k))
      return 0.0;
    return robot->second.at(c).at(k);
  }
  double row(unsigned r, unsigned c) const {
    double sum = 0.0;
    for (unsigned k = 0; k <= kWeighedClasses; ++k) sum += in(r, c, k);
    return sum;
  }
  double part(unsigned r, unsigned c, unsigned k) const { return in(r, c, k) / row(r, c); }
  bool is_judged(unsigned r, unsigned c) const {
    return row(r, c) >= 1500.0 && blocks_with.at(r).contains(c) && blocks_with.at(r).at(c) >= 8;
  }
  double relative(unsigned r, unsigned c) const {
    double others = 0.0;
    double hit = 0.0;
    for (const auto& [other, sums] : units) {
      if (other == r) continue;
      others += row(other, c);
      hit += in(other, c, c);
    }
    return std::min(1.0, part(r, c, c) * others / hit);
  }
  double right(unsigned r, unsigned k, double hit) const {
    double wrong = 0.0;
    double claimed = 0.0;
    for (unsigned c = 1; c <= kWeighedClasses; ++c) {
      claimed += in(r, c, k);
      if (c != k && is_judged(r, c)) wrong += part(r, c, k);
    }
    const double equally = hit + wrong > 0.0 ? hit / (hit + wrong) : 1.0;
    return std::max((in(r, k, k) + 450.0) / (claimed + 450.0), equally);
  }
  double agreement(unsigned r) const {
    double all = 0.0;
    double agreed = 0.0;
    double sound = 0.0;
    double sound_agreed = 0.0;
    for (unsigned c = 1; c <= kWeighedClasses; ++c) {
      if (!is_judged(r, c)) continue;
      const double trust = u(right(r, c, part(r, c, c)));
      all += row(r, c);
      agreed += row(r, c) * relative(r, c);
      sound += row(r, c) * trust;
      sound_agreed += row(r, c) * trust * relative(r, c);
    }
    if (all == 0.0) return 1.0;
    return 8.0 * sound >= all ? sound_agreed / sound : agreed / all;
  }
  Units units;
  std::map<unsigned, std::map<unsigned, unsigned>> blocks_with;
};

TEST_CASE("RobotWeights: of random confusions, what the formulas of theory.md give") {
  oracle::Random random(29);
  int partial = 0;
  for (int trial = 0; trial < 60; ++trial) {
    std::vector<Says> robots;
    for (std::uint64_t robot = 0; robot < 3 + static_cast<std::uint64_t>(trial) % 2; ++robot) {
      auto draw =
          std::make_shared<oracle::Random>(1000 + 10 * static_cast<std::uint64_t>(trial) + robot);
      // How often each class is taken for a certain other one, and how sure of it all is.
      auto share = std::make_shared<std::vector<double>>();
      auto other = std::make_shared<std::vector<unsigned>>();
      for (unsigned label = 0; label <= kWeighedClasses; ++label) {
        share->push_back(robot == 0 ? random.uniform() : 0.2 * random.uniform());
        other->push_back(1U + static_cast<unsigned>(random.below(kWeighedClasses)));
      }
      robots.push_back([=](unsigned truth) -> Label {
        const bool wrong = draw->uniform() < (*share)[truth];
        return {wrong ? (*other)[truth] : truth, 9U + static_cast<unsigned>(draw->below(7))};
      });
    }
    const auto blocks = blocks_of(robots, 3U + static_cast<unsigned>(random.below(8)));
    OwnWeights own;
    add_all(own.weights, blocks);
    static_cast<void>(own.update());
    const TheoryOfWeights theory(blocks);
    for (unsigned robot = 0; robot < robots.size(); ++robot) {
      for (unsigned label = 1; label <= kWeighedClasses; ++label) {
        const double expected = theory.weight(robot, label);
        const auto found = static_cast<double>(own.weights.weights(robot)[label]);
        REQUIRE(found == Approx(expected).margin(0.5 / RobotWeights::kSteps + 1e-9));
        partial += found > 0.0 && found < 1.0 ? 1 : 0;
      }
    }
  }
  CHECK(partial > 50);
}

}  // namespace
}  // namespace tessera
