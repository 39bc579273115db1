// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a file's header says that the file holds, against all of its voxels one by one.
#include <catch2/catch.hpp>

#include "stored_bytes.hpp"
#include "support/sample_map.hpp"
#include "tessera/map/map_summary.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

MapSummary summary_of(const LocalMap& map) {
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  return summarize(map, workspace);
}

/// Voxel by voxel, by the queries that users have.
MapSummary counted(const LocalMap& map) {
  MapSummary all;
  all.digest = digest_of(map);
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  for_each_observed(map, workspace, [&](const VoxelCoord& v, const VoxelEvidence& evidence) {
    if (all.observed() == 0) all.low = all.high = v;
    all.low = {std::min(all.low.x, v.x), std::min(all.low.y, v.y), std::min(all.low.z, v.z)};
    all.high = {std::max(all.high.x, v.x), std::max(all.high.y, v.y), std::max(all.high.z, v.z)};
    bool has_labels = evidence.rest > 0.0F;
    for (std::size_t l = 1; l < static_cast<std::size_t>(evidence.num_components); ++l)
      has_labels = has_labels || evidence.sigma[l] > 0.0F;
    ++(has_labels ? all.label_voxels : all.free_voxels);
    const Estimate e = estimate(evidence, map.config().prior);
    const bool occupied = e.state == VoxelState::kOccupied;
    ++(occupied ? all.occupied : all.free);
    if (occupied) ++all.occupied_by_label[static_cast<std::size_t>(e.label)];
  });
  return all;
}

StoredBytes stored_with(const LocalMap& map, const MapSummary& summary) {
  LimitedSink sink;
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  MapFileBuffer buffer;
  REQUIRE(save(map, {}, workspace, buffer, sink.sink(), &summary).ok());
  return sink.bytes;
}

}  // namespace

TEST_CASE("a summary counts each observed voxel once") {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const SmallMap sample = sample_map(seed, 400, 20);
    const MapSummary summary = summary_of(sample.map);
    CHECK(summary == counted(sample.map));
    CHECK(summary.label_voxels == sample.map.usage().label_voxels);
    CHECK(summary.free_voxels == sample.map.count_free_voxels());
    CHECK(summary.occupied > 0);
    CHECK(summary.free > 0);
  }
}

TEST_CASE("a summary of nothing has no voxels") {
  const SmallMap sample = sample_map(1, 0);
  const MapSummary summary = summary_of(sample.map);
  CHECK(summary.observed() == 0);
  CHECK(summary.digest == digest_of(sample.map));
}

TEST_CASE(
    "a file's header has the summary that it was given, and a map saved again gives the file") {
  const SmallMap sample = sample_map(4, 400, 20);
  const MapSummary summary = summary_of(sample.map);
  const StoredBytes bytes = stored_with(sample.map, summary);
  MapFileHeader header;
  REQUIRE(read_header(bytes, header).ok());
  REQUIRE(header.summary);
  CHECK(*header.summary == summary);
  const auto again = loaded(bytes);
  CHECK(summary_of(again->map) == summary);
  CHECK(stored_with(again->map, summary) == bytes);
  // Without one, as it was given none.
  REQUIRE(read_header(stored(sample.map), header).ok());
  CHECK_FALSE(header.summary);
}

TEST_CASE("a summary that no map can have is refused") {
  const SmallMap sample = sample_map(6, 200);
  const MapSummary good = summary_of(sample.map);
  const auto status = [&](const MapSummary& summary) {
    MapFileHeader header;
    return read_header(stored_with(sample.map, summary), header).status;
  };
  REQUIRE(status(good) == Status::kOk);
  const auto changed = [&](auto&& change) {
    MapSummary bad = good;
    change(bad);
    return status(bad);
  };
  CHECK(changed([](MapSummary& s) { ++s.label_voxels; }) == Status::kCorrupt);
  CHECK(changed([](MapSummary& s) { ++s.free_voxels; }) == Status::kCorrupt);
  CHECK(changed([](MapSummary& s) { ++s.occupied; }) == Status::kCorrupt);
  CHECK(changed([](MapSummary& s) { ++s.occupied_by_label[1]; }) == Status::kCorrupt);
  CHECK(changed([](MapSummary& s) { s.low.x = s.high.x + 1; }) == Status::kCorrupt);
  CHECK(changed([](MapSummary& s) { s.high.z = 1 << 30; }) == Status::kCorrupt);
  // Sums that are right by wrapping around.
  CHECK(changed([](MapSummary& s) {
          s.label_voxels -= 1ULL << 63U;
          s.free_voxels -= 1ULL << 63U;
        }) == Status::kCorrupt);
}

TEST_CASE("the end of a file is told from any other bytes") {
  const StoredBytes bytes = stored(sample_map(7).map);
  MapFileHeader header;
  REQUIRE(read_header(bytes, header).ok());
  std::array<std::byte, kMapFileEndBytes> end{};
  const auto at = [&](std::size_t last) {
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(last - end.size()), end.size(),
                end.begin());
    return is_end_of(header, end);
  };
  CHECK(at(bytes.size()));
  for (std::size_t last = header.header_bytes + end.size(); last < bytes.size(); ++last)
    CHECK_FALSE(at(last));
}

}  // namespace tessera
