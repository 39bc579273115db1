// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/key_maker.hpp"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <set>

#include "link/fleet_keys.hpp"
#include "sample_keys.hpp"

namespace tessera {
namespace {

bool says(const std::string& message, const char* words) {
  INFO(message);
  return message.find(words) != std::string::npos;
}

std::set<std::string> names_in(const std::string& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.insert(entry.path().filename().string());
  return names;
}

TEST_CASE("make_fleet_key: a key of its own each time, for the owner alone, never replaced") {
  const KeyFolder folder;
  const ::mode_t before = ::umask(0);
  std::set<std::array<unsigned char, kKeyBytes>> keys;
  for (const char* const name : {"a", "b", "c"}) {
    REQUIRE(make_fleet_key(folder.file(name), sample_mission()).ok());
    const Outcome<FleetSecret> key = read_fleet_key(folder.file(name));
    REQUIRE(key.ok());
    CHECK(key->mission == "harbour 7");
    keys.insert(key->key.bytes());
  }
  ::umask(before);
  CHECK(keys.size() == 3);
  const Outcome<FleetSecret> old = read_fleet_key(folder.file("a"));
  CHECK(says(make_fleet_key(folder.file("a"), sample_mission()).failure().text(), "not replaced"));
  CHECK(read_fleet_key(folder.file("a"))->key.bytes() == old->key.bytes());
  std::filesystem::create_symlink(folder.file("nowhere"), folder.file("dangling"));
  CHECK_FALSE(make_fleet_key(folder.file("dangling"), sample_mission()).ok());
  CHECK_FALSE(std::filesystem::exists(folder.file("nowhere")));
  CHECK_FALSE(make_fleet_key(folder.file("no/folder"), sample_mission()).ok());
  CHECK_FALSE(make_fleet_key("", sample_mission()).ok());
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
  INFO(keys.failure().text());
  REQUIRE(keys.ok());
  REQUIRE(keys->size() == 2);
  CHECK((*keys)[0].robot == 0);
  CHECK((*keys)[1].robot == 3);
  std::filesystem::remove(folder.file("robot_3.pub"));
  CHECK_FALSE(make_robot_key(3, folder.path()).ok());  // Its secret is still there.
  CHECK_FALSE(std::filesystem::exists(folder.file("robot_3.pub")));
}

TEST_CASE("make_fleet: each robot of it has all that it needs to sign") {
  const KeyFolder folder;
  const Outcome<std::vector<std::string>> files = make_fleet(folder.path(), 3, sample_mission());
  REQUIRE(files.ok());
  CHECK(files->size() == 8);
  for (std::uint32_t robot = 0; robot < 3; ++robot) {
    const std::string secret = folder.file("robot_" + std::to_string(robot) + ".key");
    Outcome<FleetKeys> keys =
        FleetKeys::read({folder.file("fleet.key"), secret, folder.file("fleet.pub"), ""}, robot);
    INFO(keys.failure().text());
    REQUIRE(keys.ok());
    CHECK(keys->keys().signatures.on());
    CHECK(keys->mission().name() == "harbour 7");
  }
}

TEST_CASE("make_fleet: where one file is there already, it stays and no other is left") {
  for (const char* const name : {"fleet.key", "robot_1.key", "robot_1.pub", "fleet.pub"}) {
    const KeyFolder folder;
    static_cast<void>(folder.write(name, "mine"));
    const Outcome<std::vector<std::string>> files = make_fleet(folder.path(), 3, sample_mission());
    REQUIRE_FALSE(files.ok());
    CHECK(says(files.failure().text(), "not replaced"));
    CHECK(names_in(folder.path()) == std::set<std::string>{name});
  }
}

TEST_CASE("set_mission: the name changes, or is added, and all else in the file stays") {
  const KeyFolder folder;
  for (const std::string& before :
       {std::string("# a comment\n") + kFleetLine + kMissionLine + "# z\n",
        std::string("# a comment\n") + kFleetLine + "# z"}) {
    const std::string path = folder.write("fleet.key", before);
    REQUIRE(set_mission(path, sample_mission("harbour 8")).ok());
    const Outcome<FleetSecret> fleet = read_fleet_key(path);
    REQUIRE(fleet.ok());
    CHECK(fleet->mission == "harbour 8");
    CHECK(fleet->key.bytes()[31] == 31);
    std::ifstream file(path);
    const std::string after((std::istreambuf_iterator<char>(file)), {});
    CHECK(after.starts_with(std::string("# a comment\n") + kFleetLine + "# z\n"));
    CHECK((std::filesystem::status(path).permissions() & std::filesystem::perms::all) ==
          (std::filesystem::perms::owner_read | std::filesystem::perms::owner_write));
  }
  CHECK(names_in(folder.path()) == std::set<std::string>{"fleet.key"});
}

TEST_CASE("set_mission: what is no fleet's key file stays as it is") {
  const KeyFolder folder;
  for (const std::string& text : {std::string(kSecretLine), std::string("mine"), std::string()}) {
    const std::string path = folder.write("f", text);
    CHECK_FALSE(set_mission(path, sample_mission()).ok());
    std::ifstream file(path);
    CHECK(std::string((std::istreambuf_iterator<char>(file)), {}) == text);
  }
  CHECK_FALSE(set_mission(folder.file("none"), sample_mission()).ok());
}

}  // namespace
}  // namespace tessera
