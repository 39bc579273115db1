// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map as a page is shown it: what has changed, and one voxel's counts. Read beside the thread
// that writes it, which never waits.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mapping/report.hpp"
#include "tessera/fusion/global_reader.hpp"
#include "tessera/map/map_reader.hpp"
#include "view/voxel_message.hpp"

namespace tessera {

/// What people are told of a map.
struct ViewMapInfo {
  std::string name;
  bool global = false;
  std::uint32_t robot = 0;
  Matrix34d T_global_map = Matrix34d::Identity();
  bool live = false;  ///< It may change.
  /// Names of VoxelMark::contributor; empty: not known.
  std::vector<std::string> contributors;
  /// Sets the marks of a block; none: every voxel is of contributor 0 alone if there is one, else
  /// of nobody.
  std::function<void(const BlockSnapshot&, BlockMarks&)> marks;
};

/// Voxels that may be sent now, and what looking for them costs.
class ViewBudget {
 public:
  /// voxels_per_s: 0: no limit.
  explicit ViewBudget(std::uint32_t voxels_per_s) : per_s_(voxels_per_s) {}
  /// now_us: monotonic. At most a second's worth is saved up.
  void renew(std::int64_t now_us) noexcept;
  [[nodiscard]] bool is_used_up() const noexcept { return per_s_ != 0 && left_ <= 0; }
  void take_voxels(std::uint32_t count) noexcept { left_ -= kNotes * std::int64_t{count}; }
  void take_notes(std::size_t count) noexcept { left_ -= static_cast<std::int64_t>(count); }

 private:
  /// A block that is only looked at costs this part of a voxel.
  static constexpr std::int64_t kNotes = 16;
  std::uint32_t per_s_;
  std::int64_t left_ = 0;  ///< In notes; a block more than there is may be taken.
  std::int64_t last_us_ = 0;
};

/// Not for several threads at once. Memory is taken when it is made: a block's content and a page
/// of the index.
class ViewMap {
 public:
  /// The map must outlive it and stay where it is.
  ViewMap(const LocalMap& map, ViewMapInfo info);
  ViewMap(const GlobalMap& global, ViewMapInfo info);

  [[nodiscard]] const ViewMapInfo& info() const { return info_; }
  [[nodiscard]] const LocalMap& map() const { return *map_; }  ///< For what never changes.

  /// Changed blocks from the cursor on, as many as fit into and the budget has: header, then
  /// blocks. Gives the bytes, and in header
  /// what was done. into: at least kViewHeaderBytes + kMostViewBlockBytes. Any cursor
  /// will do; a wrong one costs blocks sent twice or not at all.
  std::size_t put_changes(const ViewCursor& cursor, ViewHeader& header, ViewBudget& budget,
                          std::span<std::byte> into) noexcept;
  /// Keys of the blocks with labels of some pages of the index from `page` on, eight bytes each;
  /// the first eight bytes are the next page, 0 at the end. Gives the bytes.
  std::size_t put_keys(std::uint64_t page, ViewBudget& budget, std::span<std::byte> into) noexcept;
  /// All that is known of a voxel; null while it is being changed at every try. Numbers are text
  /// with nine significant digits, as query writes them. Uses the heap.
  [[nodiscard]] Json voxel(const Point3d& p_map);

 private:
  struct alignas(8) Word {
    std::byte bytes[8];
  };
  ViewMap(const LocalMap& map, const GlobalMap* global, ViewMapInfo info);
  /// What a message is made of while it is made.
  struct Message {
    ViewHeader& header;
    ViewBudget& budget;
    std::span<std::byte> into;
    std::size_t bytes = 0;
  };
  /// False, and it is not in the message, iff there is no room for it, the budget is used up, or it
  /// is being changed.
  [[nodiscard]] bool put_block(const BlockNote& note, Message& message) noexcept;
  /// What is left of the page at hand; true iff all of it was put.
  [[nodiscard]] bool put_page(Message& message) noexcept;
  [[nodiscard]] Result<BlockSnapshot> snapshot(BlockCoord block) noexcept;
  [[nodiscard]] Result<VoxelEvidence> evidence(VoxelCoord voxel) noexcept;

  ViewMapInfo info_;
  const LocalMap* map_;
  MapReader reader_;
  std::optional<GlobalReader> global_reader_;
  std::vector<Word> workspace_;
  std::vector<BlockNote> notes_;
  std::unique_ptr<BlockMarks> marks_;
};

}  // namespace tessera
