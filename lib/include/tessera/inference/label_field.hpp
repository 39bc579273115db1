// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Of which classes the evidence in a place is, from what points around it said over all scans: sums
// of votes (LabelVotes) by a separable kernel, in the lattice of cells. One block at a time.
#pragma once

#include <array>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/internal/lanes.hpp"
#include "tessera/inference/inference_config.hpp"
#include "tessera/inference/internal/scan_tiles.hpp"
#include "tessera/map/local_map.hpp"
#include "tessera/semantics/internal/label_shares.hpp"

namespace tessera {

class LabelField {
 public:
  /// Classes with less than this of the largest have no share.
  static constexpr float kLeastShare = 1.0F / 16.0F;

  [[nodiscard]] static constexpr std::size_t required_bytes() noexcept {
    return arena_bytes<State>(1);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<LabelField> make(Arena& arena) noexcept;
  /// No memory: nothing may be looked at.
  LabelField() noexcept = default;

  /// The layers of a block that octets lie in, a bit each.
  [[nodiscard]] static constexpr unsigned layers_of(std::uint64_t octets) noexcept {
    unsigned layers = 0;
    for (unsigned z = 0; z < kBlockLayers; ++z)
      layers |= ((octets >> (unsigned{kLayerOctets} * z)) & 0xffffU) != 0 ? 1U << z : 0U;
    return layers;
  }
  /// Takes the kernels for a scan of a map of these classes. Which blocks there are is asked once
  /// from here on: none may be opened or closed between the first look() and the last. O(C).
  void begin(const LatticeConfig& config, const ClassTable& classes, double resolution_m) noexcept;
  /// Adds the votes of the tiles' points, whose blocks are open, and opens the label pages of the
  /// layers of all units that may receive evidence. Room was reserved for them; returned is for how
  /// many tiles there was none. Units are of two voxels. Unlabelled points have no vote. O(points +
  /// tiles), and once for a layer that was loaded LocalMap::begun_votes().
  [[nodiscard]] static std::uint32_t vote(LocalMap& map, const ScanTiles& tiles) noexcept;
  /// Sums up around the octets of these layers of a block, a bit each. At most 27 look-ups, 54
  /// label pages, and for each class that they have votes on 376 products of four; and once for a
  /// layer that was loaded LocalMap::begun_votes().
  void look(LocalMap& map, const BlockCoord& block, unsigned layers) noexcept;
  /// Of an octet of those layers; none where nothing around it has votes. O(classes found).
  [[nodiscard]] LabelShares shares(int octet) const noexcept;
  /// The classes with votes around, a bit each.
  [[nodiscard]] std::uint64_t found() const noexcept { return state_[0].found; }
  /// Of one of those classes, what the votes around an octet of those layers amount to.
  [[nodiscard]] float sum_of(int label, int octet) const noexcept {
    return state_[0].sums[static_cast<std::size_t>(label)][static_cast<std::size_t>(octet)];
  }

 private:
  static constexpr std::size_t kCells = 6;   ///< On x and y: a block's two, and two on each side.
  static constexpr std::size_t kLayers = 6;  ///< A block's four, and one below and above.
  static constexpr std::size_t kOctets = 4;  ///< On each axis of a block.
  /// Of one class.
  struct Window {
    /// Cells along x fastest, then y, then layers.
    std::array<float, kCells * kCells * kLayers> votes{};
    std::uint64_t rows = 0;  ///< Those along x with votes, a bit each.
  };
  /// Sums of one class for each octet.
  using Sums = std::array<float, kBlockOctets>;
  /// A class's.
  struct Weights {
    std::array<Float4, kCells> along{};  ///< From each cell to the four octets along an axis.
    float next_layer = 0.0F;             ///< From a layer to the next.
  };
  /// A place of a block, and the block that the map has there.
  struct KnownBlock {
    BlockCoord at{kBlockLimit, 0, 0};  ///< No place of the grid.
    SlabHandle handle = 0;
  };
  static constexpr int kKnownRow = 64;  ///< On x; four on y and z.
  /// Kept in the arena: what a program puts on its stack stays small.
  struct State {
    std::array<Weights, kMaxComponents> weights{};
    std::uint64_t found = 0;                       ///< Classes with a window, a bit each.
    std::array<Window, kMaxComponents> windows{};  ///< By class, as the sums.
    std::array<Sums, kMaxComponents> sums{};
    /// By the lower bits of the place: tiles side by side look at the same blocks.
    std::array<KnownBlock, std::size_t{16} * kKnownRow> known{};
  };

  [[nodiscard]] static Weights weights_of(const ClassKernel& kernel, double resolution_m) noexcept;
  /// LocalMap::find_handle() of three blocks that follow each other along x.
  void find_row(const LocalMap& map, const BlockCoord& middle, SlabHandle* into) noexcept;
  /// Into the window's layers, a bit each, at these cells.
  void gather(LocalMap& map, SlabHandle block, unsigned layers, std::size_t x,
              std::size_t y) noexcept;
  void gather(const LabelVotes& votes, std::size_t x, std::size_t y, std::size_t layer) noexcept;
  void sum(std::size_t label, unsigned layers) noexcept;

  std::span<State> state_;
};

}  // namespace tessera
