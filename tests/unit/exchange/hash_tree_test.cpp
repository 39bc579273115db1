// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/hash_tree.hpp"

#include <catch2/catch.hpp>

#include "tessera/base/internal/digest.hpp"

namespace tessera {
namespace {

/// No hash for strangers, but another one for each tree of this test.
Signatures toy() {
  Signatures by;
  by.hash = [](void*, std::span<const std::byte> message,
               std::span<std::byte, kHashBytes> hash) noexcept {
    Digest digest;
    for (const std::byte byte : message) digest.add(std::to_integer<std::uint64_t>(byte));
    for (std::size_t i = 0; i < kHashBytes; ++i) {
      digest.add(i);
      hash[i] = static_cast<std::byte>(digest.value() & 0xffU);
    }
  };
  return by;
}

Hash leaf(std::uint32_t number) {
  Hash hash{};
  hash[0] = static_cast<std::byte>(number);
  hash[5] = std::byte{77};
  return hash;
}

TEST_CASE("hash tree: each leaf leads to the root by its path, and no other does") {
  const Signatures by = toy();
  for (std::uint32_t count = 1; count <= HashTree::kMostLeaves; ++count) {
    HashTree tree;
    for (std::uint32_t i = 0; i < count; ++i) tree.add(leaf(i));
    CHECK(tree.full() == (count == HashTree::kMostLeaves));
    const Hash root = tree.root(by);
    for (std::uint32_t i = 0; i < count; ++i) {
      std::array<Hash, HashTree::kMostPath> path{};
      const std::uint32_t length = tree.path(i, path);
      REQUIRE(length == HashTree::path_length(i, count));
      const auto way = std::span(path).first(length);
      CHECK(HashTree::climb(by, leaf(i), i, count, way) == root);
      CHECK(HashTree::climb(by, leaf(i + 1), i, count, way) != root);
      CHECK(HashTree::path_length(i, count) <= HashTree::kMostPath);
      if (length == 0) continue;
      if ((i ^ 1U) < count) CHECK(HashTree::climb(by, leaf(i), i ^ 1U, count, way) != root);
      path[length - 1][3] ^= std::byte{1};
      CHECK(HashTree::climb(by, leaf(i), i, count, way) != root);
    }
  }
}

TEST_CASE("hash tree: of one leaf the root is the leaf, of three the last is its own parent") {
  const Signatures by = toy();
  HashTree one;
  one.add(leaf(4));
  CHECK(one.root(by) == leaf(4));
  CHECK(HashTree::path_length(0, 1) == 0);
  CHECK(HashTree::path_length(2, 3) == 1);
  CHECK(HashTree::path_length(0, 3) == 2);
  CHECK(HashTree::path_length(15, 16) == 4);
}

}  // namespace
}  // namespace tessera
