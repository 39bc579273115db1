// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The blocks of a global map that somebody has evidence of, and which of them are behind: a record
// each, found by its key, and an agenda of those that wait.
#pragma once

#include <optional>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/fusion/internal/agenda.hpp"
#include "tessera/fusion/internal/node_statistics.hpp"
#include "tessera/fusion/internal/sum_store.hpp"
#include "tessera/grid/internal/block_index.hpp"
#include "tessera/replica/grid_transform.hpp"

namespace tessera {

/// What a mark is part of: an update, a move of contributions that waits for it, or an update of
/// what such a move changes.
enum class UpdatePart : std::uint8_t { kUpdate, kMove, kMovedUpdate };

/// What is known of one block.
struct GlobalRecord {
  std::uint64_t key = 0;
  std::uint64_t robots = 0;    ///< With label evidence here.
  std::uint64_t classes = 0;   ///< That any of these has, whatever it counts.
  StoredSums sums{};           ///< Where it is part of the graph.
  StoredBytes tallies{};       ///< What it says of the robots' labels.
  bool output_due = false;     ///< Though what is due first are sums.
  bool moving = false;         ///< What a move that is under way makes of it is not staged yet.
  bool hidden = false;         ///< What it gives while a move is under way is staged.
  bool refused = false;        ///< There was no room for its sums or its content.
  bool again = false;          ///< It waits as robots are weighed otherwise, not for more evidence.
  std::uint16_t objected = 0;  ///< Voxels without what a robot objects to.
  std::uint16_t disputed = 0;  ///< Voxels with it, as more robots have it than object.
  AgendaLink link{};
  NodeStatistics statistics{};

  [[nodiscard]] UpdatePart part() const noexcept {
    if (moving) return UpdatePart::kMove;
    return hidden ? UpdatePart::kMovedUpdate : UpdatePart::kUpdate;
  }
};

class GlobalRecords {
 public:
  using BlockRange = GridTransform::BlockRange;

  [[nodiscard]] static constexpr std::size_t required_bytes(std::uint32_t blocks) noexcept {
    return BlockIndex::required_bytes(blocks) + arena_bytes<GlobalRecord>(blocks);
  }
  /// Fails with kResourceExhausted iff the arena is too small. Memory of records is touched when
  /// they are first taken.
  [[nodiscard]] static Result<GlobalRecords> make(Arena& arena, std::uint32_t blocks,
                                                  std::uint64_t hash_seed) noexcept;
  GlobalRecords() noexcept = default;

  // --- Records -----------------------------------------------------------------------------------

