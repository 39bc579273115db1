// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Links on a loopback network of the test's own: what they hand over, what they refuse, and that
// they leave the heap alone.
#include "link/datagram_link.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "base/allocation_counter.hpp"
#include "base/monotonic_clock.hpp"
#include "link/status_publisher.hpp"
#include "stranger.hpp"

namespace tessera {
namespace {

TEST_CASE("DatagramLink: what one sends the other receives, once, in order, with its sender") {
  if (!enter_own_network()) return;
  const auto a = open_link(loopback_config());
  const auto b = open_link(loopback_config());
  Buffer buffer;
  CHECK(b->receive(buffer).bytes.empty());
  const std::string longest(a->max_payload_bytes(), 'x');
  REQUIRE(longest.size() == 1392);
  for (const std::string& text : {std::string("first"), longest, std::string("l")})
    REQUIRE(a->send(bytes_of(text)));
  REQUIRE(eventually([&] { return b->report().received == 3; }));
  CHECK(text_of(b->receive(buffer).bytes) == "first");
  CHECK(text_of(b->receive(buffer).bytes) == longest);
  const DatagramLink::Received last = b->receive(buffer);
  CHECK(text_of(last.bytes) == "l");
  CHECK(last.sender.address == INADDR_LOOPBACK);
  CHECK(last.sender.port != 0);
  CHECK(b->receive(buffer).bytes.empty());
  const LinkReport s = a->report();
  CHECK(s.sent == 3);
  CHECK(s.sent_bytes == 5 + 1392 + 1);
  CHECK(s.received == 0);
  CHECK(eventually([&] { return a->report().own == 3; }));
  CHECK(b->report().missing == 0);
}

TEST_CASE("DatagramLink: wait ends when a datagram comes, or with its time") {
  if (!enter_own_network()) return;
  const auto a = open_link(loopback_config());
  const auto b = open_link(loopback_config());
  Buffer buffer;
  CHECK_FALSE(b->wait(0));
  CHECK_FALSE(b->wait(-1));
  const std::int64_t start_us = MonotonicClock::now_us();
  CHECK_FALSE(b->wait(20'000));
  CHECK(MonotonicClock::now_us() - start_us >= 20'000);
  for (int i = 0; i < 200; ++i) {
    REQUIRE(a->send(bytes_of("x")));
    REQUIRE(b->wait(2'000'000));
    REQUIRE(b->wait(0));
    REQUIRE_FALSE(b->receive(buffer).bytes.empty());
    REQUIRE_FALSE(b->wait(0));
  }
}

TEST_CASE("DatagramLink: hears itself if it is asked to") {
  if (!enter_own_network()) return;
  LinkConfig config = loopback_config();
  config.hear_itself = true;
  const auto link = open_link(config);
  REQUIRE(link->send(bytes_of("echo")));
  CHECK(eventually([&] { return link->report().received == 1; }));
}

TEST_CASE("DatagramLink: nothing that is empty or too long is sent") {
  if (!enter_own_network()) return;
  const auto link = open_link(loopback_config());
  const std::string one_too_long(link->max_payload_bytes() + 1, 'x');
  CHECK_FALSE(link->send({}));
  CHECK_FALSE(link->send(bytes_of(one_too_long)));
  CHECK_FALSE(link->send_on("", bytes_of("x")));
  CHECK_FALSE(link->send_on(std::string(64, 'c'), bytes_of("x")));
  CHECK(link->send_on(std::string(63, 'c'), bytes_of("x")));
  CHECK(link->report().refused == 4);
  CHECK(link->report().sent == 1);
}

TEST_CASE("DatagramLink: each hostile packet is counted as what it is, and the next is heard") {
  if (!enter_own_network()) return;
  using namespace std::string_literals;
  const auto link = open_link(loopback_config());
  const Stranger stranger;
  const std::string good = "LC02\0\0\0\1TESSERA\0good"s;
  stranger.send("");
  stranger.send("LC02\0\0\0"s);
  stranger.send("LC02\0\0\0\0TESSERA\0"s);
  stranger.send("ABCD"s + std::string(200, '\xff'));
  stranger.send("LC02\0\0\0\0TESSERA"s);
  stranger.send("LC02\0\0\0\0"s + std::string(1000, 'c'));
  stranger.send("LC02\0\0\0\0OTHER\0x"s);
  // A fragment that claims to be the first of 65,535 of a message of 4 GB, and one beyond it.
  stranger.send(
      "LC03\0\0\0\0\xff\xff\xff\xff\0\0\0\0\0\0\xff\xff"
      "TESSERA\0x"s);
  stranger.send("LC03\0\0\0\0\0\0\0\1\xff\xff\xff\xff\xff\xff\0\1x"s);
  stranger.send("LC02\0\0\0\0TESSERA\0"s + std::string(1393, 'x'));
  stranger.send("LC02\0\0\0\0TESSERA\0"s + std::string(65'507 - 16, 'x'));
  stranger.send(good);
  REQUIRE(eventually([&] { return link->report().received == 1; }));
  const LinkReport s = link->report();
  CHECK(s.too_short == 3);
  CHECK(s.foreign == 1);
  CHECK(s.no_channel == 2);
  CHECK(s.other_channel == 1);
  CHECK(s.fragments == 2);
  CHECK(s.too_long == 2);
  CHECK(s.missing == 0);
  Buffer buffer;
  CHECK(text_of(link->receive(buffer).bytes) == "good");
}

TEST_CASE("DatagramLink: a full queue loses the newest, and counts it") {
  if (!enter_own_network()) return;
  LinkConfig config = loopback_config();
  config.queue_slots = 4;
  const auto sender = open_link(loopback_config());
  const auto link = open_link(config);
  for (int i = 0; i < 5; ++i) REQUIRE(sender->send(bytes_of(std::to_string(i))));
  REQUIRE(eventually([&] { return link->report().queue_full == 1; }));
  CHECK(link->report().received == 4);
  CHECK(link->report().queue_peak == 4);
  Buffer buffer;
  for (int i = 0; i < 4; ++i) CHECK(text_of(link->receive(buffer).bytes) == std::to_string(i));
  REQUIRE(sender->send(bytes_of("again")));
  CHECK(eventually([&] { return link->report().received == 5; }));
}

TEST_CASE("DatagramLink: numbers that do not come are counted as missing") {
  if (!enter_own_network()) return;
  using namespace std::string_literals;
  const auto link = open_link(loopback_config());
  const Stranger stranger;
  stranger.send("LC02\0\0\0\1TESSERA\0a"s);
  stranger.send("LC02\0\0\0\5OTHER\0b"s);
  stranger.send("LC02\0\0\0\6TESSERA\0c"s);
  REQUIRE(eventually([&] { return link->report().received == 2; }));
  CHECK(link->report().missing == 3);
}

TEST_CASE("DatagramLink: open says what is wrong") {
  if (!enter_own_network()) return;
  LinkConfig config = loopback_config();
  config.interface = "eth99";
  CHECK(DatagramLink::open(config).failure().text().find("eth99") != std::string::npos);
  config = loopback_config();
  config.url = "udpm://239.255.76.67:7667";
  CHECK(DatagramLink::open(config).failure().text().find("ttl") != std::string::npos);
  for (const std::string& channel : {std::string(), std::string("a b"), std::string(64, 'c')}) {
    config = loopback_config();
    config.channel = channel;
    CHECK(DatagramLink::open(config).failure().kind == FailureKind::kUsage);
  }
  config = loopback_config();
  config.interface = "";
  CHECK(open_link(config)->interface().name == "lo");
  config.interface = "127.0.0.1";
  CHECK(open_link(config)->interface().name == "lo");
}

TEST_CASE("DatagramLink: sending, receiving and status use no heap once it is open") {
  if (!enter_own_network()) return;
  const auto a = open_link(loopback_config());
  const auto b = open_link(loopback_config());
  StatusPublisher publisher(*a);
  Buffer buffer;
  const std::string payload(1000, 'x');
  std::uint64_t received = 0;
  const auto before = heap_allocations();
  bool all_sent = true;
  for (int i = 0; i < 1000; ++i) {
    all_sent = a->send(bytes_of(payload)) && all_sent;
    while (!b->receive(buffer).bytes.empty()) ++received;
    if (i % 100 == 0) all_sent = publisher.publish({}, i * 1000) && all_sent;
  }
  const bool all_received = eventually([&] {
    while (!b->receive(buffer).bytes.empty()) ++received;
    return received == 1000;
  });
  const auto after = heap_allocations();
  CHECK(all_sent);
  CHECK(all_received);
  if (!before) {
    WARN("this build cannot count heap allocations");
    return;
  }
  CHECK(*after - *before == 0);
}

}  // namespace
}  // namespace tessera
