// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <string_view>

#include "fuzz/fuzz.hpp"
#include "maps/octree_reader.hpp"
#include "support/heap_peak.hpp"
#include "support/reader_memory.hpp"

namespace tessera::fuzz {

void octrees(Bytes bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const test::HeapPeak peak;
  const Outcome<Octree> octree = Octree::parse("an.ot", std::string(text));
  require(peak.bytes() <= test::octree_bytes(text.size()), "more memory than the stated sum");
  if (!octree.ok()) {
    const Failure& failure = octree.failure();
    require(failure.kind == FailureKind::kUsage, "bad input is not the system's failure");
    require(failure.text().starts_with("an.ot: "), "a message that does not say where");
    for (const char letter : failure.text())
      require(letter >= ' ' && letter <= '~', "a message of several lines, or of no text");
    require(failure.text().size() < 1024, "a message that nobody reads");
    return;
  }
  // A leaf takes two bits at least.
  require(octree->num_nodes() <= 4 * text.size(), "more nodes than the file has room for");
  std::uint64_t voxels = 0;
  octree->for_each_leaf([&](const OctreeLeaf& leaf) {
    require(leaf.level >= 0 && leaf.level <= kOctreeLevels, "a level that there is not");
    constexpr std::int64_t kHalf = std::int64_t{1} << (kOctreeLevels - 1);
    const std::int64_t edge = std::int64_t{1} << leaf.level;
    for (const std::int64_t low : {leaf.corner.x, leaf.corner.y, leaf.corner.z}) {
      require(low >= -kHalf && low + edge <= kHalf, "a leaf out of the tree");
      require((low + kHalf) % edge == 0, "a leaf that is not aligned");
    }
    voxels += static_cast<std::uint64_t>(edge * edge * edge);
  });
  require(voxels == octree->num_occupied() + octree->num_free(), "voxels that are not counted");
  require(voxels <= std::uint64_t{1} << 48U, "voxels that lie in one another");
}

}  // namespace tessera::fuzz
