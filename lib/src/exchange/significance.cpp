// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/significance.hpp"

#include <bit>

namespace tessera {

struct Significance::Meaning {
  VoxelState state = VoxelState::kUnknown;
  int label = 0;
  double evidence = 0.0;  ///< Of labels, the rest included.
};

Significance::Significance(const MapConfig& config, int num_components,
                           float evidence_factor) noexcept
    : num_components_(num_components),
      free_weight_(config.free_weight),
      prior_(config.prior),
      evidence_factor_(static_cast<double>(evidence_factor)) {
  float passes = 0.0F;
  for (VoxelState& state : states_of_passes_) {
    state = CountSummary(num_components, passes * free_weight_).estimate(prior_).state;
    passes += 1.0F;
  }
}

Significance::Meaning Significance::meaning_of(const BlockContent& content,
                                               std::uint64_t components, int row) const noexcept {
  CountSummary summary(num_components_, static_cast<float>(content.passes(row)) * free_weight_);
  Meaning meaning;
  for (std::uint64_t rest = components; rest != 0; rest &= rest - 1) {
    const int component = std::countr_zero(rest);
    const float count = content.count(component, row);
    summary.add(component, count);
    meaning.evidence += static_cast<double>(count);
  }
  summary.add_rest(content.rest(row));
  meaning.evidence += static_cast<double>(content.rest(row));
  const Estimate estimate = summary.estimate(prior_);
  meaning.state = estimate.state;
  meaning.label = estimate.label;
  return meaning;
}

void Significance::compare_octet(const BlockContent& published, const BlockContent& current,
                                 int octet, Difference& difference) const noexcept {
  // Most octets have one component or two, however many the block has.
  const std::uint64_t components_before = published.labels().components_of(octet);
  const std::uint64_t components_now = current.labels().components_of(octet);
  for (int v = 0; v < kOctetVoxels; ++v) {
    const int row = row_order_corner(octet) + row_order(0, v);
    const Meaning before = meaning_of(published, components_before, row);
    const Meaning now = meaning_of(current, components_now, row);
    const bool same = before.state == now.state && before.label == now.label;
    const bool had = before.evidence > 0.0;
    const bool has = now.evidence > 0.0;
    if (!had && !has) {
      difference.free += same ? 0 : 1;
      continue;
    }
    if (!same || had != has) {
      ++difference.labels;
      continue;
    }
    const bool grown = now.evidence > evidence_factor_ * before.evidence;
    const bool shrunk = before.evidence > evidence_factor_ * now.evidence;
    difference.evidence += grown || shrunk ? 1 : 0;
  }
}

Difference Significance::compare(const BlockContent& published,
                                 const BlockContent& current) const noexcept {
  Difference difference;
  const std::uint64_t labelled = published.label_octets() | current.label_octets();
  for (std::uint64_t rest = labelled; rest != 0; rest &= rest - 1)
    compare_octet(published, current, std::countr_zero(rest), difference);
  const std::uint64_t passed = (published.pass_octets() | current.pass_octets()) & ~labelled;
  for (std::uint64_t rest = passed; rest != 0; rest &= rest - 1) {
    const int corner = row_order_corner(std::countr_zero(rest));
    for (int v = 0; v < kOctetVoxels; ++v) {
      const int row = corner + row_order(0, v);
      const bool same = state_of(published.passes(row)) == state_of(current.passes(row));
      difference.free += same ? 0 : 1;
    }
  }
  return difference;
}

}  // namespace tessera
