// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Tags and signatures: known answers, and that whatever is changed is found.
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "base/allocation_counter.hpp"
#include "link/datagram_seal.hpp"
#include "link/fleet_signatures.hpp"
#include "link/key_maker.hpp"
#include "link/record_signature.hpp"
#include "sample_keys.hpp"

namespace tessera {
namespace {

using Tag = std::array<std::byte, kTagBytes>;

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

DatagramSeal sample_seal(KeyUse use, const char* mission = "harbour 7") {
  const KeyFolder folder;
  const Outcome<FleetSecret> fleet = read_fleet_key(folder.write("k", kFleetLine));
  REQUIRE(fleet.ok());
  Outcome<DatagramSeal> seal = DatagramSeal::make(fleet->key, sample_mission(mission), use);
  REQUIRE(seal.ok());
  return std::move(*seal);
}

RecordSigner sample_signer(const char* mission = "harbour 7") {
  const KeyFolder folder;
  const Outcome<RobotSecret> secret = read_robot_secret(folder.write("s", kSecretLine));
  REQUIRE(secret.ok());
  Outcome<RecordSigner> signer = RecordSigner::make(*secret, sample_mission(mission));
  REQUIRE(signer.ok());
  return std::move(*signer);
}

RecordVerifier sample_verifier(const char* mission = "harbour 7") {
  const KeyFolder folder;
  Outcome<std::vector<RobotPublic>> keys = read_public_keys(folder.write("p", kPublicLine));
  REQUIRE(keys.ok());
  Outcome<RecordVerifier> verifier =
      RecordVerifier::make(std::move(*keys), sample_mission(mission));
  REQUIRE(verifier.ok());
  return std::move(*verifier);
}

// Computed by Python's hashlib.blake2b from docs/reference/wire-format.md. Other values would lock
// out the robots that run what was before.
TEST_CASE("DatagramSeal: known answers of two missions and two uses") {
  const auto tag_of = [](KeyUse use, const char* mission) {
    Tag tag;
    sample_seal(use, mission).tag(bytes_of("mosaic"), tag);
    return hex_of(tag);
  };
  CHECK(tag_of(KeyUse::kDatagram, "harbour 7") == "464386fc8bf87a2ee5de8d48fd8f1e2d");
  CHECK(tag_of(KeyUse::kDatagram, "harbour 8") == "f305f39fc54ae3a1203a25510418ea1e");
  CHECK(tag_of(KeyUse::kStatus, "harbour 7") == "2659df2f1b6fc3e2c811bf148dee62f2");
}

TEST_CASE("DatagramSeal: a tag of another mission, or of another use, is refused") {
  Tag tag;
  sample_seal(KeyUse::kDatagram, "harbour 7").tag(bytes_of("a datagram"), tag);
  CHECK(sample_seal(KeyUse::kDatagram, "harbour 7").check(bytes_of("a datagram"), tag));
  CHECK_FALSE(sample_seal(KeyUse::kDatagram, "harbour 8").check(bytes_of("a datagram"), tag));
  CHECK_FALSE(sample_seal(KeyUse::kDatagram, "harbour 7x").check(bytes_of("a datagram"), tag));
  CHECK_FALSE(sample_seal(KeyUse::kStatus, "harbour 7").check(bytes_of("a datagram"), tag));
}

TEST_CASE("DatagramSeal: each flipped bit and each cut is found") {
  const DatagramSeal seal = sample_seal(KeyUse::kDatagram);
  const std::string text = "a datagram of a robot";
  Tag tag;
  seal.tag(bytes_of(text), tag);
  CHECK(seal.check(bytes_of(text), tag));
  for (std::size_t bit = 0; bit < 8 * text.size(); ++bit) {
    std::string changed = text;
    changed[bit / 8] = static_cast<char>(changed[bit / 8] ^ (1 << (bit % 8)));
    CHECK_FALSE(seal.check(bytes_of(changed), tag));
  }
  for (std::size_t bytes = 0; bytes < text.size(); ++bytes)
    CHECK_FALSE(seal.check(bytes_of(text.substr(0, bytes)), tag));
  for (std::size_t bit = 0; bit < 8 * kTagBytes; ++bit) {
    Tag changed = tag;
    changed[bit / 8] ^= static_cast<std::byte>(1U << (bit % 8));
    CHECK_FALSE(seal.check(bytes_of(text), changed));
  }
}

TEST_CASE("DatagramSeal and crc_authenticator as the exchange calls them") {
  DatagramSeal seal = sample_seal(KeyUse::kDatagram);
  Tag direct;
  seal.tag(bytes_of("mosaic"), direct);
  for (const Authenticator& a : {seal.authenticator(), crc_authenticator()}) {
    Tag tag;
    a.tag(a.context, bytes_of("mosaic"), tag);
    CHECK(a.check(a.context, bytes_of("mosaic"), tag));
    CHECK_FALSE(a.check(a.context, bytes_of("mosaik"), tag));
    for (std::size_t i = 0; i < kTagBytes; ++i) {
      Tag changed = tag;
      changed[i] ^= std::byte{1};
      CHECK_FALSE(a.check(a.context, bytes_of("mosaic"), changed));
    }
  }
  Tag crc;
  crc_authenticator().tag(nullptr, bytes_of("123456789"), crc);
  CHECK(hex_of(crc) == "839206e3000000000000000000000000");  // CRC-32C's usual check value.
}

// By Ed25519 written in Python from RFC 8032, over the mission's value and the record.
TEST_CASE("RecordSigner: a known answer") {
  Signature signature;
  sample_signer().sign(bytes_of("a record"), signature);
  CHECK(hex_of(signature) ==
        "649f810ebc04b42cd1a947824b69abeb9b1dfa3c2895b6f6cd66394608a4ffc912cde829bb1aecabddeb553a8f"
        "b3d03c99f574591e4df75ee9ab1d16fdfaed03");
  CHECK(sample_signer().robot() == 7);
}

TEST_CASE("RecordVerifier: takes what the robot signed, and nothing else") {
  const RecordSigner signer = sample_signer();
  const RecordVerifier verifier = sample_verifier();
  const std::string text = "a record";
  Signature signature;
  signer.sign(bytes_of(text), signature);
  CHECK(verifier.knows(7));
  CHECK_FALSE(verifier.knows(8));
  CHECK(verifier.check(7, bytes_of(text), signature));
  CHECK_FALSE(verifier.check(8, bytes_of(text), signature));
  CHECK_FALSE(verifier.check(7, bytes_of("a recorD"), signature));
  CHECK_FALSE(verifier.check(7, bytes_of("a recor"), signature));
  for (std::size_t i = 0; i < kSignatureBytes; ++i) {
    Signature changed = signature;
    changed[i] ^= std::byte{1};
    CHECK_FALSE(verifier.check(7, bytes_of(text), changed));
  }
}

TEST_CASE("RecordVerifier: a signature of another mission is refused") {
  Signature signature;
  sample_signer("harbour 7").sign(bytes_of("a record"), signature);
  CHECK(sample_verifier("harbour 7").check(7, bytes_of("a record"), signature));
  CHECK_FALSE(sample_verifier("harbour 8").check(7, bytes_of("a record"), signature));
  // Nor is one without any mission, even of a message that begins with the mission's value.
  const Mission::Value value = sample_mission("harbour 7").value();
  std::vector<std::byte> message(value.begin(), value.end());
  for (const std::byte b : bytes_of("a record")) message.push_back(b);
  CHECK_FALSE(sample_verifier("harbour 7").check(7, message, signature));
}

TEST_CASE("RecordVerifier: the longest message is signed and checked, a longer one refused") {
  std::vector<std::byte> message(kMostSignedBytes + 1, std::byte{5});
  const std::span<const std::byte> longest = std::span(message).first(kMostSignedBytes);
  Signature signature;
  sample_signer().sign(longest, signature);
  CHECK(sample_verifier().check(7, longest, signature));
  CHECK_FALSE(sample_verifier().check(7, message, signature));
  message[kMostSignedBytes - 1] ^= std::byte{1};
  CHECK_FALSE(sample_verifier().check(7, longest, signature));
}

TEST_CASE("RecordVerifier: no robot can speak for another") {
  const KeyFolder folder;
  std::vector<RobotPublic> keys;
  std::vector<RecordSigner> signers;
  for (std::uint32_t robot = 0; robot < 3; ++robot) {
    const std::string stem = folder.file("robot_" + std::to_string(robot));
    REQUIRE(make_robot_key(robot, folder.path()).ok());
    keys.push_back(read_public_keys(stem + ".pub")->front());
    signers.push_back(
        std::move(*RecordSigner::make(*read_robot_secret(stem + ".key"), sample_mission())));
  }
  const Outcome<RecordVerifier> verifier = RecordVerifier::make(keys, sample_mission());
  for (const RecordSigner& signer : signers) {
    Signature signature;
    signer.sign(bytes_of("r"), signature);
    for (std::uint32_t robot = 0; robot < 3; ++robot)
      CHECK(verifier->check(robot, bytes_of("r"), signature) == (robot == signer.robot()));
  }
}

TEST_CASE("FleetSignatures: as the exchange calls them") {
  Outcome<FleetSignatures> fleet = FleetSignatures::make(sample_signer(), sample_verifier());
  REQUIRE(fleet.ok());
  const Signatures by = fleet->signatures();
  REQUIRE(by.on());
  Signature signature;
  by.sign(by.context, bytes_of("a root"), signature);
  CHECK(by.check(by.context, 7, bytes_of("a root"), signature));
  CHECK_FALSE(by.check(by.context, 8, bytes_of("a root"), signature));
  CHECK_FALSE(by.check(by.context, 7, bytes_of("a rooT"), signature));
  // By Python's hashlib.blake2b with a digest of 16 bytes.
  Hash hash;
  by.hash(by.context, bytes_of("a leaf"), hash);
  CHECK(hex_of(hash) == "f5c42554b56be5ab6cc340bee7fe8e43");
}

TEST_CASE("FleetSignatures: a robot that the fleet does not know cannot start") {
  const KeyFolder folder;
  REQUIRE(make_robot_key(7, folder.path()).ok());
  const std::string secret = folder.file("robot_7.key");
  CHECK(FleetSignatures::read(secret, folder.file("robot_7.pub"), sample_mission()).ok());
  const Outcome<FleetSignatures> fleet =
      FleetSignatures::read(secret, folder.write("p", kPublicLine), sample_mission());
  REQUIRE_FALSE(fleet.ok());
  CHECK(fleet.failure().kind == FailureKind::kUsage);
  CHECK(fleet.failure().text().find("robot 7") != std::string::npos);
}

TEST_CASE("Tags and signatures use no heap") {
  const DatagramSeal seal = sample_seal(KeyUse::kDatagram);
  const RecordSigner signer = sample_signer();
  const RecordVerifier verifier = sample_verifier();
  const std::vector<std::byte> message(1392);
  Tag tag;
  Signature signature;
  const auto before = heap_allocations();
  seal.tag(message, tag);
  bool good = seal.check(message, tag);
  signer.sign(message, signature);
  good = verifier.check(7, message, signature) && good;
  const auto after = heap_allocations();
  CHECK(good);
  if (before) CHECK(*after - *before == 0);
}

}  // namespace
}  // namespace tessera
