// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a comparison asks for next, of one who describes what it holds.
#include "tessera/exchange/internal/comparison.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "support/aligned_memory.hpp"
#include "tessera/exchange/internal/block_codec.hpp"

namespace tessera {
namespace {

/// A ledger with 64 records of its own, and a comparison of them with another robot.
struct Compared {
  static constexpr ReplicasConfig kReplicas{
      .segments = 1024, .blocks = 256, .contributions = 4, .robot_segments = 1024};
  static constexpr int kComponents = 5;
  static constexpr std::uint32_t kOther = 9;
  static ExchangeConfig config() {
    ExchangeConfig config;
    config.robot = 1;
    config.contributions = 4;
    config.records = kReplicas.blocks;
    return config;
  }
  Compared()
      : memory(Replicas::required_bytes(kReplicas) + Gate::required_bytes(config()) +
               Ledger::required_bytes(config(), kComponents) + Comparison::required_bytes() +
               BlockContent::required_bytes(kComponents)) {
    Arena arena = memory.arena();
    replicas = *Replicas::make(arena, kReplicas);
    gate = *Gate::make(arena, config(), {}, crc_authenticator(), {});
    ledger = *Ledger::make(arena, config(), store_of(replicas), gate, kComponents);
    comparison = *Comparison::make(arena);
    content = *BlockContent::make(arena, kComponents);
    REQUIRE(ledger.open(1, 0, Matrix34d::Identity(), counted) == Status::kOk);
    publish(0, 64);
    comparison.begin(ledger, own(), kOther, own().latest, now);
  }
  [[nodiscard]] const HeldContribution& own() const { return *ledger.publishing(); }
  void publish(int first, int end) {
    for (int i = first; i < end; ++i) {
      content.clear();
      content.set(1, i, 1.0F);
      quantise(content);
      VersionRange published;
      REQUIRE(ledger.publish(*pack({i, 0, 0}), content, published, counted).ok());
    }
  }
  /// Answers with what this robot itself holds, but other sums for these parts.
  void answer(VersionSpan span, std::initializer_list<std::uint32_t> other_parts) {
    Description description;
    Comparison::describe(ledger, own(), span, description);
    for (const std::uint32_t part : other_parts) description.sum[part] ^= 1U;
    comparison.hear(
        ledger, own(), description, now, [this](std::uint32_t version) { sent.push_back(version); },
        [](VersionRange) { return true; });
  }

  AlignedMemory memory;
  Replicas replicas;
  Gate gate;
  Ledger ledger;
  Comparison comparison;
  BlockContent content;
  ExchangeReport counted;
  RequestedContribution requested;
  std::vector<std::uint32_t> sent;  ///< Versions that the other robot is to get.
  Instant now = Instant::at_us(1'000'000);
};

TEST_CASE("Comparison: of more records than a list can have each part has a sum") {
  Compared compared;
  compared.publish(64, 150);
  // A version far off makes every bucket wide.
  compared.ledger.places()[compared.ledger.number_of(compared.own())].latest = 1'000'000;
  compared.publish(150, 151);
  const HeldContribution& own = compared.own();
  REQUIRE(own.index.width() == 9);
  Description description;
  Comparison::describe(compared.ledger, own, {9, 0}, description);
  REQUIRE_FALSE(description.is_list);
  // Of some 64 records each.
  REQUIRE(description.count == 4);
  CHECK(description.part_width == 7);
  std::uint64_t sum = 0;
  for (const std::uint64_t part : std::span(description.sum).first(4)) sum += part;
  CHECK(sum == own.index.sum({9, 0}));
  CHECK(description.sum[1] != 0);
  CHECK(description.sum[2] == 0);
  Description list;
  Comparison::describe(compared.ledger, own, {7, 1}, list);
  CHECK(list.is_list);
  // Version v is of block v - 1.
  CHECK(list.count == 150 - 128);
  CHECK(list.last == 256);
}

TEST_CASE("Comparison: lists with other sums and equal marks are asked for anew, as a whole") {
  Compared compared;
  REQUIRE(compared.comparison.write_next(compared.requested));
  REQUIRE(compared.requested.count == 1);
  const VersionSpan whole{compared.requested.width, compared.requested.span[0]};
  const auto ask = [&] { return compared.comparison.write_next(compared.requested); };
  const auto is_over = [&] {
    return compared.comparison.is_over(compared.ledger, compared.own(), compared.now);
  };
  // Records came between the sums of two versions and their lists.
  const auto answer_two = [&] {
    compared.answer(whole, {2, 3});
    REQUIRE(ask());
    REQUIRE(compared.requested.count == 2);
    for (const std::uint32_t part : {2U, 3U}) compared.answer({compared.requested.width, part}, {});
  };
  answer_two();
  REQUIRE_FALSE(is_over());
  REQUIRE(ask());
  CHECK(compared.requested.type == RequestType::kDescribe);
  CHECK(compared.requested.width == whole.width);
  REQUIRE(compared.requested.count == 1);
  CHECK(compared.requested.span[0] == 0);

  SECTION("and if the sums are equal then, nothing differs") {
    compared.answer(whole, {});
    CHECK(is_over());
    CHECK(compared.sent.empty());
  }
  SECTION("and if they are other ones still, both get both") {
    answer_two();
    CHECK(compared.sent == std::vector<std::uint32_t>{3, 4});
    REQUIRE(ask());
    CHECK(compared.requested.type == RequestType::kVersions);
    CHECK(compared.requested.count == 2);
  }
}

}  // namespace
}  // namespace tessera
