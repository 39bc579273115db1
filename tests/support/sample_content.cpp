// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "support/sample_content.hpp"

#include <bit>
#include <cmath>

namespace tessera {

OwnContent::OwnContent(int num_components) : memory_(BlockContent::required_bytes(num_components)) {
  Arena arena = memory_.arena();
  content_ = *BlockContent::make(arena, num_components);
}

namespace {

/// Of a place in the row order; no draw.
Centroid some_centroid(int row) {
  return Centroid::of_levels({row % 6, row / 5 % 6, row / 64 % 6});
}

}  // namespace

void fill_smoothly(BlockContent& content, oracle::Random& random, int num_components) {
  const double slope_x = random.uniform(-0.7, 0.7);
  const double slope_y = random.uniform(-0.7, 0.7);
  const double height = random.uniform(0.0, 8.0);
  const int below = 1 + random.below(num_components - 2);
  const int above = 1 + random.below(num_components - 2);
  for (int row = 0; row < kBlockVoxels; ++row) {
    const VoxelCoord v = voxel_of_row({0, 0, 0}, row);
    const double distance = v.z - (height + slope_x * (v.x - 4) + slope_y * (v.y - 4));
    const double count = random.uniform(2.7, 3.3) / (1.0 + distance * distance);
    if (std::fabs(distance) < 2.0) {
      content.add(v.x < 4 ? below : above, row, static_cast<float>(count));
      if (std::fabs(distance) < 0.5) content.set_centroid(row, some_centroid(row));
      if (v.x == 4) content.add(below, row, static_cast<float>(0.3 * count));
      if (random.below(20) == 0) content.add_passes(row, 1);
    } else if (distance > 2.0) {
      content.add_passes(row, 1U + static_cast<unsigned>(distance));
    }
  }
}

namespace {

int classes_of(const BlockContent& content, int row) {
  int classes = 0;
  for (std::uint64_t rest = content.components(); rest != 0; rest &= rest - 1)
    if (content.count(std::countr_zero(rest), row) > 0.0F) ++classes;
  return classes;
}

}  // namespace

void fill_at_random(BlockContent& content, oracle::Random& random, int num_components,
                    int most_components, double part) {
  for (int row = 0; row < kBlockVoxels; ++row) {
    if (random.uniform() >= part) continue;
    // One draw a statement: arguments are evaluated in any order.
    for (int n = random.below(most_components + 1); n > 0; --n) {
      const int component = 1 + random.below(num_components - 1);
      const int exponent = random.below(34) - 14;
      content.set(component, row,
                  static_cast<float>(std::ldexp(random.uniform(1.0, 2.0), exponent)));
      if (row % 3 == 0) content.set_centroid(row, some_centroid(row));
    }
    if (random.below(2) == 0) {
      content.add_rest(row, static_cast<float>(random.uniform(1e-4, 100.0)));
      // A code of three classes and a rest has no room for a centroid.
      if (classes_of(content, row) == 3) content.set_centroid(row, {});
    }
    if (random.below(2) == 0) content.add_passes(row, static_cast<unsigned>(random.below(256)));
  }
}

CodedBytes coded(const BlockContent& content, unsigned layers) {
  CodedBytes bytes(most_coded_bytes(kBlockLayers));
  bytes.resize(encode_block(content, layers, bytes));
  bytes.shrink_to_fit();
  return bytes;
}

std::vector<float> picture_of(const BlockContent& content, int num_components, unsigned layers) {
  std::vector<float> picture;
  for (int row = 0; row < kBlockVoxels; ++row) {
    if (((layers >> layer_of_row(row)) & 1U) == 0) continue;
    for (int l = 1; l < num_components; ++l) picture.push_back(content.count(l, row));
    picture.push_back(content.rest(row));
    picture.push_back(static_cast<float>(content.passes(row)));
    picture.push_back(static_cast<float>(content.centroid(row).code()));
  }
  return picture;
}

}  // namespace tessera
