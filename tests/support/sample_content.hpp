// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Blocks for the codec's tests: contents with memory of their own, smooth as a map's and random as
// an adversary's, and what two contents are compared by.
#pragma once

#include <cstddef>
#include <vector>

#include "support/aligned_memory.hpp"
#include "support/random.hpp"
#include "tessera/base/internal/bits.hpp"
#include "tessera/exchange/internal/block_codec.hpp"
#include "tessera/exchange/internal/evidence_levels.hpp"

namespace tessera {

/// A content with memory of its own.
class OwnContent {
 public:
  explicit OwnContent(int num_components = kMaxComponents);
  [[nodiscard]] BlockContent& operator*() { return content_; }
  [[nodiscard]] BlockContent* operator->() { return &content_; }

 private:
  AlignedMemory memory_;
  BlockContent content_;
};

/// Surfaces with evidence that falls off from them, a few classes, and free space above.
void fill_smoothly(BlockContent& content, oracle::Random& random, int num_components);
/// Any components, counts of any size, any passes: up to so many components a voxel, in the part of
/// all voxels that is given.
void fill_at_random(BlockContent& content, oracle::Random& random, int num_components,
                    int most_components, double part);

using CodedBytes = std::vector<std::byte>;
/// The code in exactly as much memory as it takes.
CodedBytes coded(const BlockContent& content, unsigned layers = kAllLayers);

/// All that a content says of the voxels of these layers: counts by component, rest, passes,
/// centroid.
std::vector<float> picture_of(const BlockContent& content, int num_components,
                              unsigned layers = kAllLayers);

}  // namespace tessera
