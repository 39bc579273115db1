// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What two maps are aligned by: a map's surfaces and free space in coarse cells, in fixed memory, a
// function of the map's content alone.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/internal/radix_sort.hpp"
#include "tessera/frames/internal/symmetric.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

/// A map in cells of 4 x 4 x 4 parts. A part is a voxel, or 2 x 2 x 2 voxels under 0.15 m, so that
/// a cell is about 0.8 m wide at the usual resolutions. What may move is left out: it is neither
/// occupied nor free.
class MapSketch {
 public:
  /// Cells with a surface, and cells that have none but free space. Of more, those are kept whose
  /// key's hash ends in enough zeros, so which ones does not depend on the order of blocks.
  static constexpr std::uint32_t kMostSurfaces = 40'960;
  static constexpr std::uint32_t kMostFreeCells = 81'920;
  static constexpr int kPartsEdge = 4;

  /// How a surface lies.
  enum class Kind : std::uint8_t { kOther = 0, kFlat = 1, kUpright = 2 };

  /// A cell with a surface.
  struct Surface {
    std::uint64_t key = 0;
    std::uint64_t occupied = 0;       ///< Parts, a bit each: x + 4 y + 16 z.
    std::uint64_t free = 0;           ///< Of those that are not occupied.
    std::array<float, 3> offset_m{};  ///< Mean of the returns, from the cell's lower corner.
    /// Covariance of where the surface is, of which the mean is a sample: xx, xy, xz, yy, yz, zz.
    std::array<float, 6> looseness_m2{};
    std::array<float, 3> normal{};  ///< Of the plane through the returns, of length 1.
    std::uint8_t label = 0;         ///< Of most of them; 0: none.
    /// To where it was seen from, by the free parts of its cell: of length about 100, or zero.
    std::array<std::int8_t, 3> open{};
    Kind kind = Kind::kOther;
  };
  /// A cell without a surface.
  struct FreeCell {
    std::uint64_t key = 0;
    std::uint64_t free = 0;
  };

  [[nodiscard]] static constexpr std::size_t required_bytes() noexcept {
    return arena_bytes<Surface>(kMostSurfaces) + arena_bytes<FreeCell>(kMostFreeCells) +
           arena_bytes<std::uint32_t>(kMostSurfaces) + arena_bytes<std::uint32_t>(kBuckets);
  }
  /// Entries of scratch that finish() needs.
  static constexpr std::size_t kScratch = 2 * std::size_t{kMostSurfaces};
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<MapSketch> make(Arena& arena) noexcept;
  MapSketch() noexcept = default;

  /// What cells of a block had, two bits each: nothing, a surface, or free space alone.
  using BlockCells = std::uint16_t;

  /// Forgets all; cells from now on are of maps of this resolution. O(1).
  void begin(double resolution_m) noexcept;
  /// Adds a block of a map; each block once. Returns what forget() is to be given. O(512 components
  /// present), and O(kept cells) where they become too many: at most 20 times.
  BlockCells add(const LocalMap& map, SlabHandle handle) noexcept;
  /// After the last block: what follows may be asked. scratch: kScratch entries. O(cells).
  void finish(std::span<KeyedIndex> scratch) noexcept;

  /// Of a sketch that is finished, to bring it up to date: blocks that have changed or gone are
  /// forgotten first, then drop_forgotten() makes room, those that changed are added again, and it
  /// is finished again. It is then as if it had been taken from nothing, unless is_too_thin().
  /// cells: as add() returned it. O(1).
  void forget(BlockKey block, BlockCells cells) noexcept;
  /// O(cells).
  void drop_forgotten() noexcept;
  /// So many cells were forgotten that fewer would be left out of a sketch that is taken anew.
  [[nodiscard]] bool is_too_thin() const noexcept;
  /// Who has taken all of it, and when: a source that goes on from there knows its own sketch.
  struct Owner {
    const void* source = nullptr;
    std::uint64_t turn = 0;
    friend constexpr bool operator==(const Owner&, const Owner&) = default;
  };
  /// None from begin() on, and while it is not finished.
  [[nodiscard]] Owner owner() const noexcept { return is_finished_ ? owner_ : Owner{}; }
  void set_owner(const Owner& owner) noexcept { owner_ = owner; }

