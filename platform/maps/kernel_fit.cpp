// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/kernel_fit.hpp"

#include <algorithm>

#include "tessera/base/assert.hpp"

namespace tessera {

/// The labels of a data set's octets under some kernels, and what they are worth.
struct KernelFit::Labelling {
  Labelling(const FitData& set, const FitPart& its_part, bool of_part)
      : data(&set), part(its_part), is_parted(of_part) {}

  /// Kernels by label.
  void label_all(const std::array<std::size_t, kMaxComponents>& of) {
    kernels = of;
    const auto octets = data->samples.octets();
    labels.assign(octets.size(), 0);
    for (std::size_t i = 0; i < octets.size(); ++i) {
      labels[i] = best(octets[i], 0, 0);
      count(octets[i], labels[i], 1);
      for (const KernelSamples::Truth& truth : data->samples.truth(octets[i]))
        if (counts(truth)) truth_of[truth.label] += truth.points;
    }
  }
  /// The label with the largest sum, the lower of equals, if that label had this kernel.
  [[nodiscard]] std::uint8_t best(const KernelSamples::Octet& octet, std::uint8_t label,
                                  std::size_t kernel) const {
    float most = 0.0F;
    std::uint8_t found = 0;
    for (const KernelSamples::Votes& votes : data->samples.votes(octet)) {
      const float sum = votes.sums[votes.label == label ? kernel : kernels[votes.label]];
      if (sum > most) {
        most = sum;
        found = votes.label;
      }
    }
    return found;
  }
  [[nodiscard]] bool counts(const KernelSamples::Truth& truth) const {
    return !is_parted || (truth.fold == part.fold) == part.alone;
  }
  void count(const KernelSamples::Octet& octet, std::uint8_t label, std::int64_t sign) {
    for (const KernelSamples::Truth& truth : data->samples.truth(octet)) {
      if (!counts(truth)) continue;
      labelled[label] += sign * truth.points;
      if (truth.label == label) right[label] += sign * truth.points;
    }
  }
  /// Takes another kernel for a label; votes: the numbers of its votes.
  void change(std::uint8_t label, std::size_t kernel, const std::vector<std::uint32_t>& votes) {
    for (const std::uint32_t number : votes) {
      const std::uint32_t i = data->samples.votes()[number].octet;
      const KernelSamples::Octet& octet = data->samples.octets()[i];
      const std::uint8_t now = best(octet, label, kernel);
      if (now == labels[i]) continue;
      count(octet, labels[i], -1);
      count(octet, now, 1);
      labels[i] = now;
    }
    kernels[label] = kernel;
  }
  [[nodiscard]] double iou(std::size_t label) const {
    const std::int64_t any = truth_of[label] + labelled[label] - right[label];
    return any == 0 ? 0.0 : static_cast<double>(right[label]) / static_cast<double>(any);
  }
  /// Nothing iff there is no truth.
  [[nodiscard]] std::optional<double> mean_iou() const {
    double sum = 0.0;
    int present = 0;
    for (std::size_t label = 1; label < truth_of.size(); ++label) {
      if (truth_of[label] == 0) continue;
      sum += iou(label);
      ++present;
    }
    return present == 0 ? std::nullopt : std::optional(sum / present);
  }

