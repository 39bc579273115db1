// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot has of its fleet's keys, the mission that is in them, and numbers of sessions.
#include "link/fleet_keys.hpp"

#include <catch2/catch.hpp>
#include <set>
#include <string>

#include "link/key_maker.hpp"
#include "link/session.hpp"
#include "sample_keys.hpp"

namespace tessera {
namespace {

using Tag = std::array<std::byte, kTagBytes>;

TEST_CASE("FleetKeys: what is named is used, and nothing else") {
  Outcome<FleetKeys> none = FleetKeys::read({}, 7);
  REQUIRE(none.ok());
  Tag tag;
  Tag by_crc;
  const auto message = std::as_bytes(std::span("a datagram", 10));
  const auto tag_of = [&](FleetKeys& keys, Tag& into) {
    const Authenticator a = keys.keys().authenticator;
    a.tag(a.context, message, into);
  };
  tag_of(*none, tag);
  const Authenticator crc = crc_authenticator();
  crc.tag(crc.context, message, by_crc);
  CHECK(tag == by_crc);
  CHECK(none->keys().signatures.sign == nullptr);

  const KeyFolder folder;
  const std::string secret = folder.write("robot_7.key", kSecretLine);
  const std::string known = folder.write("fleet.pub", kPublicLine);
  const std::string fleet =
      folder.write("fleet.key", std::string(kFleetLine) + std::string(kMissionLine));
  Outcome<FleetKeys> all = FleetKeys::read({fleet, secret, known, ""}, 7);
  REQUIRE(all.ok());
  CHECK(all->mission().name() == "harbour 7");
  CHECK(none->mission().number() == 0);
  Tag by_seal;
  const Outcome<DatagramSeal> seal =
      DatagramSeal::make(read_fleet_key(fleet)->key, sample_mission(), KeyUse::kDatagram);
  REQUIRE(seal.ok());
  seal->tag(message, by_seal);
  tag_of(*all, tag);
  CHECK(tag == by_seal);
  CHECK(all->keys().signatures.sign != nullptr);
  Outcome<FleetKeys> signing = FleetKeys::read({"", secret, known, ""}, 7);
  REQUIRE(signing.ok());
  CHECK(signing->mission().number() == 0);
  tag_of(*signing, tag);
  CHECK(tag == by_crc);

  const auto refusal = [&](const KeyFiles& files, std::uint32_t robot) {
    const Outcome<FleetKeys> keys = FleetKeys::read(files, robot);
    REQUIRE_FALSE(keys.ok());
    CHECK(keys.failure().kind == FailureKind::kUsage);
    return keys.failure().text();
  };
  CHECK(refusal({fleet, secret, known, ""}, 8) ==
        secret +
            " is of robot 7, and this is robot 8; name the key file of this robot, or "
            "give this robot its number");
  CHECK(refusal({"", secret, "", ""}, 7) ==
        "signatures need both keys: name robot_public_keys too");
  CHECK(refusal({"", "", known, ""}, 7) == "signatures need both keys: name robot_secret too");
  CHECK(refusal({secret, "", "", ""}, 7).find(secret) != std::string::npos);
}

TEST_CASE("FleetKeys: the mission of the configuration wins over the one of the key file") {
  const KeyFolder folder;
  const std::string with =
      folder.write("with.key", std::string(kFleetLine) + std::string(kMissionLine));
  const std::string without = folder.write("without.key", kFleetLine);
  const auto mission_of = [](const std::string& file, const std::string& mission) {
    const Outcome<FleetKeys> keys = FleetKeys::read({file, "", "", mission}, 7);
    return keys.ok() ? std::string(keys->mission().name()) : keys.failure().text();
  };
  CHECK(mission_of(with, "") == "harbour 7");
  CHECK(mission_of(with, "harbour 8") == "harbour 8");
  CHECK(mission_of(without, "harbour 8") == "harbour 8");
  CHECK(mission_of(without, "") ==
        without + " names no mission; write one into it with tessera key mission --new --fleet " +
            without + " and copy it to every robot, or name one as mission");
  CHECK(mission_of("", "harbour 8") ==
        "a mission protects nothing without a key: name fleet_key, or leave mission out");
  CHECK(mission_of(with, std::string(65, 'x')).find("is over 64 bytes") != std::string::npos);
}

TEST_CASE("Mission: known answers of the value and its number") {
  // By Python's hashlib.blake2b.
  CHECK(hex_of(sample_mission("harbour 7").value()) == "0f24dc5f41c9ce5fa988ef4e55652d77");
  CHECK(sample_mission("harbour 7").number() == 1608262671U);
  const std::string longest(64, 'x');
  CHECK(hex_of(sample_mission(longest.c_str()).value()) == "d2a3639fd8f1c8c8673e1cd50d204462");
  CHECK(Mission().number() == 0);
  CHECK(Mission().name().empty());
}

TEST_CASE("Mission: names are 1 to 64 bytes of text") {
  for (const std::string& name : {std::string("x"), std::string("harbour 7, \xc3\xa4"),
                                  std::string(64, 'x'), std::string("a  b")}) {
    const Outcome<Mission> mission = Mission::make(name);
    REQUIRE(mission.ok());
    CHECK(mission->name() == name);
  }
  for (const std::string& name :
       {std::string(), std::string(65, 'x'), std::string(" x"), std::string("x "),
        std::string("a\nb"), std::string("a\0b", 3), std::string("\x7f")}) {
    const Outcome<Mission> mission = Mission::make(name);
    REQUIRE_FALSE(mission.ok());
    CHECK(mission.failure().kind == FailureKind::kUsage);
  }
}

TEST_CASE("Mission: a random one is new each time") {
  std::set<std::string> names;
  for (int i = 0; i < 20; ++i) {
    const Outcome<Mission> mission = Mission::make_random();
    REQUIRE(mission.ok());
    CHECK(mission->name().starts_with("mission-"));
    names.emplace(mission->name());
  }
  CHECK(names.size() == 20);
}

TEST_CASE("make_session: later starts are higher, and the same count is another session") {
  const Outcome<std::uint64_t> first = make_session(7);
  const Outcome<std::uint64_t> again = make_session(7);
  const Outcome<std::uint64_t> later = make_session(8);
  REQUIRE((first.ok() && again.ok() && later.ok()));
  CHECK(*first >> 32U == 7);
  CHECK(*again >> 32U == 7);
  CHECK(*first != *again);
  CHECK(*later > *first);
  CHECK(*later > *again);
}

TEST_CASE("FleetKeys: which of the secrets that are read again is another one") {
  const KeyFolder folder;
  const KeyFiles files{
      folder.write("fleet.key", std::string(kFleetLine) + std::string(kMissionLine)),
      folder.write("robot_7.key", kSecretLine), folder.write("fleet.pub", kPublicLine), ""};
  Outcome<FleetKeys> before = FleetKeys::read(files, 7);
  REQUIRE(before.ok());
  const auto changed = [&](std::uint32_t robot = 7) {
    Outcome<FleetKeys> after = FleetKeys::read(files, robot);
    REQUIRE(after.ok());
    return before->changed_secrets(files, *after);
  };
  CHECK(changed().empty());
  REQUIRE(set_mission(files.fleet_key, sample_mission("harbour 8")).ok());
  CHECK(changed() == "the mission in " + files.fleet_key);
  REQUIRE(std::remove(files.fleet_key.c_str()) == 0);
  REQUIRE(make_fleet_key(files.fleet_key, sample_mission()).ok());
  CHECK(changed() == "the key in " + files.fleet_key);
}

}  // namespace
}  // namespace tessera
