// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One map of what all robots have seen: a pure function of their replicas, frames and the settings.
// A change marks the blocks that depend on it; step() brings them up to date, the nearest first.
// Once nothing waits, the map is what fusing everything anew would give, bit for bit.
#pragma once

#include <optional>
#include <span>

#include "tessera/fusion/global_map_config.hpp"
#include "tessera/fusion/internal/agenda.hpp"
#include "tessera/fusion/internal/diffusion_brick.hpp"
#include "tessera/fusion/internal/robot_share.hpp"
#include "tessera/map/internal/packed_block.hpp"
#include "tessera/map/local_map.hpp"
#include "tessera/replica/replica_store.hpp"

namespace tessera {

class GlobalMap {
 public:
  using Slot = Replicas::Slot;

  [[nodiscard]] static constexpr std::size_t required_bytes(const GlobalMapConfig& config,
                                                            int num_components) noexcept;
  /// Fails with kInvalidArgument iff a setting is out of its range; kResourceExhausted iff the
  /// arena is too small.
  [[nodiscard]] static Result<GlobalMap> make(Arena& arena, const GlobalMapConfig& config,
                                              const ClassTable& classes) noexcept;
  /// Unusable until one from make() is move-assigned.
  GlobalMap() noexcept = default;

  // --- What arrives ------------------------------------------------------------------------------

  /// The slot of a contribution, opened with this frame if it was not there. Fails with
  /// kResourceExhausted iff all slots, or all Replicas::kMostRobots, are taken. O(contributions).
  [[nodiscard]] Result<Slot> open(const ContributionId& id,
                                  const GridTransform& T_global_local) noexcept;
  /// Takes a version of a part of a block (Replicas::put) and marks what depends on it. Fails with
  /// kInvalidArgument iff the slot is empty; kBusy iff it is being removed; kCorrupt iff packed is
  /// not empty and no packed block; kResourceExhausted as put(), and iff the global grid has no
  /// place for a block: counted, unchanged. O(bytes + contributions + 27 blocks, 54 while its move
  /// is being marked).
  [[nodiscard]] Result<Replicas::Change> put(Slot slot, BlockKey key, const PartVersion& version,
                                             std::span<const std::byte> packed,
                                             std::span<const std::byte> wire = {}) noexcept;
  /// The same for a whole block.
  [[nodiscard]] Result<Replicas::Change> put(Slot slot, BlockKey key, std::uint32_t version,
                                             std::span<const std::byte> packed) noexcept {
    return put(slot, key, {.number = version, .first = version}, packed);
  }
  /// Moves a contribution to another frame with nothing sent anew, if revision is later than that
  /// of the frame it has or waits for. Until the move is complete the map is as before, then all of
  /// it is as after. Moves that wait while another is under way are made together. O(1).
  [[nodiscard]] Replicas::Change set_frame(Slot slot, const GridTransform& T_global_local,
                                           std::uint32_t revision) noexcept;
  /// Takes a contribution out of the map, as a move, and then its replicas and its slot. Until that
  /// is done, put() for it fails with kBusy. Nothing happens where the slot is empty. O(1).
  void remove(Slot slot) noexcept;
  /// The same for each contribution of a robot that has a lower epoch. O(contributions).
  void remove_before(std::uint32_t robot, std::uint32_t epoch) noexcept;
  /// Whether remove() was called for what is in the slot, which is not gone yet. O(1).
  [[nodiscard]] bool leaving(Slot slot) const noexcept { return moves_[slot].leaves; }
  /// Where near comes first: a place in the global frame. Without it all places are alike, which
  /// takes the least work in all.
  void set_focus(std::optional<BlockCoord> focus) noexcept { focus_ = focus; }

  // --- Work --------------------------------------------------------------------------------------

