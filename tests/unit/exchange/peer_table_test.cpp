// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/peer_table.hpp"

#include <catch2/catch.hpp>
#include <set>

#include "support/cloud.hpp"
#include "support/mapper.hpp"
#include "support/random.hpp"

namespace tessera {
namespace {

TEST_CASE("sequence window: a datagram is new once, within a window of 64, whatever the order") {
  oracle::Random random(oracle::announce_seed(605));
  SequenceWindow window;
  std::set<std::uint64_t> heard;
  // Beyond 32 bits: a session never runs out of numbers.
  constexpr std::uint64_t kBegin = 0xffff'fff0U;
  std::uint64_t highest = kBegin;
  for (int i = 0; i < 20000; ++i) {
    const std::int64_t step = random.below(140) - 70;
    const std::uint64_t sequence = highest + static_cast<std::uint64_t>(step);
    const bool behind = !heard.empty() && sequence + SequenceWindow::kSize <= *heard.rbegin();
    const bool wanted = !behind && heard.count(sequence) == 0;
    REQUIRE(window.is_new(sequence) == wanted);
    if (wanted) window.note(5, sequence);
    if (wanted) heard.insert(sequence);
    highest = *heard.rbegin();
  }
}

TEST_CASE("sequence window: another session begins anew") {
  SequenceWindow window;
  CHECK_FALSE(window.is_of_another(5));
  window.note(5, 100);
  CHECK_FALSE(window.is_of_another(5));
  CHECK(window.is_of_another(6));
  CHECK(window.is_of_another(4));
  CHECK_FALSE(window.is_new(100));
  window.note(6, 1);
  CHECK(window.is_of_another(5));
  CHECK_FALSE(window.is_new(1));
  CHECK(window.is_new(2));
}

TEST_CASE("rate limit: so many at once, then so many a second, from any time on") {
  for (const std::int64_t begin_us : {std::int64_t{-3'600'000'000}, std::int64_t{0}}) {
    RateLimit limit;
    int passed = 0;
    for (int i = 0; i < 1000; ++i) passed += limit.pass(50, Instant::at_us(begin_us)) ? 1 : 0;
    CHECK(passed == 50);
    for (std::int64_t i = 1; i <= 10'000; ++i)
      passed += limit.pass(50, Instant::at_us(begin_us + i * 1000)) ? 1 : 0;
    CHECK(passed == 50 + 500);
  }
}

TEST_CASE("peer table: a full table gives the place of who is silent longest, and of nobody else") {
  AlignedMemory memory(PeerTable::required_bytes(3));
  Arena arena(memory.span());
  PeerTable table = *PeerTable::make(arena, 3);
  const auto at = [](std::int64_t us) { return Instant::at_us(us); };
  for (const std::uint32_t robot : {7U, 8U, 9U}) {
    Peer* const peer = table.find_or_add(robot, at(0));
    REQUIRE(peer != nullptr);
    peer->heard = at(robot * 1'000'000);
  }
  CHECK(table.find_or_add(8, at(0))->robot == 8);
  CHECK(table.find_or_add(10, at(60'000'000)) == nullptr);
  CHECK(table.all().size() == 3);
  const Peer* const replaced = table.find_or_add(10, at(7'000'000) + PeerTable::kSilent);
  REQUIRE(replaced != nullptr);
  CHECK(replaced->robot == 10);
  CHECK(table.find_or_add(8, at(0))->robot == 8);
  CHECK(table.find_or_add(7, at(60'000'000)) == nullptr);
}

}  // namespace
}  // namespace tessera
