// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Inputs and outputs of the publisher: settings, where published blocks go, and reports.
#pragma once

#include <array>
#include <cstdint>

#include "tessera/base/counters.hpp"
#include "tessera/exchange/publisher_counters.h"
#include "tessera/map/block_content.hpp"

namespace tessera {

/// Settings and room of a publisher.
struct PublisherConfig {
  /// Blocks that are published and in the map, or wait to be; from 1 to 2^28. With fewer than the
  /// map's the rest is never published, and counted (PublisherReport::left_out).
  std::uint32_t blocks = 131072;
  /// Blocks that wait, from 64 to blocks. What finds no place is found again by later sweeps.
  std::uint32_t candidates = 65536;
  /// Within which a change of labelled voxels is published, from 1 ms to 1 h.
  std::int64_t staleness_us = 1'000'000;
  /// The same for voxels that are only free; not under staleness_us, at most 1 h.
  std::int64_t free_staleness_us = 4'000'000;
  /// Until a block that was refused is tried again; from 1 us to 1 h.
  std::int64_t retry_us = 100'000;
  /// A voxel's label evidence means something else after it grew or shrank by more than this; above
  /// 1, at most 1e6.
  float evidence_factor = 4.0F;
  /// Labelled voxels that differ, under which a block is due as if they were only free; from 1,
  /// with which none is.
  std::uint32_t few_voxels = 1;
  /// From which on a block does not wait for its time to be up, while half of the budget would do
  /// for all that waits; from 1. A block is new while it has so many more or fewer than published.
  std::uint32_t many_voxels = 32;
  /// Blocks from the focus, along each axis, within which what is new is due after a quarter of
  /// staleness_us; beyond it after half.
  std::int32_t near_blocks = 16;
};

/// What a published block takes on the wire.
struct WireBytes {
  std::uint32_t labels = 0;
  std::uint32_t free = 0;
};

/// Where published blocks go and are kept. Functions must not change the map.
struct Publication {
  void* context = nullptr;
  /// Rounds content to what the wire can say. The same content gives the same, and what it gave is
  /// left as it is.
  void (*quantise)(void* context, BlockContent& content) = nullptr;
  /// Adds what was last published of a block to content. False: nothing was, or an empty block.
  bool (*read)(void* context, BlockKey key, BlockContent& content) = nullptr;
  /// Publishes a block anew, as this and nothing else; without any evidence: as emptied. Any error:
  /// nothing was published, and it is tried again later.
  Result<WireBytes> (*publish)(void* context, BlockKey key, const BlockContent& content) = nullptr;
  /// False: a part of the block's evidence is not in the map but archived. What was published
  /// stays until it is back, which the publisher notices as a change of the block. May be null: all
  /// of a block always is in the map.
  bool (*whole)(void* whole_context, BlockKey key) = nullptr;
  void* whole_context = nullptr;
};

/// A block that is to leave the map once everything in it was published.
struct LeavingBlock {
  BlockKey key{};
  /// Block::stamp of the content that was published; 0: it is not settled yet. One more than the
  /// stamp (an odd number): a part of the block is archived, and what is in the map cannot be
  /// published alone. 1: the map does not have the block.
  std::uint64_t stamp = 0;
};

/// What a tick may do.
struct PublisherBudget {
  std::uint32_t entries = 65536;  ///< Of the map's index, looked at; in whole pages, at least one.
  std::uint32_t compared = 1024;  ///< Blocks compared with what was published of them.
  /// On the wire; the last block may go over either. 12 and 3 Mbit/s at 20 ticks a second.
  std::uint32_t label_bytes = 75000;
  std::uint32_t free_bytes = 18750;
  /// Nothing is held off: what the rest of the budget allows is published at this tick.
  bool at_once = false;
};

/// What a tick did and left.
struct PublisherReport {
  TESSERA_PUBLISHER_COUNTERS(TESSERA_COUNTER_MEMBER)
  WireBytes bytes;

  [[nodiscard]] std::uint32_t label_bytes() const noexcept { return bytes.labels; }
  [[nodiscard]] std::uint32_t free_bytes() const noexcept { return bytes.free; }
};
TESSERA_COUNTER_TABLE(PublisherReport, TESSERA_PUBLISHER_COUNTERS(TESSERA_COUNTER_ROW))

TESSERA_COUNTER_SUMS(TickSums, PublisherReport, TESSERA_PUBLISHER_COUNTERS)

/// Over all ticks; nothing in it ever decreases.
struct PublisherTotals : TickSums {
  std::uint64_t forgotten_waiting = 0;  ///< Forgotten with changes that were never published.
  std::uint32_t peak_waiting = 0;       ///< Of all kinds.
  /// Publications of labelled changes by staleness, in eighths of staleness_us; the last: beyond
  /// 15 of them.
  std::array<std::uint64_t, 16> by_staleness{};
};

class Exchange;
/// What a Publisher publishes into. Of a block with labels, 1/14 of a byte is taken for each voxel
/// that is only free, and the rest for its labels. exchange must outlive it.
[[nodiscard]] Publication publication_of(Exchange& exchange) noexcept;

}  // namespace tessera
