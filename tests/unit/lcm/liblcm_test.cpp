// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// That we speak LCM: with the real library in both directions, and with its logger and player.
#include <lcm/lcm.h>
#include <signal.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <tessera_status.hpp>
#include <vector>

#include "link/datagram_link.hpp"
#include "link/status_publisher.hpp"
#include "unit/lcm/child.hpp"
#include "unit/lcm/own_network.hpp"

namespace tessera {
namespace {

using Buffer = std::array<std::byte, kMaxMessageBytes>;
using Lcm = std::unique_ptr<lcm_t, void (*)(lcm_t*)>;

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

std::string text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// What the real library hears: payloads by channel.
using Heard = std::map<std::string, std::vector<std::string>>;

void hear(const lcm_recv_buf_t* message, const char* channel, void* heard) {
  (*static_cast<Heard*>(heard))[channel].emplace_back(static_cast<const char*>(message->data),
                                                      message->data_size);
}

std::string content_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

template <class Condition>
bool eventually_handled(lcm_t* lcm, Condition condition) {
  return eventually([&] {
    while (lcm_handle_timeout(lcm, 0) > 0) {
    }
    return condition();
  });
}

TEST_CASE("liblcm hears what a link sends, and a link what liblcm publishes") {
  if (!enter_own_network()) return;
  const LinkConfig config = loopback_config();
  Outcome<std::unique_ptr<DatagramLink>> link = DatagramLink::open(config);
  REQUIRE(link.ok());
  const Lcm lcm(lcm_create(config.url.c_str()), &lcm_destroy);
  REQUIRE(lcm != nullptr);
  Heard heard;
  lcm_subscription_t* const subscription = lcm_subscribe(lcm.get(), "TESSERA.*", hear, &heard);
  lcm_subscription_set_queue_capacity(subscription, 1000);

  const std::string longest((*link)->max_payload_bytes(), 'x');
  REQUIRE((*link)->send(bytes_of("short")));
  REQUIRE((*link)->send(bytes_of(longest)));
  CHECK(eventually_handled(lcm.get(), [&] { return heard["TESSERA"].size() == 2; }));
  CHECK(heard["TESSERA"] == std::vector<std::string>{"short", longest});

  const std::string answer(1392, 'y');
  REQUIRE(lcm_publish(lcm.get(), "TESSERA", answer.data(), 1392) == 0);
  REQUIRE(eventually([&] { return (*link)->report().received == 1; }));
  Buffer buffer;
  CHECK(text_of((*link)->receive(buffer).bytes) == answer);
  // More than one datagram of LCM's: refused part by part, and what follows is heard.
  const std::vector<char> large(200'000, 'z');
  REQUIRE(lcm_publish(lcm.get(), "TESSERA", large.data(), 200'000) == 0);
  REQUIRE(lcm_publish(lcm.get(), "TESSERA", "end", 3) == 0);
  REQUIRE(eventually([&] { return (*link)->report().received == 2; }));
  CHECK(text_of((*link)->receive(buffer).bytes) == "end");
  const LinkReport s = (*link)->report();
  CHECK(s.too_long + s.fragments >= 2);
}

TEST_CASE("StatusPublisher: a message that LCM's generated code decodes, of one fixed size") {
  if (!enter_own_network()) return;
  const LinkConfig config = loopback_config();
  Outcome<std::unique_ptr<DatagramLink>> link = DatagramLink::open(config);
  REQUIRE(link.ok());
  const Lcm lcm(lcm_create(config.url.c_str()), &lcm_destroy);
  REQUIRE(lcm != nullptr);
  Heard heard;
  lcm_subscribe(lcm.get(), kStatusChannel, hear, &heard);
  StatusPublisher publisher(**link);
  CHECK(publisher.is_due(5));
  REQUIRE(publisher.publish({.robot = 3, .digest = 0xfedcba9876543210U, .extra = {42}}, 5));
  CHECK_FALSE(publisher.is_due(5 + StatusPublisher::kPeriod_us - 1));
  CHECK(publisher.is_due(5 + StatusPublisher::kPeriod_us));
  REQUIRE((*link)->send(bytes_of(std::string(1000, 'x'))));
  // More are doubted than have room.
  NodeState doubting{.robot = 3, .doubted = 11};
  for (std::uint32_t i = 0; i < 8; ++i) doubting.first_doubted[i] = {40 + i, 1ULL << i};
  REQUIRE(publisher.publish(doubting, 5 + 500'000));
  REQUIRE(eventually_handled(lcm.get(), [&] { return heard[kStatusChannel].size() == 2; }));
  tessera_status status{};
  for (const std::string& bytes : heard[kStatusChannel]) {
    CHECK(bytes.size() == 448);
    REQUIRE(status.decode(bytes.data(), 0, static_cast<int>(bytes.size())) == 436);
    CHECK(status.decode(bytes.data(), 0, 435) < 0);
    CHECK(status.robot == 3);
  }
  CHECK(status.sent_bytes_per_s == 2 * (1000 + 448));
  CHECK(status.counters[16] == 2);  // Sent.
  CHECK(status.doubted == 11);
  CHECK(status.doubted_robot[7] == 47);
  CHECK(status.doubted_classes[7] == 128);
  CHECK(status.uptime_us == 500'000);
}

TEST_CASE("lcm-logger records what a link sends, and lcm-logplayer plays it to a link") {
  if (!enter_own_network()) return;
  const LinkConfig config = loopback_config();
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("tessera-lcm-" + std::to_string(::getpid()));
  std::filesystem::create_directory(folder);
  const std::string log = (folder / "run.lcm").string();
  constexpr std::size_t kMessages = 100;
  const auto message = [](std::size_t i) { return std::to_string(i) + std::string(1300, '.'); };
  {
    Outcome<std::unique_ptr<DatagramLink>> link = DatagramLink::open(config);
    REQUIRE(link.ok());
    // Version 1.3.1 does not know its own option -l.
    Child logger({"lcm-logger", "-q", "--flush-interval=1", "--lcm-url=" + config.url, log});
    // It writes to the disk when it hears something more, so it is knocked at until it has.
    const auto has_written = [&](const std::string& text) {
      (*link)->send_on("KNOCK", bytes_of("?"));
      return content_of(log).find(text) != std::string::npos;
    };
    REQUIRE(eventually([&] { return has_written("KNOCK"); }));
    for (std::size_t i = 0; i < kMessages; ++i) {
      REQUIRE((*link)->send(bytes_of(message(i))));
      wait_a_little();  // liblcm keeps 30 messages for who is slower than that.
    }
    REQUIRE(eventually([&] { return has_written(message(kMessages - 1)); }));
    CHECK(logger.end(SIGINT));
  }
  Outcome<std::unique_ptr<DatagramLink>> link = DatagramLink::open(config);
  REQUIRE(link.ok());
  Child player({"lcm-logplayer", "-s", "1", "-l", config.url, log});
  CHECK(eventually([&] { return (*link)->report().received == kMessages; }));
  Buffer buffer;
  for (std::size_t i = 0; i < kMessages; ++i)
    CHECK(text_of((*link)->receive(buffer).bytes) == message(i));
  CHECK(eventually([&] { return !player.is_running(); }));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace tessera
