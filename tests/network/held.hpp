// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot holds of each contribution, read from its replicas byte by byte, whatever its
// exchange says of it.
#pragma once

#include <cstdint>
#include <vector>

#include "tessera/replica/replicas.hpp"

namespace tessera::network {

struct Held {
  ContributionId id;
  std::uint32_t frame_revision = 0;
  std::uint32_t blocks = 0;     ///< With evidence.
  double label_evidence = 0.0;  ///< The sum over all of its voxels.
  std::uint64_t passes = 0;     ///< The same of free passes.
  std::uint64_t digest = 0;     ///< Of keys, layers and bytes.
};

/// By ascending id. Uses the heap.
[[nodiscard]] std::vector<Held> held(const Replicas& replicas, int num_components);
/// Of all of it.
[[nodiscard]] std::uint64_t content_digest(const Replicas& replicas, int num_components);

}  // namespace tessera::network