  [[nodiscard]] double cell_m() const noexcept { return cell_m_; }
  [[nodiscard]] double part_m() const noexcept { return cell_m_ / kPartsEdge; }
  [[nodiscard]] std::uint32_t surface_count() const noexcept { return surface_count_; }
  [[nodiscard]] std::uint32_t free_cell_count() const noexcept { return free_count_; }
  /// Surfaces in the order of their keys.
  [[nodiscard]] const Surface& surface(std::uint32_t at) const noexcept {
    return surfaces_[order_[at]];
  }
  /// Of 2^levels cells one was kept.
  [[nodiscard]] unsigned surface_levels() const noexcept { return surface_levels_; }
  /// Where its returns are on average; metres, map frame.
  [[nodiscard]] Point3d center_of(const Surface& surface) const noexcept {
    const VoxelCoord cell = cell_of(surface.key);
    return {cell.x * cell_m_ + static_cast<double>(surface.offset_m[0]),
            cell.y * cell_m_ + static_cast<double>(surface.offset_m[1]),
            cell.z * cell_m_ + static_cast<double>(surface.offset_m[2])};
  }
  [[nodiscard]] static constexpr VoxelCoord cell_of(std::uint64_t key) noexcept {
    const BlockCoord at = unpack(BlockKey{key});
    return {at.x, at.y, at.z};
  }
  /// A cell that has none, in no certain order.
  [[nodiscard]] const FreeCell& free_cell(std::uint32_t at) const noexcept {
    return free_cells_[at];
  }
  /// The middle of a cell; metres, map frame.
  [[nodiscard]] Point3d middle_of(std::uint64_t key) const noexcept {
    const VoxelCoord cell = cell_of(key);
    return {(cell.x + 0.5) * cell_m_, (cell.y + 0.5) * cell_m_, (cell.z + 0.5) * cell_m_};
  }
  /// The surface of a cell, or null. O(1) mostly.
  [[nodiscard]] const Surface* find_surface(VoxelCoord cell) const noexcept;
  /// What is known of a cell's parts, a bit each.
  struct Parts {
    std::uint64_t occupied = 0;
    std::uint64_t free = 0;
    const Surface* surface = nullptr;  ///< Null where no part is occupied.
  };
  [[nodiscard]] Parts parts(VoxelCoord cell) const noexcept;
  /// A part is 2 x 2 x 2 voxels.
  [[nodiscard]] bool is_fine() const noexcept { return voxels_part_ == 2; }

 private:
  static constexpr std::uint32_t kBuckets = 1U << 18U;
  static constexpr std::uint32_t kFreeBit = 1U << 31U;

  /// How many cells of a map hash to so many zeros at the end, whether they are kept or not.
  using HashLevels = std::array<std::uint32_t, 32>;
  enum class CellKind : std::uint8_t { kNone = 0, kSurface = 1, kFree = 2 };

  struct CellSums;
  [[nodiscard]] int cells_edge() const noexcept { return kBlockEdge / (kPartsEdge * voxels_part_); }
  /// The n-th of a block's cells, of edge^3.
  [[nodiscard]] static constexpr VoxelCoord cell_of_block(const BlockCoord& block, int n,
                                                          int edge) noexcept {
    return {block.x * edge + n % edge, block.y * edge + n / edge % edge,
            block.z * edge + n / (edge * edge)};
  }
  [[nodiscard]] CellKind add_cell(const CellSums& sums, VoxelCoord cell) noexcept;
  void keep_surface(const Surface& surface) noexcept;
  void keep_free(const FreeCell& cell) noexcept;
  /// The entry of a key in the table: 0 if it is not there.
  [[nodiscard]] std::uint32_t entry_of(VoxelCoord cell) const noexcept;
  void enter(std::uint64_t key, std::uint32_t entry) noexcept;

  std::span<Surface> surfaces_;
  std::span<FreeCell> free_cells_;
  std::span<std::uint32_t> order_;
  std::span<std::uint32_t> table_;
  double resolution_m_ = 1.0;
  double cell_m_ = 4.0;
  int voxels_part_ = 1;
  std::uint32_t surface_count_ = 0;
  std::uint32_t free_count_ = 0;
  unsigned surface_levels_ = 0;
  unsigned free_levels_ = 0;
  HashLevels surface_hashes_{};
  HashLevels free_hashes_{};
  Owner owner_;
  bool has_forgotten_ = false;
  bool is_finished_ = false;
};

}  // namespace tessera
