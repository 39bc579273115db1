// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Codes written out: robots of different builds read each other's, so that another byte here is
// another wire format, and needs another version of it.
#include <catch2/catch.hpp>
#include <string>
#include <string_view>

#include "support/sample_content.hpp"
#include "tessera/base/internal/digest.hpp"

namespace tessera {
namespace {

constexpr int kComponents = 21;

std::string hex(const CodedBytes& bytes) {
  std::string text;
  for (const std::byte byte : bytes) {
    text += "0123456789abcdef"[std::to_integer<unsigned>(byte) >> 4U];
    text += "0123456789abcdef"[std::to_integer<unsigned>(byte) & 15U];
  }
  return text;
}

std::uint64_t digest_of(const CodedBytes& bytes) {
  Digest digest;
  for (const std::byte byte : bytes) digest.add(std::to_integer<std::uint64_t>(byte));
  return digest.value();
}

TEST_CASE("golden codes: one voxel of one class") {
  OwnContent own(kComponents);
  own->add(9, row_order(0, 0), 1.0F);
  CHECK(hex(coded(*own)) == "4a44a79fa8");
}

TEST_CASE("golden codes: an octet of road under free space") {
  OwnContent own(kComponents);
  for (int v = 0; v < kOctetVoxels; ++v) {
    own->add(9, row_order(5, v), v < 4 ? 2.5F : 1.25F);
    own->add_passes(row_order(21, v), 3);
  }
  CHECK(hex(coded(*own)) == "1e13072a1ad4f1f379");
  CHECK(hex(coded(*own, 0b0001)) == "4bbaf56558ed");
  CHECK(hex(coded(*own, 0b0010)) == "7d76e15f");
}

TEST_CASE("golden codes: three components, a rest and passes in a voxel") {
  OwnContent own(kComponents);
  const int row = row_order(63, 7);
  own->add(1, row, 100.0F);
  own->add(13, row, 20.0F);
  own->add(20, row, 7.0F);
  own->add_rest(row, 10.0F);
  own->add_passes(row, 255);
  quantise(*own);
  CHECK(hex(coded(*own)) == "3cf8c2a8b6ae1cde25405626c1c7bc");
}

TEST_CASE("golden codes: blocks like a map's, and one that is coded plainly") {
  oracle::Random random(2026);
  OwnContent own(kComponents);
  fill_smoothly(*own, random, kComponents);
  quantise(*own);
  CodedBytes bytes = coded(*own);
  CHECK(bytes.size() == 265);
  CHECK(digest_of(bytes) == 0x45c710839852f2dfU);
  CHECK(bytes[0] != std::byte{0});
  OwnContent most;
  for (int row = 0; row < kLayerVoxels; ++row) {
    const int level = 21 + random.below(kMostLevel - 20);
    most->set(1 + random.below(20), row, count_of_level(level));
    most->set(21 + random.below(20), row, count_of_level(level - 20));
    const int third = 41 + random.below(22);
    most->set(third, row, count_of_level(level - random.below(20)));
    most->add_rest(row, count_of_level(1 + random.below(kMostLevel)));
    most->add_passes(row, passes_of_level(1 + random.below(kMostPassesLevel)));
  }
  quantise(*most);
  bytes = coded(*most, 1);
  CHECK(bytes[0] == std::byte{0});
  CHECK(bytes.size() == 950);
  CHECK(digest_of(bytes) == 0x839224ba4a8483cfU);
}

}  // namespace
}  // namespace tessera
