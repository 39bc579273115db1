// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/key_file.hpp"

#include <catch2/catch.hpp>
#include <set>

#include "sample_keys.hpp"

namespace tessera {
namespace {

/// What is said about a fleet key of that text; "" if it is taken.
std::string fault_of(const std::string& text) {
  const KeyFolder folder;
  const Outcome<FleetSecret> key = read_fleet_key(folder.write("fleet.key", text));
  if (key.ok()) return "";
  CHECK(key.failure().kind == FailureKind::kUsage);
  CHECK(key.failure().text().find("0001020304") == std::string::npos);  // Never quoted.
  return key.failure().text();
}

bool says(const std::string& message, const char* words) {
  INFO(message);
  return message.find(words) != std::string::npos;
}

TEST_CASE("read_fleet_key: one line, among comments and empty ones, with any line ends") {
  for (const std::string& text :
       {std::string(kFleetLine), "# a\n\n  \n" + std::string(kFleetLine) + "\n# b",
        "\xef\xbb\xbf" + std::string(kFleetLine),
        std::string(kFleetLine).substr(0, std::string(kFleetLine).size() - 1),
        "  " + std::string(kFleetLine).substr(0, std::string(kFleetLine).size() - 1) + " \r\n"}) {
    const KeyFolder folder;
    const Outcome<FleetSecret> key = read_fleet_key(folder.write("k", text));
    INFO(text << key.failure().text());
    REQUIRE(key.ok());
    for (std::size_t i = 0; i < kKeyBytes; ++i) CHECK(key->key.bytes()[i] == i);
  }
}

TEST_CASE("read_fleet_key: the mission beside the key, before it or after it, as it is written") {
  const KeyFolder folder;
  const std::string key = kFleetLine;
  const std::string mission = kMissionLine;
  for (const std::string& text :
       {key + mission, mission + key,
        key + "# a\n" + mission.substr(0, mission.size() - 1) + " \r\n"}) {
    const Outcome<FleetSecret> fleet = read_fleet_key(folder.write("k", text));
    INFO(text << fleet.failure().text());
    REQUIRE(fleet.ok());
    CHECK(fleet->mission == "harbour 7");
  }
  CHECK(read_fleet_key(folder.write("k", key))->mission.empty());
}

TEST_CASE("read_fleet_key: a changed or second mission is refused, and one alone is no key") {
  const std::string key = kFleetLine;
  const std::string mission = kMissionLine;
  for (std::size_t i = 0; i + 1 < mission.size(); ++i) {
    std::string changed = mission;
    changed[i] = changed[i] == '7' ? '8' : '7';
    INFO(changed);
    CHECK_FALSE(fault_of(key + changed).empty());
  }
  CHECK(says(fault_of(key + mission + mission), "line 3 is a second mission; keep one"));
  CHECK(says(fault_of(mission), "has no key"));
  const KeyFolder folder;
  CHECK_FALSE(read_robot_secret(folder.write("s", kSecretLine + mission)).ok());
  CHECK_FALSE(read_public_keys(folder.write("p", kPublicLine + mission)).ok());
}

TEST_CASE("read_fleet_key: a file cut anywhere is refused") {
  const std::string line = kFleetLine;
  for (std::size_t bytes = 0; bytes + 1 < line.size(); ++bytes)
    CHECK_FALSE(fault_of(line.substr(0, bytes)).empty());
}

TEST_CASE("read_fleet_key: any changed character is found") {
  const std::string line = kFleetLine;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    std::string changed = line;
    changed[i] = changed[i] == '7' ? '8' : '7';
    CHECK_FALSE(fault_of(changed).empty());
  }
}

TEST_CASE("read_fleet_key: other texts are refused with what to do") {
  CHECK(says(fault_of(""), "tessera key new --robots"));
  CHECK(says(fault_of("# only\n"), "has no key"));
  CHECK(says(fault_of(kSecretLine), "line 1 is a key of another kind"));
  CHECK(says(fault_of(std::string("# c\n") + kFleetLine + kFleetLine), "line 3 is a second key"));
  CHECK(says(fault_of(std::string(100'000, '#')), "over 64 KiB"));
  CHECK(says(fault_of(std::string("\0\xff\n", 3)), "line 1"));
}

TEST_CASE("read_fleet_key: permissions for others are refused with the chmod") {
  const KeyFolder folder;
  for (const mode_t mode : {0640U, 0604U, 0620U, 0602U, 0644U, 0666U, 0610U}) {
    const std::string path = folder.write("k", kFleetLine, mode);
    CHECK(says(read_fleet_key(path).failure().text(), ("chmod 600 " + path).c_str()));
  }
  CHECK(read_fleet_key(folder.write("k", kFleetLine, 0600)).ok());
  CHECK(read_fleet_key(folder.write("k", kFleetLine, 0400)).ok());
}

TEST_CASE("read_fleet_key: links, folders, pipes and missing files are refused") {
  const KeyFolder folder;
  const std::string path = folder.write("k", kFleetLine);
  std::filesystem::create_symlink(path, folder.file("link"));
  CHECK(says(read_fleet_key(folder.file("link")).failure().text(), "symbolic link"));
  CHECK_FALSE(read_fleet_key(folder.path()).ok());
  REQUIRE(::mkfifo(folder.file("pipe").c_str(), 0600) == 0);
  CHECK(says(read_fleet_key(folder.file("pipe")).failure().text(), "not a regular file"));
  CHECK(says(read_fleet_key(folder.file("none")).failure().text(), "No such file"));
  CHECK_FALSE(read_fleet_key("").ok());
}

TEST_CASE("read_fleet_key: another user's file is refused") {
  if (::geteuid() != 0) return;  // Only root can give a file away.
  const KeyFolder folder;
  const std::string path = folder.write("k", kFleetLine);
  REQUIRE(::chown(path.c_str(), 12345, 12345) == 0);
  CHECK(says(read_fleet_key(path).failure().text(), "chown"));
}

TEST_CASE("read_robot_secret and read_public_keys") {
  const KeyFolder folder;
  const Outcome<RobotSecret> secret = read_robot_secret(folder.write("s", kSecretLine));
  REQUIRE(secret.ok());
  CHECK(secret->robot == 7);
  CHECK_FALSE(read_robot_secret(folder.write("f", kFleetLine)).ok());
  const Outcome<std::vector<RobotPublic>> keys =
      read_public_keys(folder.write("p", kPublicLine, 0644));
  REQUIRE(keys.ok());
  REQUIRE(keys->size() == 1);
  CHECK((*keys)[0].robot == 7);
  CHECK((*keys)[0].key[0] == 0xd7);
  const auto fault = [&](const std::string& text, mode_t mode = 0644) {
    return read_public_keys(folder.write("q", text, mode)).failure().text();
  };
  CHECK(says(fault(""), "has no key"));
  CHECK(says(fault(std::string(kPublicLine) + kSecretLine), "line 2 is not a public key"));
  CHECK(says(fault(std::string(kPublicLine) + kPublicLine), "line 2 is a second key"));
  CHECK(says(fault(kPublicLine, 0664), "chmod 644"));
}

}  // namespace
}  // namespace tessera