  /// A record's number, from 1; 0 iff the block has none. Expected O(1).
  [[nodiscard]] std::uint32_t find(BlockCoord block) const noexcept;
  /// The same, for a block that is part of the graph; 0 iff it is not.
  [[nodiscard]] std::uint32_t find_with_sums(BlockCoord block) const noexcept {
    const std::uint32_t number = find(block);
    return number != 0 && at(number).sums.any() ? number : 0;
  }
  /// The same, for a block whose next work is its output; 0 iff it is not.
  [[nodiscard]] std::uint32_t find_waiting_for_output(BlockCoord block) const noexcept {
    const std::uint32_t number = find(block);
    return number != 0 && waits_for_output(number) ? number : 0;
  }
  [[nodiscard]] GlobalRecord& at(std::uint32_t number) const noexcept {
    return records_[number - 1];
  }
  [[nodiscard]] BlockCoord block_of(std::uint32_t number) const noexcept {
    return unpack(BlockKey{at(number).key});
  }
  /// Takes it off the agenda and forgets it; its sums must be released. Expected O(1).
  void close(std::uint32_t number) noexcept;
  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }
  /// The highest number that a record ever had.
  [[nodiscard]] std::uint32_t last() const noexcept { return used_; }
  [[nodiscard]] bool is_open(std::uint32_t number) const noexcept {
    return at(number).key != kClosed;
  }
  /// Blocks without a record since there was no place for one.
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }
  /// Memory of records that were ever taken, and the index's share of those in use.
  [[nodiscard]] std::size_t used_bytes() const noexcept {
    return index_.used_bytes() + arena_bytes<GlobalRecord>(used_);
  }
  /// Calls visit(record) for each. O(records that were ever taken).
  template <class Visit>
  void for_each(Visit&& visit) const noexcept {
    for (std::uint32_t number = 1; number <= used_; ++number) {
      if (at(number).key != kClosed) visit(at(number));
    }
  }

  /// Marks the sums of a block that holds what it held, of robots that are weighed otherwise.
  void mark_again(std::uint32_t number) noexcept {
    GlobalRecord& record = at(number);
    const bool waits = record.link.list != 0;
    again_ += waits ? 0U : 1U;
    record.again = record.again || !waits;
    mark(number, Agenda::kSums);
  }
  /// It is up to date, or waits for more.
  void set_up_to_date(GlobalRecord& record) noexcept {
    again_ -= record.again ? 1U : 0U;
    record.again = false;
  }
  /// How many wait for that alone, at least.
  [[nodiscard]] std::uint32_t waiting_again() const noexcept { return again_; }
  /// Marks the sums of blocks that had no room. O(records).
  void mark_refused() noexcept;

  // --- Agenda ------------------------------------------------------------------------------------

  /// Where near comes first; without it all places are alike.
  void set_focus(std::optional<BlockCoord> focus) noexcept { focus_ = focus; }
  /// Puts a record on the agenda, if this work is not due before. O(1).
  void mark(std::uint32_t number, Agenda::Work work) noexcept;
  /// Marks the sums of each block of a range as a part, and opens records for those that have none.
  /// False iff there was no place for some: counted, and the others are marked, for what a move
  /// leaves must go. O(blocks).
  [[nodiscard]] bool mark_sums(const BlockRange& range, UpdatePart part) noexcept;
  /// Marks the outputs of those blocks of a range that are part of the graph. O(blocks).
  void mark_outputs(const BlockRange& range, UpdatePart part) noexcept;
  void take_off(std::uint32_t number) noexcept { agenda_.remove(*this, number); }
  /// What is due first, or 0.
  [[nodiscard]] std::uint32_t first() const noexcept { return agenda_.first(); }
  [[nodiscard]] Agenda::Work work_of(std::uint32_t number) const noexcept {
    return Agenda::work_of(at(number).link);
  }
  [[nodiscard]] bool waits_for_output(std::uint32_t number) const noexcept {
    const GlobalRecord& record = at(number);
    return record.sums.any() && record.link.list != 0 &&
           Agenda::work_of(record.link) == Agenda::kOutput;
  }
  [[nodiscard]] std::uint32_t waiting() const noexcept { return agenda_.waiting(); }
  /// For Agenda.
  [[nodiscard]] AgendaLink& link(std::uint32_t number) const noexcept { return at(number).link; }

  // --- Moves -------------------------------------------------------------------------------------

  /// What the record's move waits for is done, or there is nothing to do.
  void set_moved(GlobalRecord& record) noexcept {
    moving_ -= record.moving ? 1U : 0U;
    record.moving = false;
  }
  /// Records that a move waits for.
  [[nodiscard]] std::uint32_t moving() const noexcept { return moving_; }

 private:
  static constexpr std::uint64_t kClosed = ~std::uint64_t{0};
  [[nodiscard]] std::uint32_t open(BlockCoord block) noexcept;
  void set_part(GlobalRecord& record, UpdatePart part) noexcept;

  BlockIndex index_{};
  std::span<GlobalRecord> records_;
  std::uint32_t used_ = 0;  ///< Records that were ever taken.
  std::uint32_t free_ = 0;  ///< A list by AgendaLink::next.
  std::uint32_t size_ = 0;
  std::uint32_t moving_ = 0;
  std::uint32_t again_ = 0;
  std::uint64_t refused_ = 0;
  Agenda agenda_{};
  std::optional<BlockCoord> focus_;
};

}  // namespace tessera
