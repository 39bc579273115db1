// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The walk through the grid against the brute-force slabs: random, axis-parallel, backward and
// border-riding segments.
#include <catch2/catch.hpp>
#include <cmath>

#include "oracle/carving_oracle.hpp"
#include "support/cloud.hpp"
#include "support/random.hpp"
#include "tessera/grid/internal/segment.hpp"

namespace tessera::oracle {

TEST_CASE(
    "walk_segment: from end to end, a face at a time, within its bound, through pierced cells "
    "only") {
  Random random(announce_seed(44));
  const auto coordinate = [&] {
    const int kind = random.below(3);
    return kind == 0 ? static_cast<double>(random.below(9) - 4)
                     : (kind == 1 ? random.below(17) * 0.5 - 4.0 : random.uniform(-4.0, 4.0));
  };
  for (int round = 0; round < 600; ++round) {
    Vector a{coordinate(), coordinate(), coordinate()};
    Vector b{coordinate(), coordinate(), coordinate()};
    const int parallel = random.below(4);  // 3: not parallel to an axis
    for (std::size_t i = 0; i < 3; ++i)
      b[i] = parallel < 3 && static_cast<int>(i) != parallel ? a[i] : b[i];
    CAPTURE(a, b);
    Pierced pierced;
    pierced.add(a, b, 1.0);
    std::vector<Voxel> walked;
    const bool all =
        walk_segment({a[0], a[1], a[2]}, {b[0], b[1], b[2]}, [&](int x, int y, int z, double) {
          walked.push_back({x, y, z});
          return true;
        });
    CHECK(all);
    REQUIRE(!walked.empty());
    CHECK(walked.front() == cell_of(a, 1.0));
    CHECK(walked.back() == cell_of(b, 1.0));
    const double bound =
        std::abs(b[0] - a[0]) + std::abs(b[1] - a[1]) + std::abs(b[2] - a[2]) + 4.0;
    CHECK(static_cast<double>(walked.size()) <= bound);
    std::int64_t far = 0;
    for (std::size_t i = 1; i < walked.size(); ++i) {
      std::int64_t steps = 0;
      for (std::size_t k = 0; k < 3; ++k) steps += std::abs(walked[i][k] - walked[i - 1][k]);
      far += steps == 1 ? 0 : 1;
    }
    CHECK(far == 0);
    const std::set<Voxel> cells(walked.begin(), walked.end());
    int missing = 0;
    int extra = 0;
    for (const Voxel& cell : pierced.certain) missing += cells.count(cell) == 0 ? 1 : 0;
    for (const Voxel& cell : cells) extra += pierced.possible.count(cell) == 0 ? 1 : 0;
    CHECK(missing == 0);
    CHECK(extra == 0);
  }
}

}  // namespace tessera::oracle
