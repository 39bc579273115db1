// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Votes of a layer's cells: bounded, whatever comes, and begun from labels where there were none.
#include "tessera/map/internal/label_votes.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "support/random.hpp"
#include "support/small_map.hpp"

namespace tessera {
namespace {

std::map<int, std::uint32_t> votes_of_cell(const LabelVotes& votes, std::size_t cell) {
  std::map<int, std::uint32_t> found;
  for (std::size_t s = 0; s < LabelVotes::kClasses; ++s)
    if (votes.votes[s][cell] != 0) found[votes.labels[s]] += votes.votes[s][cell];
  return found;
}

MapConfig config_with_votes() {
  MapConfig config = config_of_pages(64);
  config.label_votes = true;
  return config;
}

}  // namespace

TEST_CASE("label votes: five classes have theirs, cell by cell") {
  LabelVotes votes;
  for (std::uint8_t label = 1; label <= 5; ++label) {
    votes.add(0, label, 10U * label);
    votes.add(3, label, 1);
  }
  votes.add(0, 2, 7);
  CHECK(votes_of_cell(votes, 0) ==
        std::map<int, std::uint32_t>{{1, 10}, {2, 27}, {3, 30}, {4, 40}, {5, 50}});
  CHECK(votes_of_cell(votes, 1).empty());
  CHECK(votes_of_cell(votes, 3) ==
        std::map<int, std::uint32_t>{{1, 1}, {2, 1}, {3, 1}, {4, 1}, {5, 1}});
}

TEST_CASE("label votes: a sixth class takes from the one with the fewest until it has its place") {
  LabelVotes votes;
  for (std::uint8_t label = 1; label <= 5; ++label) votes.add(1, label, 100);
  votes.add(2, 5, 20);
  votes.add(1, 6, 60);  // of equals the higher gives way: 4
  CHECK(votes_of_cell(votes, 1) ==
        std::map<int, std::uint32_t>{{1, 100}, {2, 100}, {3, 100}, {4, 40}, {5, 100}});
  votes.add(2, 6, 60);
  CHECK(votes_of_cell(votes, 1) ==
        std::map<int, std::uint32_t>{{1, 100}, {2, 100}, {3, 100}, {5, 100}});
  CHECK(votes_of_cell(votes, 2) == std::map<int, std::uint32_t>{{5, 20}, {6, 20}});
}

TEST_CASE("label votes: a class that always has most votes is there in the end") {
  LabelVotes votes;
  oracle::Random random(11);
  for (int i = 0; i < 3000; ++i) {
    const bool common = random.below(2) == 0;
    votes.add(static_cast<std::size_t>(random.below(4)),
              static_cast<std::uint8_t>(common ? 40 : 1 + random.below(30)), 8);
  }
  std::map<int, std::uint32_t> all;
  for (std::size_t cell = 0; cell < LabelVotes::kCells; ++cell)
    for (const auto& [label, count] : votes_of_cell(votes, cell)) all[label] += count;
  for (const auto& [label, count] : all) CHECK(count <= all[40]);
}

TEST_CASE("label votes: a full cell halves, and shares stay") {
  LabelVotes votes;
  for (int i = 0; i < 1000; ++i) {
    votes.add(0, 1, 300);
    votes.add(0, 2, 100);
    std::uint32_t sum = 0;
    for (const auto& [label, count] : votes_of_cell(votes, 0)) sum += count;
    REQUIRE(sum <= LabelVotes::kMostOfCell);
  }
  const auto found = votes_of_cell(votes, 0);
  CHECK(static_cast<double>(found.at(1)) / found.at(2) == Approx(3.0).epsilon(0.15));
  votes.add(1, 3, ~std::uint32_t{0});
  CHECK(votes_of_cell(votes, 1).at(3) == LabelVotes::kMostAdded);
}

TEST_CASE("label votes: added to each other they are the same, whichever is added to which") {
  oracle::Random random(17);
  for (int turn = 0; turn < 200; ++turn) {
    std::array<LabelVotes, 2> votes;
    for (LabelVotes& one : votes) {
      for (int i = random.below(40); i > 0; --i)
        one.add(static_cast<std::size_t>(random.below(4)),
                static_cast<std::uint8_t>(1 + random.below(9)),
                static_cast<std::uint32_t>(random.below(3000)));
    }
    std::array<LabelVotes, 2> sums = votes;
    sums[0].add(votes[1]);
    sums[1].add(votes[0]);
    LabelVotes copy;
    copy.add(votes[0]);
    for (std::size_t cell = 0; cell < LabelVotes::kCells; ++cell) {
      const auto sum = votes_of_cell(sums[0], cell);
      REQUIRE(sum == votes_of_cell(sums[1], cell));
      REQUIRE(votes_of_cell(copy, cell) == votes_of_cell(votes[0], cell));
      std::uint32_t in_cell = 0;
      for (const auto& [label, count] : sum) in_cell += count;
      REQUIRE(in_cell <= LabelVotes::kMostOfCell);
    }
  }
}

TEST_CASE("label votes: two full cells of two classes count alike when they are added") {
  LabelVotes a;
  LabelVotes b;
  for (int i = 0; i < 2; ++i) {
    a.add(0, 1, LabelVotes::kMostAdded);
    b.add(0, 2, LabelVotes::kMostAdded);
  }
  a.add(b);
  CHECK(votes_of_cell(a, 0) == std::map<int, std::uint32_t>{{1, 4096}, {2, 4096}});
}

TEST_CASE("label votes: rounded to the nearest, and never more than an addition can be") {
  CHECK(LabelVotes::votes_of(0.0F) == 0);
  CHECK(LabelVotes::votes_of(0.49F) == 0);
  CHECK(LabelVotes::votes_of(0.5F) == 1);
  CHECK(LabelVotes::votes_of(8e6F) == LabelVotes::kMostAdded);
}

TEST_CASE("label votes: what was loaded votes as its labels, once") {
  SmallMap small(config_with_votes());
  const SlabHandle block = *small.map.open_block({0, 0, 0});
  VoxelEvidence evidence;
  evidence.num_components = small.map.num_components();
  evidence.sigma[1] = 6.0F;
  evidence.sigma[static_cast<std::size_t>(small.map.classes().unlabelled())] = 9.0F;
  constexpr int kOctet = 3;  // x 6 to 7 of the lowest layer
  REQUIRE(small.map.restore(block, kOctet, 0, evidence, 0) == Status::kOk);
  for (int time = 0; time < 2; ++time) {
    const LabelVotes votes = small.map.begun_votes(block, 0);
    CHECK(votes.begun);
    CHECK(votes_of_cell(votes, 1) == std::map<int, std::uint32_t>{{1, 12}});
    CHECK(votes_of_cell(votes, 0).empty());
  }
}

TEST_CASE("label votes: labels that come back from an archive vote where votes have begun") {
  SmallMap small(config_with_votes());
  const SlabHandle block = *small.map.open_block({0, 0, 0});
  REQUIRE(small.map.open_label_layers(block, 1) == Status::kOk);
  LabelVotes votes = small.map.begun_votes(block, 0);
  votes.add(0, 1, 40);
  small.map.set_votes(block, 0, votes);
  VoxelEvidence evidence;
  evidence.num_components = small.map.num_components();
  evidence.sigma[2] = 8.0F;
  for (int time = 1; time <= 2; ++time) {
    REQUIRE(small.map.merge(block, 0, 5, evidence, 0) == Status::kOk);
    CHECK(votes_of_cell(small.map.begun_votes(block, 0), 0) ==
          std::map<int, std::uint32_t>{{1, 40}, {2, 16U * static_cast<unsigned>(time)}});
  }
}

TEST_CASE("label votes: evidence that rounds to nothing takes neither votes nor an octet") {
  MapConfig config = config_with_votes();
  config.tuple = TuplePolicy::kCompact;
  SmallMap small(config);
  const SlabHandle block = *small.map.open_block({0, 0, 0});
  REQUIRE(small.map.open_label_layers(block, 1) == Status::kOk);
  LabelVotes votes = small.map.begun_votes(block, 0);
  votes.add(0, 1, 40);
  small.map.set_votes(block, 0, votes);
  LabelShares shares;
  shares.offer(1, 2.0F);
  shares.offer(2, 1.0F);
  shares.divide(0.0F);
  OctetEvidence added;
  added.plane(1)[0] = 1e-9F;
  REQUIRE(small.map.add_labels(block, 0, added, shares) == Status::kOk);
  CHECK(small.map.items()[kOctetSlab] == 0);
  CHECK(votes_of_cell(small.map.begun_votes(block, 0), 0) == std::map<int, std::uint32_t>{{1, 40}});
  small.map.close_empty_label_layers(block);
  CHECK(small.map.items()[kLabelSlab] == 0);
}

TEST_CASE("label votes: a full voxel with passes keeps the cap, and its classes their shares") {
  for (const TuplePolicy tuple : {TuplePolicy::kCompact, TuplePolicy::kDense}) {
    CAPTURE(to_string(tuple));
    MapConfig config = config_with_votes();
    config.tuple = tuple;
    config.max_evidence = 10.0F;
    config.free_weight = 0.5F;
    SmallMap small(config, 5);
    for (int pass = 0; pass < 4; ++pass) REQUIRE(carve(small.map, {1, 2, 0}) == Status::kOk);
    const SlabHandle block = small.map.find_handle(BlockCoord{0, 0, 0});
    LabelShares shares;
    for (const auto& [label, share] : {std::pair{2, 0.6F}, {3, 0.3F}, {5, 0.1F}})
      shares.offer(static_cast<std::uint8_t>(label), share);
    shares.divide(1.0F / 16.0F);
    const VoxelCoord voxel{1, 2, 0};
    for (int scan = 0; scan < 12; ++scan) {
      OctetEvidence added;
      added.plane(2)[static_cast<std::size_t>(voxel_in_octet(voxel))] = 2.5F;
      REQUIRE(small.map.add_labels(block, octet_in_block(voxel), added, shares) == Status::kOk);
      const VoxelEvidence evidence = small.map.evidence(voxel);
      const double labels = evidence.total() - static_cast<double>(evidence.sigma[0]);
      CHECK(evidence.total() <= 10.0 + 1e-4);
      CHECK(evidence.total() >= std::min(10.0, 2.0 + 2.5 * (scan + 1)) - 0.6);
      CHECK(static_cast<double>(evidence.sigma[2]) == Approx(0.6 * labels).epsilon(1e-3));
      CHECK(static_cast<double>(evidence.sigma[3]) == Approx(0.3 * labels).epsilon(1e-3));
      CHECK(static_cast<double>(evidence.sigma[5]) == Approx(0.1 * labels).epsilon(1e-3));
    }
    // Passes gave way in whole ones.
    const float passes = small.map.evidence(voxel).sigma[0] / 0.5F;
    CHECK(passes == std::floor(passes));
    CHECK(passes < 4.0F);
  }
}

TEST_CASE("label votes: pages that were opened for them go where no label came") {
  SmallMap small(config_with_votes());
  const SlabHandle block = *small.map.open_block({0, 0, 0});
  REQUIRE(small.map.open_label_layers(block, 0b1010U) == Status::kOk);
  CHECK(small.map.items()[kLabelSlab] == 2);
  OctetEvidence added;
  added.plane(1)[0] = 1.0F;
  REQUIRE(small.map.add_labels(block, 16, added) == Status::kOk);  // of layer 1
  small.map.close_empty_label_layers(block);
  CHECK(small.map.items()[kLabelSlab] == 1);
  CHECK(small.map.block_at(block).labels[1] != 0);
}

}  // namespace tessera
