// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map for a page: changed blocks, and the counts of one voxel. Reads in parallel to the writing
// thread, which never waits.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/arena_memory.hpp"
#include "base/json.hpp"
#include "tessera/fusion/global_reader.hpp"
#include "tessera/map/map_reader.hpp"
#include "view/voxel_message.hpp"

namespace tessera {

/// Description of a map for users.
struct ViewMapInfo {
  std::string name;
  bool global = false;
  std::uint32_t robot = 0;
  Matrix34d T_global_map = Matrix34d::Identity();
  bool live = false;  ///< The map may change.
  /// Names of VoxelMark::contributor; empty: not known.
  std::vector<std::string> contributors;
  /// Sets the marks of a block; none: every voxel is of contributor 0 only if there is one, else of
  /// none.
  std::function<void(const BlockSnapshot&, BlockMarks&)> marks;
};

/// Budget of voxels that may be sent now, including the cost of the search.
class ViewBudget {
 public:
  /// voxels_per_s: 0: no limit.
  explicit ViewBudget(std::uint32_t voxels_per_s) : per_s_(voxels_per_s) {}
  /// now_us: monotonic. Saves up at most the budget of one second.
  void renew(std::int64_t now_us) noexcept;
  [[nodiscard]] bool is_used_up() const noexcept { return per_s_ != 0 && left_ <= 0; }
  void take_voxels(std::uint32_t count) noexcept { left_ -= kNotes * std::int64_t{count}; }
  void take_notes(std::size_t count) noexcept { left_ -= static_cast<std::int64_t>(count); }

 private:
  /// Cost of checking a block, as a fraction of a voxel.
  static constexpr std::int64_t kNotes = 16;
  std::uint32_t per_s_;
  std::int64_t left_ = 0;  ///< In notes; may be exceeded by one block.
  std::int64_t last_us_ = 0;
};

/// For one thread at a time. Allocates memory at construction: a block's content and a page of the
/// index.
class ViewMap {
 public:
  /// The map must outlive it, at the same address.
  ViewMap(const LocalMap& map, ViewMapInfo info);
  ViewMap(const GlobalMap& global, ViewMapInfo info);

  [[nodiscard]] const ViewMapInfo& info() const { return info_; }
  [[nodiscard]] const LocalMap& map() const { return *map_; }  ///< For constants.

  /// Writes changed blocks from the cursor, as many as fit into the memory and the budget: header,
  /// then blocks. Returns the bytes, and in header the result. into: at least kViewHeaderBytes +
  /// kMostViewBlockBytes. Accepts any cursor; with an invalid one blocks are repeated or missing.
  std::size_t put_changes(const ViewCursor& cursor, ViewHeader& header, ViewBudget& budget,
                          std::span<std::byte> into) noexcept;
  /// Writes keys of the blocks with labels in some pages of the index from `page`, eight bytes
  /// each; the first eight bytes are the next page, 0 at the end. Returns the bytes.
  std::size_t put_keys(std::uint64_t page, ViewBudget& budget, std::span<std::byte> into) noexcept;
  /// Everything about a voxel; null if it was changed during every try. Numbers are text with nine
  /// significant digits, as of query. Uses the heap.
  [[nodiscard]] Json voxel(const Point3d& p_map);

 private:
  ViewMap(const LocalMap& map, const GlobalMap* global, ViewMapInfo info);
  /// A message under construction.
  struct Message {
    ViewHeader& header;
    ViewBudget& budget;
    std::span<std::byte> into;
    std::size_t bytes = 0;
  };
  /// Adds a block. False, and nothing is added, iff there is no room for it, the budget is used up,
  /// or it is being changed.
  [[nodiscard]] bool put_block(const BlockNote& note, Message& message) noexcept;
  /// Adds the rest of the current page; true iff all of it was added.
  [[nodiscard]] bool put_page(Message& message) noexcept;
  [[nodiscard]] Result<BlockSnapshot> snapshot(BlockCoord block) noexcept;
  [[nodiscard]] Result<VoxelEvidence> evidence(VoxelCoord voxel) noexcept;

  ViewMapInfo info_;
  const LocalMap* map_;
  MapReader reader_;
  std::optional<GlobalReader> global_reader_;
  ArenaMemory workspace_;
  std::vector<BlockNote> notes_;
  std::unique_ptr<BlockMarks> marks_;
};

}  // namespace tessera
