// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/short_message.hpp"

#include <catch2/catch.hpp>
#include <random>
#include <string>
#include <vector>

#include "link/sender_table.hpp"

namespace tessera {
namespace {

std::vector<std::byte> bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

std::vector<std::byte> message(std::string_view channel, std::size_t payload_bytes) {
  ShortHeader header;
  const std::size_t n = write_header(header, 7, channel);
  std::vector<std::byte> bytes(header.begin(), header.begin() + static_cast<std::ptrdiff_t>(n));
  bytes.resize(n + payload_bytes, std::byte{5});
  return bytes;
}

MessageKind kind_of(std::string_view text) { return read_message(bytes_of(text)).kind; }

TEST_CASE("read_message: what write_header wrote, at both ends of every length") {
  for (const std::size_t channel_bytes : {1U, 62U, 63U}) {
    const std::string channel(channel_bytes, 'c');
    const std::size_t most = kMaxMessageBytes - channel_bytes - 1;
    for (const std::size_t payload_bytes : {std::size_t{0}, std::size_t{1}, most}) {
      const std::vector<std::byte> bytes = message(channel, payload_bytes);
      const ReceivedMessage read = read_message(bytes);
      REQUIRE(read.kind == MessageKind::kShort);
      CHECK(read.sequence == 7);
      CHECK(read.channel == channel);
      CHECK(read.payload.size() == payload_bytes);
    }
    CHECK(read_message(message(channel, most + 1)).kind == MessageKind::kTooLong);
  }
}

TEST_CASE("read_message: the bytes that LCM defines") {
  using namespace std::string_view_literals;
  const std::vector<std::byte> bytes = bytes_of(
      "LC02\x01\x02\x03\x04"
      "AB\0xyz"sv);
  const ReceivedMessage read = read_message(bytes);
  REQUIRE(read.kind == MessageKind::kShort);
  CHECK(read.sequence == 0x01020304);
  CHECK(read.channel == "AB");
  CHECK(read.payload.size() == 3);
}

TEST_CASE("read_message: each refusal has its kind") {
  using namespace std::literals;
  CHECK(kind_of("") == MessageKind::kTooShort);
  CHECK(kind_of("LC02\0\0\0"sv) == MessageKind::kTooShort);
  CHECK(kind_of("LC03\0\0\0\1"sv) == MessageKind::kFragment);
  CHECK(kind_of("LC01\0\0\0\1A\0x"sv) == MessageKind::kForeign);
  CHECK(kind_of("LC02\0\0\0\1"sv) == MessageKind::kNoChannel);
  CHECK(kind_of("LC02\0\0\0\1\0x"sv) == MessageKind::kNoChannel);
  CHECK(kind_of("LC02\0\0\0\1ABC"sv) == MessageKind::kNoChannel);
  CHECK(kind_of("LC02\0\0\0\1"s + std::string(64, 'c') + "\0x"s) == MessageKind::kNoChannel);
  CHECK(kind_of("LC02\0\0\0\1"s + std::string(1300, 'c')) == MessageKind::kNoChannel);
}

TEST_CASE("read_message: random and mutated datagrams stay within their bounds") {
  constexpr unsigned kSeed = 5;
  INFO("seed " << kSeed);
  std::mt19937 random(kSeed);
  for (int i = 0; i < 200'000; ++i) {
    std::vector<std::byte> bytes = message("TESSERA", random() % 40);
    bytes.resize(random() % (bytes.size() + 1));
    for (int flips = static_cast<int>(random() % 4); flips > 0 && !bytes.empty(); --flips)
      bytes[random() % bytes.size()] = static_cast<std::byte>(random());
    bytes.shrink_to_fit();  // So that the address sanitizer sees a byte too many.
    const ReceivedMessage read = read_message(bytes);
    if (read.kind != MessageKind::kShort) continue;
    REQUIRE(read.channel.size() + 1 + read.payload.size() + kShortHeaderBytes == bytes.size());
  }
}

TEST_CASE("SenderTable: counts what is missing, and only that") {
  SenderTable table;
  const Endpoint a{1, 1}, b{1, 2};
  CHECK(table.missing_before(a, 100) == 0);
  CHECK(table.missing_before(a, 101) == 0);
  CHECK(table.missing_before(b, 7) == 0);
  CHECK(table.missing_before(a, 105) == 3);
  CHECK(table.missing_before(a, 103) == 0);  // Late.
  CHECK(table.missing_before(a, 106) == 0);
  CHECK(table.missing_before(a, 106) == 0);  // Twice, as fragments of one message are.
  CHECK(table.missing_before(b, 9) == 1);
}

TEST_CASE("SenderTable: numbers that wrap around and senders that start again") {
  SenderTable table;
  const Endpoint a{1, 1};
  CHECK(table.missing_before(a, 0xffffffff) == 0);
  CHECK(table.missing_before(a, 1) == 1);
  CHECK(table.missing_before(a, 1U << 30U) == 0);  // A leap: started again.
  CHECK(table.missing_before(a, (1U << 30U) + 2) == 1);
}

TEST_CASE("SenderTable: at 63, 64 and 65 senders, of which the one silent for longest goes") {
  SenderTable table;
  for (std::uint16_t port = 1; port <= SenderTable::kSenders; ++port)
    CHECK(table.missing_before({1, port}, 10) == 0);
  CHECK(table.missing_before({1, 1}, 12) == 1);   // All are remembered.
  CHECK(table.missing_before({1, 65}, 10) == 0);  // Takes the place of port 2.
  CHECK(table.missing_before({1, 3}, 12) == 1);
  CHECK(table.missing_before({1, 2}, 12) == 0);
}

}  // namespace
}  // namespace tessera
