// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Evidence that is sent: what is new, and what others wait for, in turns.
#include "tessera/exchange/internal/chunk_writer.hpp"

#include <catch2/catch.hpp>
#include <optional>
#include <set>

#include "exchange_rig.hpp"

namespace tessera {
namespace {

constexpr Instant kNow = at_ms(1'000'000);
constexpr std::uint32_t kAsker = 9;

/// What a chunk says.
struct Chunk {
  ChunkHeader header;
  std::vector<std::uint32_t> versions;
  std::optional<std::uint32_t> asker;
};

/// A robot that publishes, and the writer that is looked at.
struct Bench {
  Bench() : rig(1), memory(ChunkWriter::required_bytes(rig.config)) {
    Arena arena = memory.arena();
    writer = *ChunkWriter::make(arena, rig.config);
    own = &rig.open_own();
    rig.peer(kAsker, kNow);
  }
  void publish(int blocks) {
    for (int i = 0; i < blocks; ++i) {
      const BlockCoord block{next_block++, 0, 0};
      writer.note_fresh(*pack(block), rig.publish(block));
    }
  }
  /// The same of blocks of which a few fill a datagram; returns the latest version.
  std::uint32_t publish_large(int blocks) {
    oracle::Random random(5);
    OwnContent content(kExchangeComponents);
    for (int i = 0; i < blocks; ++i) {
      const BlockCoord block{next_block++, 0, 0};
      content->clear();
      fill_smoothly(*content, random, kExchangeComponents);
      writer.note_fresh(*pack(block), rig.publish(block, *content));
    }
    return own->latest;
  }
  /// The next chunk, if there is one.
  std::optional<Chunk> next() {
    std::vector<std::byte> body(kMostBodyBytes);
    ByteWriter to(body);
    Outgoing out = rig.outgoing(kNow);
    if (!writer.write(out, to)) return std::nullopt;
    REQUIRE(out.kind == DatagramKind::kChunk);
    Chunk chunk;
    if (out.for_asker) chunk.asker = out.asker;
    body.resize(to.size());
    ByteReader from(body);
    REQUIRE(read_chunk_header(from, rig.config.session, chunk.header));
    RecordReader reader(from, chunk.header.range, false);
    for (ChunkRecord record; from.remaining() != 0 && reader.read(record);)
      chunk.versions.push_back(record.version.number);
    REQUIRE(from.remaining() == 0);
    return chunk;
  }
  void ask(VersionRange range, std::uint32_t asker = kAsker) {
    REQUIRE(writer.answers().add({.contribution = rig.ledger.number_of(*own),
                                  .generation = own->generation,
                                  .range = range,
                                  .due = kNow,
                                  .asker = asker,
                                  .held = own->records},
                                 rig.counted));
  }
  void pick(std::uint32_t version, std::uint32_t asker = kAsker) {
    REQUIRE(writer.answers().picks().push({.contribution = rig.ledger.number_of(*own),
                                           .generation = own->generation,
                                           .version = version,
                                           .asker = asker}));
  }

