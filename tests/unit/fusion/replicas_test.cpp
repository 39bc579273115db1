// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Replicas: the latest version of each block, whatever comes in whatever order.
#include "tessera/replica/replicas.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <map>
#include <tuple>
#include <vector>

#include "support/mapper.hpp"
#include "support/random.hpp"

namespace tessera {
namespace {

struct OwnReplicas {
  explicit OwnReplicas(const ReplicasConfig& given) : memory(Replicas::required_bytes(given)) {
    Arena arena(memory.span());
    replicas = *Replicas::make(arena, given);
  }
  AlignedMemory memory;
  Replicas replicas;
};

std::vector<std::byte> bytes_of(std::size_t size, std::uint32_t value) {
  return std::vector<std::byte>(size, static_cast<std::byte>(value & 0xffU));
}

std::vector<std::byte> held(const Replicas& replicas, Replicas::Slot slot, BlockKey key) {
  const Replicas::Replica* const replica = replicas.find(slot, key);
  if (replica == nullptr) return {};
  std::vector<std::byte> bytes(replica->bytes);
  static_cast<void>(replicas.read(*replica, bytes));
  return bytes;
}

TEST_CASE("replicas: only the latest version counts, and the rest is counted as stale") {
  OwnReplicas own({.segments = 64, .blocks = 16, .contributions = 4, .robot_segments = 64});
  const Replicas::Slot slot = *own.replicas.open({7, 1, 0});
  const BlockKey key{42};
  CHECK(*own.replicas.put(slot, key, 3, bytes_of(200, 3)) == Replicas::Change::kTaken);
  CHECK(*own.replicas.put(slot, key, 2, bytes_of(900, 2)) == Replicas::Change::kStale);
  CHECK(*own.replicas.put(slot, key, 3, bytes_of(10, 9)) == Replicas::Change::kStale);
  CHECK(held(own.replicas, slot, key) == bytes_of(200, 3));
  CHECK(*own.replicas.put(slot, key, 9, bytes_of(50, 9)) == Replicas::Change::kTaken);
  CHECK(held(own.replicas, slot, key) == bytes_of(50, 9));
  // Known to be empty is not the same as unknown.
  CHECK(*own.replicas.put(slot, key, 10, {}) == Replicas::Change::kTaken);
  CHECK(own.replicas.find(slot, key)->bytes == 0);
  CHECK(*own.replicas.put(slot, key, 9, bytes_of(50, 9)) == Replicas::Change::kStale);
  CHECK(own.replicas.usage().replicas_stale == 3);
  CHECK(own.replicas.usage().segments == 0);
}

TEST_CASE("replicas: contributions are in the order of their ids, whenever they came") {
  OwnReplicas own({.segments = 8, .blocks = 8, .contributions = 4, .robot_segments = 8});
  for (const ContributionId id : {ContributionId{5, 0, 1}, {2, 9, 0}, {5, 0, 0}, {2, 1, 3}})
    REQUIRE(own.replicas.open(id).ok());
  CHECK(own.replicas.open({9, 0, 0}).status() == Status::kResourceExhausted);
  CHECK(own.replicas.open({5, 0, 1}).ok());  // is there already
  std::vector<ContributionId> found;
  for (const Replicas::Slot slot : own.replicas.in_order())
    found.push_back(own.replicas.contribution(slot).id);
  CHECK(found == std::vector<ContributionId>{{2, 1, 3}, {2, 9, 0}, {5, 0, 0}, {5, 0, 1}});
  const auto bit = [&](ContributionId id) {
    return own.replicas.contribution(*own.replicas.find(id)).robot_bit;
  };
  CHECK(bit({5, 0, 0}) == bit({5, 0, 1}));
  CHECK(bit({5, 0, 0}) != bit({2, 1, 3}));
  own.replicas.close(*own.replicas.find({2, 9, 0}));
  CHECK_FALSE(own.replicas.find({2, 9, 0}).ok());
  CHECK(own.replicas.open({9, 0, 0}).ok());
}

TEST_CASE("replicas: quota and storage refuse without loss, and say which it was") {
  OwnReplicas own({.segments = 10, .blocks = 8, .contributions = 4, .robot_segments = 6});
  const Replicas::Slot a = *own.replicas.open({1, 0, 0});
  const Replicas::Slot b = *own.replicas.open({2, 0, 0});
  const std::size_t three = 3 * SegmentStore::kPayloadBytes;
  CHECK(own.replicas.put(a, {1}, 1, bytes_of(three, 1)).ok());
  CHECK(own.replicas.put(a, {2}, 1, bytes_of(three, 2)).ok());
  CHECK_FALSE(own.replicas.put(a, {3}, 1, bytes_of(1, 3)).ok());
  CHECK(own.replicas.usage().replicas_refused_quota == 1);
  CHECK(own.replicas.put(b, {1}, 1, bytes_of(three, 1)).ok());
  CHECK_FALSE(own.replicas.put(b, {2}, 1, bytes_of(three, 1)).ok());
  CHECK(own.replicas.usage().replicas_refused_storage == 1);
  // A larger version that does not fit leaves the older one.
  CHECK_FALSE(own.replicas.put(b, {1}, 2, bytes_of(5 * SegmentStore::kPayloadBytes, 2)).ok());
  CHECK(held(own.replicas, b, {1}) == bytes_of(three, 1));
  CHECK(own.replicas.put(a, {2}, 2, bytes_of(1, 4)).ok());
  CHECK(own.replicas.put(a, {3}, 1, bytes_of(1, 3)).ok());
}

TEST_CASE("replicas: random versions, repeats and removals agree with a table") {
  OwnReplicas own({.segments = 4000, .blocks = 400, .contributions = 8, .robot_segments = 4000});
  oracle::Random random(17);
  std::map<std::tuple<std::uint32_t, std::uint64_t>, std::tuple<std::uint32_t, std::size_t>> table;
  std::vector<Replicas::Slot> slots;
  for (std::uint32_t robot = 0; robot < 8; ++robot)
    slots.push_back(*own.replicas.open({robot, 0, 0}));
  for (int i = 0; i < 20000; ++i) {
    const Replicas::Slot slot = slots[static_cast<std::size_t>(random.below(8))];
    const std::uint64_t key = random.bits() % 40;
    const auto place = table.find({slot, key});
    if (random.below(20) == 0 && place != table.end()) {
      std::uint32_t number = own.replicas.contribution(slot).first_block;
      while (own.replicas.record(number).key != key) number = own.replicas.record(number).next;
      own.replicas.drop(number);
      table.erase(place);
      continue;
    }
    const auto version = static_cast<std::uint32_t>(random.below(100));
    const auto size = static_cast<std::size_t>(random.below(600));
    const bool newer = place == table.end() || version > std::get<0>(place->second);
    const Result<Replicas::Change> put =
        own.replicas.put(slot, {key}, version, bytes_of(size, version));
    REQUIRE(put.ok());
    REQUIRE((*put == Replicas::Change::kTaken) == newer);
    if (newer) table[{slot, key}] = {version, size};
  }
  std::uint32_t segments = 0;
  for (const auto& [at, what] : table) {
    const auto [slot, key] = at;
    const auto [version, size] = what;
    REQUIRE(held(own.replicas, slot, {key}) == bytes_of(size, version));
    segments += SegmentStore::segments_of(size);
  }
  CHECK(own.replicas.usage().replica_blocks == table.size());
  CHECK(own.replicas.usage().segments == segments);
}

TEST_CASE("replicas: of each layer the latest version counts, in whatever parts it comes") {
  constexpr std::uint32_t kSegments = 4096;
  OwnReplicas own(
      {.segments = kSegments, .blocks = 64, .contributions = 2, .robot_segments = kSegments});
  const Replicas::Slot slot = *own.replicas.open({1, 0, 0});
  oracle::Random random(oracle::announce_seed(4711));
  const std::array<std::uint8_t, 7> parts{1, 2, 4, 8, 0b0011, 0b1100, kAllLayers};
  struct Held {
    std::uint32_t version = 0;
    std::size_t bytes = 0;
  };
  std::map<std::uint64_t, std::array<Held, kBlockLayers>> table;
  std::map<std::uint64_t, std::uint32_t> newest;
  for (int i = 0; i < 4000; ++i) {
    const auto key = static_cast<std::uint64_t>(random.below(16));
    const auto first = static_cast<std::uint32_t>(random.below(200) + 1);
    const PartVersion version{.number = first + static_cast<std::uint32_t>(random.below(4)),
                              .first = first,
                              .layers = parts[static_cast<std::size_t>(random.below(7))]};
    const auto size = static_cast<std::size_t>(random.below(400));
    std::uint8_t news = 0;
    for (std::size_t layer = 0; layer < kBlockLayers; ++layer) {
      if (((version.layers >> layer) & 1U) == 0) continue;
      Held& held = table[key][layer];
      if (version.number <= held.version) continue;
      news |= static_cast<std::uint8_t>(1U << layer);
      held = {version.number, size};
    }
    if (news != 0) newest[key] = std::max(newest[key], first);
    REQUIRE(own.replicas.news(slot, {key}, version) == news);
    const auto wire = bytes_of(size % 50, version.number + 1);
    const Result<Replicas::Change> put =
        own.replicas.put(slot, {key}, version, bytes_of(size, version.number), wire);
    REQUIRE(put.ok());
    REQUIRE((*put == Replicas::Change::kTaken) == (news != 0));
  }
  std::uint32_t segments = 0;
  for (const auto& [key, layers] : table) {
    std::uint8_t seen = 0;
    for (const Replicas::Replica* part = own.replicas.find(slot, {key}); part != nullptr;
         part = own.replicas.next_part(*part)) {
      REQUIRE((seen & part->live) == 0);
      REQUIRE((part->live & ~part->layers) == 0);
      seen |= part->live;
      if (part->live == 0) continue;
      REQUIRE(part->newest == newest[key]);
      std::vector<std::byte> bytes(part->bytes);
      std::vector<std::byte> wire(part->wire_bytes);
      CHECK(own.replicas.read(*part, bytes).size() == part->bytes);
      CHECK(own.replicas.read_wire(*part, wire).size() == part->wire_bytes);
      REQUIRE(bytes == bytes_of(part->bytes, part->version));
      REQUIRE(wire == bytes_of(part->bytes % 50, part->version + 1));
      segments += SegmentStore::segments_of(bytes.size() + wire.size());
      for (std::size_t layer = 0; layer < kBlockLayers; ++layer) {
        if (((part->live >> layer) & 1U) == 0) continue;
        REQUIRE(layers[layer].version == part->version);
        REQUIRE(layers[layer].bytes == part->bytes);
      }
    }
    for (std::size_t layer = 0; layer < kBlockLayers; ++layer)
      REQUIRE((((seen >> layer) & 1U) != 0) == (layers[layer].version != 0));
  }
  CHECK(own.replicas.usage().segments == segments);
  while (own.replicas.contribution(slot).first_block != 0)
    own.replicas.drop(own.replicas.contribution(slot).first_block);
  CHECK(own.replicas.usage().segments == 0);
  CHECK(own.replicas.usage().replica_blocks == 0);
}

}  // namespace
}  // namespace tessera
