// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot signs of its records, byte by byte: other bytes would lock out the robots that run
// what was before.
#include "tessera/exchange/internal/record_proof.hpp"

#include <catch2/catch.hpp>
#include <optional>
#include <string>
#include <vector>

#include "link/fleet_signatures.hpp"
#include "sample_keys.hpp"

namespace tessera {
namespace {

constexpr ContributionId kId{7, 2, 1};
constexpr std::uint32_t kConfiguration = 0x04030201;

/// Whether the origin of a contribution signed a record, by the proof beside it.
bool is_proved(const Signatures& by, std::uint32_t configuration, const ContributionId& id,
               const ChunkRecord& record) {
  return ProofCheck().check(by, configuration, id, leaf_of(by, id, record), record.proof);
}

/// As its robot sends it alone, in hexadecimal digits.
std::string body_of(const FrameBody& frame) {
  std::array<std::byte, FramesHeader::kBytes + kMostFrameBytes> bytes{};
  ByteWriter to(bytes);
  REQUIRE(write_frame(to, frame));
  return hex_of(to.written());
}

struct Fixture {
  Fixture() {
    const KeyFolder folder;
    Outcome<FleetSignatures> read = FleetSignatures::read(
        folder.write("s", kSecretLine), folder.write("p", kPublicLine), sample_mission());
    REQUIRE(read.ok());
    fleet.emplace(std::move(*read));
    by = fleet->signatures();
    for (int i = 0; i < 40; ++i) code.push_back(static_cast<std::byte>(i));
    records = {
        ChunkRecord{.block = {1, -2, 3},
                    .version = {.number = 5, .first = 5, .layers = 15},
                    .coded = std::as_bytes(std::span("abc", 3))},
        ChunkRecord{
            .block = {-9, 0, 4}, .version = {.number = 8, .first = 7, .layers = 12}, .coded = {}},
        ChunkRecord{
            .block = {0, 0, 0}, .version = {.number = 9, .first = 9, .layers = 3}, .coded = code}};
    for (const ChunkRecord& record : records) tree.add(leaf_of(by, kId, record));
    root = tree.root(by);
    const auto message = root_message(kConfiguration, kId, tree.count(), root);
    by.sign(by.context, message, signature);
  }
  std::optional<FleetSignatures> fleet;
  Signatures by;
  std::vector<std::byte> code;
  std::vector<ChunkRecord> records;
  HashTree tree;
  Hash root{};
  Signature signature{};
};

// By Python's hashlib.blake2b and struct from docs/reference/wire-format.md.
TEST_CASE("record proof: leaves and the root are those of the page") {
  Fixture f;
  CHECK(hex_of(leaf_of(f.by, kId, f.records[0])) == "38cc1bc6da193d0c4a3aa20b9bc10c7a");
  CHECK(hex_of(leaf_of(f.by, kId, f.records[1])) == "d77928b13cb34d173fd195fcc479f18d");
  CHECK(hex_of(leaf_of(f.by, kId, f.records[2])) == "4757c838d7519c79eb80605f88d68108");
  CHECK(hex_of(f.root) == "c7d56ec1040169fd448f80074a8b7fe6");
  CHECK(hex_of(root_message(kConfiguration, kId, 3, f.root)) ==
        "545302030102030407000000020000000100000003" + hex_of(f.root));
  const Statement statement{.id = kId,
                            .range = {5, 9},
                            .latest = 9,
                            .records = 3,
                            .fingerprint = {0x1122334455667788U, 0x99aabbccddeeff00U},
                            .frame_revision = 6,
                            .floor = 2,
                            .session_floor = 1,
                            .session = std::uint64_t{3} << 32U | 17U};
  CHECK(hex_of(leaf_of(f.by, statement)) == "896741279bf31135627f164555ada12f");
  const FrameBody frame{.id = kId, .revision = 6};
  CHECK(body_of(frame) == "00070000000204020c" + std::string(44, '0'));
  CHECK(hex_of(leaf_of(f.by, frame)) == "087800c61180206f3bc8b3c0e446aac1");
  // Of one that no short code stands for, with blocks, and of a session.
  FrameBody other{.id = {7, 2, MapSession::kFirst + 1}, .revision = 6};
  other.T_global_map(0, 3) = 0.1;
  other.T_global_map(1, 3) = -2.0;
  other.extent = {{-3, 0, 200}, {1, 0, 330}};
  other.session = {0x0123456789abcdefU, -2, 16384};
  const std::string body = body_of(other);
  CHECK(body.substr(0, 22) == "00070000000104fdff070c");
  CHECK(body.substr(22 + 2 * 96) == "0500900304008201efcdab8967452301feffffffffffffff0040");
  CHECK(hex_of(leaf_of(f.by, other)) == "01fc39af3b5d456f43afc1843bfcf3d8");
  HashTree frames;
  for (const FrameBody& one : {frame, other}) frames.add(leaf_of(f.by, one));
  const Hash root = frames.root(f.by);
  CHECK(hex_of(root_message(kConfiguration, TreeOf::frames(7), 2, root)) ==
        "545302040102030407000000000000000000000002a687e9cf01414cc98674650ae9354903");
}

TEST_CASE("record proof: each record stands alone, as it was signed and not otherwise") {
  Fixture f;
  for (std::uint32_t leaf = 0; leaf < 3; ++leaf) {
    std::array<std::byte, kMostProofBytes> bytes{};
    const std::size_t size = write_proof(f.tree, leaf, f.signature, bytes);
    CHECK(size == 1 + (leaf == 2 ? 1 : 2) * kHashBytes + kSignatureBytes);
    CHECK(std::to_integer<unsigned>(bytes[0]) == (leaf | 2U << 4U));
    ByteReader from(bytes);
    ChunkRecord record = f.records[leaf];
    record.proof = read_proof(from);
    REQUIRE(record.proof.size() == size);
    CHECK(is_proved(f.by, kConfiguration, kId, record));
    CHECK_FALSE(is_proved(f.by, kConfiguration + 1, kId, record));
    CHECK_FALSE(is_proved(f.by, kConfiguration, {7, 2, 2}, record));
    CHECK_FALSE(is_proved(f.by, kConfiguration, {8, 2, 1}, record));
    ChunkRecord other = record;
    ++other.version.number;
    CHECK_FALSE(is_proved(f.by, kConfiguration, kId, other));
    other = record;
    --other.block.z;
    CHECK_FALSE(is_proved(f.by, kConfiguration, kId, other));
    for (std::size_t i = 0; i < size; ++i) {
      std::array<std::byte, kMostProofBytes> changed = bytes;
      changed[i] ^= std::byte{1};
      ByteReader changed_from(changed);
      other = record;
      other.proof = read_proof(changed_from);
      CHECK_FALSE((!other.proof.empty() && is_proved(f.by, kConfiguration, kId, other)));
    }
  }
}

TEST_CASE("record proof: a leaf beyond the tree is none, and nothing is read beyond the end") {
  std::array<std::byte, kMostProofBytes> bytes{};
  bytes[0] = std::byte{0x23};
  ByteReader from(bytes);
  CHECK(read_proof(from).empty());
  CHECK_FALSE(from.ok());
  for (std::size_t size = 0; size < kMostProofBytes; ++size) {
    bytes[0] = std::byte{0xf0};
    ByteReader cut(std::span<const std::byte>(bytes).first(size));
    CHECK(read_proof(cut).empty());
  }
}

}  // namespace
}  // namespace tessera
