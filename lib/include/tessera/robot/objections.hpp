// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What this robot objects to of what others, and its own earlier submaps, say
// (docs/design/theory.md, The team clears together). Voxels that are occupied in a contribution and
// free in the robot's own map are watched. Through those that scans see surely, after the block's
// version was heard, the robot objects to. A block of its own that others object to, and in which a
// scan meets something again, it publishes again. No clock is read.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/counters.hpp"
#include "tessera/exchange/exchange.hpp"
#include "tessera/fusion/global_map.hpp"
#include "tessera/map/map_reader.hpp"
#include "tessera/registration/scan.hpp"
#include "tessera/robot/objection_counters.h"

namespace tessera {

/// How this robot's objections stand.
struct ObjectionsReport {
  TESSERA_OBJECTION_COUNTERS(TESSERA_COUNTER_MEMBER)
};
TESSERA_COUNTER_TABLE(ObjectionsReport, TESSERA_OBJECTION_COUNTERS(TESSERA_COUNTER_ROW))

class Objections {
 public:
  /// Blocks that are watched at a time.
  static constexpr std::uint32_t kWatched = 256;
  /// Voxels that one scan is asked about, at most.
  static constexpr std::size_t kMostPoints = 512;
  /// Scans that must see through a voxel of a class that may move, and of another one; twice as
  /// many each time that an objection to the block has lapsed, up to five times.
  static constexpr std::uint8_t kScansMoving = 2;
  static constexpr std::uint8_t kScans = 5;

  /// most: objections that are followed; 0: none are made. num_components: C + 2.
  [[nodiscard]] static constexpr std::size_t required_bytes(std::uint32_t most,
                                                            int num_components) noexcept {
    return most == 0 ? 0
                     : arena_bytes<Made>(most) + arena_bytes<Watch>(kWatched) +
                           arena_bytes<Voxels>(1) + BlockContent::required_bytes(num_components) +
                           arena_bytes<std::byte>(most_packed_bytes(num_components));
  }
  /// Fails with kResourceExhausted iff the arena is too small. exchange, global: those of the
  /// sharer; they must outlive it.
  [[nodiscard]] static Result<Objections> make(Arena& arena, std::uint32_t most, Exchange& exchange,
                                               const GlobalMap& global) noexcept;
  /// Makes none.
  Objections() noexcept = default;

  /// Where the robot is, and what it maps into.
  struct Here {
    const LocalMap& map;
    ContributionId own;  ///< As the map is published: not objected to.
    Matrix34d T_global_map = Matrix34d::Identity();
    Point3d p_global = Point3d::Zero();
  };
  /// Goes on looking for blocks that others say are occupied, objects to what was seen through, and
  /// publishes again what others object to and its own scans meet. The map may be written to
  /// meanwhile. O(contributions + most + kLooks records + kReads blocks of 512 voxels, each with at
  /// most 19 look-ups in the map + kAnswers objections of others, each with a block).
  void tick(const Here& here) noexcept;
  /// Voxels' centres to be asked of the next scan (ScanView::watched), in the frame of a submap; as
  /// far as into goes. moment: now, by whatever clock or count the scans have. Returns how many.
  /// O(into + kWatched).
  [[nodiscard]] std::size_t place(const Matrix34d& T_map_global, std::int64_t moment,
                                  std::span<WatchedPoint> into) noexcept;
  /// What a scan told of them. taken: its moment. Of a block it counts only if that is after the
  /// block was first asked about, hence heard. O(points).
  void note(std::span<const WatchedPoint> watched, std::int64_t taken) noexcept;
  /// The epoch was left: what was said in it is not followed any more. O(most).
  void begin_epoch() noexcept;

  [[nodiscard]] const ObjectionsReport& report() const noexcept { return report_; }

 private:
  using Slot = Replicas::Slot;
  static constexpr std::uint32_t kLooks = 1024;
  static constexpr std::uint32_t kReads = 48;
  static constexpr std::uint32_t kAnswers = 64;  ///< Objections of others that a tick looks at.
  static constexpr std::uint32_t kFollowed = 16;
  static constexpr std::ptrdiff_t kMostAnswers = 64;  ///< Blocks watched for that.
  static constexpr std::uint8_t kMostLapses = 5;
  static constexpr double kReach_m = 40.0;
  static constexpr std::uint32_t kMostTicks = 200;  ///< Without being seen through.
  static constexpr std::uint32_t kGatherTicks = 5;  ///< From the first voxel to the objection.

