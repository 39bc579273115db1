// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What every robot has published, as far as it has arrived: of each contribution the latest version
// of each of its blocks. A version replaces an older one and is never added to it, so that order,
// repetition and loss change nothing but what has arrived. A block that is large comes in parts,
// which are whole layers of it and have versions of their own.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/counters.hpp"
#include "tessera/grid/block_extent.hpp"
#include "tessera/grid/internal/block_index.hpp"
#include "tessera/map/map_config.hpp"
#include "tessera/replica/contribution_id.hpp"
#include "tessera/replica/grid_transform.hpp"
#include "tessera/replica/internal/segment_store.hpp"
#include "tessera/replica/map_session.hpp"
#include "tessera/replica/replica_counters.h"

namespace tessera {

class BlockContent;

/// Of a record's name and content.
struct RecordHash {
  std::uint64_t high = 0;
  std::uint64_t low = 0;
  friend constexpr auto operator<=>(const RecordHash&, const RecordHash&) = default;
};

/// Which of a block's versions this is. A block is always published as a whole, if need be in parts
/// with versions that follow each other.
struct PartVersion {
  std::uint32_t number = 0;          ///< From 1; of each layer the highest counts.
  std::uint32_t first = 0;           ///< Of the parts that were published together.
  std::uint8_t layers = kAllLayers;  ///< A bit each (map_config.hpp); not 0.
  /// Of two contents of one version the one with the lower hash counts, in whatever order they
  /// come.
  RecordHash hash{};
};

/// used of all, rounded down; 1024 of none.
[[nodiscard]] constexpr std::uint32_t share_in_1024(std::uint64_t used,
                                                    std::uint64_t all) noexcept {
  return all == 0 ? 1024 : static_cast<std::uint32_t>(used * 1024 / all);
}

/// Room for what robots publish.
struct ReplicasConfig {
  std::uint32_t segments = 1U << 17U;  ///< Of 128 bytes; a part of a block takes at least one.
  std::uint32_t blocks = 1U << 15U;    ///< Parts of blocks of all contributions.
  std::uint32_t contributions = 64;    ///< At most kMostContributions.
  /// Segments that one robot's contributions may take together.
  std::uint32_t robot_segments = 1U << 17U;
  /// Parts of blocks that they may have together; empty ones take no segment.
  std::uint32_t robot_blocks = ~std::uint32_t{0};
};

/// Robots that they can be of.
[[nodiscard]] constexpr std::uint32_t most_robots(const ReplicasConfig& config) noexcept {
  constexpr std::uint32_t kMost = 64;  // Replicas::kMostRobots
  return config.contributions < kMost ? config.contributions : kMost;
}

/// How full they are. Counters of refusals never decrease.
struct ReplicasUsage {
  TESSERA_REPLICA_COUNTERS(TESSERA_COUNTER_MEMBER)
  std::uint32_t segments = 0;  ///< In use.
};
TESSERA_COUNTER_TABLE(ReplicasUsage, TESSERA_REPLICA_COUNTERS(TESSERA_COUNTER_ROW))

class Replicas {
 public:
  static constexpr std::uint32_t kMostContributions = 4096;
  static constexpr std::uint32_t kMostRobots = 64;
  using Slot = std::uint32_t;  ///< Names a contribution while it is there.

  /// What is known of a contribution, beside its blocks.
  struct Contribution {
    ContributionId id;
    bool present = false;
    bool leaving = false;        ///< No longer part of any sum; its blocks are being dropped.
    bool hidden = false;         ///< Part of no sum: it has no place (GlobalMap::place).
    std::uint8_t robot_bit = 0;  ///< Of this robot's contributions alone; under kMostRobots.
    std::uint32_t frame_revision = 0;
    std::uint32_t first_block = 0;  ///< Of a list; a record's number plus one, 0: none.
    std::uint32_t blocks = 0;       ///< Parts of blocks.
    std::uint32_t segments = 0;
    GridTransform T_global_local;  ///< Where it lies; not valid while it is hidden.
    GridTransform T_world_local;   ///< As its robot states it: the same where none is placed.
    std::uint32_t place = 0;       ///< As FrameStamp has it.
    BlockExtent extent;            ///< Of all blocks that it ever had.
    MapSession session{};          ///< Of one (MapSession::is).
    /// Whether it is part of sums.
    [[nodiscard]] bool counts() const noexcept { return !leaving && !hidden; }
    [[nodiscard]] FrameStamp frame() const noexcept { return {frame_revision, place}; }
    /// False: it has no block in a range.
    [[nodiscard]] bool may_have(const GridTransform::BlockRange& range) const noexcept {
      return extent.touches({range.first, range.last});
    }
  };
  /// One block of a contribution, or a part of one.
  struct Replica {
    std::uint64_t key = 0;
    std::uint32_t version = 0;
    std::uint32_t newest = 0;       ///< The highest PartVersion::first that is known of the block.
    std::uint32_t bytes = 0;        ///< Packed; 0: known to be empty.
    SegmentStore::Chain chain = 0;  ///< What is packed, then what came on the wire.
    Slot slot = 0;
    std::uint32_t next = 0;  ///< In the contribution's list, as first_block.
    std::uint32_t previous = 0;
    std::uint32_t next_part = 0;  ///< Of the same block, as first_block.
    std::uint16_t wire_bytes = 0;
    std::uint8_t part = 0;    ///< Its version less PartVersion::first.
    std::uint8_t layers = 0;  ///< As published.
    std::uint8_t live = 0;    ///< Of these, those of which no later version is known; 0: spare.
    RecordHash hash{};
    /// False: a later version of the whole block was published, and this only fills in for what of
    /// it has not arrived.
    [[nodiscard]] bool latest() const noexcept { return version >= newest; }
    /// True if this part counts before a version of the same layers.
    [[nodiscard]] bool supersedes(const PartVersion& other) const noexcept {
      return version > other.number || (version == other.number && hash <= other.hash);
    }
  };
  /// What put() did. kStale: the version was not newer than the one that is held.
  enum class Change : std::uint8_t { kTaken, kStale };