  ExchangeRig rig;
  AlignedMemory memory;
  ChunkWriter writer;
  const HeldContribution* own = nullptr;
  int next_block = 0;
};

using Versions = std::vector<std::uint32_t>;

TEST_CASE("ChunkWriter: without anything new or asked for nothing is written") {
  Bench bench;
  CHECK_FALSE(bench.next());
  CHECK(bench.rig.counted.fresh_chunks == 0);
}

TEST_CASE("ChunkWriter: what was published goes out once, to all, with a statement") {
  Bench bench;
  bench.publish(3);
  const std::optional<Chunk> chunk = bench.next();
  REQUIRE(chunk);
  CHECK(chunk->header.id == bench.own->id);
  CHECK(chunk->header.range == VersionRange{1, 3});
  CHECK_FALSE(chunk->header.relayed);
  CHECK_FALSE(chunk->header.partial);
  CHECK(chunk->header.statement.latest == 3);
  CHECK(chunk->header.statement.records == 3);
  CHECK(chunk->versions == Versions{1, 2, 3});
  CHECK_FALSE(chunk->asker);
  CHECK_FALSE(bench.next());
  bench.publish(1);
  CHECK(bench.next()->header.range == VersionRange{4, 4});
  CHECK(bench.rig.counted.fresh_chunks == 2);
}

TEST_CASE("ChunkWriter: of a block that was published twice the later record alone goes out") {
  Bench bench;
  for (const float count : {2.0F, 3.0F})
    bench.writer.note_fresh(*pack({1, 1, 1}), bench.rig.publish({1, 1, 1}, count));
  const std::optional<Chunk> chunk = bench.next();
  REQUIRE(chunk);
  CHECK(chunk->header.range == VersionRange{1, 2});
  CHECK(chunk->versions == Versions{2});
}

TEST_CASE("ChunkWriter: more than fits a datagram goes in several, without a gap") {
  Bench bench;
  const std::uint32_t latest = bench.publish_large(20);
  std::uint32_t next = 1;
  int chunks = 0;
  while (const std::optional<Chunk> chunk = bench.next()) {
    CHECK(chunk->header.range.first == next);
    next = chunk->header.range.last + 1;
    ++chunks;
  }
  CHECK(next == latest + 1);
  CHECK(chunks > 1);
}

TEST_CASE("ChunkWriter: an answer is for who asked, and what all heard is not sent again") {
  Bench bench;
  bench.publish(4);
  REQUIRE(bench.next());
  bench.ask({2, 3});
  const std::optional<Chunk> chunk = bench.next();
  REQUIRE(chunk);
  CHECK(chunk->header.range == VersionRange{2, 3});
  CHECK(chunk->versions == Versions{2, 3});
  CHECK(chunk->asker == kAsker);
  CHECK_FALSE(bench.next());
  CHECK(bench.rig.counted.answer_chunks == 1);
}

TEST_CASE("ChunkWriter: single records come in a partial chunk, each once") {
  Bench bench;
  bench.publish(6);
  REQUIRE(bench.next());
  bench.pick(2);
  bench.pick(5);
  bench.pick(40);  // nobody published that
  const std::optional<Chunk> chunk = bench.next();
  REQUIRE(chunk);
  CHECK(chunk->header.partial);
  CHECK(chunk->header.range == VersionRange{2, 5});
  CHECK(chunk->versions == Versions{2, 5});
  CHECK(chunk->asker == kAsker);
  CHECK_FALSE(bench.next());
  CHECK(bench.writer.answers().waiting() == 0);
}

TEST_CASE("ChunkWriter: records for two robots come in two chunks") {
  Bench bench;
  bench.publish(6);
  REQUIRE(bench.next());
  bench.rig.peer(8, kNow);
  bench.pick(2);
  bench.pick(3, 8);
  CHECK(bench.next()->asker == kAsker);
  CHECK(bench.next()->asker == 8);
}

TEST_CASE("ChunkWriter: a robot that is no peer gets no answer") {
  Bench bench;
  bench.publish(2);
  REQUIRE(bench.next());
  bench.ask({1, 2}, 77);
  bench.pick(1, 77);
  CHECK_FALSE(bench.next());
  CHECK(bench.writer.answers().waiting() == 0);
}

TEST_CASE("ChunkWriter: a robot that has had too much gets no answer, and that is counted") {
  Bench bench;
  bench.publish(2);
  REQUIRE(bench.next());
  bench.rig.peer(kAsker, kNow).walk = -1'000'000'000;
  bench.ask({1, 2});
  CHECK_FALSE(bench.next());
  CHECK(bench.rig.counted.refused_answers == 1);
}

TEST_CASE("ChunkWriter: what is new and what is asked for take turns") {
  Bench bench;
  bench.publish_large(20);
  REQUIRE(bench.next());
  bench.ask({1, 1});
  bench.pick(2);
  std::set<int> kinds;
  for (int i = 0; i < 3; ++i) {
    const std::optional<Chunk> chunk = bench.next();
    REQUIRE(chunk);
    kinds.insert(chunk->header.partial ? 2 : (chunk->asker ? 1 : 0));
  }
  CHECK(kinds == std::set<int>{0, 1, 2});
}

TEST_CASE("ChunkWriter: what waited of the contribution before is not sent as the next one's") {
  Bench bench;
  bench.publish(3);
  REQUIRE(bench.rig.ledger.open(2, 0, Matrix34d::Identity(), bench.rig.counted) == Status::kOk);
  bench.writer.begin_own();
  CHECK_FALSE(bench.next());
  bench.own = bench.rig.ledger.publishing();
  bench.publish(1);
  const std::optional<Chunk> chunk = bench.next();
  REQUIRE(chunk);
  CHECK(chunk->header.id.epoch == 2);
  CHECK(chunk->versions == Versions{1});
}

TEST_CASE("ChunkWriter: memory that is too small is refused") {
  const ExchangeConfig config = ExchangeRig::config_of(1);
  AlignedMemory memory(ChunkWriter::required_bytes(config) - 1);
  Arena arena = memory.arena();
  CHECK(ChunkWriter::make(arena, config).status() == Status::kResourceExhausted);
}

}  // namespace
}  // namespace tessera
