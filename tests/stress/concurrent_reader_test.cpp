// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One thread writes to a map while others read it. What is written keeps to rules that any mixture
// of two states of an octet or a block, or of two blocks, would break. Run under ThreadSanitizer
// too: see .ci/run.
#include "race.hpp"
#include "tessera/inference/integrator.hpp"

namespace tessera {
namespace {

constexpr int kBlocks = 12;

BlockCoord block_number(int b) { return {b % 3 - 1, b / 3 - 2, -(b % 2)}; }

/// The two components that are ever written to an octet: of its block, and of its place there.
int block_component(int b) { return 1 + b % 6; }
int octet_component(int octet) { return 7 + octet % 6; }

/// Whether counts are of this octet and of one moment: its two components alike, no other.
bool is_whole(const VoxelEvidence& evidence, int b, int octet) {
  const float one = evidence.sigma[static_cast<std::size_t>(block_component(b))];
  const float two = evidence.sigma[static_cast<std::size_t>(octet_component(octet))];
  double others = evidence.total() - static_cast<double>(evidence.sigma[0]);
  others -= static_cast<double>(one) + static_cast<double>(two);
  return one == two && others == 0.0;
}

bool has_labels(const VoxelEvidence& evidence) {
  return evidence.total() > static_cast<double>(evidence.sigma[0]);
}

void read_voxel(MapReader& reader, oracle::Random& random, Findings& findings) {
  const int b = random.below(kBlocks);
  const int octet = random.below(kBlockOctets);
  const VoxelCoord voxel = voxel_at(block_number(b), octet, random.below(kOctetVoxels));
  const Result<VoxelEvidence> evidence = reader.evidence(voxel);
  if (!evidence.ok()) return;
  findings.torn += is_whole(*evidence, b, octet) ? 0U : 1U;
  findings.full += has_labels(*evidence) ? 1U : 0U;
}

/// All voxels of an octet alike and, without a cap, all passes of the block; tuples where voxels
/// are observed.
void read_block(MapReader& reader, oracle::Random& random, bool capped,
                std::span<std::byte> workspace, Findings& findings) {
  const int b = random.below(kBlocks);
  const Result<BlockSnapshot> block = reader.snapshot(block_number(b), workspace);
  if (!block.ok()) return;
  bool whole = true;
  for (int octet = 0; octet < kBlockOctets; ++octet) {
    const VoxelEvidence first = block->evidence(octet, 0);
    whole = whole && is_whole(first, b, octet);
    whole = whole && int{block->observed_labels(octet)} == (has_labels(first) ? 0xff : 0);
    for (int voxel = 0; voxel < kOctetVoxels; ++voxel) {
      const VoxelEvidence other = block->evidence(octet, voxel);
      whole = whole && other.sigma == first.sigma && other.rest == first.rest;
      const std::uint8_t like = block->free_passes(capped ? octet : 0, 0);
      whole = whole && block->free_passes(octet, voxel) == like;
    }
  }
  findings.torn += whole ? 0U : 1U;
  findings.full += block->empty() ? 0U : 1U;
}

/// Adds to octets, carves whole blocks, opens and closes others; every 16 rounds all is cleared.
void write_round(LocalMap& map, oracle::Random& random, int round) {
  if (round % 16 == 15) map.clear();
  map.begin_revision();
  for (int i = 0; i < 400; ++i) {
    const int b = random.below(kBlocks);
    const int octet = random.below(kBlockOctets);
    OctetEvidence added;
    for (const int component : {block_component(b), octet_component(octet)})
      added.plane(component).fill(static_cast<float>(1 + random.below(3)));
    added.plane(block_component(b)) = added.read(octet_component(octet));
    REQUIRE(map.add_labels(*map.open_block(block_number(b)), octet, added) == Status::kOk);
    const Result<SlabHandle> other = map.open_block({100 + random.below(500), 0, 0});
    REQUIRE(other.ok());
    if (i % 2 == 0) map.close_if_empty(*other);
    if (i % 40 != 0) continue;
    VoxelMask all;
    all.fill(~std::uint64_t{0});
    REQUIRE(map.add_free_pass(*map.open_block(block_number(b)), all) == Status::kOk);
  }
  map.close_empty_blocks();
}

}  // namespace

TEST_CASE("reader: a voxel's counts are of one moment, while octets and blocks come and go") {
  OwnedMap owned(config_of(GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact)));
  Findings findings;
  oracle::Random random(7);
  race(
      owned.map, findings, kVoxelReads, [&](int round) { write_round(owned.map, random, round); },
      [&](MapReader& reader, oracle::Random& own) { read_voxel(reader, own, findings); });
}

TEST_CASE("reader: a snapshot's octets and passes are of one moment") {
  const bool capped = GENERATE(false, true);
  OwnedMap owned(
      config_of(GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact), capped ? 40.0F : 0.0F));
  Findings findings;
  oracle::Random random(8);
  const std::size_t bytes = MapReader(owned.map).snapshot_bytes();
  race(
      owned.map, findings, kBlockReads, [&](int round) { write_round(owned.map, random, round); },
      [&](MapReader& reader, oracle::Random& own) {
        thread_local std::vector<std::uint64_t> workspace;
        workspace.resize(bytes / 8);
        read_block(reader, own, capped, std::as_writable_bytes(std::span(workspace)), findings);
      });
}

