// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/security_update.hpp"

#include <catch2/catch.hpp>

namespace tessera {
namespace {

using Robots = std::vector<std::uint32_t>;

TEST_CASE("exclude_digest: the same set is the same number, another set another one") {
  CHECK(exclude_digest(Robots{}) == 0);
  CHECK(exclude_digest(Robots{3, 5}) == exclude_digest(Robots{5, 3, 5}));
  CHECK(exclude_digest(Robots{3, 5}) != exclude_digest(Robots{3}));
  CHECK(exclude_digest(Robots{0}) != exclude_digest(Robots{}));
}

// By Python: crc32c of 03000000 05000000. Other values would make robots differ that do not.
TEST_CASE("exclude_digest: a known answer") { CHECK(exclude_digest(Robots{5, 3}) == 0xf10baea8U); }

TEST_CASE("SecurityUpdates: what is offered waits until it is done") {
  SecurityUpdates updates;
  CHECK(updates.waiting() == nullptr);
  Outcome<FleetKeys> keys = FleetKeys::read({}, 0);
  REQUIRE(keys.ok());
  updates.offer(std::make_unique<SecurityUpdate>(SecurityUpdate{{7}, std::move(*keys)}));
  CHECK(updates.is_waiting());
  REQUIRE(updates.waiting() != nullptr);
  CHECK(updates.waiting()->exclude == Robots{7});
  updates.done();
  CHECK_FALSE(updates.is_waiting());
  CHECK(updates.waiting() == nullptr);
}

}  // namespace
}  // namespace tessera