  /// Brings blocks up to date until none waits or so much work is done: entries read, edges
  /// visited, places looked up. Over it by one quantum at most (docs/measured/timing.md): the sums
  /// of a block, the nodes of a brick gathered or linked, an iteration over them, a block written,
  /// a block of a move marked, up to 8 copied, a block of each contribution that leaves dropped.
  /// Not counted: the look-ups of a block's halo, (2 ceil(halo / 8) + 1)^3, at most 125 for each
  /// block whose sums change. Returns the work done.
  std::uint64_t step(std::uint64_t budget) noexcept;
  /// Blocks that are behind.
  [[nodiscard]] std::uint32_t waiting() const noexcept {
    return agenda_.waiting() + job_.last - job_.first;
  }
  /// Whether the map is behind what has arrived, or a move is under way.
  [[nodiscard]] bool busy() const noexcept {
    return waiting() != 0 || phase_ != Phase::kSettled || moves_waiting_ != 0;
  }

  // --- What is there -----------------------------------------------------------------------------

  /// The map, complete but while a finished move is copied into it: settled() says so.
  [[nodiscard]] const LocalMap& map() const noexcept { return *map_; }
  [[nodiscard]] bool settled() const noexcept { return phase_ != Phase::kMerging; }
  /// A voxel's estimate, for the thread that works; others have a GlobalReader each. At any moment
  /// all voxels are as before a move or all as after it.
  [[nodiscard]] Estimate query(VoxelCoord voxel) const noexcept;
  /// Counts completed moves, so that a reader can tell data of before from data of after.
  [[nodiscard]] std::uint64_t generation() const noexcept { return view_ / 2; }
  [[nodiscard]] const Replicas& replicas() const noexcept { return replicas_; }
  [[nodiscard]] const GlobalMapConfig& config() const noexcept { return config_; }
  /// O(blocks).
  [[nodiscard]] GlobalMapReport report() const noexcept;
  /// Those of the report that only grow (refused_..., torn_blocks, saturated_voxels); what it
  /// measures is 0. O(1).
  [[nodiscard]] const GlobalMapReport& counters() const noexcept { return counted_; }

 private:
  friend class GlobalReader;
  /// Sums over nodes, in 2^-40: whole numbers, so that their order does not matter.
  struct NodeStatistics {
    std::uint64_t variance = 0;
    std::uint64_t variance_undiffused = 0;
    std::uint32_t nodes = 0;
    float largest_sum = 0.0F;
    float largest_change = 0.0F;
  };
  struct Record {
    std::uint64_t key = 0;
    std::uint64_t robots = 0;   ///< With label evidence here.
    std::uint64_t classes = 0;  ///< Of its sums, where it is part of the graph.
    SegmentStore::Chain sums = 0;
    std::uint32_t sums_bytes = 0;
    bool output_due = false;  ///< Though what is due first are sums.
    bool moving = false;      ///< What a move that is under way makes of it is not staged yet.
    bool hidden = false;      ///< What it gives while a move is under way is staged.
    AgendaLink link{};
    NodeStatistics statistics{};
  };
  struct Records {
    std::span<Record> all;
    [[nodiscard]] Record& at(std::uint32_t number) const noexcept { return all[number - 1]; }
    [[nodiscard]] AgendaLink& link(std::uint32_t number) const noexcept { return at(number).link; }
  };

  /// Blocks whose outputs are under way, from step to step: nothing else is brought up to date
  /// meanwhile, so that the sums stay as they were gathered.
  struct Job {
    enum class Stage : std::uint8_t { kNone, kLinking, kIterating, kFinishing };
    Stage stage = Stage::kNone;
    int edge = DiffusionBrick::kMostBlocks;  ///< Blocks of the cube that the next one is part of.
    std::uint32_t first = 0;                 ///< In box_blocks_: of those that are not finished.
    std::uint32_t last = 0;
  };

