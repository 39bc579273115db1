// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Decides which blocks of a robot's map it publishes again, and when. A block is published only if
// its meaning is another one than what was published of it (Significance): at the next tick if
// little waits, else held off, as a block published later carries more, but so that a change of
// labelled voxels is out within staleness_us wherever the budget allows. What it did not allow is
// counted.
//
// Time is the caller's. The same maps, times, budgets and answers give the same publications.
#pragma once

#include <optional>
#include <span>

#include "tessera/base/instant.hpp"
#include "tessera/exchange/internal/due_wheel.hpp"
#include "tessera/exchange/internal/significance.hpp"
#include "tessera/exchange/publication.hpp"
#include "tessera/grid/internal/key_index.hpp"
#include "tessera/map/map_reader.hpp"

namespace tessera {

class Publisher {
 public:
  /// Bytes of arena that make takes. num_components: those of the map.
  [[nodiscard]] static constexpr std::size_t required_bytes(const PublisherConfig& config,
                                                            int num_components) noexcept {
    return KeyIndex::required_bytes(config.blocks) + arena_bytes<Candidate>(config.candidates) +
           2 * BlockContent::required_bytes(num_components) +
           arena_bytes<BlockNote>(MapReader::kPageBlocks) +
           arena_bytes<std::uint64_t>(snapshot_words(num_components));
  }
  /// Fails with kInvalidArgument iff a value of config is outside its documented range;
  /// kResourceExhausted iff the arena has under required_bytes left. map, num_components: those of
  /// the map that is published. O(blocks).
  [[nodiscard]] static Result<Publisher> make(Arena& arena, const PublisherConfig& config,
                                              const MapConfig& map, int num_components) noexcept;
  /// Publishes nothing.
  Publisher() noexcept = default;

  /// Where attention is: what is new near it comes first. Known from the first call on; before it,
  /// nothing is near.
  void set_focus(BlockCoord focus) noexcept {
    focus_ = focus;
    has_focus_ = true;
  }

  /// To be called every few tens of milliseconds, by any one thread, beside the one that writes to
  /// the map too (MapReader); map: the same always.
  /// now_us: monotonic, from any zero; an earlier one than before counts as the same.
  ///
  /// Work, at worst: entries of the map's index, in whole pages of BlockIndex; a look-up for each
  /// block changed since the last round through the index, and for a sixteenth of `blocks`;
  /// `compared` blocks read from map and publication, compared, rounded and published, each
  /// O(512 + voxels * components).
  ///
  /// leaving: blocks that are to leave the map. They are published first, as far as half of
  /// `compared` and the bytes allow. Once gone, those that Publication::whole does not know as
  /// archived are withdrawn, unless forget() was called.
  PublisherReport tick(const LocalMap& map, std::int64_t now_us, const PublisherBudget& budget,
                       const Publication& publication,
                       std::span<LeavingBlock> leaving = {}) noexcept;

  /// The block leaves the map without its evidence being wrong (MovingWindow evicts it): what was
  /// published of it stays. Should it come back, it is compared with that. Two look-ups.
  void forget(BlockKey key) noexcept;
  /// The block is whole again, and may have changed while it was not: it is compared with what was
  /// published of it. False: there is no room for it to wait. O(1).
  bool note_returned(BlockKey key) noexcept;
  /// Forgets all that was published and all that waits, for a map that was cleared and a
  /// publication that begins anew. Totals stay. O(blocks + candidates).
  void clear() noexcept;
  /// The map's stamp (MapReader::stamp) when the last round through its index began that missed no
  /// block; 0: none has ended. What changed before it is published, waits, or was left out and
  /// counted. While the map's is the same, nothing has changed that was not noted.
  [[nodiscard]] std::uint64_t noted_stamp() const noexcept { return noted_stamp_; }
  /// Blocks of the map that have changed since then and do not wait: those that nobody has heard
  /// of, and those that the round at hand has met and ticks have published. Nothing if a page of
  /// the index is being changed at every try. O(index).
  [[nodiscard]] std::optional<std::uint64_t> unnoted(const LocalMap& map) noexcept;

  [[nodiscard]] const PublisherTotals& totals() const noexcept { return totals_; }
  /// Blocks that are published and in the map, or wait.
  [[nodiscard]] std::size_t blocks() const noexcept { return index_.size(); }
  [[nodiscard]] std::uint32_t waiting() const noexcept {
    return labels_.wheel.waiting() + free_.wheel.waiting();
  }

