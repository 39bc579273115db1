// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/replica/internal/segment_store.hpp"

#include <catch2/catch.hpp>
#include <map>
#include <vector>

#include "support/mapper.hpp"
#include "support/random.hpp"

namespace tessera {
namespace {

std::vector<std::byte> random_bytes(oracle::Random& random, std::size_t size) {
  std::vector<std::byte> bytes(size);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random.bits() & 0xffU);
  return bytes;
}

TEST_CASE("segment store: what fits hangs on how much is stored, not on the order it came in") {
  constexpr std::uint32_t kSegments = 200;
  AlignedMemory memory(SegmentStore::required_bytes(kSegments));
  Arena arena(memory.span());
  SegmentStore store = *SegmentStore::make(arena, kSegments);
  oracle::Random random(5);
  std::map<SegmentStore::Chain, std::vector<std::byte>> kept;
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    if (random.below(3) == 0 && !kept.empty()) {
      auto one = kept.begin();
      std::advance(one, random.below(static_cast<int>(kept.size())));
      store.release(one->first);
      kept.erase(one);
      continue;
    }
    const std::vector<std::byte> bytes =
        random_bytes(random, 1 + static_cast<std::size_t>(random.below(1500)));
    const bool fits = SegmentStore::segments_of(bytes.size()) <= store.free_segments();
    const Result<SegmentStore::Chain> chain = store.write(bytes);
    REQUIRE(chain.ok() == fits);
    if (chain.ok()) kept[*chain] = bytes;
    refused += fits ? 0 : 1;
  }
  CHECK(refused > 100);
  std::uint32_t used = 0;
  for (const auto& [chain, bytes] : kept) {
    used += SegmentStore::segments_of(bytes.size());
    std::vector<std::byte> found(bytes.size());
    store.read(chain, found);
    REQUIRE(found == bytes);
    REQUIRE(store.equals(chain, bytes));
    found.back() ^= std::byte{1};
    REQUIRE_FALSE(store.equals(chain, found));
  }
  CHECK(store.used_segments() == used);
  for (const auto& [chain, bytes] : kept) store.release(chain);
  CHECK(store.free_segments() == kSegments);
}

}  // namespace
}  // namespace tessera
