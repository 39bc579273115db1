// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot for tests of the publisher: a small map, and a publication that keeps what it is told.
#pragma once

#include <map>
#include <set>
#include <vector>

#include "support/small_map.hpp"
#include "tessera/exchange/publisher.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace tessera {

/// Content in memory of its own.
struct ReadContent {
  explicit ReadContent(int num_components);
  std::vector<std::byte> memory;
  BlockContent content;
};

/// Counts with four binary digits, passes of voxels that are only free to one.
void round_counts(BlockContent& content);

class KeptPublication {
 public:
  explicit KeptPublication(int num_components) : packed_(most_packed_bytes(num_components)) {}
  Publication interface();

  void (*quantise)(BlockContent&) = [](BlockContent&) {};
  bool refuses = false;
  std::set<std::uint64_t> archived;  ///< Blocks that are not whole.
  std::vector<std::uint64_t> log;    ///< Keys in the order in which they were published.
  std::map<std::uint64_t, std::vector<std::byte>> blocks;

  bool read(BlockKey key, BlockContent& content) const;

 private:
  Result<WireBytes> publish(BlockKey key, const BlockContent& content);
  std::vector<std::byte> packed_;
};

inline constexpr std::int64_t kTick_us = 50'000;

/// Ticks of plenty in which all that is published is looked at, a sixteenth in each.
inline constexpr int kPublishedRound = 17;

/// A hundred times what a test publishes.
inline constexpr PublisherBudget kPlenty{
    .entries = 1U << 20U, .compared = 1U << 20U, .label_bytes = 1U << 26U, .free_bytes = 1U << 26U};

struct SampleRobot {
  explicit SampleRobot(const PublisherConfig& config = {}, std::size_t pages = 1024);
  PublisherReport tick(std::int64_t after_us = kTick_us) {
    now_us += after_us;
    return publisher.tick(small.map, now_us, budget, kept.interface());
  }
  /// Ticks until nothing waits and a round through what is published finds nothing gone; true iff
  /// that round has begun after so many.
  bool settles(int most_ticks);
  /// Voxels whose state or label is not what was published of them, everywhere.
  int disagreement();
  LocalMap& map() { return small.map; }

  SmallMap small;
  KeptPublication kept;
  AlignedMemory memory;
  Publisher publisher;
  PublisherBudget budget = kPlenty;
  std::int64_t now_us = 0;
};

/// The i-th of many blocks in a row along x.
constexpr VoxelCoord voxel_of_block(int i) { return {8 * i, 0, 0}; }
constexpr std::uint64_t key_of_block(int i) { return pack_in_grid({i, 0, 0}).bits; }

}  // namespace tessera