 private:
  static constexpr std::size_t snapshot_words(int num_components) noexcept {
    return MapReader::most_snapshot_bytes(num_components) / sizeof(std::uint64_t) + 1;
  }
  static constexpr std::int64_t kNever = -1;
  static constexpr std::uint64_t kAllListed = ~std::uint64_t{0};
  struct Candidate {
    BlockKey key;
    std::int64_t labels_since_us = kNever;  ///< Since when labelled voxels may mean another thing.
    std::int64_t free_since_us = kNever;
    DueLink link;
    std::uint16_t published_labels = 0;  ///< Voxels with label evidence when it was published.
    bool published = false;
    bool fresh = false;   ///< New, or of many voxels more or fewer than published.
    bool gone = false;    ///< Not in the map any more.
    bool leaves = false;  ///< It is to leave the map: whatever differs is published.
  };
  static_assert(sizeof(Candidate) <= 48);
  /// Of two kinds: blocks with labelled voxels that have changed, and with others alone.
  struct Queue {
    DueWheel wheel{1};
    std::uint64_t bytes_q6 = 4096;  ///< What a block took, of those done with lately.
    [[nodiscard]] std::uint64_t expected_bytes() const noexcept {
      return wheel.waiting() * bytes_q6 / 64;
    }
    void note_bytes(std::uint32_t bytes) noexcept { bytes_q6 = bytes_q6 - bytes_q6 / 64 + bytes; }
  };
  /// A round through the map's index, over as many ticks as it takes.
  struct Round {
    std::size_t page = 0;  ///< The next, and its first slot.
    std::size_t slot = 0;
    std::uint64_t unchanged_stamp = 0;  ///< What has no newer stamp needs no look.
    std::uint64_t start_stamp = 0;
    std::int64_t unchanged_us = 0;  ///< When the newest of these stamps was given, or later.
    std::int64_t start_us = 0;
    std::uint64_t stop_moves = 0;  ///< Of the map's index, when it stopped within a page.
    bool going = false;
    bool complete = false;  ///< No block may have been missed so far.
  };
  struct Tick;
  /// Candidates as a wheel wants them.
  struct Links {
    std::span<Candidate> candidates;
    [[nodiscard]] DueLink& link(std::uint32_t number) const noexcept {
      return candidates[number - 1].link;
    }
  };

  [[nodiscard]] Candidate& candidate(std::uint32_t number) noexcept {
    return candidates_[number - 1];
  }
  [[nodiscard]] Queue& queue_of(const Candidate& waiting) noexcept {
    return waiting.labels_since_us != kNever ? labels_ : free_;
  }
  [[nodiscard]] bool is_near(BlockKey key) const noexcept;
  [[nodiscard]] std::int64_t due_of(const Candidate& waiting) const noexcept;
  void enqueue(std::uint32_t number, std::int64_t due_us) noexcept;
  void dequeue(std::uint32_t number) noexcept;
  /// A candidate for a block that does not wait yet; 0: no room for it, or for its key.
  std::uint32_t open(BlockKey key) noexcept;
  /// Back to what is published, or to what was never seen.
  void close(std::uint32_t number) noexcept;
  void release(std::uint32_t number) noexcept;

  void begin_tick(Tick& tick) noexcept;
  void begin_round(const Tick& tick) noexcept;
  void sweep(Tick& tick) noexcept;
  void end_round() noexcept;
  bool note(Tick& tick, const BlockNote& block) noexcept;
  bool read(Tick& tick, BlockKey key, BlockSnapshot& into) noexcept;
  void sweep_published(Tick& tick) noexcept;
  void work_off(Tick& tick, Queue& queue) noexcept;
  void set_timers(Candidate& waiting, const Difference& difference) const noexcept;
  /// The stamp of what it has seen of the block, if it is done with it; 0: the block waits again.
  std::uint64_t handle(Tick& tick, Queue& queue, std::uint32_t number) noexcept;
  void settle_leaving(Tick& tick, std::span<LeavingBlock> leaving) noexcept;
  void settle(Tick& tick, LeavingBlock& block) noexcept;
  [[nodiscard]] bool is_time(const Tick& tick, const Candidate& waiting,
                             const Difference& difference) const noexcept;
  /// False: it was refused, and the block waits again.
  bool publish(Tick& tick, Queue& queue, std::uint32_t number, std::uint32_t label_voxels) noexcept;
  void note_published(Tick& tick, const Candidate& waiting, const WireBytes& bytes) noexcept;
  void end_tick(Tick& tick) noexcept;

  PublisherConfig config_{};
  Significance significance_;
  KeyIndex index_;  ///< Of blocks: a candidate's number, or how many label voxels were published.
  std::span<Candidate> candidates_;
  std::uint32_t first_free_ = 0;  ///< Candidates that are not in use, by link.next.
  BlockContent published_;        ///< Scratch.
  BlockContent current_;
  std::span<BlockNote> notes_;          ///< Scratch: of a page of the map's index.
  std::span<std::uint64_t> workspace_;  ///< Scratch: of a block as it is read.
  Queue labels_;
  Queue free_;
  Round round_;
  std::uint64_t noted_stamp_ = 0;
  /// Blocks with a newer stamp may have found no room for their keys.
  std::uint64_t unlisted_stamp_ = kAllListed;
  std::size_t published_place_ = 0;
  std::size_t leaving_place_ = 0;
  BlockCoord focus_{};
  bool has_focus_ = false;
  Instant first_tick_;
  std::int64_t last_us_ = 0;  ///< Since the first tick.
  PublisherTotals totals_;
};

}  // namespace tessera
