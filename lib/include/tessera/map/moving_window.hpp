// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map that follows the robot: blocks that it leaves behind are handed to an archive that the
// caller provides, and come back when it returns. A step before each scan, bounded work in each:
// what does not fit a step waits for the next ones and is reported.
//
// No evidence is lost: a block leaves the map only after the archive took it, and the archive lets
// go of it only after all of it is in the map. Where the archive has a block that the map has too
// (the robot came back faster than blocks are reloaded, or sees beyond the radius), their counts
// are added when they meet: the same counts as without a window, but for the order of float sums
// and, where the cap was reached, for what the cap took between.
#pragma once

#include <optional>

#include "tessera/base/counters.hpp"
#include "tessera/map/local_map.hpp"
#include "tessera/map/window_counters.h"

namespace tessera {

/// How far the window reaches and how much moves at a time.
struct WindowConfig {
  /// The farthest radius, in blocks.
  static constexpr double kMaxRadiusBlocks = 4096.0;

  /// Blocks with any part this near the robot belong to the window: above 0, and with the
  /// hysteresis at most kMaxRadiusBlocks. At least as far as scans reach, so that they meet no
  /// block that is archived.
  double radius_m = 50.0;
  /// How much farther than that a block is before it is evicted; from 0.
  double hysteresis_m = 2.0;
  std::uint32_t entries_per_step = 65536;  ///< Entries of the map's index looked at; from 1.
  std::uint32_t evictions_per_step = 512;  ///< Blocks handed to the archive; from 1.
  /// The same while the map has no room for reserve, whatever their label voxels; not under
  /// evictions_per_step.
  std::uint32_t pressed_evictions_per_step = 1024;
  std::uint32_t regions_per_step = 4096;  ///< Regions of the archive looked at; from 1.
  std::uint32_t reloads_per_step = 512;   ///< Blocks asked back from the archive; from 1.
  /// Voxels with label evidence in the blocks handed to the archive, and of those asked back; from
  /// 1. Beyond it a step hands out, and asks back, no further block: what a block costs is what is
  /// in it. To keep up, at least what scans add in a step.
  std::uint32_t label_voxels_per_step = 131072;
  SlabPool::Counts reserve{1024, 2048, 2048, 8192};
  /// Far blocks stay while the map has room for reserve: they leave, and others come back, as
  /// memory requires it. A step then goes around twice.
  bool keep_while_room = false;
  /// Where the map has no room for reserve after that, near blocks leave too, the farthest first,
  /// until it has: the window reaches less far, and farther again where there is room for an eighth
  /// more than reserve. Blocks come back while there is. reserve is then at least three halves of
  /// what the map was found to grow by from one step to the next, up to three quarters of it. With
  /// keep_while_room all leave that the archive takes, and from then on none comes back: what a
  /// scan adds is all that has to fit.
  bool evicts_near = false;
};

/// Blocks of a region, a cube of 8 x 8 x 8 blocks: bit y * 8 + x of word z.
using RegionMask = std::array<std::uint64_t, 8>;

/// The region of a block; regions are counted like blocks.
constexpr BlockCoord region_of(BlockCoord block) noexcept {
  return {block.x >> 3, block.y >> 3, block.z >> 3};
}

/// Where evicted blocks are kept. Functions must not change the map but as said.
struct BlockArchive {
  void* context = nullptr;
  /// Takes a block, and adds it to what there is of it already (restore_block does). False: it is
  /// not taken, nothing was changed, and it stays in the map.
  bool (*evict)(void* context, const LocalMap& map, const Block& block) = nullptr;
  /// The archived blocks of a region, valid until the next call of any function; nullptr: none.
  /// An archive that only takes has no such function.
  const RegionMask* (*archived)(void* context, BlockCoord region) = nullptr;
  /// Adds an archived block to the map and lets go of it. kResourceExhausted: the map has no room.
  /// Whatever fails, map and archive are as before.
  Status (*reload)(void* context, LocalMap& map, BlockKey key) = nullptr;
  /// Lets go of all blocks, as the map is cleared (Mapper::clear, a new submap of a Robot).
  void (*clear)(void* context) = nullptr;
};

/// What a step did and left.
struct WindowStep {
  Status position = Status::kOk;  ///< kOutOfRange: not in the grid; nothing was done.
  std::uint32_t entries = 0;      ///< Of the index, looked at.
  std::uint32_t regions = 0;      ///< Of the archive, looked at.
  std::uint32_t evicted = 0;
  std::uint32_t near_evicted = 0;       ///< Of these, within the window.
  std::uint32_t reach_blocks = 0;       ///< How far the window reaches now.
  std::uint32_t evictions_refused = 0;  ///< By the archive: the blocks stay in the map.
  std::uint32_t reloaded = 0;
  std::uint32_t merged = 0;          ///< Of these, added to a block that the map had.
  std::uint32_t reloads_failed = 0;  ///< For other reasons than lack of room.
  bool no_room = false;              ///< There was no room for a block that should come back.
  /// Blocks seen that should go and are still there, and that should come back and did not. All of
  /// them, where entries and regions a step cover the map and the window.
  std::uint32_t eviction_backlog = 0;
  std::uint32_t reload_backlog = 0;
};

/// Sums over steps.
struct WindowReport {
  TESSERA_WINDOW_COUNTERS(TESSERA_COUNTER_MEMBER)