  [[nodiscard]] static constexpr std::size_t required_bytes(const ReplicasConfig& config) noexcept {
    return SegmentStore::required_bytes(config.segments) + arena_bytes<Replica>(config.blocks) +
           BlockIndex::required_bytes(config.blocks) +
           arena_bytes<Contribution>(config.contributions) +
           arena_bytes<Slot>(config.contributions);
  }
  /// Fails with kInvalidArgument iff config.contributions is 0 or over kMostContributions;
  /// kResourceExhausted iff the arena is too small. O(contributions + index). hash_seed: of the
  /// index, as BlockIndex::make has it.
  [[nodiscard]] static Result<Replicas> make(Arena& arena, const ReplicasConfig& config,
                                             std::uint64_t hash_seed = 0) noexcept;
  Replicas() noexcept = default;

  /// The slot of a contribution, which is added if it is not there yet. Fails with
  /// kResourceExhausted iff all slots, or all kMostRobots, are taken. O(contributions).
  [[nodiscard]] Result<Slot> open(const ContributionId& id) noexcept;
  /// Its slot, or nothing. O(log contributions).
  [[nodiscard]] Result<Slot> find(const ContributionId& id) const noexcept;
  /// Takes a version of a block or of a part: packed (packed_block.hpp) with nothing in other
  /// layers, or empty where nothing is left of it; wire: what is to be kept beside it, under 2^16
  /// bytes. Fails with kResourceExhausted iff storage or quota is used up: counted, and what was
  /// there stays. O(bytes).
  [[nodiscard]] Result<Change> put(Slot slot, BlockKey key, const PartVersion& version,
                                   std::span<const std::byte> packed,
                                   std::span<const std::byte> wire = {}) noexcept;
  /// The same for a whole block.
  [[nodiscard]] Result<Change> put(Slot slot, BlockKey key, std::uint32_t version,
                                   std::span<const std::byte> packed) noexcept {
    return put(slot, key, {.number = version, .first = version}, packed);
  }
  /// The layers of a part that are not known in this version or a later one, a bit each. O(parts).
  [[nodiscard]] std::uint8_t news(Slot slot, BlockKey key,
                                  const PartVersion& version) const noexcept;
  /// Takes a block away with all its parts: that of record(number). O(segments).
  void drop(std::uint32_t number) noexcept;
  /// Closes a contribution that has no block any more. O(contributions).
  void close(Slot slot) noexcept;

  /// The record of a block's first part, or null.
  [[nodiscard]] const Replica* find(Slot slot, BlockKey key) const noexcept;
  /// Of the same block, or null. Their live layers have nothing in common.
  [[nodiscard]] const Replica* next_part(const Replica& replica) const noexcept {
    return replica.next_part == 0 ? nullptr : &record(replica.next_part);
  }
  /// The packed bytes of a block, in into, which must be long enough. O(bytes).
  [[nodiscard]] std::span<const std::byte> read(const Replica& replica,
                                                std::span<std::byte> into) const noexcept {
    const std::span<std::byte> bytes = into.first(replica.bytes);
    segments_.read(replica.chain, bytes);
    return bytes;
  }
  /// Adds what is held of a block to content: of each part its live layers, whatever versions these
  /// are of. first: of find(); null adds nothing. The bytes must be such as check_packed accepts,
  /// with components that content has room for. packed: at least most_packed_bytes. True iff any
  /// part has bytes; false: nothing is held of the block, or it is known to be empty. O(bytes).
  bool read_block(const Replica* first, std::span<std::byte> packed,
                  BlockContent& content) const noexcept;
  /// What came with it on the wire. As read().
  [[nodiscard]] std::span<const std::byte> read_wire(const Replica& replica,
                                                     std::span<std::byte> into) const noexcept {
    const std::span<std::byte> bytes = into.first(replica.wire_bytes);
    segments_.read(replica.chain, bytes, replica.bytes);
    return bytes;
  }