  /// A move: first all blocks that it touches are marked, then they are brought up to date beside
  /// the map, then they are shown, all at once, and copied into the map.
  enum class Phase : std::uint8_t { kSettled, kMarking, kStaging, kMerging };
  struct Move {
    GridTransform to;  ///< Of the move that is under way.
    std::uint32_t revision = 0;
    bool under_way = false;
    bool leaves = false;  ///< It is to be removed, or is being.
    bool waits = false;   ///< For the moves that are under way to end.
    GridTransform next;
    std::uint32_t next_revision = 0;
  };

  static constexpr std::size_t cube(int edge) noexcept {
    const auto e = static_cast<std::size_t>(edge);
    return e * e * e;
  }
  static constexpr MapConfig staged_config(const GlobalMapConfig& config) noexcept {
    MapConfig staged = config.map;
    staged.storage_bytes = config.staged_bytes;
    return staged;
  }
  /// The part of required_bytes that does not grow with the map.
  [[nodiscard]] static constexpr std::size_t scratch_bytes(const GlobalMapConfig& config,
                                                           int num_components) noexcept;
  /// The rest of make(): on its own, so that the stack of one part is gone before the next.
  [[gnu::noinline]] static Result<GlobalMap> around(Arena& arena, const GlobalMapConfig& config,
                                                    std::span<LocalMap> maps,
                                                    int components) noexcept;
  [[gnu::noinline]] Status set_up(Arena& arena, const GlobalMapConfig& config,
                                  std::span<LocalMap> maps, int components) noexcept;
  std::uint64_t work_on_moves(std::uint64_t budget) noexcept;
  std::uint64_t update_first() noexcept;
  void begin_moves() noexcept;
  std::uint64_t mark_moves(std::uint64_t budget) noexcept;
  std::uint64_t merge_staged(std::uint64_t budget) noexcept;
  std::uint64_t drop_replicas(Slot slot, std::uint64_t budget) noexcept;
  void show_moves() noexcept;
  /// What a mark is part of: an update, a move that waits for it, or an update of what moves.
  enum class Part : std::uint8_t { kUpdate, kMove, kMovedUpdate };
  void set_part(Record& record, Part part) noexcept;
  void moved(Record& record) noexcept;
  [[nodiscard]] bool stage_content(BlockCoord block) noexcept;
  void show_content(BlockCoord block) noexcept;
  [[nodiscard]] std::uint32_t find_record(BlockCoord block) const noexcept;
  [[nodiscard]] std::uint32_t open_record(BlockCoord block) noexcept;
  void close_record(std::uint32_t number) noexcept;
  [[nodiscard]] bool open_records(const GridTransform& T_global_local, BlockCoord local,
                                  Part part) noexcept;
  void mark(std::uint32_t number, Agenda::Work work) noexcept;
  void mark_halo(BlockCoord block, Part part) noexcept;
  [[nodiscard]] static Part part_of(const Record& record) noexcept;
  [[nodiscard]] bool belongs_to_graph(std::uint64_t robots) const noexcept;

  std::uint64_t update_sums(std::uint32_t number) noexcept;
  std::uint64_t add_contributions(BlockCoord block, std::uint64_t& robots) noexcept;
  std::uint64_t add_robot(std::span<const Slot> contributions, BlockCoord block,
                          std::uint64_t& robots) noexcept;
  std::uint64_t add_contribution(Slot slot, BlockCoord block, bool& labelled) noexcept;
  std::uint64_t add_local_block(const Replicas::Contribution& contribution, Slot slot,
                                BlockCoord local, BlockCoord block, bool& labelled) noexcept;
  std::uint64_t add_replica(const Replicas::Contribution& contribution,
                            const Replicas::Replica& replica, BlockCoord block,
                            bool& labelled) noexcept;
  void add_priors() noexcept;
  enum class Stored : std::uint8_t { kAsBefore, kAnew, kNoRoom };
  [[nodiscard]] Stored store_sums(Record& record) noexcept;
  bool drop_sums(Record& record) noexcept;

