// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/semantics/internal/tuple_store.hpp"

namespace tessera {

void TupleStore::share_dense(std::byte* octet, int voxel, const LabelShares& shares,
                             int num_components) noexcept {
  VoxelEvidence evidence;
  evidence.num_components = num_components;
  DenseTuple::read(octet, voxel, evidence);
  float sum = 0.0F;
  for (std::size_t l = 1; l + 1 < static_cast<std::size_t>(num_components); ++l) {
    sum += evidence.sigma[l];
    evidence.sigma[l] = 0.0F;
  }
  if (sum == 0.0F) return;
  float left = sum;
  for (std::size_t i = 1; i < shares.count; ++i) {
    const float count = sum * shares.shares[i];
    if (count < kLeastCount) continue;
    evidence.sigma[shares.labels[i]] = count;
    left -= count;
  }
  evidence.sigma[shares.labels[0]] = left;
  DenseTuple::scale(octet, voxel, 0.0F);
  DenseTuple::restore(octet, voxel, evidence);
}

}  // namespace tessera
