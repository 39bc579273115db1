// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Outputs that are under way: which blocks go together, and that this does not show in them.
#include "tessera/fusion/internal/output_job.hpp"

#include <catch2/catch.hpp>
#include <map>
#include <set>
#include <vector>

#include "support/sample_content.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace tessera {
namespace {

constexpr int kComponents = 5;
constexpr std::uint32_t kBlocks = 256;
constexpr double kResolution_m = 0.1;

DiffusionConfig config_of(int iterations) {
  DiffusionConfig config;
  config.iterations = iterations;
  return config;
}

/// Blocks of the graph with their sums, and a job.
struct Bench {
  explicit Bench(const DiffusionConfig& config)
      : memory(GlobalRecords::required_bytes(kBlocks) + SegmentStore::required_bytes(4 * kSums) +
               OutputJob::required_bytes(config, kResolution_m, kComponents)),
        scratch(most_packed_bytes(kComponents)) {
    Arena arena = memory.arena();
    records = *GlobalRecords::make(arena, kBlocks, 0);
    sums = *SumStore::make(arena, 4 * kSums, scratch);
    job = *OutputJob::make(arena, config, kResolution_m, kComponents);
  }
  /// Gives a block nodes with evidence of a class each; its output waits then.
  std::uint32_t add(BlockCoord block) {
    REQUIRE(records.mark_sums({block, block}, UpdatePart::kUpdate));
    const std::uint32_t number = records.find(block);
    OwnContent content(kComponents);
    for (int row = 0; row < kBlockVoxels; row += 37)
      content->add(1 + row % 3, row, 1.0F + static_cast<float>(row % 7));
    GlobalRecord& record = records.at(number);
    REQUIRE(sums.keep(record.sums, *content) == SumStore::Kept::kAnew);
    record.sums.classes = 0b1110;
    records.take_off(number);
    records.mark(number, Agenda::kOutput);
    return number;
  }
  /// Goes on until results are there.
  void finish() {
    int steps = 0;
    while (!job.finishing()) {
      REQUIRE(job.work_on(records, sums) > 0);
      REQUIRE(++steps < 100);
    }
  }
  /// Evidence of a block's nodes after the last iteration, by row.
  std::map<int, std::vector<float>> results(BlockCoord block) {
    std::map<int, std::vector<float>> all;
    std::uint64_t work = 0;
    for (int row = 0; row < kBlockVoxels; row += 37) {
      const auto result = job.brick().result(voxel_of_row(block, row), work);
      all[row] = std::vector<float>(result.sigma, result.sigma + job.brick().lanes().size());
    }
    return all;
  }
  static constexpr std::uint32_t kSums = kBlocks;

  AlignedMemory memory;
  std::vector<std::byte> scratch;
  GlobalRecords records;
  SumStore sums;
  OutputJob job;
};

}  // namespace

TEST_CASE("OutputJob: blocks that wait in one cube go together and leave the agenda") {
  Bench bench(config_of(2));
  const std::uint32_t first = bench.add({0, 0, 0});
  bench.add({1, 0, 0});
  bench.add({0, 7, 7});
  const std::uint32_t far = bench.add({8, 0, 0});  // in the next cube
  CHECK_FALSE(bench.job.busy());
  CHECK(bench.job.begin(bench.records, bench.sums, first) > 0);
  CHECK(bench.job.busy());
  CHECK(bench.job.waiting() == 3);
  CHECK_FALSE(bench.records.waits_for_output(first));
  CHECK(bench.records.waits_for_output(far));
  CHECK(bench.records.waiting() == 1);
}

TEST_CASE("OutputJob: cubes lie alike on both sides of zero") {
  Bench bench(config_of(2));
  const std::uint32_t below = bench.add({-1, -1, -1});
  bench.add({-8, -8, -8});
  bench.add({0, 0, 0});
  bench.add({-9, -1, -1});
  bench.job.begin(bench.records, bench.sums, below);
  CHECK(bench.job.waiting() == 2);
}

TEST_CASE("OutputJob: each block is finished once, and then the job is over") {
  Bench bench(config_of(2));
  std::set<std::uint32_t> wanted;
  for (int x = 0; x < 4; ++x) wanted.insert(bench.add({x, 0, 0}));
  bench.job.begin(bench.records, bench.sums, *wanted.begin());
  CHECK_FALSE(bench.job.finishing());
  bench.finish();
  std::set<std::uint32_t> finished;
  while (bench.job.busy()) {
    REQUIRE(bench.job.finishing());
    CHECK(finished.insert(bench.job.next()).second);
    CHECK(bench.job.waiting() == wanted.size() - finished.size() + 1);
    bench.job.done();
  }
  CHECK(finished == wanted);
  CHECK(bench.job.waiting() == 0);
  // Another one may begin.
  bench.records.mark(*wanted.begin(), Agenda::kOutput);
  bench.job.begin(bench.records, bench.sums, *wanted.begin());
  CHECK(bench.job.waiting() == 1);
}

TEST_CASE("OutputJob: a block's result is the same bits whatever goes through with it") {
  const BlockCoord block{3, 3, 3};
  Bench alone(config_of(4));
  Bench together(config_of(4));
  const std::vector<BlockCoord> all{block, {2, 3, 3}, {4, 3, 3}, {3, 4, 3}, {3, 3, 2}, {6, 6, 6}};
  for (const BlockCoord each : all) {
    const std::uint32_t number = alone.add(each);
    if (!(each == block)) alone.records.take_off(number);
    together.add(each);
  }
  alone.job.begin(alone.records, alone.sums, alone.records.find(block));
  together.job.begin(together.records, together.sums, together.records.find(block));
  REQUIRE(alone.job.waiting() == 1);
  REQUIRE(together.job.waiting() == all.size());
  alone.finish();
  together.finish();
  CHECK(alone.results(block) == together.results(block));
}

TEST_CASE("OutputJob: without an iteration the result is the sum itself") {
  Bench bench(config_of(0));
  const std::uint32_t number = bench.add({0, 0, 0});
  bench.job.begin(bench.records, bench.sums, number);
  bench.finish();
  REQUIRE(bench.job.brick().lanes().size() == 3);
  for (const auto& [row, z] : bench.results({0, 0, 0})) {
    for (std::size_t lane = 0; lane < z.size(); ++lane) {
      const bool is_class = bench.job.brick().lanes()[lane] == 1 + row % 3;
      CHECK(z[lane] == (is_class ? 1.0F + static_cast<float>(row % 7) : 0.0F));
    }
  }
}

TEST_CASE("OutputJob: a block's sums matter to those within as many blocks as the halo takes") {
  const Bench bench(config_of(8));
  const int halo = bench.job.brick().halo();
  REQUIRE(halo > 0);
  const int blocks = (halo + kBlockEdge - 1) / kBlockEdge;
  const GridTransform::BlockRange around = bench.job.around({10, -10, 0});
  CHECK(around.first == BlockCoord{10 - blocks, -10 - blocks, -blocks});
  CHECK(around.last == BlockCoord{10 + blocks, -10 + blocks, blocks});
}

TEST_CASE("OutputJob: memory that is too small is refused") {
  const DiffusionConfig config = config_of(2);
  AlignedMemory memory(OutputJob::required_bytes(config, kResolution_m, kComponents) - 1);
  Arena arena = memory.arena();
  CHECK(OutputJob::make(arena, config, kResolution_m, kComponents).status() ==
        Status::kResourceExhausted);
}

}  // namespace tessera
