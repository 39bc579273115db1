// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is left of a block's content once it is fit to be coded: levels, three components a voxel,
// labels as they were, and nothing that packing would change.
#include <catch2/catch.hpp>
#include <cmath>

#include "support/sample_content.hpp"
#include "tessera/map/internal/packed_block.hpp"
#include "tessera/semantics/estimate.hpp"

namespace tessera {
namespace {

using oracle::Random;

/// The label among 1 .. C, and the largest count of any component.
struct Voxel {
  int label = 0;
  float largest = 0.0F;
  double total = 0.0;
};
Voxel voxel_of(const BlockContent& content, int row, int num_components) {
  CountSummary summary(num_components, 0.0F);
  Voxel voxel;
  for (int l = 1; l < num_components; ++l) {
    summary.add(l, content.count(l, row));
    voxel.largest = std::max(voxel.largest, content.count(l, row));
  }
  summary.add_rest(content.rest(row));
  const Estimate found = summary.estimate(0.001);
  voxel.label = found.label;
  voxel.total = found.evidence;
  return voxel;
}

TEST_CASE("quantise: twice is once, and packing what is quantised loses nothing") {
  Random random(static_cast<std::uint64_t>(GENERATE(range(1, 30))));
  const int components = 3 + random.below(kMaxComponents - 2);
  OwnContent own(components);
  fill_smoothly(*own, random, components);
  if (random.below(2) == 0) fill_at_random(*own, random, components, 8, random.uniform());
  quantise(*own);
  const std::vector<float> once = picture_of(*own, components);
  std::vector<std::byte> packed(most_packed_bytes(components));
  packed.resize(pack_block(*own, packed));
  OwnContent unpacked(components);
  unpack_block(
      packed,
      [&](int row, Centroid centroid) {
        if (centroid.known()) unpacked->set_centroid(row, centroid);
      },
      [&](int row, int component, float count) {
        component == 0 ? unpacked->add_rest(row, count) : unpacked->add(component, row, count);
      },
      [&](int row, unsigned passes) { unpacked->add_passes(row, passes); });
  CHECK(picture_of(*unpacked, components) == once);
  quantise(*own);
  CHECK(picture_of(*own, components) == once);
}

TEST_CASE("quantise: the label stays, and no evidence is more than its share off") {
  Random random(static_cast<std::uint64_t>(GENERATE(range(1, 30))));
  const int components = 3 + random.below(kMaxComponents - 2);
  OwnContent before(components);
  OwnContent after(components);
  const std::uint64_t seed = random.bits();
  for (OwnContent* own : {&before, &after}) {
    Random same(seed);
    for (int row = 0; row < kBlockVoxels; ++row) {
      for (int n = same.below(6); n > 0; --n)
        (*own)->set(1 + same.below(components - 1), row,
                    static_cast<float>(same.uniform(0.3, 3.0) * (same.below(2) == 0 ? 0.05 : 1.0)));
      if (same.below(4) == 0) (*own)->add_rest(row, static_cast<float>(same.uniform(0.0, 2.0)));
    }
  }
  quantise(*after);
  for (int row = 0; row < kBlockVoxels; ++row) {
    const Voxel was = voxel_of(*before, row, components);
    const Voxel is = voxel_of(*after, row, components);
    int kept = 0;
    double moved = static_cast<double>(before->rest(row));
    for (int l = 1; l < components; ++l) {
      const float count = before->count(l, row);
      const float found = after->count(l, row);
      kept += found > 0.0F ? 1 : 0;
      if (found == 0.0F) {
        moved += static_cast<double>(count);
        continue;
      }
      REQUIRE(found <= count * 10.0F / 9.0F);
      // A ninth, and two levels where counts are as good as equal.
      REQUIRE(found >= count * (count == was.largest ? 8.0F / 9.0F : 0.57F));
    }
    REQUIRE(kept <= 3);
    const auto rest = static_cast<double>(after->rest(row));
    if (rest == 0.0 && moved > 0.0) {
      REQUIRE(moved < static_cast<double>(was.largest) / 32.0 * 1.0001);
    } else {
      REQUIRE(std::fabs(rest - moved) <= moved / 9.0 + 1e-6);
    }
    // Random counts here are within 32 times of the largest, or far under it: the label stays.
    if (was.largest == before->count(std::max(was.label, 1), row)) REQUIRE(is.label == was.label);
  }
}

TEST_CASE("quantise: counts of one level keep their order, whichever component is lower") {
  OwnContent own(8);
  own->add(2, 0, 1.00F);
  own->add(5, 0, 1.02F);
  own->add(2, 1, 1.02F);
  own->add(5, 1, 1.00F);
  own->add(1, 2, 1.00F);
  own->add(2, 2, 1.01F);
  own->add(3, 2, 1.02F);
  own->add(4, 3, 2.0F);
  own->add(6, 3, 2.0F);
  quantise(*own);
  CHECK(own->count(5, 0) == 1.0F);
  CHECK(own->count(2, 0) == 0.875F);
  CHECK(own->count(2, 1) == 1.0F);
  CHECK(own->count(5, 1) == 1.0F);
  CHECK(own->count(3, 2) == 1.0F);
  CHECK(own->count(2, 2) == 0.875F);
  CHECK(own->count(1, 2) == 0.75F);
  // Ties are the lower component's already.
  CHECK(own->count(4, 3) == 2.0F);
  CHECK(own->count(6, 3) == 2.0F);
}

TEST_CASE("quantise: three components stay, the others and faint ones go to the rest") {
  OwnContent own(8);
  for (int l = 1; l <= 5; ++l) own->add(l, 7, static_cast<float>(l));
  own->add_rest(7, 0.5F);
  own->add(1, 8, 16.0F);
  own->add(2, 8, 0.25F);  // 1/64
  own->add(3, 8, 0.5F);   // 1/32
  quantise(*own);
  CHECK(own->count(5, 7) == 5.0F);
  CHECK(own->count(4, 7) == 4.0F);
  CHECK(own->count(3, 7) == 3.0F);
  CHECK(own->count(2, 7) == 0.0F);
  CHECK(own->count(1, 7) == 0.0F);
  CHECK(own->rest(7) == 3.5F);
  CHECK(own->count(3, 8) == 0.5F);
  CHECK(own->count(2, 8) == 0.0F);
  CHECK(own->rest(8) == 0.0F);
}

TEST_CASE("quantise: a rest alone stays, and so does the smallest count") {
  OwnContent own(8);
  own->add_rest(0, 1.1F);
  own->add(4, 1, 1e-9F);
  quantise(*own);
  CHECK(own->rest(0) == 1.0F);
  CHECK(own->count(4, 1) == 0x1p-12F);
}

TEST_CASE("quantise: passes of labelled voxels are their own, those of an octet's others shared") {
  OwnContent own(8);
  own->add(1, row_order(9, 0), 1.0F);
  own->add_passes(row_order(9, 0), 9);
  own->add_passes(row_order(9, 1), 2);
  own->add_passes(row_order(9, 4), 3);
  own->add_passes(row_order(9, 5), 6);
  own->add_passes(row_order(10, 5), 255);
  quantise(*own);
  CHECK(own->passes(row_order(9, 0)) == 10);
  CHECK(own->passes(row_order(9, 1)) == 4);
  CHECK(own->passes(row_order(9, 2)) == 0);
  CHECK(own->passes(row_order(9, 4)) == 4);
  CHECK(own->passes(row_order(9, 5)) == 4);
  CHECK(own->passes(row_order(10, 5)) == 224);
}

}  // namespace
}  // namespace tessera
