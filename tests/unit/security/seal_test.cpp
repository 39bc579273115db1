// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Tags and signatures: known answers, and that whatever is changed is found.
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "posix/allocation_counter.hpp"
#include "sample_keys.hpp"
#include "security/datagram_seal.hpp"
#include "security/fleet_keys.hpp"
#include "security/fleet_signatures.hpp"
#include "security/record_signature.hpp"

namespace tessera {
namespace {

using Tag = std::array<std::byte, kTagBytes>;

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

DatagramSeal sample_seal(KeyUse use) {
  const KeyFolder folder;
  const Outcome<SecretKey> key = read_fleet_key(folder.write("k", kFleetLine));
  REQUIRE(key.ok());
  Outcome<DatagramSeal> seal = DatagramSeal::make(*key, use);
  REQUIRE(seal.ok());
  return std::move(*seal);
}

RecordSigner sample_signer() {
  const KeyFolder folder;
  const Outcome<RobotSecret> secret = read_robot_secret(folder.write("s", kSecretLine));
  REQUIRE(secret.ok());
  Outcome<RecordSigner> signer = RecordSigner::make(*secret);
  REQUIRE(signer.ok());
  return std::move(*signer);
}

RecordVerifier sample_verifier() {
  const KeyFolder folder;
  Outcome<std::vector<RobotPublic>> keys = read_public_keys(folder.write("p", kPublicLine));
  REQUIRE(keys.ok());
  Outcome<RecordVerifier> verifier = RecordVerifier::make(std::move(*keys));
  REQUIRE(verifier.ok());
  return std::move(*verifier);
}

// Computed by Python's hashlib.blake2b from the definition of crypto_kdf and keyed BLAKE2b. Other
// values would lock out the robots that still run what was before.
TEST_CASE("DatagramSeal: a known answer") {
  Tag tag;
  sample_seal(KeyUse::kDatagram).tag(bytes_of("mosaic"), tag);
  CHECK(hex_of(tag) == "8cd73c07e69822a756a0cf371745fa9b");
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

TEST_CASE("RecordSigner: the first known answer of RFC 8032") {
  Signature signature;
  sample_signer().sign({}, signature);
  CHECK(hex_of(signature) ==
        "e5564300c360ac729086e2cc806e828a84877f1eb8e5d974d873e065224901555fb8821590a33bacc61e39701c"
        "f9b46bd25bf5f0595bbe24655141438e7a100b");
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

TEST_CASE("RecordVerifier: no robot can speak for another") {
  const KeyFolder folder;
  std::vector<RobotPublic> keys;
  std::vector<RecordSigner> signers;
  for (std::uint32_t robot = 0; robot < 3; ++robot) {
    const std::string stem = folder.file("robot_" + std::to_string(robot));
    REQUIRE(make_robot_key(robot, folder.path()).ok());
    keys.push_back(read_public_keys(stem + ".pub")->front());
    signers.push_back(std::move(*RecordSigner::make(*read_robot_secret(stem + ".key"))));
  }
  const Outcome<RecordVerifier> verifier = RecordVerifier::make(keys);
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
  CHECK(FleetSignatures::read(folder.file("robot_7.key"), folder.file("robot_7.pub")).ok());
  const Outcome<FleetSignatures> fleet =
      FleetSignatures::read(folder.file("robot_7.key"), folder.write("p", kPublicLine));
  REQUIRE_FALSE(fleet.ok());
  CHECK(fleet.failure().kind == FailureKind::kUsage);
  CHECK(fleet.failure().message.find("robot 7") != std::string::npos);
}

TEST_CASE("FleetKeys: what is named is used, and nothing else") {
  Outcome<FleetKeys> none = FleetKeys::read({}, 7);
  REQUIRE(none.ok());
  Tag tag;
  Tag by_crc;
  const auto message = bytes_of("a datagram");
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
  const std::string fleet = folder.write("fleet.key", kFleetLine);
  Outcome<FleetKeys> all = FleetKeys::read({fleet, secret, known}, 7);
  REQUIRE(all.ok());
  Tag by_seal;
  sample_seal(KeyUse::kDatagram).tag(message, by_seal);
  tag_of(*all, tag);
  CHECK(tag == by_seal);
  CHECK(all->keys().signatures.sign != nullptr);
  Outcome<FleetKeys> signing = FleetKeys::read({"", secret, known}, 7);
  REQUIRE(signing.ok());
  tag_of(*signing, tag);
  CHECK(tag == by_crc);

  const auto refusal = [&](const KeyFiles& files, std::uint32_t robot) {
    const Outcome<FleetKeys> keys = FleetKeys::read(files, robot);
    REQUIRE_FALSE(keys.ok());
    CHECK(keys.failure().kind == FailureKind::kUsage);
    return keys.failure().message;
  };
  CHECK(refusal({fleet, secret, known}, 8) ==
        secret +
            " is of robot 7, and this is robot 8; name the key file of this robot, or "
            "give this robot its number");
  CHECK(refusal({"", secret, ""}, 7) == "signatures take both: name robot_public_keys too");
  CHECK(refusal({"", "", known}, 7) == "signatures take both: name robot_secret too");
  CHECK(refusal({secret, "", ""}, 7).find(secret) != std::string::npos);
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
