// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/diffusion_stencil.hpp"

#include "tessera/inference/kernel.hpp"

namespace tessera {

namespace {

/// Less is rounding: a length of two voxels as a float is a little more, and must not reach a
/// third, for a node without other neighbours would take all of that one.
constexpr double kLeastWeight = 0x1p-44;

}  // namespace

DiffusionStencil::DiffusionStencil(double length) noexcept : length_(length) {
  while (reach_ < DiffusionConfig::kMostReach && weight_at((reach_ + 1) * (reach_ + 1)) > 0.0F)
    ++reach_;
  for_edges([this](int, int, int, float) { ++edges_; });
}

float DiffusionStencil::weight_at(int squared) const noexcept {
  if (squared == 0) return 0.0F;
  const double weight = kernel_exact(detail::exact_sqrt(squared) / length_);
  return weight >= kLeastWeight ? static_cast<float>(weight) : 0.0F;
}

}  // namespace tessera
