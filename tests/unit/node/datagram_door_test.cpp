// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a node's link takes: a datagram of the exchange with this fleet's tag, and nothing else.
#include "node/datagram_door.hpp"

#include <array>
#include <catch2/catch.hpp>

#include "tessera/exchange/wire.hpp"

namespace tessera {
namespace {

using Datagram = std::array<std::byte, kHeaderBytes + 4 + kTagBytes>;

Datagram tagged(std::uint32_t mission = 0) {
  Datagram datagram{};
  ByteWriter writer(datagram);
  write_header(writer,
               {.kind = DatagramKind::kLeave, .mission = mission, .sender = 3, .session = 1});
  const Authenticator crc = crc_authenticator();
  crc.tag(nullptr, std::span(datagram).first<kHeaderBytes + 4>(),
          std::span(datagram).last<kTagBytes>());
  return datagram;
}

TEST_CASE("DatagramDoor: takes what the exchange takes, and each changed bit is refused") {
  const DatagramDoor door(crc_authenticator());
  const Datagram datagram = tagged();
  CHECK(door.judge(datagram) == PayloadVerdict::kTaken);
  for (std::size_t bit = 0; bit < 8 * datagram.size(); ++bit) {
    Datagram changed = datagram;
    changed[bit / 8] ^= std::byte{1} << (bit % 8);
    REQUIRE(door.judge(changed) != PayloadVerdict::kTaken);
  }
}

TEST_CASE("DatagramDoor: robots that are excluded are refused until they are no more") {
  DatagramDoor door(crc_authenticator());
  const Datagram datagram = tagged();  // Of robot 3.
  const std::uint32_t robots[] = {2, 3};
  door.set_excluded(robots);
  CHECK(door.judge(datagram) == PayloadVerdict::kExcluded);
  door.set_excluded(std::span(robots).first(1));
  CHECK(door.judge(datagram) == PayloadVerdict::kTaken);
}

TEST_CASE(
    "DatagramDoor: what is too short, too long or of another format costs no check of a tag") {
  static int checks = 0;
  checks = 0;
  Authenticator counting = crc_authenticator();
  counting.check = [](void*, std::span<const std::byte>,
                      std::span<const std::byte, kTagBytes>) noexcept {
    ++checks;
    return true;
  };
  const DatagramDoor door(counting);
  const Datagram datagram = tagged();
  CHECK(door.judge(std::span(datagram).first(kHeaderBytes + kTagBytes - 1)) ==
        PayloadVerdict::kFormat);
  std::array<std::byte, kMostDatagramBytes + 1> long_one{};
  std::copy(datagram.begin(), datagram.end(), long_one.begin());
  CHECK(door.judge(long_one) == PayloadVerdict::kFormat);
  Datagram other = datagram;
  other[0] ^= std::byte{1};
  CHECK(door.judge(other) == PayloadVerdict::kFormat);
  CHECK(checks == 0);
  CHECK(door.judge(std::span(long_one).first(kMostDatagramBytes)) == PayloadVerdict::kTaken);
  CHECK(checks == 1);
}

TEST_CASE("DatagramDoor: a datagram of another mission is counted as such, by its header alone") {
  static int checks = 0;
  checks = 0;
  Authenticator counting = crc_authenticator();
  counting.check = [](void*, std::span<const std::byte>,
                      std::span<const std::byte, kTagBytes>) noexcept {
    ++checks;
    return true;
  };
  DatagramDoor door(counting, {}, 7);
  CHECK(door.judge(tagged(7)) == PayloadVerdict::kTaken);
  CHECK(checks == 1);
  CHECK(door.judge(tagged(8)) == PayloadVerdict::kMission);
  CHECK(door.judge(tagged(0)) == PayloadVerdict::kMission);
  CHECK(checks == 1);
}

}  // namespace
}  // namespace tessera
