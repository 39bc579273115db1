// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/peer_table.hpp"

#include <catch2/catch.hpp>
#include <set>

#include "oracle/cloud.hpp"
#include "oracle/mapper.hpp"
#include "oracle/random.hpp"

namespace tessera {
namespace {

TEST_CASE("sequence window: a datagram is new once, within a window of 64, whatever the order") {
  oracle::Random random(oracle::announce_seed(605));
  SequenceWindow window;
  std::set<std::uint32_t> heard;
  std::uint32_t highest = 0;
  for (int i = 0; i < 20000; ++i) {
    const int step = random.below(140) - 70;
    const std::uint32_t sequence =
        1000U + static_cast<std::uint32_t>(static_cast<int>(highest) + step + i / 1000);
    const bool behind = !heard.empty() && sequence + SequenceWindow::kSize <= *heard.rbegin();
    const bool wanted = !behind && heard.count(sequence) == 0;
    REQUIRE(window.is_new(5, sequence) == wanted);
    if (wanted) window.note(5, sequence);
    if (wanted) heard.insert(sequence);
    highest = *heard.rbegin() - 1000U;
  }
}

TEST_CASE("sequence window: an earlier session is never new, a later one begins anew") {
  SequenceWindow window;
  const auto hear = [&](std::uint32_t session, std::uint32_t sequence) {
    const bool is_new = window.is_new(session, sequence);
    if (is_new) window.note(session, sequence);
    return is_new;
  };
  CHECK(hear(5, 100));
  CHECK_FALSE(hear(5, 100));
  CHECK_FALSE(hear(4, 101));
  CHECK(hear(6, 1));
  CHECK_FALSE(hear(6, 1));
  CHECK_FALSE(hear(5, 102));
}

TEST_CASE("peer table: a full table gives the place of who is silent longest, and of nobody else") {
  oracle::AlignedMemory memory(PeerTable::required_bytes(3));
  Arena arena(memory.span());
  PeerTable table = *PeerTable::make(arena, 3);
  for (const std::uint32_t robot : {7U, 8U, 9U}) {
    Peer* const peer = table.find_or_add(robot, 0);
    REQUIRE(peer != nullptr);
    peer->heard_us = robot * 1'000'000;
  }
  CHECK(table.find_or_add(8, 0)->robot == 8);
  CHECK(table.find_or_add(10, 60'000'000) == nullptr);
  CHECK(table.all().size() == 3);
  const Peer* const replaced = table.find_or_add(10, 7'000'000 + PeerTable::kSilentUs);
  REQUIRE(replaced != nullptr);
  CHECK(replaced->robot == 10);
  CHECK(table.find_or_add(8, 0)->robot == 8);
  CHECK(table.find_or_add(7, 60'000'000) == nullptr);
}

}  // namespace
}  // namespace tessera
