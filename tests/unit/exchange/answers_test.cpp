// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What one robot may cause others to send.
#include "tessera/exchange/answers.hpp"

#include <catch2/catch.hpp>

#include "oracle/mapper.hpp"

namespace tessera {
namespace {

TEST_CASE(
    "Answers: an allowance that is spent grows by a share of the rate, however often it is asked "
    "for") {
  constexpr std::int64_t kRate = 20'000;
  const std::int64_t step_us = GENERATE(17, 100, 1'000, 10'000, 333'333);
  ExchangeConfig config;
  config.bytes_per_s = kRate;
  oracle::AlignedMemory memory(Answers::required_bytes(config));
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

}  // namespace
}  // namespace tessera
