// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What holds of the tables whatever the DBC file says; that both are the same is for tests/can.
#include "vehicle/bus_table.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "support/random.hpp"

namespace tessera {
namespace {

TEST_CASE("bus table: places, sizes and end-to-end headers fit") {
  std::set<std::uint32_t> places;
  for (const BusMessage& message : kBusMessages) {
    INFO(message.name << " at " << message.place);
    CHECK(places.insert(message.place).second);
    CHECK(message.place < kBusIds);
    CHECK(message.from_vehicle == (message.place < bus::kIdHeartbeat));
    CHECK(message.cycle_ms > 0);
    CHECK(message.size <= (message.is_fd ? kMostCanFdBytes : kMostClassicBytes));
    std::vector<bool> used(8U * message.size);
    for (const Signal& signal : message.signals) {
      INFO(signal.name);
      REQUIRE(signal.start + signal.length <= 8 * message.size);
      for (unsigned i = signal.start; i < unsigned{signal.start} + signal.length; ++i) {
        CHECK_FALSE(used[i]);
        used[i] = true;
      }
      CHECK(signal.scale > 0.0);
      CHECK(signal.least <= signal.most);
    }
    if (message.e2e != E2eProfile::kNone) {
      const Signal& crc = message.signals[0];
      const Signal& counter = message.signals[1];
      const bool one = message.e2e == E2eProfile::kProfile1;
      CHECK(crc.start == 0);
      CHECK(crc.length == (one ? 8 : 16));
      CHECK(counter.start == (one ? 8 : 16));
      CHECK(counter.length == (one ? 4 : 8));
    }
  }
}

TEST_CASE("bus table: base identifiers") {
  CHECK(is_base_id(0));
  CHECK(is_base_id(0x100));
  CHECK(is_base_id(0x7e0));
  CHECK_FALSE(is_base_id(0x800));
  CHECK_FALSE(is_base_id(0x110));
  CHECK_FALSE(is_base_id(0xffffffe0U));
  CHECK(bus_message(0x07) == nullptr);
  CHECK(bus_message(32) == nullptr);
}

TEST_CASE("Signal: every value in range comes back within half a step, in any bytes") {
  oracle::Random random(7301);
  for (const BusMessage& message : kBusMessages) {
    std::vector<std::uint8_t> data(message.size);
    for (const Signal& signal : message.signals) {
      INFO(message.name << " " << signal.name);
      for (std::uint8_t& byte : data) byte = static_cast<std::uint8_t>(random.below(256));
      const std::vector<std::uint8_t> before = data;
      for (int round = 0; round < 20; ++round) {
        const double value = random.uniform(signal.least, signal.most);
        put_value(data, signal, value);
        REQUIRE(std::abs(value_of(data, signal) - value) <= 0.5001 * signal.scale);
        REQUIRE(in_range(signal, value_of(data, signal)));
      }
      for (const double value : {signal.least, signal.most}) {
        put_value(data, signal, value);
        CHECK(value_of(data, signal) == Approx(value).margin(0.5001 * signal.scale));
      }
      put_value(data, signal, 1e300);
      CHECK(value_of(data, signal) == Approx(signal.most).margin(0.5001 * signal.scale));
      put_value(data, signal, std::numeric_limits<double>::quiet_NaN());
      CHECK(value_of(data, signal) == Approx(signal.least).margin(0.5001 * signal.scale));
      // The bits around it are as they were.
      put_raw(data, signal, raw_of(before, signal));
      REQUIRE(data == before);
    }
  }
}

TEST_CASE("Signal: one that is not within the data is neither read nor written") {
  std::vector<std::uint8_t> data(2, 0xff);
  constexpr Signal kBeyond{.name = "Beyond", .start = 9, .length = 8, .most = 255};
  CHECK(raw_of(data, kBeyond) == 0);
  put_raw(data, kBeyond, 0);
  CHECK(data == std::vector<std::uint8_t>{0xff, 0xff});
}

}  // namespace
}  // namespace tessera
