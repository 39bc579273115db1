// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The arena hands out aligned, zeroed, disjoint regions front to back, and says when there is no
// more.
#include "tessera/base/arena.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <limits>

namespace tessera {
namespace {

struct Triple {
  std::uint32_t a = 7;
  std::uint32_t b = 8;
  std::uint32_t c = 9;
};

/// Four cache lines, filled with a pattern that is not zero.
struct Memory {
  Memory() { bytes.fill(std::byte{0xa5}); }
  alignas(kArenaAlignment) std::array<std::byte, 4 * kArenaAlignment> bytes;
};

std::size_t offset(const Memory& memory, const void* address) {
  return static_cast<std::size_t>(static_cast<const std::byte*>(address) - memory.bytes.data());
}

static_assert(align_up(0, 64) == 0 && align_up(1, 64) == 64);
static_assert(align_up(63, 64) == 64 && align_up(64, 64) == 64 && align_up(65, 64) == 128);
static_assert(arena_bytes<std::uint64_t>(0) == 0);
static_assert(arena_bytes<std::uint64_t>(7) == 64);
static_assert(arena_bytes<std::uint64_t>(8) == 64);
static_assert(arena_bytes<std::uint64_t>(9) == 128);
static_assert(arena_bytes<Triple>(6) == 128);

TEST_CASE("Arena: every region starts on a cache line") {
  Memory memory;
  Arena arena(memory.bytes);
  CHECK(offset(memory, arena.take<std::uint8_t>(1).data()) == 0);
  CHECK(offset(memory, arena.take<Triple>(1).data()) == kArenaAlignment);
  CHECK(offset(memory, arena.take_untouched(3).data()) == 2 * kArenaAlignment);
}

TEST_CASE("Arena: taking uses exactly arena_bytes") {
  for (std::size_t count = 0; count <= 20; ++count) {
    Memory memory;
    Arena arena(memory.bytes);
    const std::size_t before = arena.remaining_bytes();
    REQUIRE(arena.take<Triple>(count).size() == count);
    CHECK(before - arena.remaining_bytes() == arena_bytes<Triple>(count));
  }
}

TEST_CASE("Arena: numbers are zeroed, whatever the memory held") {
  Memory memory;
  Arena arena(memory.bytes);
  const auto words = arena.take<std::uint64_t>(32);
  REQUIRE(words.size() == 32);
  CHECK(std::all_of(words.begin(), words.end(), [](std::uint64_t w) { return w == 0; }));
}

TEST_CASE("Arena: objects have their members' default values") {
  Memory memory;
  Arena arena(memory.bytes);
  const auto items = arena.take<Triple>(2);
  REQUIRE(items.size() == 2);
  CHECK(items[1].a == 7);
  CHECK(items[1].c == 9);
}

TEST_CASE("Arena: take_untouched leaves the memory as it was") {
  Memory memory;
  Arena arena(memory.bytes);
  const auto bytes = arena.take_untouched(100);
  REQUIRE(bytes.size() == 100);
  CHECK(std::all_of(bytes.begin(), bytes.end(), [](std::byte b) { return b == std::byte{0xa5}; }));
}

TEST_CASE("Arena: one below and exactly the memory fit, one above does not") {
  constexpr std::size_t kWords = 4 * kArenaAlignment / sizeof(std::uint64_t);
  for (const std::size_t count : {kWords - 1, kWords, kWords + 1}) {
    Memory memory;
    Arena arena(memory.bytes);
    CHECK(arena.take<std::uint64_t>(count).size() == (count <= kWords ? count : 0));
  }
}

TEST_CASE("Arena: a region that does not fit takes nothing, so a smaller one still fits") {
  Memory memory;
  Arena arena(memory.bytes);
  REQUIRE(arena.take<std::uint8_t>(1).size() == 1);
  CHECK(arena.take<std::uint8_t>(3 * kArenaAlignment + 1).empty());
  CHECK(arena.remaining_bytes() == 3 * kArenaAlignment);
  CHECK(arena.take<std::uint8_t>(3 * kArenaAlignment).size() == 3 * kArenaAlignment);
  CHECK(arena.take<std::uint8_t>(1).empty());
}

TEST_CASE("Arena: memory that ends inside a cache line serves whole lines only") {
  Memory memory;
  Arena arena(std::span<std::byte>(memory.bytes).first(kArenaAlignment + 8));
  CHECK(arena.take<std::uint8_t>(kArenaAlignment).size() == kArenaAlignment);
  CHECK(arena.take<std::uint8_t>(8).empty());
}

TEST_CASE("Arena: a count whose bytes overflow size_t does not fit") {
  Memory memory;
  Arena arena(memory.bytes);
  constexpr std::size_t kHuge = std::numeric_limits<std::size_t>::max();
  CHECK(arena.take<std::uint64_t>(kHuge / 4).empty());
  CHECK(arena.take<std::uint8_t>(kHuge).empty());
  CHECK(arena.take_untouched(kHuge).empty());
  CHECK(arena.remaining_bytes() == memory.bytes.size());
}

TEST_CASE("Arena: without memory nothing fits") {
  Arena arena(std::span<std::byte>{});
  CHECK(arena.remaining_bytes() == 0);
  CHECK(arena.take<std::uint8_t>(1).empty());
}

TEST_CASE("Arena: says whether the memory starts on a cache line") {
  Memory memory;
  CHECK(Arena(memory.bytes).aligned());
  CHECK_FALSE(Arena(std::span<std::byte>(memory.bytes).subspan(1)).aligned());
  CHECK_FALSE(Arena(std::span<std::byte>(memory.bytes).subspan(kArenaAlignment / 2)).aligned());
}

}  // namespace
}  // namespace tessera