  /// Slots by ascending id: the order in which evidence is added up.
  [[nodiscard]] std::span<const Slot> in_order() const noexcept { return order_.first(present_); }
  [[nodiscard]] const Contribution& contribution(Slot slot) const noexcept {
    return contributions_[slot];
  }
  /// Of these, robots' objections (objection.hpp): two of each robot at most, where an exchange
  /// has opened them.
  [[nodiscard]] std::span<const Slot> objections() const noexcept {
    return std::span(objections_).first(objection_count_);
  }
  /// Grows whenever what robots state about frames (contribution_kind.hpp) has changed here: one
  /// was taken, or a contribution of them leaves. Equal: collect() gives the same as before. O(1).
  [[nodiscard]] std::uint64_t frame_changes() const noexcept { return frame_changes_; }
  [[nodiscard]] const Replica& record(std::uint32_t number) const noexcept {
    return records_[number - 1];
  }
  [[nodiscard]] std::uint32_t number_of(const Replica& replica) const noexcept {
    return static_cast<std::uint32_t>(&replica - records_.data()) + 1;
  }
  /// As its robot states it, and where it lies. session: if it is one.
  void set_frame(Slot slot, const GridTransform& T_global_local, std::uint32_t revision,
                 const MapSession& session = {}) noexcept {
    contributions_[slot].T_global_local = contributions_[slot].T_world_local = T_global_local;
    contributions_[slot].frame_revision = revision;
    contributions_[slot].session = session;
  }
  /// Where it lies instead, by which place of its robot's world; hidden: nowhere.
  void set_place(Slot slot, const GridTransform& T_global_local, bool hidden,
                 std::uint32_t place) noexcept {
    contributions_[slot].T_global_local = T_global_local;
    contributions_[slot].hidden = hidden;
    contributions_[slot].place = place;
  }
  void set_leaving(Slot slot) noexcept;
  /// Of segments and of records, whichever are fuller: those in use, in 1024 of all. O(1).
  [[nodiscard]] std::uint32_t fullness() const noexcept;
  [[nodiscard]] ReplicasUsage usage() const noexcept;
  [[nodiscard]] const ReplicasConfig& config() const noexcept { return config_; }

 private:
  [[nodiscard]] static BlockKey index_key(Slot slot, std::uint64_t key) noexcept {
    return {key ^ mix64(slot)};
  }
  [[nodiscard]] std::uint32_t find_record(Slot slot, BlockKey key) const noexcept;
  /// What a version leaves of a block's parts.
  struct Superseded {
    std::uint8_t news = 0;
    std::uint32_t segments = 0;  ///< Of parts that are gone.
    std::uint32_t number = 0;    ///< The first of them or of those that are spare, or 0.
  };
  [[nodiscard]] Superseded superseded(std::uint32_t first,
                                      const PartVersion& version) const noexcept;
  [[nodiscard]] bool has_room(Slot slot, std::uint32_t wanted, std::uint32_t held) noexcept;
  [[nodiscard]] Result<std::uint32_t> add_record(Slot slot, BlockKey key,
                                                 std::uint32_t first) noexcept;
  void note_objections() noexcept;
  void note_frame_change(Slot slot) noexcept;
  void retire(std::uint32_t first, std::uint8_t news) noexcept;
  void empty(Replica& replica) noexcept;
  void release(std::uint32_t number) noexcept;
  [[nodiscard]] static std::uint32_t segments_of(const Replica& replica) noexcept {
    return SegmentStore::segments_of(replica.bytes + replica.wire_bytes);
  }
  /// What all contributions of a robot take.
  struct RobotUse {
    std::uint32_t segments = 0;
    std::uint32_t blocks = 0;
  };
  [[nodiscard]] RobotUse& use_of(Slot slot) noexcept {
    return uses_[contributions_[slot].robot_bit];
  }

  ReplicasConfig config_{};
  SegmentStore segments_{};
  BlockIndex index_{};
  std::span<Replica> records_;
  std::span<Contribution> contributions_;
  std::span<Slot> order_;
  std::uint32_t present_ = 0;
  std::array<Slot, std::size_t{2} * kMostRobots> objections_{};  ///< By ascending id.
  std::uint32_t objection_count_ = 0;
  std::uint64_t frame_changes_ = 0;
  std::uint32_t records_used_ = 0;  ///< Records that were ever taken.
  std::uint32_t free_records_ = 0;  ///< A list by Replica::next, as first_block.
  std::uint32_t blocks_ = 0;
  std::array<RobotUse, kMostRobots> uses_{};  ///< By Contribution::robot_bit.
  ReplicasUsage counted_{};
};

}  // namespace tessera
