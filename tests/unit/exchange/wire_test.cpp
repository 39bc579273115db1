// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/wire.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "oracle/cloud.hpp"
#include "oracle/random.hpp"

namespace tessera {
namespace {

struct Body {
  std::vector<std::byte> bytes = std::vector<std::byte>(kMostBodyBytes);
  ByteWriter to{bytes};
  [[nodiscard]] ByteReader reader() const { return ByteReader(to.written()); }
};

std::uint32_t any_number(oracle::Random& random) {
  return static_cast<std::uint32_t>(random.bits() >> (32 + random.below(32)));
}

std::int32_t any_coordinate(oracle::Random& random) {
  return random.below(3) == 0 ? random.below(2 * kBlockLimit) - kBlockLimit : random.below(9) - 4;
}

TEST_CASE("wire: a header is twenty bytes that begin with TS and the format") {
  Body body;
  const DatagramHeader header{.kind = DatagramKind::kChunk,
                              .configuration = 0x04030201,
                              .sender = 7,
                              .session = 8,
                              .sequence = 0xffffffff};
  write_header(body.to, header);
  CHECK(body.to.size() == kHeaderBytes);
  const std::vector<int> wanted{'T', 'S', 1, 3, 1, 2, 3,   4,   7,   0,
                                0,   0,   8, 0, 0, 0, 255, 255, 255, 255};
  for (std::size_t i = 0; i < wanted.size(); ++i)
    CHECK(std::to_integer<int>(body.bytes[i]) == wanted[i]);
  DatagramHeader read;
  ByteReader from = body.reader();
  CHECK(read_header(from, read));
  CHECK(read.kind == header.kind);
  CHECK(read.configuration == header.configuration);
  CHECK(read.sequence == header.sequence);
  for (const std::size_t at : {0U, 1U, 2U, 3U}) {
    const std::byte before = body.bytes[at];
    body.bytes[at] = std::byte{99};
    ByteReader damaged = body.reader();
    CHECK_FALSE(read_header(damaged, read));
    body.bytes[at] = before;
  }
}

TEST_CASE("wire: what is written is what is read, and what is cut is refused") {
  oracle::Random random(oracle::announce_seed(602));
  for (int round = 0; round < 2000; ++round) {
    Body body;
    const ContributionId id{any_number(random), any_number(random), any_number(random)};
    const AnnouncedContribution announced{.id = id,
                                          .latest = any_number(random),
                                          .frame_revision = any_number(random),
                                          .complete = random.below(2) == 0,
                                          .digest = random.bits()};
    REQUIRE(write_announced(body.to, announced));
    RequestedContribution requested{.id = id, .frame_revision = any_number(random)};
    requested.all = random.below(4) == 0;
    requested.digest = requested.all ? random.bits() : 0;
    requested.gaps = static_cast<std::uint8_t>(requested.all ? 0 : random.below(33));
    std::uint32_t last = 0;
    for (std::size_t i = 0; i < requested.gaps; ++i) {
      const std::uint32_t first = last + 1 + any_number(random) / 128;
      last = first + any_number(random) / 128;
      requested.gap[i] = {first, last};
    }
    REQUIRE(write_requested(body.to, requested));
    FrameBody frame{.id = id, .revision = 1 + any_number(random) / 2};
    for (Eigen::Index i = 0; i < 12; ++i)
      frame.T_global_map(i / 4, i % 4) = random.uniform(-1e6, 1e6);
    REQUIRE(write_frame(body.to, frame));
    const std::size_t size = body.to.size();

    ByteReader from = body.reader();
    AnnouncedContribution announced_read;
    RequestedContribution requested_read;
    FrameBody frame_read;
    REQUIRE(read_announced(from, announced_read));
    REQUIRE(read_requested(from, requested_read));
    REQUIRE(read_frame(from, frame_read));
    REQUIRE(from.remaining() == 0);
    CHECK(announced_read.id == id);
    CHECK(announced_read.latest == announced.latest);
    CHECK(announced_read.complete == announced.complete);
    CHECK(announced_read.digest == announced.digest);
    CHECK(requested_read.all == requested.all);
    CHECK(requested_read.digest == requested.digest);
    REQUIRE(requested_read.gaps == requested.gaps);
    for (std::size_t i = 0; i < requested.gaps; ++i)
      CHECK(requested_read.gap[i] == requested.gap[i]);
    CHECK(frame_read.T_global_map == frame.T_global_map);

    const auto cut = static_cast<std::size_t>(random.below(static_cast<int>(size)));
    ByteReader shorter(std::span<const std::byte>(body.bytes).first(cut));
    CHECK_FALSE((read_announced(shorter, announced_read) &&
                 read_requested(shorter, requested_read) && read_frame(shorter, frame_read)));
  }
}

TEST_CASE("wire: records of a chunk come back as they were, and no others") {
  oracle::Random random(oracle::announce_seed(603));
  for (int round = 0; round < 2000; ++round) {
    Body body;
    std::vector<ChunkRecord> records;
    std::vector<std::vector<std::byte>> codes;
    VersionRange range{1 + any_number(random) / 4, 0};
    std::uint32_t version = range.first - 1;
    for (int i = random.below(12); i > 0; --i) {
      version += 1 + static_cast<std::uint32_t>(random.below(random.below(5) == 0 ? 100000 : 3));
      codes.emplace_back(static_cast<std::size_t>(random.below(80)));
      for (std::byte& byte : codes.back()) byte = static_cast<std::byte>(random.below(256));
      const auto part = std::min(static_cast<std::uint32_t>(random.below(4)), version - 1);
      records.push_back(
          {.block = {any_coordinate(random), any_coordinate(random), any_coordinate(random)},
           .version = {.number = version,
                       .first = version - part,
                       .layers = static_cast<std::uint8_t>(1 + random.below(15))},
           .coded = {}});
    }
    range.last = std::max(version, range.first) + static_cast<std::uint32_t>(random.below(5));
    RecordWriter writer(body.to, range);
    std::size_t written = 0;
    for (std::size_t i = 0; i < records.size(); ++i) {
      records[i].coded = codes[i];
      const std::size_t before = body.to.size();
      if (!writer.write(records[i])) break;
      ++written;
      CHECK(body.to.size() - before <= kMostRecordHeaderBytes + codes[i].size());
    }
    REQUIRE(written == records.size());
    ByteReader from = body.reader();
    RecordReader reader(from, {.range = range});
    for (const ChunkRecord& record : records) {
      ChunkRecord read;
      REQUIRE(reader.read(read));
      CHECK(read.block == record.block);
      CHECK(read.version.number == record.version.number);
      CHECK(read.version.first == record.version.first);
      CHECK(read.version.layers == record.version.layers);
      REQUIRE(read.coded.size() == record.coded.size());
      CHECK(std::equal(read.coded.begin(), read.coded.end(), record.coded.begin()));
    }
    CHECK(from.remaining() == 0);
    // Versions beyond the range are none of the chunk's.
    if (!records.empty()) {
      ByteReader again = body.reader();
      RecordReader short_of_one(again, {.range = {range.first, records.back().version.number - 1}});
      ChunkRecord read;
      std::size_t fine = 0;
      while (fine < records.size() && short_of_one.read(read)) ++fine;
      CHECK(fine < records.size());
    }
  }
}

TEST_CASE("wire: any bytes are read within their bounds") {
  oracle::Random random(oracle::announce_seed(604));
  for (int round = 0; round < 200000; ++round) {
    // Of exactly the size, so that a sanitizer sees what is beyond.
    const std::vector<std::byte> bytes = [&] {
      std::vector<std::byte> any(static_cast<std::size_t>(random.below(80)));
      for (std::byte& byte : any)
        byte = static_cast<std::byte>(random.below(3) == 0 ? random.below(256) : random.below(3));
      return any;
    }();
    ByteReader from(bytes);
    ChunkHeader header;
    if (!read_chunk_header(from, header)) continue;
    CHECK(header.range.first >= 1);
    RecordReader reader(from, header);
    ChunkRecord record;
    std::uint32_t before = header.range.first - 1;
    while (from.remaining() != 0 && reader.read(record)) {
      REQUIRE(record.version.number > before);
      REQUIRE(record.version.number <= header.range.last);
      REQUIRE(record.version.first >= 1);
      REQUIRE(record.version.layers != 0);
      REQUIRE(pack(record.block).ok());
      before = record.version.number;
    }
  }
}

}  // namespace
}  // namespace tessera
