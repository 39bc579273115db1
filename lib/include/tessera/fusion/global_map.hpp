// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One map of what all robots have seen: a pure function of their replicas, frames and the settings.
// A change marks the blocks that depend on it; step() brings them up to date, the nearest first.
// Once nothing waits, the map is what fusing everything anew would give, bit for bit.
#pragma once

#include <optional>
#include <span>

#include "tessera/fusion/global_map_config.hpp"
#include "tessera/fusion/internal/block_sums.hpp"
#include "tessera/fusion/internal/frame_moves.hpp"
#include "tessera/fusion/internal/fused_block.hpp"
#include "tessera/fusion/internal/global_records.hpp"
#include "tessera/fusion/internal/output_job.hpp"
#include "tessera/fusion/internal/robot_weights.hpp"
#include "tessera/fusion/internal/sum_store.hpp"
#include "tessera/fusion/internal/two_maps.hpp"
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
  /// make() where it is to be, without a copy of it on the stack: for one that is unusable yet, and
  /// stays so where this fails.
  [[nodiscard, gnu::noinline]] Status set_up(Arena& arena, const GlobalMapConfig& config,
                                             const ClassTable& classes) noexcept;
  /// Unusable until one from make() is move-assigned, or set_up().
  GlobalMap() noexcept = default;

  // --- What arrives ------------------------------------------------------------------------------

  /// The slot of a contribution, opened with this frame if it was not there. T_global_local, here
  /// and of set_frame(): T_world_local where robots are placed. Fails with
  /// kResourceExhausted iff all slots, or all Replicas::kMostRobots, are taken. O(contributions).
  [[nodiscard]] Result<Slot> open(const ContributionId& id,
                                  const GridTransform& T_global_local) noexcept;
  /// Takes a version of a part of a block (Replicas::put) and marks what depends on it. Fails with
  /// kInvalidArgument iff the slot is empty; kBusy iff it is being removed; kCorrupt iff packed is
  /// not empty and no packed block, or of objections no Objection, or of what a robot states about
  /// frames no is_frame_statement; kResourceExhausted as put(), and
  /// iff the global grid has no place for a block: counted, unchanged. O(bytes + contributions + 27
  /// blocks, 54 while its move is being marked). What a robot objects to (Objection) is put in the
  /// same way, and marks what it is against. What it states about frames marks nothing.
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
  /// it is as after. Moves that wait while another is under way are made together. session: what
  /// its robot states with this frame, if it is one; one that has none yet counts nothing. O(1).
  [[nodiscard]] Replicas::Change set_frame(Slot slot, const GridTransform& T_global_local,
                                           std::uint32_t revision,
                                           const MapSession& session = {}) noexcept {
    return moves_.set_frame(replicas_, slot, T_global_local, revision, session);
  }
  /// Where config.place_robots is set: has a robot's world lie at T_team_world, metres. Each of its
  /// contributions lies at GridTransform::compose(T_team_world, T_world_local); one that would be
  /// out of the grid is left out and counted. Nothing: the robot is left out, as one is that was
  /// never placed: its contributions and objections count nowhere, take versions and frames as
  /// before, and are there again once it is placed. This is a move as set_frame() is, which no
  /// revision orders: the last call counts. Places are kept of robots that have no contributions
  /// too. Where the setting is not set, robots lie as they state: nothing leaves one out, and the
  /// identity takes it back. kStale: as it was asked for before. Fails with kInvalidArgument iff
  /// the transform is not rigid (check_rigid), or is another than the identity where the setting is
  /// not set; kResourceExhausted iff Replicas::kMostRobots others have a place, or will have one,
  /// or are left out. O(kMostRobots), then O(all contributions) in one step, then as a move of the
  /// robot's.
  [[nodiscard]] Result<Replicas::Change> place(
      std::uint32_t robot, const std::optional<Matrix34d>& T_team_world) noexcept {
    return moves_.place(robot, T_team_world);
  }
  /// Where the setting is not set: whether a robot is left out. O(kMostRobots).
  [[nodiscard]] bool is_left_out(std::uint32_t robot) const noexcept {
    return moves_.places().is_left_out(robot);
  }
  /// The first of these from this number on; nothing: there is none. O(kMostRobots).
  [[nodiscard]] std::optional<std::uint32_t> next_left_out(std::uint32_t robot) const noexcept {
    return moves_.places().next_left_out(robot);
  }
  /// Whether a contribution or a robot moves, or is to. O(1).
  [[nodiscard]] bool moving() const noexcept { return moves_.busy(); }
  /// Takes a contribution out of the map, as a move, and then its replicas and its slot. Until that
  /// is done, put() for it fails with kBusy. Nothing happens where the slot is empty. O(1).
  void remove(Slot slot) noexcept;
  /// The same for each contribution of a robot that has a lower epoch. O(contributions).
  void remove_before(std::uint32_t robot, std::uint32_t epoch) noexcept;
  /// Whether remove() was called for what is in the slot, which is not gone yet. O(1).
  [[nodiscard]] bool leaving(Slot slot) const noexcept { return moves_.leaving(slot); }
  /// Where near comes first: a place in the global frame. Without it all places are alike, which
  /// takes the least work in all.
  void set_focus(std::optional<BlockCoord> focus) noexcept { records_.set_focus(focus); }

  // --- Work --------------------------------------------------------------------------------------

  /// Brings blocks up to date until none waits or so much work is done: entries read, edges and
  /// witnesses visited, places looked up. Over it by one quantum at most (docs/measured/timing.md):
  /// the sums of a block, the nodes of a brick gathered or linked, an iteration over them, a block
  /// written, a block of a move marked, up to 8 copied, a block of each contribution that leaves
  /// dropped, all robots weighed. Not counted: the look-ups of a block's halo, (2 ceil(halo / 8) +
  /// 1)^3, at most 125 for each block whose sums change. Returns the work done.
  std::uint64_t step(std::uint64_t budget) noexcept;
  /// Blocks that are behind.
  [[nodiscard]] std::uint32_t waiting() const noexcept {
    return records_.waiting() + job_.waiting();
  }
  /// Whether the map is behind what has arrived, or a move is under way.
  [[nodiscard]] bool busy() const noexcept {
    return waiting() != 0 || moves_.busy() || weights_.changed() || to_mark_.robots != 0;
  }

  // --- What is there -----------------------------------------------------------------------------

  /// The map, complete but while a finished move is copied into it: settled() says so.
  [[nodiscard]] const LocalMap& map() const noexcept { return maps_.map(); }
  [[nodiscard]] bool settled() const noexcept { return moves_.phase() != Phase::kMerging; }
  /// A voxel's estimate, for the thread that works; others have a GlobalReader each. At any moment
  /// all voxels are as before a move or all as after it.
  [[nodiscard]] Estimate query(VoxelCoord voxel) const noexcept {
    return maps_.query(voxel, !settled());
  }
  /// Counts completed moves, so that a reader can tell data of before from data of after.
  [[nodiscard]] std::uint64_t generation() const noexcept { return maps_.generation(); }
  /// For GlobalReader.
  [[nodiscard]] const TwoMaps& maps() const noexcept { return maps_; }
  [[nodiscard]] const Replicas& replicas() const noexcept { return replicas_; }
  [[nodiscard]] const GlobalMapConfig& config() const noexcept { return config_; }
  /// How far evidence may be from a block whose content depends on it, at most. O(1).
  [[nodiscard]] double dependence_m() const noexcept {
    const GridTransform::BlockRange around = job_.around({0, 0, 0});
    return 1.8 * kBlockEdge * config_.map.resolution_m * (around.last.x + 1);
  }
  /// Of its replicas (Replicas::fullness), the blocks of the global grid, the sums and the map's
  /// storage, whichever is fullest: in 1024 of all. Blocks that wait count as if they were new and
  /// as large as those that are there, at most twice what is there. O(1).
  [[nodiscard]] std::uint32_t fullness() const noexcept;
  /// What the others say of a robot's labels; complete once the map is not busy(). Fails with
  /// kOutOfRange iff nothing of the robot is there, or all of it is left out (place()).
  /// O(contributions + C).
  [[nodiscard]] Result<RobotReliability> reliability(std::uint32_t robot) const noexcept;
  /// And of those of one class, 1 .. C. Fails in the same way, and iff there is no such class.
  [[nodiscard]] Result<ClassReliability> reliability(std::uint32_t robot, int label) const noexcept;
  /// O(blocks + contributions).
  [[nodiscard]] GlobalMapReport report() const noexcept;
  /// Those of the report that only grow (refused_..., torn_blocks, saturated_voxels); what it
  /// measures is 0. O(1).
  [[nodiscard]] GlobalMapReport counters() const noexcept;

 private:
  using Phase = FrameMoves::Phase;
  [[nodiscard]] Result<Replicas::Change> put_objection(Slot slot, BlockKey place,
                                                       const PartVersion& version,
                                                       std::span<const std::byte> packed,
                                                       std::span<const std::byte> wire) noexcept;
  [[nodiscard]] Result<Replicas::Change> put_frame_statement(
      Slot slot, BlockKey place, const PartVersion& version, std::span<const std::byte> packed,
      std::span<const std::byte> wire) noexcept;
  /// The part of required_bytes that does not grow with the map, nor with its maps' config.
  [[nodiscard]] static constexpr std::size_t scratch_bytes(const GlobalMapConfig& config,
                                                           int num_components) noexcept;
  /// The rest of set_up(): on its own, so that the stack of one part is gone before the next.
  [[gnu::noinline]] Status set_up_replicas(Arena& arena, int components) noexcept;
  [[gnu::noinline]] Status set_up_moves(Arena& arena) noexcept;
  [[gnu::noinline]] Status set_up_fusion(Arena& arena, int components) noexcept;
  std::uint64_t work_on_moves(std::uint64_t budget) noexcept;
  std::uint64_t merge(std::uint64_t budget) noexcept;
  std::uint64_t work_on_job() noexcept;
  std::uint64_t update_first() noexcept;
  std::uint64_t update_sums(std::uint32_t number) noexcept;
  [[nodiscard]] bool keep_sums(std::uint32_t number, BlockCoord block) noexcept;
  [[nodiscard]] bool belongs_to_graph(std::uint64_t robots) const noexcept;
  void write_content(GlobalRecord& record, BlockCoord block) noexcept;
  void try_refused_again() noexcept;
  void keep_tallies(GlobalRecord& record, std::span<const LabelTally> tallies) noexcept;
  std::uint64_t weigh_robots(std::uint64_t budget) noexcept;
  [[nodiscard]] Result<std::uint8_t> bit_of(std::uint32_t robot) const noexcept;

  GlobalMapConfig config_{};
  TwoMaps maps_{};
  Replicas replicas_{};
  FrameMoves moves_{};
  GlobalRecords records_{};
  BlockSums adder_{};
  SumStore sums_{};
  OutputJob job_{};
  FusedBlock fused_{};  ///< Scratch.
  GlobalMapReport counted_{};
  bool any_refused_ = false;  ///< Blocks that had no room wait for some.
  RobotWeights weights_{};
  RobotWeights::Changed to_mark_{};  ///< Whose blocks are still to be marked.
  std::uint32_t next_to_mark_ = 1;   ///< The record that is next.
};

constexpr std::size_t GlobalMap::required_bytes(const GlobalMapConfig& config,
                                                int num_components) noexcept {
  return scratch_bytes(config, num_components) + TwoMaps::required_bytes(config) +
         Replicas::required_bytes(config.replicas) +
         SegmentStore::required_bytes(config.sum_segments) +
         GlobalRecords::required_bytes(config.blocks);
}

constexpr std::size_t GlobalMap::scratch_bytes(const GlobalMapConfig& config,
                                               int num_components) noexcept {
  return FrameMoves::required_bytes(config.replicas.contributions) + RobotPlaces::required_bytes() +
         OutputJob::required_bytes(config.diffusion, config.map.resolution_m, num_components) +
         FusedBlock::required_bytes(num_components) +
         BlockSums::required_bytes(config, num_components) +
         RobotWeights::required_bytes(most_robots(config.replicas), num_components) +
         arena_bytes<std::byte>(most_packed_bytes(num_components));
}

/// The replicas of a global map, which follows what changes there. global outlives it.
[[nodiscard]] ReplicaStore store_of(GlobalMap& global) noexcept;

}  // namespace tessera