  std::uint64_t begin_job(std::uint32_t number) noexcept;
  std::uint64_t go_on() noexcept;
  [[nodiscard]] std::span<const std::uint32_t> find_sums(const BlockBox& box,
                                                         std::uint64_t& classes) noexcept;
  [[nodiscard]] bool gather(const BlockBox& box, std::uint64_t& work) noexcept;
  [[nodiscard]] BlockBox waiting_around(BlockCoord block, int edge) const noexcept;
  [[nodiscard]] static bool waits_for_output(const Record& record) noexcept;
  [[nodiscard]] std::span<const std::byte> read_sums(const Record& record) noexcept;
  std::uint64_t finish_block(Record& record) noexcept;
  template <class Change>
  NodeStatistics measure_nodes(Change&& change) noexcept;
  [[nodiscard]] NodeStatistics measure_sums() noexcept;
  void diffuse_node(VoxelCoord node, int row, NodeStatistics& statistics) noexcept;
  void write_content(Record& record) noexcept;
  void scale_to_passes() noexcept;
  [[nodiscard]] Estimate estimate_at(int row) const noexcept;

  GlobalMapConfig config_{};
  LocalMap* map_ = nullptr;  ///< In the arena, for they are large.
  LocalMap* staged_ = nullptr;
  Replicas replicas_{};
  SegmentStore sums_{};
  BlockIndex index_{};
  Records records_{};
  std::uint32_t records_used_ = 0;
  std::uint32_t free_records_ = 0;
  std::uint32_t blocks_ = 0;
  Agenda agenda_{};
  std::span<Move> moves_;  ///< By slot.
  Phase phase_ = Phase::kSettled;
  std::uint32_t moves_waiting_ = 0;
  std::uint32_t records_moving_ = 0;
  /// Twice the generation; one more while what is staged hides what the map has. Other threads
  /// read it.
  std::uint64_t view_ = 0;
  SweepCursor merged_{};
  Slot marked_slot_ = 0;
  std::uint32_t marked_record_ = 0;  ///< The next to be marked.
  bool marking_slot_ = false;
  std::optional<BlockCoord> focus_;
  DiffusionBrick brick_{};
  Job job_{};
  std::span<std::uint32_t> box_blocks_;   ///< Scratch: records of a job's box.
  std::span<std::uint32_t> near_blocks_;  ///< Scratch: records that a job depends on.
  BlockContent content_{};
  RobotShare share_{};
  std::span<std::uint8_t> observers_;  ///< Local voxels that went to each voxel of content_.
  std::span<std::byte> packed_;        ///< Scratch for one packed block.
  GlobalMapReport counted_{};
};

constexpr std::size_t GlobalMap::required_bytes(const GlobalMapConfig& config,
                                                int num_components) noexcept {
  return scratch_bytes(config, num_components) + tessera::required_bytes(config.map) +
         tessera::required_bytes(staged_config(config)) +
         Replicas::required_bytes(config.replicas) +
         SegmentStore::required_bytes(config.sum_segments) +
         BlockIndex::required_bytes(config.blocks) + arena_bytes<Record>(config.blocks);
}

constexpr std::size_t GlobalMap::scratch_bytes(const GlobalMapConfig& config,
                                               int num_components) noexcept {
  return arena_bytes<LocalMap>(2) + arena_bytes<Move>(config.replicas.contributions) +
         DiffusionBrick::required_bytes(config.diffusion, config.map.resolution_m, num_components) +
         arena_bytes<std::uint32_t>(cube(DiffusionBrick::kMostBlocks)) +
         arena_bytes<std::uint32_t>(cube(DiffusionBrick::kMostEdge / kBlockEdge)) +
         BlockContent::required_bytes(num_components) + RobotShare::required_bytes(num_components) +
         arena_bytes<std::uint8_t>(kBlockVoxels) +
         arena_bytes<std::byte>(most_packed_bytes(num_components));
}

/// The replicas of a global map, which follows what changes there. global outlives it.
[[nodiscard]] ReplicaStore store_of(GlobalMap& global) noexcept;

}  // namespace tessera
