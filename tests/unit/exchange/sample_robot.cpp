// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "sample_robot.hpp"

#include <catch2/catch.hpp>

namespace tessera {

namespace {

constexpr int kClasses = 3;
constexpr int kComponents = kClasses + 2;

bool has_labels(const BlockContent& content, int row) {
  bool found = content.rest(row) > 0.0F;
  for (int c = 1; c < kComponents; ++c) found = found || content.count(c, row) > 0.0F;
  return found;
}

}  // namespace

ReadContent::ReadContent(int num_components)
    : memory(BlockContent::required_bytes(num_components) + kArenaAlignment) {
  const auto past = reinterpret_cast<std::uintptr_t>(memory.data()) % kArenaAlignment;
  Arena arena(std::span<std::byte>(memory).subspan(past == 0 ? 0 : kArenaAlignment - past));
  content = *BlockContent::make(arena, num_components);
}

void round_counts(BlockContent& content) {
  for (int row = 0; row < kBlockVoxels; ++row) {
    for (int c = 1; c < kComponents; ++c) {
      if (!(content.count(c, row) > 0.0F)) continue;
      const std::uint32_t bits = std::bit_cast<std::uint32_t>(content.count(c, row)) + (1U << 19U);
      content.set(c, row, std::bit_cast<float>(bits & ~((1U << 20U) - 1U)));
    }
    if (!has_labels(content, row) && content.passes(row) != 0) content.set_passes(row, 1);
  }
}

Publication KeptPublication::interface() {
  return {this,
          [](void* self, BlockContent& content) {
            static_cast<KeptPublication*>(self)->quantise(content);
          },
          [](void* self, BlockKey key, BlockContent& content) {
            return static_cast<KeptPublication*>(self)->read(key, content);
          },
          [](void* self, BlockKey key, const BlockContent& content) {
            return static_cast<KeptPublication*>(self)->publish(key, content);
          },
          [](void* self, BlockKey key) {
            return static_cast<KeptPublication*>(self)->archived.count(key.bits) == 0;
          },
          this};
}

bool KeptPublication::read(BlockKey key, BlockContent& content) const {
  const auto found = blocks.find(key.bits);
  if (found == blocks.end()) return false;
  unpack_block(
      found->second,
      [&](int row, int component, float count) {
        component == 0 ? content.add_rest(row, count) : content.add(component, row, count);
      },
      [&](int row, unsigned passes) { content.add_passes(row, passes); });
  return true;
}

Result<WireBytes> KeptPublication::publish(BlockKey key, const BlockContent& content) {
  if (refuses) return Status::kResourceExhausted;
  log.push_back(key.bits);
  const std::size_t size = pack_block(content, packed_);
  if (size == 0) {
    blocks.erase(key.bits);
    return WireBytes{12, 0};
  }
  blocks[key.bits].assign(packed_.begin(), packed_.begin() + static_cast<std::ptrdiff_t>(size));
  std::uint32_t labels = 0;
  std::uint32_t free = 0;
  for (int row = 0; row < kBlockVoxels; ++row) {
    const bool labelled = has_labels(content, row);
    labels += labelled ? 1U : 0U;
    free += !labelled && content.passes(row) != 0 ? 1U : 0U;
  }
  return labels > 0 ? WireBytes{12 + labels * 13 / 10, free / 10} : WireBytes{0, 12 + free / 10};
}

SampleRobot::SampleRobot(const PublisherConfig& config, std::size_t pages)
    : small(config_of_pages(pages), kClasses),
      kept(kComponents),
      memory(Publisher::required_bytes(config, kComponents)) {
  Arena arena = memory.arena();
  Result<Publisher> made = Publisher::make(arena, config, small.map.config(), kComponents);
  REQUIRE(made.ok());
  REQUIRE(arena.remaining_bytes() == 0);
  publisher = std::move(*made);
}

bool SampleRobot::settles(int most_ticks) {
  REQUIRE(budget.entries >= kPlenty.entries);
  int quiet = 0;
  for (int i = 0; i < most_ticks + kPublishedRound && quiet < kPublishedRound; ++i) {
    const PublisherReport report = tick();
    const bool rests = report.waiting + report.free_waiting + report.noted + report.left_out == 0;
    quiet = rests ? quiet + 1 : 0;
  }
  return quiet == kPublishedRound;
}

int SampleRobot::disagreement() {
  std::set<std::uint64_t> keys;
  SweepCursor cursor;
  small.map.visit_blocks(cursor, small.map.index().slots(), [&](BlockKey key, SlabHandle) {
    keys.insert(key.bits);
    return true;
  });
  for (const auto& [key, bytes] : kept.blocks) keys.insert(key);
  ReadContent own(kComponents);
  int count = 0;
  for (const std::uint64_t key : keys) {
    own.content.clear();
    kept.read(BlockKey{key}, own.content);
    for (int row = 0; row < kBlockVoxels; ++row) {
      VoxelEvidence evidence;
      evidence.num_components = kComponents;
      evidence.sigma[0] =
          static_cast<float>(own.content.passes(row)) * small.map.config().free_weight;
      for (int c = 1; c < kComponents; ++c)
        evidence.sigma[static_cast<std::size_t>(c)] = own.content.count(c, row);
      evidence.rest = own.content.rest(row);
      const Estimate said = estimate(evidence, small.map.config().prior);
      const Estimate here = small.map.query(voxel_of_row(unpack(BlockKey{key}), row));
      count += said.state != here.state || said.label != here.label ? 1 : 0;
    }
  }
  return count;
}

}  // namespace tessera
