// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/opinions.hpp"

#include <bit>

namespace tessera {

Result<Opinions> Opinions::make(Arena& arena, std::uint32_t robots, int num_components,
                                float free_weight) noexcept {
  Opinions made;
  made.opinions_ = arena.take<Opinion>(robots);
  const std::span<Scratch> scratch = arena.take<Scratch>(1);
  made.cells_ = arena.take<std::uint16_t>(cells(num_components));
  made.tallies_ = arena.take<LabelTally>(kMostTallies);
  if (made.opinions_.empty() || scratch.empty() || made.cells_.empty() || made.tallies_.empty())
    return Status::kResourceExhausted;
  made.scratch_ = scratch.data();
  made.labels_ = static_cast<std::size_t>(num_components - 1);
  made.free_weight_ = free_weight;
  return made;
}

/// The label of a voxel, if its evidence outweighs its free passes. Returns whether it has one.
bool Opinions::decide(Opinion& one, std::size_t at, const BlockContent& content) noexcept {
  const float all = scratch_->labels[at];
  if (!(all > 0.0F)) return false;
  const int row = static_cast<int>(at);
  const float others = content.count(static_cast<int>(labels_), row) + content.rest(row);
  if (!(all + others > static_cast<float>(content.passes(row)) * free_weight_)) return false;
  one.label[at] = static_cast<std::uint8_t>(scratch_->label[at]);
  const float units = LabelTally::kUnits * scratch_->most[at] / all;
  one.units[at] = static_cast<std::uint8_t>(floor_to_int(static_cast<double>(units) + 0.5));
  return true;
}

void Opinions::add(unsigned robot_bit, const BlockContent& content) noexcept {
  const BlockEvidence labels = content.labels();
  const std::uint64_t classes = labels.components & ((std::uint64_t{1} << labels_) - 2);
  if (classes == 0) return;
  Opinion& one = opinions_[count_];
  one.robot_bit = robot_bit;
  scratch_->most.fill(0.0F);
  scratch_->labels.fill(0.0F);
  scratch_->label.fill(0);
  one.label.fill(0);
  std::uint64_t touched = 0;
  for (std::uint64_t rest = classes; rest != 0; rest &= rest - 1) {
    const int component = std::countr_zero(rest);
    const std::size_t c = static_cast<std::size_t>(component);
    const float* const counts = labels.sums + c * labels.component;
    touched |= labels.touched[c];
    for (std::uint64_t rows = labels.touched[c]; rows != 0; rows &= rows - 1) {
      const auto first = 8 * static_cast<std::size_t>(std::countr_zero(rows));
      for (std::size_t at = first; at < first + 8; ++at) {
        const bool is_more = counts[at] > scratch_->most[at];
        scratch_->labels[at] += counts[at];
        scratch_->most[at] = is_more ? counts[at] : scratch_->most[at];
        scratch_->label[at] = is_more ? component : scratch_->label[at];
      }
    }
  }
  bool any = false;
  for (; touched != 0; touched &= touched - 1) {
    const auto first = 8 * static_cast<std::size_t>(std::countr_zero(touched));
    for (std::size_t at = first; at < first + 8; ++at) any = decide(one, at, content) || any;
  }
  if (any) ++count_;
}

/// The class that most robots have, two of them at least, and no other class as many; 0: none.
unsigned Opinions::majority_of(std::size_t row) noexcept {
  unsigned majority = 0;
  unsigned most = 1;
  for (const Opinion& one : opinions_.first(count_)) {
    const unsigned label = one.label[row];
    if (label == 0) continue;
    const unsigned votes = ++scratch_->votes[label];
    if (votes == most && label != majority) majority = 0;
    if (votes > most) {
      most = votes;
      majority = label;
    }
  }
  for (const Opinion& one : opinions_.first(count_)) scratch_->votes[one.label[row]] = 0;
  return majority;
}

void Opinions::find_majorities() noexcept {
  scratch_->said.fill(0);
  for (const Opinion& one : opinions_.first(count_)) {
    for (std::size_t row = 0; row < one.label.size(); ++row)
      scratch_->said[row] =
          static_cast<std::uint8_t>(scratch_->said[row] + (one.label[row] != 0 ? 1 : 0));
  }
  for (std::size_t row = 0; row < scratch_->said.size(); ++row)
    scratch_->majority[row] =
        static_cast<std::uint8_t>(scratch_->said[row] > 2 ? majority_of(row) : 0);
}

/// Of a voxel with two labels: whether they are not the same.
bool Opinions::differs(std::size_t row) const noexcept {
  unsigned first = 0;
  for (const Opinion& one : opinions_.first(count_)) {
    if (one.label[row] == 0) continue;
    if (first != 0) return one.label[row] != first;
    first = one.label[row];
  }
  return false;
}

/// False iff there is no room for all of them; then there is none.
bool Opinions::add_tallies(const Opinion& one, std::size_t& size) noexcept {
  std::fill(cells_.begin(), cells_.end(), std::uint16_t{0});
  const std::span<std::uint16_t> pairs = cells_.subspan(labels_ * labels_);
  std::uint64_t said = 0;
  std::uint64_t majorities = 0;
  for (std::size_t row = 0; row < one.label.size(); ++row) {
    const unsigned label = one.label[row];
    if (label == 0 || scratch_->said[row] < 2) continue;
    const unsigned majority = scratch_->majority[row];
    if (majority == 0 && scratch_->said[row] > 2) continue;
    said |= std::uint64_t{1} << label;
    if (majority == 0) {
      ++pairs[label];
      if (differs(row)) ++pairs[labels_ + label];
      continue;
    }
    majorities |= std::uint64_t{1} << majority;
    cells_[majority * labels_ + label] =
        static_cast<std::uint16_t>(cells_[majority * labels_ + label] + one.units[row]);
    cells_[majority * labels_] = static_cast<std::uint16_t>(cells_[majority * labels_] +
                                                            LabelTally::kUnits - one.units[row]);
  }
  const std::size_t before = size;
  const auto append = [&](LabelTally tally) {
    if (size < tallies_.size()) tallies_[size] = tally;
    ++size;
  };
  for (std::uint64_t rest = majorities; rest != 0; rest &= rest - 1) {
    const auto majority = static_cast<unsigned>(std::countr_zero(rest));
    for (std::uint64_t labels = said | 1U; labels != 0; labels &= labels - 1) {
      const auto label = static_cast<unsigned>(std::countr_zero(labels));
      if (const unsigned units = cells_[majority * labels_ + label]; units != 0)
        append(LabelTally::of_majority(one.robot_bit, majority, label, units));
    }
  }
  for (std::uint64_t labels = said; labels != 0; labels &= labels - 1) {
    const auto label = static_cast<unsigned>(std::countr_zero(labels));
    if (pairs[label] != 0)
      append(LabelTally::of_pair(one.robot_bit, label, pairs[label], pairs[labels_ + label]));
  }
  if (size <= tallies_.size()) return true;
  size = before;
  return false;
}

/// Of two robots, as most blocks of an overlap have them.
std::size_t Opinions::tally_pair() noexcept {
  const Opinion& first = opinions_[0];
  const Opinion& second = opinions_[1];
  std::fill(cells_.begin(), cells_.end(), std::uint16_t{0});
  // Voxels of the first one's label, those that differ, and the same of the second one.
  const auto cell = [this](std::size_t what, std::size_t label) -> std::uint16_t& {
    return cells_[what * labels_ + label];
  };
  for (std::size_t row = 0; row < first.label.size(); ++row) {
    const std::uint8_t a = first.label[row];
    const std::uint8_t b = second.label[row];
    if (a == 0 || b == 0) continue;
    const auto differs = static_cast<std::uint16_t>(a != b ? 1 : 0);
    ++cell(0, a);
    cell(1, a) = static_cast<std::uint16_t>(cell(1, a) + differs);
    ++cell(2, b);
    cell(3, b) = static_cast<std::uint16_t>(cell(3, b) + differs);
  }
  std::size_t size = 0;
  for (std::size_t robot = 0; robot < 2; ++robot) {
    for (std::size_t label = 1; label < labels_; ++label) {
      if (const unsigned voxels = cell(2 * robot, label); voxels != 0)
        tallies_[size++] =
            LabelTally::of_pair(opinions_[robot].robot_bit, static_cast<unsigned>(label), voxels,
                                cell(2 * robot + 1, label));
    }
  }
  return size;
}

std::span<const LabelTally> Opinions::tally() noexcept {
  if (count_ < 2) return {};
  if (count_ == 2) return tallies_.first(tally_pair());
  find_majorities();
  std::size_t size = 0;
  for (const Opinion& one : opinions_.first(count_)) {
    if (!add_tallies(one, size)) break;
  }
  return tallies_.first(size);
}

}  // namespace tessera