  void add(const WindowStep& step) noexcept;
};
TESSERA_COUNTER_TABLE(WindowReport, TESSERA_WINDOW_COUNTERS(TESSERA_COUNTER_ROW))

class MovingWindow {
 public:
  /// Fails with kInvalidArgument iff a value is outside its documented range or resolution_m is not
  /// above 0.
  [[nodiscard]] static Result<MovingWindow> make(const WindowConfig& config,
                                                 double resolution_m) noexcept;
  /// No window: everything is far.
  MovingWindow() noexcept = default;

  /// To be called before a scan from p_map (metres) is integrated. Evicts blocks that are farther
  /// than radius and hysteresis, then reloads those within the radius; both go around in a fixed
  /// order and go on where the last step ended, so that the same calls give the same map.
  ///
  /// Worst-case work, wherever the robot jumps: entries_per_step + 7 keys compared twice,
  /// pressed_evictions_per_step blocks handed out and closed (64 octets each), and that many and 7
  /// more that the archive refuses, regions_per_step regions of 512 bits tested, reloads_per_step
  /// blocks asked back. While there is room for reserve, no further block after
  /// label_voxels_per_step voxels in those handed out, and always in those asked back. Where near
  /// blocks leave, blocks handed out and refusals once more, and keys 2 kDrawings + 1 times more.
  /// No memory of its own.
  WindowStep step(LocalMap& map, const Point3d& p_map, const BlockArchive& archive) noexcept;
  /// The map has room for the reserve.
  [[nodiscard]] bool has_room(const LocalMap& map) const noexcept { return map.fits(reserve_); }

 private:
  enum class Which : std::uint8_t { kFar, kNear };
  /// How many blocks may still leave in a step.
  struct Allowance {
    std::uint32_t left = 0;
    std::uint32_t refusals_left = 0;
    bool pressed = false;
    std::uint64_t voxels = 0;
  };
  static constexpr int kDrawings = 4;  ///< In a step, of an eighth of the blocks up to all of them.
  [[nodiscard]] std::int64_t square_distance(BlockCoord block) const noexcept;
  [[nodiscard]] bool keeps_all(const LocalMap& map) const noexcept {
    return config_.keep_while_room && has_room(map);
  }
  /// There is room for what comes back and for the scan.
  [[nodiscard]] bool has_ample_room(const LocalMap& map) const noexcept {
    return !draws_in() || map.fits(ample_);
  }
  /// Near blocks leave and come back.
  [[nodiscard]] bool draws_in() const noexcept {
    return config_.evicts_near && !config_.keep_while_room;
  }
  void learn(const LocalMap& map) noexcept;
  [[nodiscard]] Allowance allowance(const LocalMap& map) const noexcept;
  void evict_far(LocalMap& map, const BlockArchive& archive, WindowStep& report) noexcept;
  void evict_near(LocalMap& map, const BlockArchive& archive, WindowStep& report) noexcept;
  void draw_in(const LocalMap& map, int eighths) noexcept;
  void evict(Which which, LocalMap& map, const BlockArchive& archive, Allowance& allowance,
             WindowStep& report) noexcept;
  void reload_near(LocalMap& map, const BlockArchive& archive, WindowStep& report) noexcept;
  void reload_region(LocalMap& map, const BlockArchive& archive, BlockCoord region,
                     WindowStep& report) noexcept;
  void reload_block(LocalMap& map, const BlockArchive& archive, BlockCoord block,
                    WindowStep& report) noexcept;

  WindowConfig config_{};
  SlabPool::Counts reserve_{};
  SlabPool::Counts ample_{};  ///< More than the reserve, so that few blocks come and go.
  std::optional<SlabPool::Counts> left_{};  ///< What the last step left in use.
  std::int64_t near_square_ = 0;            ///< Between the centres of blocks, in blocks.
  std::int64_t far_square_ = 0;
  std::int64_t held_square_ = 0;  ///< As near_square_, where memory is short: less, down to -1.
  std::int32_t reach_blocks_ = 0;
  BlockCoord robot_{};
  bool near_left_ = false;  ///< Near blocks had to leave.
  SweepCursor cursor_{};
  std::uint64_t region_cursor_ = 0;
  std::uint64_t reloaded_voxels_ = 0;  ///< Of the step at hand.
};

}  // namespace tessera
