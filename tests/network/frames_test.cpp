// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Frames of many submaps: what a correction of them costs, and who is believed about them.
#include <algorithm>
#include <catch2/catch.hpp>
#include <memory>

#include "network/forger.hpp"
#include "network/simulated_network.hpp"
#include "tessera/base/internal/quaternion.hpp"
#include "tessera/base/rigid_code.hpp"
#include "tessera/exchange/internal/record_proof.hpp"

namespace tessera::network {
namespace {

constexpr std::int64_t kSecond = 1'000'000;
constexpr std::uint32_t kSubmaps = 100;
/// LCM puts its own 8 bytes and the channel's 8 in front.
constexpr std::size_t kOnTheWire = 16;

std::unique_ptr<Robot> robot(std::uint32_t number, bool signs = true) {
  ReplicasConfig replicas = Network::default_replicas();
  replicas.contributions = 256;
  ExchangeConfig config;
  config.contributions = replicas.contributions;
  config.contributions_per_robot = 128;
  config.own_contributions = 110;
  RobotOptions options;
  if (signs) options.key = number;
  return std::make_unique<Robot>(number, 1, replicas, config, options);
}

/// As corrections are: of a short code.
Matrix34d moved(std::uint32_t submap, double by) {
  Quaternion q{1.0, 0.01 * by, -0.02, 0.003 * submap};
  normalise(q);
  return *round_rigid(transform_of(q, {20.0 * submap + by, -3.0 * by, 0.1}));
}

/// A robot with so many submaps beside its first, each with blocks of 80 m.
std::unique_ptr<Robot> robot_of_submaps(std::uint32_t number, bool signs = true,
                                        std::uint32_t submaps = kSubmaps) {
  auto made = robot(number, signs);
  oracle::Random random(17);
  for (std::uint32_t submap = 1; submap <= submaps; ++submap) {
    REQUIRE(made->exchange().open(1, submap, moved(submap, 0.0)) == Status::kOk);
    for (const BlockCoord block : {BlockCoord{-53, -47, -4}, BlockCoord{61, 40, 9}})
      REQUIRE(made->publish(*pack(block), random, 1).ok());
  }
  return made;
}

void correct(Robot& robot, double by, std::uint32_t submaps = kSubmaps) {
  for (std::uint32_t submap = 1; submap <= submaps; ++submap)
    REQUIRE(robot.exchange().move(1, submap, moved(submap, by)) == Status::kOk);
}

/// Whether a robot holds that submap of robot 1 in that frame.
bool holds(const Robot& robot, std::uint32_t submap, const Matrix34d& T_global_map) {
  const Replicas& held = robot.replicas();
  const Result<Replicas::Slot> slot = held.find({1, 1, submap});
  if (!slot.ok()) return false;
  const GridTransform& found = held.contribution(*slot).T_global_local;
  const auto wanted = GridTransform::make(T_global_map, ExchangeConfig{}.resolution_m);
  const VoxelCoord far{9'000, -7'000, 500};
  return found.to_local({0, 0, 0}) == wanted->to_local({0, 0, 0}) &&
         found.to_local(far) == wanted->to_local(far);
}

/// Of robot 1's submaps how many a robot holds where they are moved to by so much.
std::uint32_t held_at(const Robot& robot, double by, std::uint32_t submaps = kSubmaps) {
  std::uint32_t found = 0;
  for (std::uint32_t submap = 1; submap <= submaps; ++submap)
    found += holds(robot, submap, moved(submap, by)) ? 1U : 0U;
  return found;
}

std::uint64_t frame_datagrams(const std::vector<std::vector<std::byte>>& all) {
  return static_cast<std::uint64_t>(std::count_if(all.begin(), all.end(), [](const auto& one) {
    return kind_of(one) == DatagramKind::kFrame;
  }));
}

std::size_t bytes_on_the_wire(const std::vector<std::vector<std::byte>>& all) {
  std::size_t bytes = 0;
  for (const auto& datagram : all) bytes += datagram.size() + kOnTheWire;
  return bytes;
}

TEST_CASE("frames: a correction of 100 submaps adds at most 6,400 bytes to what a robot says") {
  const bool signs = GENERATE(true, false);
  const auto corrected = robot_of_submaps(1, signs);
  const auto same = robot_of_submaps(1, signs);
  const auto hearer = robot(2, signs);
  constexpr std::int64_t kBegin = 60 * kSecond;
  for (const auto& datagram : said(*corrected, 0, kBegin)) hearer->exchange().receive(datagram, 0);
  static_cast<void>(said(*same, 0, kBegin));
  REQUIRE(held_at(*hearer, 0.0) == kSubmaps);
  correct(*corrected, 1.0);
  const auto now = said(*corrected, kBegin, kTickUs);
  const auto after = said(*corrected, kBegin + kTickUs, 2 * kSecond);
  for (const auto* const all : {&now, &after}) {
    for (const auto& datagram : *all) hearer->exchange().receive(datagram, kBegin);
  }
  CHECK(held_at(*hearer, 1.0) == kSubmaps);
  const std::size_t usual = bytes_on_the_wire(said(*same, kBegin, kTickUs + 2 * kSecond));
  const std::size_t bytes = bytes_on_the_wire(now) + bytes_on_the_wire(after) - usual;
  UNSCOPED_INFO(bytes << " bytes in all, " << bytes_on_the_wire(now) << " at once, in "
                      << frame_datagrams(now) << " datagrams");
  CHECK(bytes <= 6'400);
  CHECK(bytes_on_the_wire(now) <= 6'400);
  CHECK(frame_datagrams(now) <= 7);
  // What goes out at once are the frames of seven eighths at least: the others were just said.
  CHECK(held_at(*hearer, 1.0) == kSubmaps);
}

TEST_CASE("frames: of each datagram of a correction one signature is checked") {
  const auto origin = robot_of_submaps(1);
  const auto hearer = robot(2);
  for (const auto& datagram : said(*origin, 0, 20 * kSecond))
    hearer->exchange().receive(datagram, 0);
  correct(*origin, 1.0);
  const std::uint64_t before = hearer->signature_checks();
  std::uint64_t datagrams = 0;
  for (const auto& datagram : said(*origin, 20 * kSecond, 2 * kSecond)) {
    if (kind_of(datagram) != DatagramKind::kFrame) continue;
    ++datagrams;
    hearer->exchange().receive(datagram, 20 * kSecond);
  }
  CHECK(held_at(*hearer, 1.0) == kSubmaps);
  CHECK(hearer->signature_checks() - before <= datagrams);
  CHECK(datagrams < kSubmaps / 4);
}

TEST_CASE("frames: who never heard a robot gets its frames from one who did, and checks each") {
  const bool signs = GENERATE(true, false);
  auto origin = robot_of_submaps(1, signs);
  const auto witness = robot(2, signs);
  std::int64_t now_us = 0;
  talk({origin.get(), witness.get()}, now_us, 20 * kSecond);
  correct(*origin, 2.0);
  talk({origin.get(), witness.get()}, now_us, 5 * kSecond);
  REQUIRE(held_at(*witness, 2.0) == kSubmaps);
  origin.reset();
  const auto newcomer = robot(3, signs);
  const std::uint64_t before = witness->exchange().report().frames;
  talk({witness.get(), newcomer.get()}, now_us, 20 * kSecond);
  CHECK(held_at(*newcomer, 2.0) == kSubmaps);
  CHECK(newcomer->exchange().report().refused_signature == 0);
  CHECK(newcomer->exchange().report().refused_body == 0);
  CHECK(newcomer->exchange().digest() == witness->exchange().digest());
  CHECK(witness->exchange().report().frames - before < 2 * kSubmaps + 10);
}

TEST_CASE("frames: those that are lost are asked for together, and come together") {
  const auto origin = robot_of_submaps(1);
  const auto hearer = robot(2);
  std::int64_t now_us = 0;
  talk({origin.get(), hearer.get()}, now_us, 20 * kSecond);
  correct(*origin, 3.0);
  const auto is_frame = [](const Robot& /*to*/, std::span<const std::byte> datagram) {
    return kind_of(datagram) == DatagramKind::kFrame;
  };
  talk({origin.get(), hearer.get()}, now_us, kTickUs, is_frame);
  std::uint64_t datagrams = 0;
  talk({origin.get(), hearer.get()}, now_us, 10 * kSecond,
       [&](const Robot& /*to*/, std::span<const std::byte> datagram) {
         datagrams += kind_of(datagram) == DatagramKind::kFrame ? 1U : 0U;
         return false;
       });
  CHECK(held_at(*hearer, 3.0) == kSubmaps);
  // One with each announcement, and these: each is missed when an announcement names it.
  CHECK(datagrams <= 10 + kSubmaps / 3);
}

// --- What is forged ------------------------------------------------------------------------------

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
  std::unique_ptr<Robot> one = robot(2);
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
