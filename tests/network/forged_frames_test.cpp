// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Who is believed about frames, where robots sign.
#include <algorithm>
#include <catch2/catch.hpp>

#include "network/forger.hpp"
#include "network/moved_submaps.hpp"
#include "tessera/exchange/internal/record_proof.hpp"

namespace tessera::network {
namespace {

constexpr std::int64_t kSecond = 1'000'000;

/// Frames of robot 1 as it signs them, or somebody else.
struct Signed {
  explicit Signed(std::uint32_t count, std::uint32_t key = 1) : key_of(key) {
    for (std::uint32_t i = 0; i < count; ++i) {
      frames.push_back({.id = {1, 1, submap_of(i)}, .revision = 1, .T_global_map = moved(i, 1.0)});
      tree.add(leaf_of(by(), frames.back()));
    }
    sign(TreeOf::frames(1), details_of_network().checksum());
  }
  void sign(const TreeOf& of, std::uint32_t configuration) {
    const Hash root = tree.root(by());
    by().sign(by().context, root_message(configuration, of, tree.count(), root), signature);
  }
  /// So far apart that no bit of a step leads from one to another.
  static std::uint32_t submap_of(std::uint32_t i) { return 1 + 37 * i; }
  Signatures by() { return key_of.signatures(); }
  std::vector<std::byte> proof(std::uint32_t leaf) {
    std::array<std::byte, kMostProofBytes> bytes{};
    const std::size_t size = write_proof(tree, leaf, signature, bytes);
    return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)};
  }
  /// As robot 1 sends them, or this one in its place.
  std::vector<std::byte> datagram(std::uint32_t sender = 1) {
    return from(sender, {.robot = 1}, [&](FrameWriter& writer, ByteWriter& to) {
      for (const FrameBody& frame : frames) REQUIRE(writer.write(frame));
      to.bytes(signature);
    });
  }
  /// As robot 3 relays them, the proof of each that of another by so many places.
  std::vector<std::byte> relayed(std::uint32_t swapped = 0, std::uint32_t robot = 1) {
    return from(3, {.robot = robot, .relayed = true}, [&](FrameWriter& writer, ByteWriter&) {
      for (std::uint32_t i = 0; i < frames.size(); ++i)
        REQUIRE(writer.write(frames[i], proof((i + swapped) % tree.count())));
    });
  }
  template <class Write>
  static std::vector<std::byte> from(std::uint32_t sender, const FramesHeader& header,
                                     const Write& write) {
    static std::uint64_t sequence = 0;
    std::vector<std::byte> bytes(kMostDatagramBytes);
    ByteWriter to(bytes);
    write_header(to, {.kind = DatagramKind::kFrame,
                      .configuration = details_of_network().checksum(),
                      .sender = sender,
                      .session = std::uint64_t{1} << 32U,
                      .sequence = ++sequence,
                      .is_signed = true});
    write_frames_header(to, header);
    FrameWriter writer(to);
    write(writer, to);
    bytes.resize(to.size() + kTagBytes);
    Forger::seal(bytes);
    return bytes;
  }

  ToySignatures key_of;
  std::vector<FrameBody> frames;
  HashTree tree;
  Signature signature{};
};

/// Robot 2, and how many frames of robot 1 it took of a datagram.
struct Hearer {
  std::uint32_t taken(const std::vector<std::byte>& datagram) {
    const std::uint32_t before = exchange().report().contributions;
    exchange().receive(datagram, kSecond);
    return exchange().report().contributions - before;
  }
  Exchange& exchange() { return one->exchange(); }
  ExchangeReport report() { return exchange().report(); }
  std::unique_ptr<Robot> one = roomy_robot(2);
};

TEST_CASE("frames: what a robot signed is taken from itself, and by its proofs from anybody") {
  const bool relayed = GENERATE(false, true);
  const std::uint32_t count = GENERATE(1U, 2U, 5U, 7U);
  Signed frames(count);
  Hearer hearer;
  CHECK(hearer.taken(relayed ? frames.relayed() : frames.datagram()) == count);
  CHECK(hearer.report().refused_signature == 0);
  CHECK(hearer.one->signature_checks() == 1);
}

