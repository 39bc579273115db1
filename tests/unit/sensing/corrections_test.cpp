// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <vector>

#include "unit/sensing/port_bench.hpp"

namespace tessera {
namespace {

TEST_CASE("SensorPort: corrections of its robot wait for who takes them, two at most") {
  if (!enter_own_network()) return;
  SensorPortConfig config = port_config();
  config.robot = 3;
  config.takes_corrections = true;
  const auto port = open_port(config);
  const auto sender = open_sender();
  const std::vector<std::int64_t> keys(2000, 5);
  const std::vector<Matrix34d> poses(2000, Matrix34d::Identity());
  const auto send = [&](std::uint32_t robot, std::uint32_t revision) {
    REQUIRE(sender->send("TESSERA_CORRECTION", encode(CorrectionToSend{.robot = robot,
                                                                       .revision = revision,
                                                                       .of_submaps = true,
                                                                       .keys = keys,
                                                                       .poses = poses})));
  };
  CHECK(port->correction() == nullptr);
  send(4, 1);
  for (std::uint32_t revision = 2; revision <= 4; ++revision) send(3, revision);
  REQUIRE(sender->send("TESSERA_CORRECTION", std::vector<std::byte>(10)));
  REQUIRE(eventually_stepped(*port, [&] {
    const SensorReport r = port->report();
    return r.corrections_dropped == 2 && r.corrections == 2 && r.corrections_foreign == 1;
  }));
  for (std::uint32_t revision = 2; revision <= 3; ++revision) {
    const CorrectionMessage* const message = port->correction();
    REQUIRE(message != nullptr);
    CHECK(message->header.revision == revision);
    CHECK(message->header.count == 2000);
    CHECK(message->keys[1999] == 5);
    port->pop_correction();
  }
  CHECK(port->correction() == nullptr);
  REQUIRE(sender->send("TESSERA_CORRECTION", std::vector<std::byte>(10)));
  REQUIRE(eventually_stepped(*port, [&] {
    return port->report().faults[static_cast<std::size_t>(MessageFault::kOtherType)] == 1;
  }));
}

}  // namespace
}  // namespace tessera