  const FitData* data;
  FitPart part;
  bool is_parted;  ///< Else all of the data set counts.
  std::array<std::size_t, kMaxComponents> kernels{};
  std::vector<std::uint8_t> labels;
  Counts truth_of{};  ///< Points of each class,
  Counts labelled{};  ///< with each label, 0: none,
  Counts right{};     ///< and with that of their class.
};

KernelFit::KernelFit(const std::vector<FitData>& data) : data_(data) {
  for (const FitData& set : data) {
    std::vector<std::size_t>& places = places_.emplace_back();
    for (int label = 1; label <= set.classes.num_classes(); ++label) {
      const std::string name(set.classes[label].name_view());
      const auto at = std::find(names_.begin(), names_.end(), name);
      places.push_back(static_cast<std::size_t>(at - names_.begin()));
      if (at == names_.end()) names_.push_back(name);
    }
    auto& of_label = votes_of_.emplace_back();
    const auto votes = set.samples.votes();
    for (std::size_t i = 0; i < votes.size(); ++i)
      of_label[votes[i].label].push_back(static_cast<std::uint32_t>(i));
  }
}

KernelChoice KernelFit::of_tables() const {
  KernelChoice choice{names_, std::vector<std::size_t>(names_.size(), 0)};
  for (std::size_t set = data_.size(); set-- > 0;) {
    for (std::size_t i = 0; i < places_[set].size(); ++i)
      choice.kernels[places_[set][i]] =
          KernelGrid::nearest(data_[set].classes.kernel(static_cast<int>(i) + 1));
  }
  return choice;
}

KernelChoice KernelFit::of_one(const ClassKernel& kernel) const {
  return {names_, std::vector<std::size_t>(names_.size(), KernelGrid::nearest(kernel))};
}

std::vector<KernelFit::Labelling> KernelFit::label_all(const KernelChoice& choice,
                                                       const FitPart& part) const {
  std::vector<Labelling> labellings;
  for (std::size_t set = 0; set < data_.size(); ++set) {
    if (part.alone && part.set != set) continue;
    Labelling& made = labellings.emplace_back(data_[set], part, part.set == set);
    std::array<std::size_t, kMaxComponents> kernels{};
    for (std::size_t i = 0; i < places_[set].size(); ++i)
      kernels[i + 1] = choice.kernels[places_[set][i]];
    made.label_all(kernels);
  }
  return labellings;
}

std::optional<double> KernelFit::mean_of(const std::vector<Labelling>& sets) {
  double sum = 0.0;
  int present = 0;
  for (const Labelling& one : sets) {
    const std::optional<double> iou = one.mean_iou();
    sum += iou.value_or(0.0);
    present += iou ? 1 : 0;
  }
  return present == 0 ? std::nullopt : std::optional(sum / present);
}

std::optional<double> KernelFit::score(const KernelChoice& choice, const FitPart& part) const {
  return mean_of(label_all(choice, part));
}

KernelChoice KernelFit::start_of(const ClassKernel& kernel) const {
  KernelChoice start = of_one(kernel);
  const KernelChoice tables = of_tables();
  for (std::size_t i = 0; i < names_.size(); ++i) {
    if (iou(start, names_[i]) < 0.0) start.kernels[i] = tables.kernels[i];
  }
  return start;
}

double KernelFit::iou(const KernelChoice& choice, std::string_view name) const {
  double sum = 0.0;
  int sets = 0;
  const std::vector<Labelling> labellings = label_all(choice, {});
  for (std::size_t set = 0; set < labellings.size(); ++set) {
    for (std::size_t i = 0; i < places_[set].size(); ++i) {
      if (names_[places_[set][i]] != name || labellings[set].truth_of[i + 1] == 0) continue;
      sum += labellings[set].iou(i + 1);
      ++sets;
    }
  }
  return sets == 0 ? -1.0 : sum / sets;
}

KernelChoice KernelFit::fit(KernelChoice start, const FitPart& part) const {
  TESSERA_ASSERT(!part.alone);  // then there would be one data set, whatever its number
  std::vector<Labelling> sets = label_all(start, part);
  const auto total = [&sets] { return mean_of(sets).value_or(0.0); };
  const auto has_truth = [&](std::size_t name) {
    for (std::size_t set = 0; set < sets.size(); ++set) {
      for (std::size_t i = 0; i < places_[set].size(); ++i)
        if (places_[set][i] == name && sets[set].truth_of[i + 1] != 0) return true;
    }
    return false;
  };
  const auto change = [&](std::size_t name, std::size_t kernel) {
    for (std::size_t set = 0; set < sets.size(); ++set) {
      for (std::size_t i = 0; i < places_[set].size(); ++i) {
        if (places_[set][i] == name)
          sets[set].change(static_cast<std::uint8_t>(i + 1), kernel, votes_of_[set][i + 1]);
      }
    }
  };
  double reached = total();
  bool changed = true;
  for (int round = 0; changed && round < kMostRounds; ++round) {
    changed = false;
    for (std::size_t name = 0; name < names_.size(); ++name) {
      if (!has_truth(name)) continue;
      const std::size_t before = start.kernels[name];
      std::size_t best = before;
      for (std::size_t kernel = 0; kernel < KernelGrid::kKernels; ++kernel) {
        if (kernel == before) continue;
        change(name, kernel);
        const double found = total();
        if (!(found > reached + kLeastGain)) continue;
        reached = found;
        best = kernel;
      }
      change(name, best);
      changed = changed || best != before;
      start.kernels[name] = best;
    }
  }
  return start;
}

}  // namespace tessera
