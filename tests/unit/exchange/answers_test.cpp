// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What one robot may cause others to send.
#include "tessera/exchange/internal/answers.hpp"

#include <catch2/catch.hpp>

#include "support/mapper.hpp"

namespace tessera {
namespace {

TEST_CASE(
    "Answers: an allowance that is spent grows by a share of the rate, however often it is asked "
    "for") {
  constexpr std::int64_t kRate = 20'000;
  const std::int64_t step_us = GENERATE(17, 100, 1'000, 10'000, 333'333);
  ExchangeConfig config;
  config.bytes_per_s = kRate;
  AlignedMemory memory(Answers::required_bytes(config));
  Arena arena(memory.span());
  const Result<Answers> answers = Answers::make(arena, config);
  REQUIRE(answers.ok());
  const Ledger ledger;
  Peer peer;
  std::int64_t now_us = 1'000'000;
  CHECK(answers->may_ask(peer, ledger, Instant::at_us(now_us)));
  Answers::charge(peer, 10'000'000);
  const std::int64_t before = peer.allowance_bytes;
  for (const std::int64_t end_us = now_us + 10'000'000; now_us < end_us;) {
    now_us += step_us;
    CHECK_FALSE(answers->may_ask(peer, ledger, Instant::at_us(now_us)));
  }
  const double share = static_cast<double>(kRate) / Answers::kRepeatShare;
  const double due = share * static_cast<double>(now_us - 1'000'000) / 1e6;
  const auto grown = static_cast<double>(peer.allowance_bytes - before);
  CHECK(grown <= due);
  CHECK(grown > 0.99 * due);
}

TEST_CASE("Answers: what an asker had goes last, however often it asks for all, and gaps first") {
  const ExchangeConfig config;
  AlignedMemory memory(Answers::required_bytes(config));
  Arena arena(memory.span());
  Result<Answers> answers = Answers::make(arena, config);
  REQUIRE(answers.ok());
  ExchangeReport counted;
  PeerTable peers;
  const auto ask = [&](VersionRange range) {
    REQUIRE(answers->add({.range = range, .due = Instant::at_us(1), .asker = 9}, counted));
  };
  const auto send_next = [&](std::uint32_t most) {
    const Answers::Range* const next = answers->next(peers, Instant::at_us(2));
    REQUIRE(next != nullptr);
    const VersionRange sent{next->range.first,
                            std::min(next->range.last, next->range.first + most - 1)};
    answers->drop(0, sent);
    return sent;
  };
  ask({1, 1000});
  for (std::uint32_t first = 1; first <= 1000; first += 100) {
    CHECK(send_next(100) == VersionRange{first, first + 99});
    // The last time nothing waits, so all of it is wanted again.
    if (first != 901) ask({1, 1000});
  }
  CHECK(send_next(1000) == VersionRange{1, 900});
  CHECK(answers->next(peers, Instant::at_us(2)) == nullptr);
  ask({1, 1000});
  CHECK(send_next(500) == VersionRange{1, 500});
  ask({1, 1000});
  ask({200, 205});
  CHECK(send_next(500) == VersionRange{200, 205});
  CHECK(send_next(500) == VersionRange{501, 1000});
  CHECK(send_next(500) == VersionRange{1, 500});
}

TEST_CASE("Answers: one robot leaves a quarter of the places for single records to others") {
  ExchangeConfig config;
  config.picks = 400;
  AlignedMemory memory(Answers::required_bytes(config));
  Arena arena(memory.span());
  Result<Answers> answers = Answers::make(arena, config);
  REQUIRE(answers.ok());
  auto& picks = answers->picks();
  const auto push_all = [&](std::uint32_t asker) {
    std::size_t pushed = 0;
    while (picks.room_for(asker) != 0 && picks.push({.version = 1, .asker = asker})) ++pushed;
    return pushed;
  };
  // Where the ring begins makes no difference.
  for (int i = 0; i < 150; ++i) {
    REQUIRE(picks.push({.version = 1, .asker = 5}));
    picks.pop();
  }
  CHECK(push_all(7) == 300);
  CHECK(push_all(8) == 100);
  CHECK(picks.count == 400);
  for (int i = 0; i < 10; ++i) picks.pop();
  CHECK(picks.room_for(7) == 10);
  CHECK(push_all(9) == 10);
}

}  // namespace
}  // namespace tessera
