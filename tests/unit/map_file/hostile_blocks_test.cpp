// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Files whose checksums fit and whose blocks no map could have written: refused, so that what is
// loaded keeps every promise that a map makes.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "stored_bytes.hpp"
#include "support/sample_map.hpp"
#include "tessera/base/internal/crc32.hpp"

namespace tessera {

namespace {

constexpr std::size_t kMaxEvidence = kBodyOffset + 4 + 16;
constexpr std::size_t kRevision = kMaxEvidence + 8 + 8;
constexpr std::size_t kOctets = kRevision + 4 + 96 + 24;
constexpr std::size_t kHeadBytes = 21 + 4;

/// A map of one octet of labels in one block, and one voxel of free space in another.
StoredBytes two_blocks() {
  SmallMap sample(config_of_pages(8), kSampleClasses);
  sample.map.begin_revision();
  observe(sample.map, {{{0, 0, 0}, 1, 9.0F}, {{40, 0, 0}, 0}});
  return stored(sample.map);
}

/// Loads bytes into a map with ample storage; it must be empty after a refusal.
MapFileStatus status_of(const StoredBytes& bytes) {
  MapFileHeader header;
  const MapFileStatus status = read_header(bytes, header);
  if (!status.ok()) return status;
  header.config.storage_bytes += 16 * SlabPool::kPageBytes;
  LoadedMap target(header.config, header.classes);
  const MapFileStatus loaded = read_into(bytes, target.map);
  CHECK((loaded.ok() || target.map.block_count() == 0));
  return loaded;
}

/// Replaces count bytes from `from` on, and the checksum after them.
StoredBytes with_part(StoredBytes bytes, std::size_t from, std::size_t count,
                      const StoredBytes& part) {
  StoredBytes changed(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(from));
  changed.insert(changed.end(), part.begin(), part.end());
  const std::uint32_t crc = crc32c(part);
  for (unsigned i = 0; i < 4; ++i)
    changed.push_back(static_cast<std::byte>((crc >> (8 * i)) & 0xff));
  changed.insert(changed.end(), bytes.begin() + static_cast<std::ptrdiff_t>(from + count + 4),
                 bytes.end());
  return changed;
}

}  // namespace

TEST_CASE("the sound file is loaded") { CHECK(status_of(two_blocks()).ok()); }

TEST_CASE("evidence over the cap is refused") {
  const StoredBytes bytes = with_header(two_blocks(), [](StoredBytes& b) {
    const float cap = 8.0F;
    std::memcpy(&b[kMaxEvidence], &cap, sizeof cap);
  });
  CHECK(status_of(bytes).status == Status::kCorrupt);
}

TEST_CASE("a block newer than its map is refused") {
  const StoredBytes bytes =
      with_header(two_blocks(), [](StoredBytes& b) { b[kRevision] = std::byte{0}; });
  CHECK(status_of(bytes).status == Status::kCorrupt);
}

TEST_CASE("other content than the header says is refused") {
  const StoredBytes bytes =
      with_header(two_blocks(), [](StoredBytes& b) { b[kOctets] = std::byte{2}; });
  CHECK(status_of(bytes).status == Status::kCorrupt);
}

TEST_CASE("more content than the header says is refused before it takes storage") {
  const SmallMap large = sample_map(3, 1500, 120, 800);
  const StoredBytes bytes = stored(large.map);
  constexpr std::size_t kFreePages = kOctets - 8;
  const StoredBytes fewer = with_header(bytes, [](StoredBytes& b) {
    b[kFreePages] = std::byte{1};
    b[kFreePages + 1] = std::byte{0};
  });
  MapFileHeader header;
  REQUIRE(read_header(fewer, header).ok());
  LoadedMap target(header.config, header.classes);
  CHECK(read_into(fewer, target.map).status == Status::kCorrupt);
}

TEST_CASE("a free layer without a pass is refused") {
  const StoredBytes bytes = two_blocks();
  // header, first block (head; 1 + 2 + 5 bytes of labels; checksum), second block's head
  const std::size_t passes = header_bytes(bytes) + kHeadBytes + 8 + 4 + kHeadBytes;
  CHECK(status_of(with_part(bytes, passes, kBlockVoxels, StoredBytes(kBlockVoxels))).status ==
        Status::kCorrupt);
}

TEST_CASE("more passes than the cap allows are refused, in a voxel without labels too") {
  const StoredBytes bytes = two_blocks();
  const std::size_t passes = header_bytes(bytes) + kHeadBytes + 8 + 4 + kHeadBytes;
  StoredBytes most(kBlockVoxels);
  most[3] = std::byte{250};
  CHECK(status_of(with_part(bytes, passes, kBlockVoxels, most)).ok());
  most[3] = std::byte{251};
  const MapFileStatus status = status_of(with_part(bytes, passes, kBlockVoxels, most));
  CHECK(status.status == Status::kCorrupt);
  CHECK(status.what == std::string("a voxel has counts that no map can hold"));
}

TEST_CASE("a count outside of floor and ceiling is refused") {
  const StoredBytes bytes = with_header(two_blocks(), [](StoredBytes& b) {
    std::memset(&b[kMaxEvidence], 0, sizeof(float));  // no cap
  });
  const auto status_with = [&](float count) {
    StoredBytes labels(8);
    // Voxel 0, one count, a centroid, component 1.
    labels[0] = labels[1] = labels[2] = labels[3] = std::byte{1};
    std::memcpy(&labels[4], &count, sizeof(count));
    return status_of(with_part(bytes, header_bytes(bytes) + kHeadBytes, 8, labels)).status;
  };
  CHECK(status_with(kLeastCount) == Status::kOk);
  CHECK(status_with(kLargestCount) == Status::kOk);
  CHECK(status_with(std::nextafter(kLeastCount, 0.0F)) == Status::kCorrupt);
  CHECK(status_with(std::nextafter(kLargestCount, 3e30F)) == Status::kCorrupt);
  CHECK(status_with(1e-39F) == Status::kCorrupt);
}

TEST_CASE("a centroid that is none is refused") {
  const StoredBytes bytes = two_blocks();
  const auto status_with = [&](unsigned centroid) {
    StoredBytes labels(8);
    labels[0] = labels[1] = labels[3] = std::byte{1};
    labels[2] = static_cast<std::byte>(centroid);
    labels[7] = std::byte{0x3f};  // 0.5
    return status_of(with_part(bytes, header_bytes(bytes) + kHeadBytes, 8, labels)).status;
  };
  CHECK(status_with(216) == Status::kOk);
  CHECK(status_with(217) == Status::kCorrupt);
}

TEST_CASE("an octet without an observed voxel is refused") {
  const StoredBytes bytes = two_blocks();
  CHECK(status_of(with_part(bytes, header_bytes(bytes) + kHeadBytes, 8, StoredBytes(1))).status ==
        Status::kCorrupt);
}

TEST_CASE("damage in a block's labels is told at that block's end") {
  StoredBytes bytes = two_blocks();
  const std::size_t labels = header_bytes(bytes) + kHeadBytes;
  bytes[labels + 4] ^= std::byte{1};  // the count's lowest bit: a value as good as another
  CHECK(status_of(bytes).offset_bytes == labels + 8 + 4);
}

TEST_CASE("damage is told at its place in the file") {
  StoredBytes bytes = two_blocks();
  bytes.back() ^= std::byte{1};
  CHECK(status_of(bytes).offset_bytes == bytes.size());
  bytes = two_blocks();
  const std::size_t first_head_end = header_bytes(bytes) + kHeadBytes;
  bytes[first_head_end - 1] ^= std::byte{1};
  CHECK(status_of(bytes).offset_bytes == first_head_end);
}

}  // namespace tessera