TEST_CASE(
    "frames: who has no signature of their robot's is not believed, at the cost of one check") {
  Hearer hearer;
  std::vector<std::byte> datagram;
  Signed frames(7);
  SECTION("another robot's key") { datagram = Signed(7, 3).datagram(); }
  SECTION("another robot's key, relayed") { datagram = Signed(7, 3).relayed(); }
  SECTION("another configuration") {
    frames.sign(TreeOf::frames(1), details_of_network().checksum() + 1);
    datagram = frames.datagram();
  }
  SECTION("signed as the root of a chunk") {
    frames.sign(ContributionId{1, 0, 0}, details_of_network().checksum());
    datagram = frames.relayed();
  }
  SECTION("signed as frames of another robot") {
    frames.sign(TreeOf::frames(3), details_of_network().checksum());
    datagram = frames.relayed();
  }
  SECTION("a proof of another frame") { datagram = frames.relayed(1); }
  SECTION("in another robot's name") { datagram = frames.relayed(0, 4); }
  SECTION("another frame than was signed") {
    frames.frames[0].T_global_map = moved(5, 0.3);
    datagram = frames.relayed();
  }
  SECTION("another order than was signed") {
    std::swap(frames.frames[1], frames.frames[2]);
    datagram = frames.datagram();
  }
  CHECK(hearer.taken(datagram) == 0);
  CHECK(hearer.report().refused_signature == 1);
  CHECK(hearer.one->signature_checks() == 1);
}

TEST_CASE("frames: of relayed ones those before a forged one are taken") {
  Signed frames(6);
  frames.frames[3].revision = 9;
  Hearer hearer;
  CHECK(hearer.taken(frames.relayed()) == 3);
  CHECK(hearer.report().refused_signature == 1);
  CHECK(hearer.taken(frames.datagram()) == 0);
}

TEST_CASE("frames: a robot's own are sent by itself, and an invalid one spoils all") {
  Signed frames(3);
  Hearer hearer;
  CHECK(hearer.taken(frames.datagram(3)) == 0);
  CHECK(hearer.report().refused_body == 1);
  const bool relayed = GENERATE(false, true);
  FrameBody far{.id = {1, 1, 9}, .revision = 1};
  far.T_global_map(0, 3) = 2.0 * kBlockLimit;
  frames.frames.push_back(far);
  frames.tree.add(leaf_of(frames.by(), far));
  frames.sign(TreeOf::frames(1), details_of_network().checksum());
  CHECK(hearer.taken(relayed ? frames.relayed() : frames.datagram()) == 0);
  CHECK(hearer.report().refused_body == 2);
  CHECK(hearer.one->signature_checks() == 0);
}

TEST_CASE("frames: no byte of them can be changed") {
  const bool relayed = GENERATE(false, true);
  Signed frames(4);
  const std::vector<std::byte> good = relayed ? frames.relayed() : frames.datagram();
  for (std::size_t at = kHeaderBytes; at < good.size() - kTagBytes; ++at) {
    for (const unsigned bit : {0U, 3U, 7U}) {
      std::vector<std::byte> bad = good;
      bad[at] ^= static_cast<std::byte>(1U << bit);
      Forger::seal(bad);
      Hearer hearer;
      const std::uint32_t taken = hearer.taken(bad);
      // Of relayed ones those before it are as they were.
      CHECK(taken < (relayed ? 4U : 1U));
      CHECK(hearer.report().refused_signature + hearer.report().refused_body == 1);
      for (std::uint32_t i = 0; i < taken; ++i)
        CHECK(holds(*hearer.one, Signed::submap_of(i), frames.frames[i].T_global_map));
    }
  }
}

}  // namespace
}  // namespace tessera::network
