// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/key_maker.hpp"

#include <fmt/core.h>
#include <sodium.h>
#include <unistd.h>

#include <array>
#include <span>

#include "base/atomic_file.hpp"
#include "base/new_file.hpp"
#include "link/key_text.hpp"

namespace tessera {
namespace {

constexpr unsigned kSecretMode = 0600;
constexpr unsigned kPublicMode = 0644;
constexpr const char* kPublicComment =
    "Public: the fleet's file of public keys has the lines of all robots.";

Outcome<void> write_key(const std::string& path, const char* comment, const std::string& lines,
                        unsigned mode) {
  SecretText text{std::string()};
  // Growing would leave copies that are not wiped.
  text.bytes.reserve(kMostKeyLineBytes + lines.size());
  text.bytes.append("# ").append(comment).append("\n").append(lines);
  return write_new_file(path, std::as_bytes(std::span(text.bytes)), mode);
}

/// Files that are removed unless all of them could be made.
class NewFiles {
 public:
  NewFiles() = default;
  NewFiles(const NewFiles&) = delete;
  NewFiles& operator=(const NewFiles&) = delete;
  ~NewFiles() {
    for (const std::string& path : made_) ::unlink(path.c_str());
  }
  void add(std::string path) { made_.push_back(std::move(path)); }
  std::vector<std::string> keep() { return std::exchange(made_, {}); }

 private:
  std::vector<std::string> made_;
};

/// Adds the line of the public key to `lines`.
Outcome<void> make_pair_of_keys(std::uint32_t robot, const std::string& folder, NewFiles& files,
                                std::string& lines) {
  SecretKey seed;
  ::randombytes_buf(seed.bytes().data(), kKeyBytes);
  RobotPublic open{robot, {}};
  std::array<unsigned char, crypto_sign_SECRETKEYBYTES> expanded{};
  ::crypto_sign_seed_keypair(open.key.data(), expanded.data(), seed.bytes().data());
  ::sodium_memzero(expanded.data(), expanded.size());
  const std::string stem = fmt::format("{}/robot_{}", folder, robot);
  const SecretText secret(key_line_of(kRobotSecretKind, robot, seed.bytes()));
  TESSERA_TRY(write_key(stem + ".key", "Secret: for this robot only.", secret.bytes, kSecretMode));
  files.add(stem + ".key");
  const std::string line = key_line_of(kRobotPublicKind, robot, open.key);
  TESSERA_TRY(write_key(stem + ".pub", kPublicComment, line, kPublicMode));
  files.add(stem + ".pub");
  lines += line;
  return {};
}

Failure no_sodium() { return {"libsodium does not start", FailureKind::kFailure}; }

}  // namespace

Outcome<void> make_fleet_key(const std::string& path, const Mission& mission) {
  if (::sodium_init() < 0) return no_sodium();
  SecretKey key;
  ::randombytes_buf(key.bytes().data(), kKeyBytes);
  SecretText lines(key_line_of(kFleetKeyKind, std::nullopt, key.bytes()));
  lines.bytes += mission_line_of(mission.name());
  return write_key(path, "Secret: gives access to the fleet. The same on every robot.", lines.bytes,
                   kSecretMode);
}

Outcome<void> make_robot_key(std::uint32_t robot, const std::string& folder) {
  if (::sodium_init() < 0) return no_sodium();
  NewFiles files;
  std::string lines;
  Outcome<void> made = make_pair_of_keys(robot, folder, files, lines);
  if (made.ok()) static_cast<void>(files.keep());
  return made;
}

Outcome<std::vector<std::string>> make_fleet(const std::string& folder, std::uint32_t robots,
                                             const Mission& mission) {
  NewFiles files;
  std::string lines;
  TESSERA_TRY(make_fleet_key(folder + "/fleet.key", mission));
  files.add(folder + "/fleet.key");
  for (std::uint32_t robot = 0; robot < robots; ++robot) {
    TESSERA_TRY(make_pair_of_keys(robot, folder, files, lines));
  }
  TESSERA_TRY(
      write_key(folder + "/fleet.pub", "Public: the keys of all robots.", lines, kPublicMode));
  files.add(folder + "/fleet.pub");
  return files.keep();
}

Outcome<void> set_mission(const std::string& path, const Mission& mission) {
  TESSERA_TRY(read_fleet_key(path));
  TESSERA_TRY_ASSIGN(const SecretText old, read_key_text(path, true));
  SecretText text{std::string()};
  text.bytes.reserve(old.bytes.size() + 2 * kMostKeyLineBytes);
  std::string_view rest = old.bytes;
  while (!rest.empty()) {
    const std::string_view line = take_key_line(rest);
    const std::optional<KeyLine> key = parse_key_line(line);
    if (!key || key->kind != kMissionKind) text.bytes.append(line).append("\n");
  }
  text.bytes += mission_line_of(mission.name());
  TESSERA_TRY_ASSIGN(AtomicFile file, AtomicFile::open(path));
  file.write(std::as_bytes(std::span(text.bytes)));
  return file.commit();
}

}  // namespace tessera
