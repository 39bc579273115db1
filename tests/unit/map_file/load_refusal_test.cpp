// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Sound files that cannot go where they are asked to go.
#include <catch2/catch.hpp>

#include "stored_bytes.hpp"
#include "support/sample_map.hpp"

namespace tessera {

namespace {

Status status_with(const StoredBytes& bytes, void (*change)(MapConfig&)) {
  MapFileHeader header;
  REQUIRE(read_header(bytes, header).ok());
  change(header.config);
  LoadedMap target(header.config, header.classes);
  const Status status = read_into(bytes, target.map).status;
  if (status != Status::kOk) CHECK(target.map.block_count() == 0);
  return status;
}

}  // namespace

TEST_CASE("a map made with another setting does not match") {
  const StoredBytes bytes = stored(sample_map(1).map);
  CHECK(status_with(bytes, [](MapConfig&) {}) == Status::kOk);
  CHECK(status_with(bytes, [](MapConfig& c) { c.resolution_m = 0.2; }) == Status::kMismatch);
  CHECK(status_with(bytes, [](MapConfig& c) { c.prior = 0.01; }) == Status::kMismatch);
  CHECK(status_with(bytes, [](MapConfig& c) { c.max_evidence = 50.0F; }) == Status::kMismatch);
  CHECK(status_with(bytes, [](MapConfig& c) { c.free_weight = 0.5F; }) == Status::kMismatch);
}

TEST_CASE("a map made with other classes does not match") {
  const StoredBytes bytes = stored(sample_map(1).map);
  MapFileHeader header;
  REQUIRE(read_header(bytes, header).ok());
  REQUIRE(header.classes.add("one more", {}) == Status::kOk);
  LoadedMap target(header.config, header.classes);
  CHECK(read_into(bytes, target.map).status == Status::kMismatch);
}

TEST_CASE("a map that is not empty does not match, and keeps what it has") {
  SmallMap target = sample_map(2);
  const Content before = content_of(target.map);
  const StoredBytes bytes = stored(target.map);
  CHECK(read_into(bytes, target.map).status == Status::kMismatch);
  CHECK(content_of(target.map) == before);
}

TEST_CASE("more storage than needed is fine") {
  const StoredBytes bytes = stored(sample_map(1).map);
  CHECK(status_with(bytes, [](MapConfig& c) { c.storage_bytes *= 3; }) == Status::kOk);
}

TEST_CASE("a storage that is too small is exhausted, and the map is left empty") {
  const SmallMap large = sample_map(3, 1500, 120, 800);
  const StoredBytes bytes = stored(large.map);
  CHECK(status_with(bytes, [](MapConfig& c) { c.storage_bytes = 4 * SlabPool::kPageBytes; }) ==
        Status::kResourceExhausted);
}

TEST_CASE("the storage that the header names is enough") {
  for (const std::uint64_t seed : {4U, 5U, 6U}) {
    const SmallMap sample = sample_map(seed, 1500, 120, 800);
    CHECK(status_with(stored(sample.map), [](MapConfig&) {}) == Status::kOk);
  }
}

TEST_CASE("what cannot be saved or read is an invalid argument, and nothing is written") {
  const SmallMap sample = sample_map(1);
  std::vector<KeyedIndex> workspace(2 * sample.map.block_count());
  MapFileBuffer buffer;
  LimitedSink sink{.limit = 100000};
  MapIdentity identity;
  identity.settings_bytes = MapIdentity::kMaxSettings + 1;
  CHECK(save(sample.map, identity, workspace, buffer, sink.sink()).status ==
        Status::kInvalidArgument);
  CHECK(save(sample.map, {}, workspace, buffer, ByteSink{}).status == Status::kInvalidArgument);
  CHECK(save(sample.map, {}, std::span(workspace).first(1), buffer, sink.sink()).status ==
        Status::kInvalidArgument);
  CHECK(save(LocalMap{}, {}, workspace, buffer, sink.sink()).status == Status::kInvalidArgument);
  CHECK(sink.bytes.empty());
  MapFileHeader header;
  CHECK(load_header(ByteSource{}, buffer, header).status == Status::kInvalidArgument);
  REQUIRE(read_header(stored(sample.map), header).ok());
  LoadedMap target(header.config, header.classes);
  CHECK(load_blocks(ByteSource{}, header, buffer, target.map).status == Status::kInvalidArgument);
}

TEST_CASE("a sink that refuses at any place ends saving as input/output failed") {
  const SmallMap sample = sample_map(7, 6, 3);
  const std::size_t whole = stored(sample.map).size();
  std::vector<KeyedIndex> workspace(2 * sample.map.block_count());
  MapFileBuffer buffer;
  for (std::size_t limit = 0; limit < whole; ++limit) {
    LimitedSink sink{.limit = limit};
    CHECK(save(sample.map, {}, workspace, buffer, sink.sink()).status == Status::kIo);
  }
  LimitedSink enough{.limit = whole};
  CHECK(save(sample.map, {}, workspace, buffer, enough.sink()).ok());
}

}  // namespace tessera
