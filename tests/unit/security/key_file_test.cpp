// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "security/key_file.hpp"

#include <catch2/catch.hpp>
#include <set>

#include "sample_keys.hpp"

namespace tessera {
namespace {

/// What is said about a fleet key of that text; "" if it is taken.
std::string fault_of(const std::string& text) {
  const KeyFolder folder;
  const Outcome<SecretKey> key = read_fleet_key(folder.write("fleet.key", text));
  if (key.ok()) return "";
  CHECK(key.failure().kind == FailureKind::kUsage);
  CHECK(key.failure().message.find("0001020304") == std::string::npos);  // Never quoted.
  return key.failure().message;
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
    const Outcome<SecretKey> key = read_fleet_key(folder.write("k", text));
    INFO(text << key.failure().message);
    REQUIRE(key.ok());
    for (std::size_t i = 0; i < kKeyBytes; ++i) CHECK(key->bytes()[i] == i);
  }
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
  CHECK(says(fault_of(""), "tessera key new --fleet"));
  CHECK(says(fault_of("# only\n"), "holds no key"));
  CHECK(says(fault_of(kSecretLine), "line 1 is a key of another kind"));
  CHECK(says(fault_of(std::string("# c\n") + kFleetLine + kFleetLine), "line 3 is a second key"));
  CHECK(says(fault_of(std::string(100'000, '#')), "over 64 KiB"));
  CHECK(says(fault_of(std::string("\0\xff\n", 3)), "line 1"));
}

TEST_CASE("read_fleet_key: permissions for others are refused with the chmod") {
  const KeyFolder folder;
  for (const mode_t mode : {0640U, 0604U, 0620U, 0602U, 0644U, 0666U, 0610U}) {
    const std::string path = folder.write("k", kFleetLine, mode);
    CHECK(says(read_fleet_key(path).failure().message, ("chmod 600 " + path).c_str()));
  }
  CHECK(read_fleet_key(folder.write("k", kFleetLine, 0600)).ok());
  CHECK(read_fleet_key(folder.write("k", kFleetLine, 0400)).ok());
}

TEST_CASE("read_fleet_key: links, folders, pipes and missing files are refused") {
  const KeyFolder folder;
  const std::string path = folder.write("k", kFleetLine);
  std::filesystem::create_symlink(path, folder.file("link"));
  CHECK(says(read_fleet_key(folder.file("link")).failure().message, "symbolic link"));
  CHECK_FALSE(read_fleet_key(folder.path()).ok());
  REQUIRE(::mkfifo(folder.file("pipe").c_str(), 0600) == 0);
  CHECK(says(read_fleet_key(folder.file("pipe")).failure().message, "no regular file"));
  CHECK(says(read_fleet_key(folder.file("none")).failure().message, "No such file"));
  CHECK_FALSE(read_fleet_key("").ok());
}

TEST_CASE("read_fleet_key: another user's file is refused") {
  if (::geteuid() != 0) return;  // Only root can give a file away.
  const KeyFolder folder;
  const std::string path = folder.write("k", kFleetLine);
  REQUIRE(::chown(path.c_str(), 12345, 12345) == 0);
  CHECK(says(read_fleet_key(path).failure().message, "chown"));
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
    return read_public_keys(folder.write("q", text, mode)).failure().message;
  };
  CHECK(says(fault(""), "holds no key"));
  CHECK(says(fault(std::string(kPublicLine) + kSecretLine), "line 2 is no public key"));
  CHECK(says(fault(std::string(kPublicLine) + kPublicLine), "line 2 is a second key"));
  CHECK(says(fault(kPublicLine, 0664), "chmod 644"));
}

TEST_CASE("make_fleet_key: a key of its own each time, for the owner alone, never replaced") {
  const KeyFolder folder;
  const ::mode_t before = ::umask(0);
  std::set<std::array<unsigned char, kKeyBytes>> keys;
  for (const char* const name : {"a", "b", "c"}) {
    REQUIRE(make_fleet_key(folder.file(name)).ok());
    const Outcome<SecretKey> key = read_fleet_key(folder.file(name));
    REQUIRE(key.ok());
    keys.insert(key->bytes());
  }
  ::umask(before);
  CHECK(keys.size() == 3);
  const Outcome<SecretKey> old = read_fleet_key(folder.file("a"));
  CHECK(says(make_fleet_key(folder.file("a")).failure().message, "not replaced"));
  CHECK(read_fleet_key(folder.file("a"))->bytes() == old->bytes());
  std::filesystem::create_symlink(folder.file("nowhere"), folder.file("dangling"));
  CHECK_FALSE(make_fleet_key(folder.file("dangling")).ok());
  CHECK_FALSE(std::filesystem::exists(folder.file("nowhere")));
  CHECK_FALSE(make_fleet_key(folder.file("no/folder")).ok());
  CHECK_FALSE(make_fleet_key("").ok());
  for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
    CHECK(entry.path().extension() != ".part");
}

TEST_CASE("make_robot_key: both files or none, and public files put together are the fleet's") {
  const KeyFolder folder;
  REQUIRE(make_robot_key(3, folder.path()).ok());
  REQUIRE(make_robot_key(0, folder.path()).ok());
  CHECK(read_robot_secret(folder.file("robot_3.key"))->robot == 3);
  std::ofstream all(folder.file("fleet.pub"));
  for (const char* const name : {"robot_3.pub", "robot_0.pub"})
    all << std::ifstream(folder.file(name)).rdbuf();
  all.close();
  const Outcome<std::vector<RobotPublic>> keys = read_public_keys(folder.file("fleet.pub"));
  INFO(keys.failure().message);
  REQUIRE(keys.ok());
  REQUIRE(keys->size() == 2);
  CHECK((*keys)[0].robot == 0);
  CHECK((*keys)[1].robot == 3);
  std::filesystem::remove(folder.file("robot_3.pub"));
  CHECK_FALSE(make_robot_key(3, folder.path()).ok());  // Its secret is still there.
  CHECK_FALSE(std::filesystem::exists(folder.file("robot_3.pub")));
}

}  // namespace
}  // namespace tessera
