// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/hash_tree.hpp"

#include <algorithm>

namespace tessera {

/// The first byte is another than a leaf's, so that no node can pass for one.
Hash HashTree::parent(const Signatures& by, const Hash& left, const Hash& right) noexcept {
  std::array<std::byte, 1 + 2 * kHashBytes> message{};
  message[0] = std::byte{1};
  std::copy(left.begin(), left.end(), message.begin() + 1);
  std::copy(right.begin(), right.end(), message.begin() + 1 + kHashBytes);
  Hash hash{};
  by.hash(by.context, message, hash);
  return hash;
}

Hash HashTree::root(const Signatures& by) noexcept {
  TESSERA_ASSERT(count_ != 0);
  std::uint32_t level = 0;
  for (std::uint32_t width = count_; width > 1; width = (width + 1) / 2, ++level) {
    for (std::uint32_t i = 0; i < width; i += 2) {
      const Hash& left = levels_[level][i];
      levels_[level + 1][i / 2] = i + 1 < width ? parent(by, left, levels_[level][i + 1]) : left;
    }
  }
  return levels_[level][0];
}

std::uint32_t HashTree::path(std::uint32_t leaf, std::span<Hash, kMostPath> into) const noexcept {
  std::uint32_t length = 0;
  std::uint32_t level = 0;
  for (std::uint32_t width = count_; width > 1; width = (width + 1) / 2, ++level, leaf /= 2) {
    if ((leaf ^ 1U) < width) into[length++] = levels_[level][leaf ^ 1U];
  }
  return length;
}

std::uint32_t HashTree::path_length(std::uint32_t leaf, std::uint32_t count) noexcept {
  std::uint32_t length = 0;
  for (std::uint32_t width = count; width > 1; width = (width + 1) / 2, leaf /= 2)
    length += (leaf ^ 1U) < width ? 1U : 0U;
  return length;
}

Hash HashTree::climb(const Signatures& by, Hash leaf, std::uint32_t index, std::uint32_t count,
                     std::span<const Hash> path) noexcept {
  for (std::uint32_t width = count; width > 1; width = (width + 1) / 2, index /= 2) {
    if ((index ^ 1U) >= width) continue;
    TESSERA_ASSERT(!path.empty());
    leaf = (index & 1U) != 0 ? parent(by, path.front(), leaf) : parent(by, leaf, path.front());
    path = path.subspan(1);
  }
  return leaf;
}

}  // namespace tessera