  /// Of a block as it was heard.
  struct Heard {
    ContributionId id;
    BlockKey key{};
    std::uint32_t version = 0;
    friend bool operator==(const Heard&, const Heard&) = default;
  };
  struct Watch {
    Heard heard{};
    std::uint32_t number = 0;  ///< 0: none. Of this watch; kWatched apart in one place.
    FrameStamp frame{};        ///< Of its contribution.
    bool is_asked = false;
    std::int64_t asked_at = 0;    ///< When first.
    std::uint32_t ticks = 0;      ///< Since it began, or a voxel was seen through.
    std::uint32_t gathering = 0;  ///< Ticks, from the first one on.
    bool answers = false;         ///< It is of what this robot publishes, and others object to.
    bool is_hit = false;
    std::uint8_t lapses = 0;  ///< Of objections to what it said before.
    GridTransform T_global_local;
    VoxelMask asked{};
    VoxelMask moving{};
    VoxelMask seen{};  ///< By enough scans, and not objected to yet.
    std::array<std::uint8_t, kBlockVoxels> times{};
  };
  struct Made {
    Heard heard{};
    bool used = false;
    bool holds = false;  ///< It is of the version that is heard.
    FrameStamp frame{};
    std::uint8_t lapses = 0;  ///< Each time more scans are needed.
  };
  /// A block's content: evidence that it is occupied, and how much of it may move.
  struct Voxels {
    std::array<float, kBlockVoxels> labels{};
    std::array<float, kBlockVoxels> moving{};
    std::array<std::uint16_t, kBlockVoxels> passes{};
  };

  void look(const Here& here) noexcept;
  [[nodiscard]] bool is_near(const Here& here, const Replicas::Contribution& one) const noexcept;
  void look_at(const Here& here, Slot slot, const Replicas::Replica& record) noexcept;
  [[nodiscard]] bool hear(Slot slot, BlockKey key, Heard& heard) noexcept;
  [[nodiscard]] Point3d centre_of(const GridTransform& T_global_local,
                                  const VoxelCoord& voxel) const noexcept;
  void watch(const Here& here, Slot slot, const Heard& heard) noexcept;
  [[nodiscard]] Watch* watch_of(const Heard& heard) noexcept;
  void follow_watches(const Here& here) noexcept;
  void forget_frames(const Here& here) noexcept;
  void withdraw(Made& made) noexcept;
  [[nodiscard]] bool find_own(const Heard& heard, Objection& into) const noexcept;
  void object(Watch& watch) noexcept;
  [[nodiscard]] Made* made_against(const ContributionId& id, BlockKey key) noexcept;
  void follow_made() noexcept;
  void hear_objections(const Here& here) noexcept;
  /// False: there is more of it, but not in this tick.
  [[nodiscard]] bool hear_objections_of(Slot slot, const Here& here, Slot own,
                                        std::uint32_t& looks) noexcept;
  void answer(Slot own, const Objection& objection) noexcept;
  [[nodiscard]] Watch* new_watch(const Heard& heard, Slot slot) noexcept;
  void publish_again(const Heard& heard) noexcept;

  Exchange* exchange_ = nullptr;
  const GlobalMap* global_ = nullptr;
  std::span<Made> made_;
  std::span<Watch> watches_;
  Voxels* voxels_ = nullptr;
  std::span<std::byte> packed_;  ///< Scratch: a block's part.
  BlockContent content_{};       ///< Scratch.
  std::uint64_t moving_classes_ = 0;
  // Where looking goes on.
  ContributionId looking_at_{};
  std::optional<BlockKey> next_key_{};  ///< Of that contribution; none: its first.
  std::uint32_t next_made_ = 0;
  std::uint32_t next_followed_ = 0;
  bool has_frame_ = false;
  Matrix34d T_global_map_ = Matrix34d::Identity();  ///< At the last tick.
  ContributionId answering_{};
  std::optional<BlockKey> next_answer_{};
  std::uint32_t next_place_ = 0;
  std::uint32_t numbers_ = 0;
  ObjectionsReport report_{};
};

}  // namespace tessera
