// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One signature for all records of a datagram, each of which can be passed on without the others: a
// Merkle tree. The path of a leaf are the hashes beside its way to the root, lowest first; a node
// without a neighbour is its own parent.
#pragma once

#include "tessera/base/assert.hpp"
#include "tessera/exchange/signatures.hpp"

namespace tessera {

class HashTree {
 public:
  static constexpr std::uint32_t kMostLeaves = 16;
  static constexpr std::uint32_t kMostPath = 4;

  void clear() noexcept { count_ = 0; }
  [[nodiscard]] std::uint32_t count() const noexcept { return count_; }
  [[nodiscard]] bool full() const noexcept { return count_ == kMostLeaves; }
  /// Not of a full tree.
  void add(const Hash& leaf) noexcept {
    TESSERA_ASSERT(!full());
    levels_[0][count_++] = leaf;
  }
  /// Of a tree that has a leaf; call it before path(). At most 15 hashes.
  [[nodiscard]] Hash root(const Signatures& by) noexcept;
  /// The path of a leaf, in into; returns how many hashes.
  std::uint32_t path(std::uint32_t leaf, std::span<Hash, kMostPath> into) const noexcept;

  /// How long the path of a leaf is in a tree of count leaves.
  [[nodiscard]] static std::uint32_t path_length(std::uint32_t leaf, std::uint32_t count) noexcept;
  /// The root that a leaf and its path lead to. path: of path_length(leaf, count).
  [[nodiscard]] static Hash climb(const Signatures& by, Hash leaf, std::uint32_t index,
                                  std::uint32_t count, std::span<const Hash> path) noexcept;

 private:
  [[nodiscard]] static Hash parent(const Signatures& by, const Hash& left,
                                   const Hash& right) noexcept;
  std::uint32_t count_ = 0;
  std::array<std::array<Hash, kMostLeaves>, kMostPath + 1> levels_{};
};

}  // namespace tessera
