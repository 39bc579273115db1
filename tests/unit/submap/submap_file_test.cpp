// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The table of submaps: what is written is read, and nothing that was damaged is.
#include "tessera/submap/submap_file.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "support/random.hpp"
#include "tessera/base/internal/quaternion.hpp"

namespace tessera {
namespace {

struct Bytes {
  std::vector<std::byte> all;
  std::size_t at = 0;
  std::size_t room = SIZE_MAX;
  ByteSink sink() {
    return {this, [](void* self, std::span<const std::byte> bytes) {
              auto& to = *static_cast<Bytes*>(self);
              if (to.all.size() + bytes.size() > to.room) return false;
              to.all.insert(to.all.end(), bytes.begin(), bytes.end());
              return true;
            }};
  }
  ByteSource source() {
    return {this, [](void* self, std::span<std::byte> into) {
              auto& from = *static_cast<Bytes*>(self);
              const std::size_t n = std::min(into.size(), from.all.size() - from.at);
              std::copy_n(from.all.begin() + static_cast<std::ptrdiff_t>(from.at), n, into.begin());
              from.at += n;
              return n;
            }};
  }
};

std::vector<SubmapRow> drawn_rows(std::uint32_t count) {
  oracle::Random random(72);
  std::vector<SubmapRow> rows(count);
  std::uint64_t offset = 4000;
  for (std::uint32_t i = 0; i < count; ++i) {
    Quaternion q{1.0, random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    normalise(q);
    rows[i] = {
        .number = 2 * i,
        .revision = 1 + i,
        .first_scan = 10 * i,
        .last_scan = 10 * i + 9,
        .length_m = random.uniform(0, 30),
        .T_map_submap = *encode_rigid(transform_of(q, {random.uniform(-900, 900), 5.0, -0.25})),
        .offset_bytes = offset,
        .bytes = 1000 + i,
        .digest = random.bits(),
        .label_voxels = 7 * i,
        .free_voxels = 3 * i,
        .occupied = 6 * i};
    offset += rows[i].bytes;
  }
  return rows;
}

/// A file whose submaps are zeros.
Bytes file_of(const std::vector<SubmapRow>& rows) {
  Bytes file;
  file.all.resize(rows.empty() ? 4000 : rows.back().offset_bytes + rows.back().bytes);
  REQUIRE(save_submap_table(rows, file.all.size(), file.sink()).ok());
  return file;
}

MapFileStatus load(Bytes file, std::vector<SubmapRow>& rows) {
  if (file.all.size() < SubmapTableEnd::kBytes) return {Status::kTruncated, "", 0};
  SubmapTableEnd end;
  const MapFileStatus found = load_submap_end(
      std::span(std::as_const(file.all)).last<SubmapTableEnd::kBytes>(), file.all.size(), end);
  if (!found.ok()) return found;
  rows.assign(end.submaps, {});
  file.at = end.offset_bytes;
  return load_submap_table(file.source(), end, rows);
}

TEST_CASE("submap table: what is written is read") {
  for (const std::uint32_t count : {0U, 1U, 2U, 100U}) {
    const std::vector<SubmapRow> rows = drawn_rows(count);
    std::vector<SubmapRow> read;
    REQUIRE(load(file_of(rows), read).ok());
    CHECK(read == rows);
  }
}

TEST_CASE("submap table: cut short or with a bit flipped it is refused") {
  const std::vector<SubmapRow> rows = drawn_rows(3);
  const Bytes whole = file_of(rows);
  const std::size_t table = rows.back().offset_bytes + rows.back().bytes;
  std::vector<SubmapRow> read;
  for (std::size_t size = table; size < whole.all.size(); ++size) {
    Bytes cut = whole;
    cut.all.resize(size);
    CHECK_FALSE(load(cut, read).ok());
  }
  for (std::size_t at = table; at < whole.all.size(); ++at) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      Bytes flipped = whole;
      flipped.all[at] ^= std::byte{1} << bit;
      CHECK_FALSE(load(flipped, read).ok());
    }
  }
}

TEST_CASE("submap table: rows that are out of order or overlap are refused") {
  const auto refused = [](auto&& change) {
    std::vector<SubmapRow> rows = drawn_rows(3);
    const std::vector<SubmapRow> sound = rows;
    change(rows);
    Bytes file;
    file.all.resize(sound.back().offset_bytes + sound.back().bytes);
    REQUIRE(save_submap_table(rows, file.all.size(), file.sink()).ok());
    std::vector<SubmapRow> read;
    return load(file, read).status == Status::kCorrupt;
  };
  using Rows = std::vector<SubmapRow>;
  CHECK_FALSE(refused([](Rows&) {}));
  CHECK(refused([](Rows& rows) { rows[2].number = rows[1].number; }));
  CHECK(refused([](Rows& rows) { rows[1].offset_bytes = rows[0].offset_bytes; }));
  CHECK(refused([](Rows& rows) { rows[0].bytes += 1; }));
  CHECK(refused([](Rows& rows) { rows[2].bytes += 1; }));
  CHECK(refused([](Rows& rows) { rows[2].offset_bytes = UINT64_MAX - 10; }));
  CHECK(refused([](Rows& rows) { rows[1].revision = 0; }));
  CHECK(refused([](Rows& rows) { rows[1].last_scan = rows[1].first_scan - 1; }));
  CHECK(refused([](Rows& rows) { rows[1].length_m = -1.0; }));
  CHECK(refused([](Rows& rows) { rows[1].length_m = std::nan(""); }));
  CHECK(refused([](Rows& rows) { rows[1].T_map_submap.largest = 9; }));
}

TEST_CASE("submap table: a sink that refuses is said") {
  const std::vector<SubmapRow> rows = drawn_rows(2);
  for (const std::size_t room : {0U, 100U, 190U}) {
    Bytes file;
    file.room = room;
    CHECK(save_submap_table(rows, 0, file.sink()).status == Status::kIo);
  }
  Bytes file;
  const std::vector<SubmapRow> many(kMostSubmaps + 1);
  CHECK(save_submap_table(many, 0, file.sink()).status == Status::kInvalidArgument);
  CHECK(file.all.empty());
}

TEST_CASE("submap table: the digest covers numbers, frames and contents, and no more") {
  const std::vector<SubmapRow> rows = drawn_rows(3);
  const auto changed = [&](auto&& change) {
    std::vector<SubmapRow> other = rows;
    change(other[1]);
    return digest(other) != digest(rows);
  };
  CHECK(changed([](SubmapRow& row) { ++row.number; }));
  CHECK(changed([](SubmapRow& row) { ++row.T_map_submap.translation[2]; }));
  CHECK(changed([](SubmapRow& row) { ++row.T_map_submap.rotation[0]; }));
  CHECK(changed([](SubmapRow& row) { ++row.digest; }));
  CHECK_FALSE(changed([](SubmapRow& row) { ++row.revision; }));
  CHECK_FALSE(changed([](SubmapRow& row) { ++row.offset_bytes; }));
}

}  // namespace
}  // namespace tessera
