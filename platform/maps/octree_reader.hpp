// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Reads .bt and .ot files of OctoMap. Does not use the OctoMap library, which recurses as deep as a
// file says and makes nodes of what it reads after the end of the file: with a few bytes too few or
// too many it uses all memory or overflows the stack. tests/unit/octomap checks that files of that
// library are read to the same voxels.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "maps/octree_header.hpp"
#include "tessera/grid/lattice.hpp"

namespace tessera {

inline constexpr int kOctreeLevels = 16;
inline constexpr std::uint64_t kMostOctreeFileBytes = std::uint64_t{1} << 30U;

/// State of a cube of voxels of the file's resolution: [corner, corner + 2^level) on each axis.
struct OctreeLeaf {
  VoxelCoord corner;  ///< At least -2^15, a multiple of 2^level.
  int level = 0;      ///< 0 .. 16; 0 is a voxel.
  bool occupied = false;
};

/// A file that was checked to be valid. Visits its leaves in the order of the file.
class Octree {
 public:
  /// Keeps the bytes. Fails with kUsage iff parse_octree_header() does, the tree is deeper than 16
  /// levels, ends too early or before the file does, has another number of nodes than its header
  /// says, an inner node without children (.bt), or log-odds that are not a number. O(bytes), with
  /// no other memory, whatever the header claims.
  static Outcome<Octree> parse(std::string_view path, std::string bytes);
  /// The same for a file. Fails too as InputFile does, and with kUsage iff it is over 1 GiB.
  static Outcome<Octree> read(const std::string& path);

  [[nodiscard]] double resolution_m() const noexcept { return header_.resolution_m; }
  [[nodiscard]] std::uint64_t num_nodes() const noexcept { return header_.nodes; }
  /// Voxels of the file's resolution in all leaves, including pruned ones.
  [[nodiscard]] std::uint64_t num_occupied() const noexcept { return occupied_; }
  [[nodiscard]] std::uint64_t num_free() const noexcept { return free_; }

  /// Calls visit(const OctreeLeaf&) for each leaf; occupied means log-odds of 0 or more.
  template <class Visit>
  void for_each_leaf(Visit&& visit) const {
    Walk walk(header_, bytes_);
    while (walk.next()) visit(walk.leaf());
  }

 private:
  /// Depth first, in the order of the nodes in the file, with a frame per level.
  class Walk {
   public:
    Walk(const OctreeHeader& header, std::string_view bytes) noexcept;
    /// True if there is another leaf; false at the end, or if the tree is invalid.
    bool next() noexcept;
    [[nodiscard]] const OctreeLeaf& leaf() const noexcept { return leaf_; }
    /// What is wrong; null if nothing.
    [[nodiscard]] const char* fault() const noexcept { return fault_; }
    [[nodiscard]] std::uint64_t nodes() const noexcept { return nodes_; }
    [[nodiscard]] bool at_end() const noexcept { return place_ == bytes_.size(); }

   private:
    /// A node whose children are being visited: two bits per child as in a .bt, for a .ot 0 for
    /// none and 3 for one whose data is still to be read.
    struct Frame {
      VoxelCoord corner;
      std::uint32_t children = 0;
      int next_child = 0;
    };
    bool open_node(const VoxelCoord& corner, int level) noexcept;
    bool open_binary(const VoxelCoord& corner, int level) noexcept;
    bool open_full(const VoxelCoord& corner, int level) noexcept;
    bool push(const VoxelCoord& corner, std::uint32_t children) noexcept;
    bool refuse(const char* fault) noexcept;
    bool give(const VoxelCoord& corner, int level, bool occupied) noexcept;

    const OctreeHeader& header_;
    std::string_view bytes_;
    std::size_t place_;
    Frame frames_[kOctreeLevels];
    int depth_ = -1;  ///< Of the current frame, 0 for the root; -1: before or after the tree.
    bool begun_ = false;
    bool has_leaf_ = false;
    OctreeLeaf leaf_;
    std::uint64_t nodes_ = 0;
    const char* fault_ = nullptr;
  };

  Octree(const OctreeHeader& header, std::string bytes)
      : header_(header), bytes_(std::move(bytes)) {}

  OctreeHeader header_;
  std::string bytes_;
  std::uint64_t occupied_ = 0;
  std::uint64_t free_ = 0;
};

}  // namespace tessera
