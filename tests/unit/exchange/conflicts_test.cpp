// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which proofs are kept, and when they are sent.
#include "tessera/exchange/conflicts.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "support/mapper.hpp"

namespace tessera {
namespace {

constexpr std::size_t kLeastProof = 1 + kSignatureBytes;

struct Table {
  Table() : memory(Conflicts::required_bytes()) {
    Arena arena(memory.span());
    conflicts = *Conflicts::make(arena);
  }
  bool add(std::uint32_t robot, std::uint32_t epoch, Instant due = Instant::never()) {
    const std::array<std::byte, kLeastProof> proof{};
    ConflictBody conflict{.id = {robot, epoch, 0}};
    for (ConflictBody::Side& side : conflict.side) side.proof = proof;
    return conflicts.add(conflict, due);
  }
  AlignedMemory memory;
  Conflicts conflicts;
};

Instant at(std::int64_t us) { return Instant::at_us(us); }

TEST_CASE(
    "Conflicts: one proof of an epoch, three of a robot, and no more than there is room for") {
  Table table;
  CHECK(table.add(7, 1));
  CHECK_FALSE(table.add(7, 1));
  CHECK(table.add(7, 2));
  CHECK(table.add(7, 9));
  CHECK_FALSE(table.add(7, 10));
  CHECK(table.conflicts.count_of(7) == 3);
  CHECK(table.conflicts.find(7, 9) != nullptr);
  CHECK(table.conflicts.find(7, 10) == nullptr);
  CHECK(table.conflicts.find(8, 9) == nullptr);
  std::size_t added = 3;
  for (std::uint32_t robot = 100; robot < 200; ++robot) added += table.add(robot, 1) ? 1U : 0U;
  CHECK(added == Conflicts::kMost);
  CHECK(table.conflicts.all().size() == Conflicts::kMost);
}

TEST_CASE("Conflicts: a proof is sent when it is due, and again after a pause") {
  Table table;
  std::vector<std::byte> body(kMostConflictBytes);
  const auto is_sent = [&](Instant now) {
    ByteWriter to(body);
    return table.conflicts.write_due(to, now);
  };
  REQUIRE(table.add(7, 1, Instant::long_ago()));
  CHECK(is_sent(at(0)));
  CHECK_FALSE(is_sent(at(1'000'000)));
  Conflicts::Known& known = *table.conflicts.find(7, 1);
  Conflicts::owe(known, at(100), {500});
  CHECK_FALSE(is_sent(at(499)));
  CHECK(is_sent(at(500)));
  // What is owed earlier counts.
  Conflicts::owe(known, at(5000), {500});
  Conflicts::owe(known, at(2000), {500});
  CHECK(is_sent(at(2000)));
  // It stays due where it does not fit.
  Conflicts::owe(known, at(9000), {500});
  ByteWriter little(std::span<std::byte>(body).first(20));
  CHECK_FALSE(table.conflicts.write_due(little, at(9000)));
  CHECK(is_sent(at(9000)));
}

TEST_CASE("Conflicts: of other robots' proofs some twenty are checked in a second") {
  Table table;
  int checked = 0;
  for (int i = 0; i < 10'000; ++i) checked += table.conflicts.may_check(at(100 * i)) ? 1 : 0;
  // 20 at once, and 20 in the second that this is.
  CHECK(checked >= 39);
  CHECK(checked <= 40);
}

}  // namespace
}  // namespace tessera
