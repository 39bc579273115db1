// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Newer and hostile files whose checksums fit: what the version rule promises, and that no value is
// trusted because its checksum is right.
#include <catch2/catch.hpp>
#include <limits>

#include "stored_bytes.hpp"
#include "support/sample_map.hpp"

namespace tessera {

namespace {

// Offsets in the file. The header's body is laid out in docs/reference/memory.md.
constexpr std::size_t kMajor = 8;
constexpr std::size_t kMinor = 10;
constexpr std::size_t kKind = kBodyOffset;
constexpr std::size_t kTuple = kBodyOffset + 1;
constexpr std::size_t kNumClasses = kBodyOffset + 2;
constexpr std::size_t kBlocks = kBodyOffset + 4 + 16 + 8 + 12 + 96;
constexpr std::size_t kSettingsBytes =
    kBlocks + 32 + kSampleClasses * (SemanticClass::kNameBytes + 3);

StoredBytes with_byte(const StoredBytes& bytes, std::size_t at, unsigned value) {
  return with_header(bytes, [&](StoredBytes& b) { b[at] = static_cast<std::byte>(value); });
}

Status header_status(const StoredBytes& bytes) {
  MapFileHeader header;
  return read_header(bytes, header).status;
}

}  // namespace

TEST_CASE("another major version is refused as not supported") {
  const StoredBytes bytes = stored(sample_map(1).map);
  CHECK(header_status(with_byte(bytes, kMajor, 1)) == Status::kUnsupported);
  CHECK(header_status(with_byte(bytes, kMajor, 3)) == Status::kUnsupported);
  CHECK(header_status(with_byte(bytes, kMajor + 1, 1)) == Status::kUnsupported);
}

TEST_CASE("a newer minor version is read, whatever it appended to the header") {
  const SmallMap sample = sample_map(1);
  for (const std::size_t appended : {0U, 1U, 5U, 500U}) {
    const StoredBytes newer = with_header(stored(sample.map), [&](StoredBytes& bytes) {
      bytes[kMinor] = std::byte{9};
      bytes.resize(bytes.size() + appended, std::byte{0xA5});
    });
    CHECK(content_of(loaded(newer)->map) == content_of(sample.map));
  }
}

TEST_CASE("a kind or a tuple policy of the future is refused as not supported") {
  const StoredBytes bytes = stored(sample_map(1).map);
  CHECK(header_status(with_byte(bytes, kKind, 2)) == Status::kOk);  // in submaps
  CHECK(header_status(with_byte(bytes, kKind, 3)) == Status::kUnsupported);
  CHECK(header_status(with_byte(bytes, kTuple, 77)) == Status::kUnsupported);
}

TEST_CASE("a number of classes that no table has is refused") {
  const StoredBytes bytes = stored(sample_map(1).map);
  CHECK(header_status(with_byte(bytes, kNumClasses, 0)) == Status::kCorrupt);
  CHECK(header_status(with_byte(bytes, kNumClasses, kMaxClasses + 1)) == Status::kCorrupt);
  CHECK(header_status(with_byte(bytes, kNumClasses, 255)) == Status::kCorrupt);
}

TEST_CASE(
    "a T_global_map that is not rigid is refused, and one that is not there is not looked at") {
  MapIdentity identity{.has_T_global_map = true};
  CHECK(header_status(stored(sample_map(1).map, identity)) == Status::kOk);
  for (const double entry : {2.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    identity.has_T_global_map = true;
    identity.T_global_map(1, 1) = entry;
    CHECK(header_status(stored(sample_map(1).map, identity)) == Status::kCorrupt);
    identity.has_T_global_map = false;
    CHECK(header_status(stored(sample_map(1).map, identity)) == Status::kOk);
  }
}

TEST_CASE("settings longer than their place are refused") {
  const StoredBytes bytes = stored(sample_map(1).map);
  CHECK(header_status(with_byte(bytes, kSettingsBytes + 1, 0xFF)) == Status::kCorrupt);
  CHECK(header_status(with_byte(bytes, kSettingsBytes, 1)) == Status::kCorrupt);
}

TEST_CASE("a header shorter than its fields is refused at any length") {
  const StoredBytes bytes = stored(sample_map(1).map);
  const std::size_t whole = header_bytes(bytes) - 4;
  for (std::size_t length = kBodyOffset; length < whole; ++length) {
    INFO("header of " << length << " of " << whole << " bytes");
    CHECK(header_status(with_header(bytes, [&](StoredBytes& b) { b.resize(length); })) ==
          Status::kCorrupt);
  }
}

TEST_CASE("a header longer than any version's is refused") {
  const StoredBytes longer = with_header(stored(sample_map(1).map),
                                         [](StoredBytes& b) { b.resize(100000, std::byte{1}); });
  CHECK(header_status(longer) == Status::kCorrupt);
}

TEST_CASE("counts that contradict each other are refused") {
  const StoredBytes bytes = stored(sample_map(1).map);
  constexpr std::size_t kLabelPages = kBlocks + 8;
  constexpr std::size_t kFreePages = kBlocks + 16;
  constexpr std::size_t kOctets = kBlocks + 24;
  for (const std::size_t at : {kBlocks, kLabelPages, kFreePages, kOctets}) {
    CHECK(header_status(with_byte(bytes, at + 7, 0x7F)) == Status::kCorrupt);
  }
}

TEST_CASE("a header with a setting that no map can have is refused") {
  const StoredBytes bytes = stored(sample_map(1).map);
  constexpr std::size_t kResolution = kBodyOffset + 4;
  constexpr std::size_t kPrior = kResolution + 8;
  constexpr std::size_t kMaxEvidence = kPrior + 8;
  constexpr std::size_t kFreeWeight = kMaxEvidence + 4;
  CHECK(header_status(with_byte(bytes, kResolution + 7, 0xBF)) == Status::kCorrupt);   // negative
  CHECK(header_status(with_byte(bytes, kPrior + 7, 0xFF)) == Status::kCorrupt);        // negative
  CHECK(header_status(with_byte(bytes, kMaxEvidence + 3, 0x7F)) == Status::kCorrupt);  // huge
  CHECK(header_status(with_byte(bytes, kFreeWeight + 3, 0xBE)) == Status::kCorrupt);   // negative
  CHECK(header_status(with_byte(bytes, kBodyOffset + 3, 2)) == Status::kCorrupt);      // a flag
}

TEST_CASE("a setting that is not a number is refused") {
  const StoredBytes bytes = stored(sample_map(1).map);
  for (const std::size_t setting : {kBodyOffset + 4, kBodyOffset + 4 + 8}) {
    const StoredBytes nan = with_header(bytes, [&](StoredBytes& b) {
      b[setting + 7] = std::byte{0x7F};
      b[setting + 6] = std::byte{0xF8};
    });
    CHECK(header_status(nan) == Status::kCorrupt);
  }
}

TEST_CASE("a class name with more after its end is refused: it could not be saved again") {
  const StoredBytes bytes = stored(sample_map(1).map);
  CHECK(header_status(with_byte(bytes, kBlocks + 32 + 30, 'x')) == Status::kCorrupt);
  CHECK(header_status(with_byte(bytes, kBlocks + 32 + 31, 'x')) == Status::kCorrupt);
}

TEST_CASE("content that no map has storage for is refused") {
  const StoredBytes bytes = stored(sample_map(1).map);
  const StoredBytes vast = with_header(bytes, [](StoredBytes& b) {
    // 2^31 and some blocks, all with labels, one octet in each
    b[kBlocks + 3] = b[kBlocks + 8 + 3] = b[kBlocks + 24 + 3] = std::byte{0x80};
  });
  CHECK(header_status(vast) == Status::kCorrupt);
}

TEST_CASE("a header that promises fewer blocks than follow is refused when they follow") {
  const SmallMap sample = sample_map(1);
  const StoredBytes bytes = stored(sample.map);
  const auto blocks = std::to_integer<unsigned>(bytes[kBlocks]);
  REQUIRE(blocks > 2);
  const std::unique_ptr<LoadedMap> target = loaded(bytes);
  for (const unsigned claimed : {blocks - 1, blocks + 1}) {
    target->map.clear();
    CHECK(read_into(with_byte(bytes, kBlocks, claimed), target->map).status != Status::kOk);
    CHECK(target->map.block_count() == 0);
  }
}

}  // namespace tessera
