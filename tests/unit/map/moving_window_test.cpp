// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The window's front door; what it does on a drive is in tests/laws.
#include "tessera/map/moving_window.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "support/small_map.hpp"

namespace tessera {

TEST_CASE("moving window: settings out of range are refused") {
  const WindowConfig good;
  const auto made = [](const WindowConfig& config) {
    return MovingWindow::make(config, 0.1).status();
  };
  CHECK(made(good) == Status::kOk);
  WindowConfig bad = good;
  for (const double radius : {0.0, -1.0, 4000.0, std::numeric_limits<double>::quiet_NaN()}) {
    bad.radius_m = radius;
    CHECK(made(bad) == Status::kInvalidArgument);
  }
  bad = good;
  bad.hysteresis_m = -0.1;
  CHECK(made(bad) == Status::kInvalidArgument);
  for (std::uint32_t WindowConfig::*const field :
       {&WindowConfig::entries_per_step, &WindowConfig::evictions_per_step,
        &WindowConfig::pressed_evictions_per_step, &WindowConfig::regions_per_step,
        &WindowConfig::reloads_per_step, &WindowConfig::label_voxels_per_step}) {
    bad = good;
    bad.*field = 0;
    CHECK(made(bad) == Status::kInvalidArgument);
  }
  CHECK(MovingWindow::make(good, 0.0).status() == Status::kInvalidArgument);
}

TEST_CASE("moving window: nothing happens at a place out of the grid") {
  SmallMap small(config_of_pages(16));
  REQUIRE(hit(small.map, {0, 0, 0}, 1, 1.0F) == Status::kOk);
  MovingWindow window = *MovingWindow::make({}, small.map.config().resolution_m);
  const BlockArchive taker{.evict = [](void*, const LocalMap&, const Block&) { return true; }};
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double x : {1e9, kInfinity, std::numeric_limits<double>::quiet_NaN()})
    CHECK(window.step(small.map, Point3d(x, 0, 0), taker).position == Status::kOutOfRange);
  CHECK(small.map.block_count() == 1);
  CHECK(window.step(small.map, Point3d(1e3, 0, 0), taker).evicted == 1);
  CHECK(small.map.block_count() == 0);
}

TEST_CASE("moving window: blocks that are refused for ever keep no others waiting") {
  WindowConfig config;
  config.evictions_per_step = config.pressed_evictions_per_step = 1;
  config.label_voxels_per_step = 1;
  // Crowded, so that most share their place in the index with some that are refused.
  constexpr std::int32_t kBlocks = 300;
  for (const std::uint64_t every : {2U, 3U, 60U}) {
    SmallMap small(config_of_pages(64));
    for (std::int32_t i = 0; i < kBlocks; ++i)
      REQUIRE(hit(small.map, {8 * i, 8 * (i % 7), 0}, 1, 1.0F) == Status::kOk);
    std::uint64_t modulus = every;
    const BlockArchive picky{
        .context = &modulus, .evict = [](void* context, const LocalMap&, const Block& block) {
          const auto x = static_cast<std::uint64_t>(unpack(BlockKey{block.key}).x);
          return x % *static_cast<std::uint64_t*>(context) != 0;
        }};
    const std::size_t refused = (kBlocks + every - 1) / every;
    MovingWindow window = *MovingWindow::make(config, small.map.config().resolution_m);
    for (std::int32_t i = 0; i < 2 * kBlocks && small.map.block_count() > refused; ++i) {
      const WindowStep step = window.step(small.map, Point3d(1e4, 0, 0), picky);
      CHECK(step.evicted <= 1);
      CHECK(step.evictions_refused <= 8);
    }
    CHECK(small.map.block_count() == refused);
  }
}

TEST_CASE("moving window: where far blocks do not make room near ones leave, for good") {
  struct Archive {
    int taken = 0;
    int asked = 0;
  } kept;
  const BlockArchive archive{.context = &kept,
                             .evict =
                                 [](void* context, const LocalMap&, const Block&) {
                                   ++static_cast<Archive*>(context)->taken;
                                   return true;
                                 },
                             .archived = [](void* context, BlockCoord) -> const RegionMask* {
                               ++static_cast<Archive*>(context)->asked;
                               return nullptr;
                             }};
  SmallMap small(config_of_pages(16));
  for (std::int32_t i = 0; i < 10; ++i)
    REQUIRE(hit(small.map, {8 * i, 0, 0}, 1, 1.0F) == Status::kOk);
  WindowConfig config;
  config.keep_while_room = config.evicts_near = true;
  config.reserve = {1, 1, 0, 1};
  MovingWindow roomy = *MovingWindow::make(config, small.map.config().resolution_m);
  CHECK(roomy.step(small.map, Point3d(0, 0, 0), archive).evicted == 0);
  CHECK(kept.asked > 0);

  // No map of this size has that much room beside ten blocks.
  config.reserve = {1 << 20, 1, 0, 1};
  config.evicts_near = false;
  MovingWindow keeping = *MovingWindow::make(config, small.map.config().resolution_m);
  CHECK(keeping.step(small.map, Point3d(0, 0, 0), archive).evicted == 0);
  config.evicts_near = true;
  config.pressed_evictions_per_step = config.evictions_per_step = 7;
  MovingWindow pressed = *MovingWindow::make(config, small.map.config().resolution_m);
  kept.asked = 0;
  CHECK(pressed.step(small.map, Point3d(0, 0, 0), archive).evicted == 7);
  CHECK(pressed.step(small.map, Point3d(0, 0, 0), archive).evicted == 3);
  CHECK(small.map.block_count() == 0);
  CHECK(kept.taken == 10);
  CHECK(kept.asked == 0);
}

}  // namespace tessera
