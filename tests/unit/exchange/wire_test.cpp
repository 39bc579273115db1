// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/wire.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "support/cloud.hpp"
#include "support/random.hpp"

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

TEST_CASE("wire: a header is 32 bytes that begin with TS and the format") {
  Body body;
  const DatagramHeader header{.kind = DatagramKind::kChunk,
                              .mission = 0x08070605,
                              .configuration = 0x04030201,
                              .sender = 7,
                              .session = std::uint64_t{8} << 32U | 9U,
                              .sequence = 0xffffffff};
  write_header(body.to, header);
  CHECK(body.to.size() == kHeaderBytes);
  const std::vector<int> wanted{'T', 'S', 2, 3, 5, 6, 7, 8, 1,   2,   3,   4,   7, 0, 0, 0,
                                9,   0,   0, 0, 8, 0, 0, 0, 255, 255, 255, 255, 0, 0, 0, 0};
  for (std::size_t i = 0; i < wanted.size(); ++i)
    CHECK(std::to_integer<int>(body.bytes[i]) == wanted[i]);
  DatagramHeader read;
  ByteReader from = body.reader();
  CHECK(read_header(from, read));
  CHECK(read.kind == header.kind);
  CHECK(read.configuration == header.configuration);
  CHECK(read.mission == header.mission);
  CHECK(read.session == header.session);
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
                                          .stated = random.below(2) == 0,
                                          .complete = random.below(2) == 0,
                                          .digest = random.bits()};
    REQUIRE(write_announced(body.to, announced));
    RequestedContribution requested{.id = id, .frame_revision = any_number(random)};
    requested.type = static_cast<RequestType>(random.below(3));
    requested.stated = random.below(2) == 0;
    requested.latest = requested.stated ? any_number(random) : 0;
    requested.target = requested.type == RequestType::kGaps ? 0 : any_number(random);
    requested.count = static_cast<std::uint8_t>(random.below(33));
    requested.width = static_cast<std::uint8_t>(random.below(16));
    std::uint32_t last = 0;
    for (std::size_t i = 0; i < requested.count; ++i) {
      const std::uint32_t first = last + 1 + any_number(random) / 128;
      last = first + any_number(random) / 128;
      requested.gap[i] = {first, last};
      requested.version[i] = first;
      requested.span[i] = static_cast<std::uint32_t>(7 * i);
    }
    REQUIRE(write_requested(body.to, requested));
    const Statement statement{
        .id = id,
        .range = {1 + any_number(random) / 4, 0x8000'0000U},
        .latest = any_number(random) / 2,
        .records = any_number(random),
        .fingerprint = {random.bits(), random.bits()},
        .frame_revision = 1 + any_number(random) / 2,
        .floor = id.epoch - static_cast<std::uint32_t>(random.below(2)) * (id.epoch / 2),
        .session_floor = id.epoch - static_cast<std::uint32_t>(random.below(2)) * (id.epoch / 2),
        .session = random.bits()};
    REQUIRE(write_statement(body.to, statement));
    const std::size_t size = body.to.size();

    ByteReader from = body.reader();
    AnnouncedContribution announced_read;
    RequestedContribution requested_read;
    Statement statement_read;
    REQUIRE(read_announced(from, announced_read));
    REQUIRE(read_requested(from, requested_read));
    REQUIRE(read_statement(from, statement_read));
    REQUIRE(from.remaining() == 0);
    CHECK((announced_read.id == id && announced_read.latest == announced.latest));
    CHECK((announced_read.complete == announced.complete &&
           announced_read.digest == announced.digest));
    CHECK((announced_read.stated == announced.stated && requested_read.type == requested.type &&
           requested_read.stated == requested.stated && requested_read.latest == requested.latest &&
           requested_read.target == requested.target));
    REQUIRE(requested_read.count == requested.count);
    for (std::size_t i = 0; i < requested.count; ++i) {
      if (requested.type == RequestType::kGaps) CHECK(requested_read.gap[i] == requested.gap[i]);
      if (requested.type == RequestType::kVersions)
        CHECK(requested_read.version[i] == requested.version[i]);
      if (requested.type == RequestType::kDescribe)
        CHECK(requested_read.span[i] == requested.span[i]);
    }
    CHECK((statement_read.id == id && statement_read.range == statement.range));
    CHECK(
        (statement_read.latest == statement.latest && statement_read.records == statement.records));
    CHECK(statement_read.fingerprint == statement.fingerprint);
    CHECK(statement_read.frame_revision == statement.frame_revision);
    CHECK((statement_read.floor == statement.floor &&
           statement_read.session_floor == statement.session_floor));
    CHECK(statement_read.session == statement.session);

    const auto cut = static_cast<std::size_t>(random.below(static_cast<int>(size)));
    ByteReader shorter(std::span<const std::byte>(body.bytes).first(cut));
    CHECK_FALSE((read_announced(shorter, announced_read) &&
                 read_requested(shorter, requested_read) &&
                 read_statement(shorter, statement_read)));
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
    RecordReader reader(from, range, false);
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
      RecordReader short_of_one(again, {range.first, records.back().version.number - 1}, false);
      ChunkRecord read;
      std::size_t fine = 0;
      while (fine < records.size() && short_of_one.read(read)) ++fine;
      CHECK(fine < records.size());
    }
  }
}

