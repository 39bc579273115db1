// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Memory: its size is known at compile time, a map takes exactly that, writes nowhere else, and
// refuses settings and memory that it cannot work with.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <limits>

#include "support/small_map.hpp"

namespace tessera {
namespace {

constexpr MapConfig kConfig = config_of_pages(16);
constexpr std::size_t kBytes = required_bytes(kConfig);
static_assert(kBytes ==
              BlockIndex::required_bytes(max_blocks(kConfig)) + 16 * SlabPool::kPageBytes);
static_assert(kBytes % kArenaAlignment == 0);

struct Guarded {
  alignas(kArenaAlignment) std::array<std::byte, kBytes> memory;
  std::array<std::byte, 256> canary;
};

Guarded& fresh_guarded() {
  static Guarded guarded;
  guarded.memory.fill(std::byte{0xcd});
  guarded.canary.fill(std::byte{0x7e});
  return guarded;
}

Status make_status(const MapConfig& config, int num_classes = 3) {
  Guarded& guarded = fresh_guarded();
  Arena arena(guarded.memory);
  return LocalMap::make(arena, config, table_of(num_classes)).status();
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST_CASE("LocalMap: lives in a static array whose size the compiler computes") {
  Guarded& guarded = fresh_guarded();
  Arena arena(guarded.memory);
  const Result<LocalMap> map = LocalMap::make(arena, kConfig, table_of(19));
  REQUIRE(map.ok());
  CHECK(arena.remaining_bytes() == 0);
  CHECK(map->usage().capacity_bytes == kBytes);
  CHECK(map->block_count() == 0);
}

TEST_CASE("LocalMap: making one does not touch the storage") {
  Guarded& guarded = fresh_guarded();
  Arena arena(guarded.memory);
  REQUIRE(LocalMap::make(arena, kConfig, table_of(3)).ok());
  const auto storage = std::span(guarded.memory).last(kConfig.storage_bytes);
  CHECK(std::all_of(storage.begin(), storage.end(),
                    [](std::byte b) { return b == std::byte{0xcd}; }));
}

TEST_CASE("LocalMap: writes nowhere but in its memory, also when it is full") {
  Guarded& guarded = fresh_guarded();
  Arena arena(guarded.memory);
  Result<LocalMap> map = LocalMap::make(arena, kConfig, table_of(kMaxClasses));
  REQUIRE(map.ok());
  int refusals = 0;
  for (std::int32_t i = 0; refusals < 50; ++i) {
    const VoxelCoord v{5 * i - 700, 3 * (i % 7) - 9, i % 16 - 8};
    if (hit(*map, v, 1 + i % (kMaxClasses + 1), 60.0F) != Status::kOk) ++refusals;
    if (carve(*map, {v.x + 1, v.y, v.z}) != Status::kOk) ++refusals;
  }
  CHECK(std::all_of(guarded.canary.begin(), guarded.canary.end(),
                    [](std::byte b) { return b == std::byte{0x7e}; }));
}

TEST_CASE("LocalMap: memory one byte short, or not on a cache line, is refused untaken") {
  Guarded& guarded = fresh_guarded();
  Arena short_arena(std::span<std::byte>(guarded.memory).first(kBytes - 1));
  CHECK(LocalMap::make(short_arena, kConfig, table_of(3)).status() == Status::kResourceExhausted);
  CHECK(short_arena.remaining_bytes() == kBytes - 1);
  MapConfig smaller = kConfig;
  smaller.storage_bytes -= SlabPool::kPageBytes;
  Arena skewed(std::span<std::byte>(guarded.memory).subspan(8));
  CHECK(LocalMap::make(skewed, smaller, table_of(3)).status() == Status::kResourceExhausted);
}

TEST_CASE("LocalMap: a resolution that is not positive and finite is invalid") {
  for (const double bad : {0.0, -0.1, kNaN, kInfinity, -kInfinity}) {
    MapConfig config = kConfig;
    config.resolution_m = bad;
    CHECK(make_status(config) == Status::kInvalidArgument);
  }
}

TEST_CASE("LocalMap: a prior that is negative or not finite is invalid, zero is valid") {
  MapConfig config = kConfig;
  for (const double bad : {-0.001, kNaN, kInfinity}) {
    config.prior = bad;
    CHECK(make_status(config) == Status::kInvalidArgument);
  }
  config.prior = 0.0;
  CHECK(make_status(config) == Status::kOk);
}

TEST_CASE("LocalMap: a cap that is negative or not finite is invalid, zero means none") {
  MapConfig config = kConfig;
  for (const double bad : {-1.0, kNaN, kInfinity}) {
    config.max_evidence = static_cast<float>(bad);
    CHECK(make_status(config) == Status::kInvalidArgument);
  }
  config.max_evidence = 0.0F;
  CHECK(make_status(config) == Status::kOk);
}

TEST_CASE("LocalMap: a free weight that is not positive and finite is invalid") {
  for (const double bad : {0.0, -0.4, kNaN, kInfinity}) {
    MapConfig config = kConfig;
    config.free_weight = static_cast<float>(bad);
    CHECK(make_status(config) == Status::kInvalidArgument);
  }
}

TEST_CASE("LocalMap: the cap is at most 255 passes of free evidence") {
  MapConfig config = kConfig;
  config.free_weight = 0.5F;
  config.max_evidence = 127.0F;  // 254
  CHECK(make_status(config) == Status::kOk);
  config.max_evidence = 127.5F;  // 255
  CHECK(make_status(config) == Status::kOk);
  config.max_evidence = 127.625F;  // 255.25
  CHECK(make_status(config) == Status::kInvalidArgument);
  config.max_evidence = 128.0F;  // 256
  CHECK(make_status(config) == Status::kInvalidArgument);
}

TEST_CASE("LocalMap: a tuple policy that does not exist is invalid") {
  MapConfig config = kConfig;
  config.tuple = static_cast<TuplePolicy>(200);
  CHECK(make_status(config) == Status::kInvalidArgument);
}

TEST_CASE("LocalMap: a table without a class is invalid, one and 62 classes are not") {
  CHECK(make_status(kConfig, 0) == Status::kInvalidArgument);
  CHECK(make_status(kConfig, 1) == Status::kOk);
  CHECK(make_status(kConfig, kMaxClasses) == Status::kOk);
}

TEST_CASE("LocalMap: storage under four pages is invalid") {
  MapConfig config = config_of_pages(4);
  CHECK(make_status(config) == Status::kOk);
  config.storage_bytes += 1;
  CHECK(make_status(config) == Status::kOk);
  config.storage_bytes -= 2;
  CHECK(make_status(config) == Status::kInvalidArgument);
  config.storage_bytes = 0;
  CHECK(make_status(config) == Status::kInvalidArgument);
}

TEST_CASE("max_passes: the whole passes that the cap holds, 255 without a cap") {
  const auto passes = [](float max_evidence, float free_weight) {
    MapConfig config = kConfig;
    config.max_evidence = max_evidence;
    config.free_weight = free_weight;
    return int{SmallMap(config).map.max_passes()};
  };
  CHECK(passes(100.0F, 0.4F) == 250);
  CHECK(passes(25.0F, 0.1F) == 250);
  CHECK(passes(10.0F, 3.0F) == 3);
  CHECK(passes(1.0F, 1.0F) == 1);
  CHECK(passes(0.0F, 0.4F) == 255);
  CHECK(passes(249.9375F, 1.0F) == 249);
  CHECK(passes(249.9995F, 1.0F) == 249);  // 250 would be over the cap by more than rounding
}

TEST_CASE("fit_to_budget: the largest storage whose required bytes stay within the budget") {
  for (const std::size_t budget : {std::size_t{20000}, std::size_t{1} << 20U, std::size_t{10000001},
                                   std::size_t{64} << 20U, std::size_t{512} << 20U}) {
    INFO("budget " << budget);
    MapConfig config = fit_to_budget({}, budget);
    CHECK(config.storage_bytes % SlabPool::kPageBytes == 0);
    CHECK(required_bytes(config) <= budget);
    config.storage_bytes += SlabPool::kPageBytes;
    CHECK(required_bytes(config) > budget);
  }
}

TEST_CASE("fit_to_budget: storage is zero where not even a page fits beside its index") {
  static_assert(fit_to_budget({}, 0).storage_bytes == 0);
  CHECK(fit_to_budget({}, SlabPool::kPageBytes - 1).storage_bytes == 0);
  CHECK(fit_to_budget({}, SlabPool::kPageBytes).storage_bytes == 0);
  CHECK(required_bytes(fit_to_budget({}, 2 * SlabPool::kPageBytes)) <= 2 * SlabPool::kPageBytes);
}

}  // namespace
}  // namespace tessera
