// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The levels that evidence is rounded to: which there are, and how far off they may be.
#include "tessera/exchange/internal/evidence_levels.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "support/random.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace tessera {
namespace {

TEST_CASE("levels: four an octave from 2^-12 to 1.5 * 2^19, and each is its own level") {
  CHECK(count_of_level(0) == 0.0F);
  CHECK(count_of_level(1) == 0x1p-12F);
  CHECK(count_of_level(2) == 1.25F * 0x1p-12F);
  CHECK(count_of_level(3) == 1.5F * 0x1p-12F);
  CHECK(count_of_level(4) == 1.75F * 0x1p-12F);
  CHECK(count_of_level(49) == 1.0F);
  CHECK(count_of_level(kMostLevel) == 0x1.8p19F);
  for (int level = 0; level <= kMostLevel; ++level) {
    CHECK(level_of(count_of_level(level)) == level);
    // A packed block holds it to the last bit.
    CHECK(detail::long_float(detail::short_float(count_of_level(level))) == count_of_level(level));
  }
}

TEST_CASE("levels: a count in their range is off by a ninth of it at most, and order stays") {
  oracle::Random random(3);
  int before = 1;
  for (float count = 0x1p-12F; count < 0x1.8p19F; count *= 1.0F + 0x1p-6F) {
    const int level = level_of(count);
    REQUIRE(std::fabs(count_of_level(level) - count) <= count / 9.0F);
    REQUIRE(level >= before);
    before = level;
  }
  CHECK(count_of_level(level_of(1.125F)) == 1.25F);
  CHECK(count_of_level(level_of(std::nextafter(1.125F, 0.0F))) == 1.0F);
}

TEST_CASE("levels: beyond their range there is the nearest, and what is no count is none") {
  CHECK(level_of(1e-30F) == 1);
  CHECK(level_of(std::numeric_limits<float>::denorm_min()) == 1);
  CHECK(level_of(1e9F) == kMostLevel);
  CHECK(level_of(std::numeric_limits<float>::max()) == kMostLevel);
  CHECK(level_of(std::numeric_limits<float>::infinity()) == kMostLevel);
  CHECK(level_of(0.0F) == 0);
  CHECK(level_of(-1.0F) == 0);
  CHECK(level_of(std::numeric_limits<float>::quiet_NaN()) == 0);
}

TEST_CASE("levels of passes: 0 to 8 are exact, up to 255 they are off by an eighth at most") {
  int before = 0;
  for (unsigned passes = 0; passes < 256; ++passes) {
    const int level = passes_level_of(passes);
    const auto found = static_cast<double>(passes_of_level(level));
    REQUIRE(std::fabs(found - passes) <= passes / 8.0);
    if (passes <= 8) REQUIRE(level == static_cast<int>(passes));
    REQUIRE((level == before || level == before + 1));
    before = level;
  }
  CHECK(before == kMostPassesLevel);
  CHECK(passes_of_level(kMostPassesLevel) == 224);
  CHECK(passes_level_of(0xffffffffU) == kMostPassesLevel);
  for (int level = 0; level <= kMostPassesLevel; ++level)
    CHECK(passes_level_of(passes_of_level(level)) == level);
}

}  // namespace
}  // namespace tessera