TEST_CASE("wire: descriptions come back as they were") {
  oracle::Random random(oracle::announce_seed(606));
  for (int round = 0; round < 2000; ++round) {
    Body body;
    Description description;
    description.span = {static_cast<std::uint8_t>(1 + random.below(20)),
                        static_cast<std::uint32_t>(random.below(1000))};
    description.is_list = random.below(2) == 0;
    if (description.is_list) {
      description.count = static_cast<std::uint8_t>(random.below(100));
      std::uint64_t version = description.span.first();
      for (std::size_t i = 0; i < description.count; ++i, ++version) {
        if (version > description.span.last()) description.count = static_cast<std::uint8_t>(i);
        if (i < description.count)
          description.record[i] = {static_cast<std::uint32_t>(version),
                                   static_cast<std::uint32_t>(random.bits())};
      }
      description.last = static_cast<std::uint32_t>(description.span.last());
    } else {
      const int bits = 1 + random.below(std::min(6, int{description.span.width}));
      description.part_width = static_cast<std::uint8_t>(description.span.width - bits);
      description.count = static_cast<std::uint8_t>(1 << bits);
      for (std::uint64_t& sum : description.sum) sum = random.bits();
    }
    const DescriptionHeader header{{1, 2, 3}, 4};
    write_description_header(body.to, header);
    REQUIRE(write_description(body.to, description));
    ByteReader from = body.reader();
    DescriptionHeader header_read;
    Description read;
    REQUIRE(read_description_header(from, header_read));
    REQUIRE(read_description(from, read));
    CHECK(from.remaining() == 0);
    CHECK(header_read.id == header.id);
    CHECK(header_read.target == header.target);
    CHECK(read.span == description.span);
    REQUIRE(read.is_list == description.is_list);
    REQUIRE(read.count == description.count);
    for (std::size_t i = 0; i < read.count; ++i) {
      if (!read.is_list) CHECK(read.sum[i] == description.sum[i]);
      if (read.is_list) CHECK(read.record[i].version == description.record[i].version);
      if (read.is_list) CHECK(read.record[i].mark == description.record[i].mark);
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
    if (!read_chunk_header(from, 1, header)) continue;
    CHECK(header.range.first >= 1);
    RecordReader reader(from, header.range, header.relayed);
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

TEST_CASE("wire: a span begins at a version that there may be") {
  const auto is_read = [](std::uint32_t index) {
    std::array<std::byte, 64> bytes{};
    ByteWriter to(bytes);
    RequestedContribution requested{.id = {1, 1, 0}};
    requested.type = RequestType::kDescribe;
    requested.width = 0;
    requested.count = 1;
    requested.span[0] = index;
    REQUIRE(write_requested(to, requested));
    ByteReader from(to.written());
    RequestedContribution read;
    return read_requested(from, read);
  };
  CHECK(is_read(kLastVersion - 1));
  CHECK_FALSE(is_read(kLastVersion));
}

}  // namespace
}  // namespace tessera