TEST_CASE("reader: the votes of a snapshot are of one moment") {
  MapConfig config = config_of(TuplePolicy::kCompact);
  config.label_votes = true;
  OwnedMap owned(config);
  const BlockCoord coord = block_number(0);
  const SlabHandle block = *owned.map.open_block(coord);
  REQUIRE(owned.map.open_label_layers(block, kAllLayers) == Status::kOk);
  // All cells of all classes of all layers have the same number at each moment.
  const auto write = [&](int round) {
    for (int i = 100 * round; i < 100 * (round + 1); ++i) {
      LabelVotes votes;
      votes.begun = true;
      for (auto& of_class : votes.votes) of_class.fill(static_cast<std::uint16_t>(1 + i % 8000));
      votes.labels.fill(static_cast<std::uint8_t>(1 + i % 4));
      owned.map.set_votes(block, static_cast<std::size_t>(i % kBlockLayers), votes);
    }
    std::this_thread::yield();
  };
  Findings findings;
  const std::size_t bytes = MapReader(owned.map).snapshot_bytes();
  race(owned.map, findings, kBlockReads, write, [&](MapReader& reader, oracle::Random&) {
    thread_local std::vector<std::uint64_t> workspace;
    workspace.resize(bytes / 8);
    const Result<BlockSnapshot> read =
        reader.snapshot(coord, std::as_writable_bytes(std::span(workspace)));
    if (!read.ok()) return;
    for (std::size_t layer = 0; layer < kBlockLayers; ++layer) {
      const LabelVotes votes = read->votes(layer);
      if (!votes.begun) continue;
      ++findings.full;
      const std::uint16_t first = votes.votes[0][0];
      bool same = votes.labels[0] == 1 + (first - 1) % 4;
      for (const auto& of_class : votes.votes)
        for (const std::uint16_t count : of_class) same = same && count == first;
      if (!same) ++findings.torn;
    }
  });
}

TEST_CASE("reader: scans are integrated with free space while others read") {
  OwnedMap owned(config_of(GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact)));
  InferenceConfig config;
  config.mode = InferenceMode::kCounting;
  config.thinning_m = 0.0;
  config.min_range_m = 0.0F;
  constexpr ScanCapacity kCapacity{.points = 8192, .tiles = 1024, .ray_blocks = 1024};
  AlignedMemory memory(Integrator::required_bytes(kCapacity, config));
  Arena arena = memory.arena();
  Result<Integrator> integrator = Integrator::make(arena, config, kCapacity);
  REQUIRE(integrator.ok());
  // Each voxel of some octets gets two returns, of the classes that read_voxel looks for.
  const auto write = [&](int round) {
    oracle::Random random(static_cast<std::uint64_t>(round));
    std::vector<float> points;
    std::vector<std::uint8_t> components;
    for (int i = 0; i < 60; ++i) {
      const int b = random.below(kBlocks);
      const int octet = random.below(kBlockOctets);
      for (int voxel = 0; voxel < kOctetVoxels; ++voxel) {
        const Point3d p = owned.map.lattice().center_of(voxel_at(block_number(b), octet, voxel));
        for (const int component : {block_component(b), octet_component(octet)}) {
          for (const double c : {p.x(), p.y(), p.z()}) points.push_back(static_cast<float>(c));
          components.push_back(static_cast<std::uint8_t>(component));
        }
      }
    }
    ScanView scan;
    scan.points = points.data();
    scan.count = components.size();
    scan.stride_floats = 3;
    scan.components = components.data();
    REQUIRE(integrator->integrate(owned.map, scan).left_out() == 0);
  };
  Findings findings;
  race(owned.map, findings, kVoxelReads, write,
       [&](MapReader& reader, oracle::Random& own) { read_voxel(reader, own, findings); });
}

TEST_CASE("reader: without a writer it says what the map says") {
  OwnedMap owned(config_of(GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact)));
  oracle::Random random(9);
  write_round(owned.map, random, 0);
  MapReader reader(owned.map);
  std::vector<std::uint64_t> words(reader.snapshot_bytes() / 8);
  const std::span<std::byte> workspace = std::as_writable_bytes(std::span(words));
  for (int b = 0; b <= kBlocks; ++b) {
    const BlockCoord coord = block_number(b);
    const Result<BlockSnapshot> block = reader.snapshot(coord, workspace);
    REQUIRE(block.ok());
    CHECK(block->empty() == (owned.map.find(coord) == nullptr));
    for (int i = 0; i < kBlockVoxels; ++i) {
      const VoxelCoord voxel = voxel_at(coord, i / 8, i % 8);
      const VoxelEvidence expected = owned.map.evidence(voxel);
      REQUIRE(reader.evidence(voxel)->sigma == expected.sigma);
      REQUIRE(block->evidence(i / 8, i % 8).sigma == expected.sigma);
      REQUIRE(reader.query(voxel)->label == owned.map.query(voxel).label);
    }
  }
  CHECK(reader.retries() == 0);
  CHECK(reader.busy() == 0);
  CHECK(reader.evidence(VoxelCoord{kVoxelLimit, 0, 0})->total() == 0.0);
  CHECK(reader.snapshot({kBlockLimit, 0, 0}, workspace).status() == Status::kOutOfRange);
  CHECK(reader.snapshot({0, 0, 0}, workspace.first(workspace.size() - 1)).status() ==
        Status::kInvalidArgument);
  CHECK(reader.snapshot({0, 0, 0}, workspace.subspan(1)).status() == Status::kInvalidArgument);
}

}  // namespace tessera
