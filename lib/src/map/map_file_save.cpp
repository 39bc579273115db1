// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <bit>

#include "map_block_format.hpp"

namespace tessera {

namespace {

using detail::BlockHead;
using detail::CheckedSink;
using detail::head_of;
using detail::put_block;

/// A block and what of it is stored; block is nullptr where it cannot be had.
struct Found {
  const Block* block = nullptr;
  BlockHead head;
};
Found find(const LocalMap& map, const BlockLookup& lookup, const KeyedIndex& item) noexcept {
  const Block* const block = lookup.find(lookup.context, item);
  return {block, block == nullptr ? BlockHead{} : head_of(map, *block)};
}

/// False iff a block cannot be had.
bool count(const LocalMap& map, std::span<const KeyedIndex> blocks, const BlockLookup& lookup,
           MapFileContent& counts) noexcept {
  for (const KeyedIndex& item : blocks) {
    const auto [block, head] = find(map, lookup, item);
    if (block == nullptr) return false;
    if (head.octets == 0 && !head.free) continue;
    ++counts.blocks;
    counts.label_pages += head.octets != 0 ? 1U : 0U;
    counts.free_pages += head.free ? 1U : 0U;
    counts.octets += static_cast<std::uint64_t>(std::popcount(head.octets));
  }
  return true;
}

void put_voxel(VoxelCoord voxel, ByteWriter& body) noexcept {
  for (const std::int32_t c : {voxel.x, voxel.y, voxel.z}) body.u32(static_cast<std::uint32_t>(c));
}

void put_summary(const MapSummary* summary, int num_components, ByteWriter& body) noexcept {
  body.u8(summary == nullptr ? 0 : 1);
  if (summary == nullptr) return;
  body.u64(summary->digest);
  body.u64(summary->label_voxels);
  body.u64(summary->free_voxels);
  body.u64(summary->occupied);
  body.u64(summary->free);
  put_voxel(summary->low, body);
  put_voxel(summary->high, body);
  for (const std::uint64_t voxels :
       std::span(summary->occupied_by_label).first(static_cast<std::size_t>(num_components)))
    body.u64(voxels);
}

void put_header(const LocalMap& map, const MapIdentity& identity, const MapFileContent& counts,
                const MapSummary* summary, MapFileBuffer& buffer, CheckedSink& sink) noexcept {
  ByteWriter body(std::span(buffer.bytes).subspan(detail::kPreambleBytes));
  body.u8(static_cast<std::uint8_t>(identity.kind));
  body.u8(static_cast<std::uint8_t>(
      static_cast<unsigned>(map.config().tuple) |
      (map.config().probabilities == Probabilities::kShares ? detail::kSharesBit : 0U) |
      (map.keeps_votes() ? detail::kVotesBit : 0U)));
  body.u8(static_cast<std::uint8_t>(map.classes().num_classes()));
  body.u8(identity.has_T_global_map ? 1 : 0);
  body.f64(map.config().resolution_m);
  body.f64(map.config().prior);
  body.f32(map.config().max_evidence);
  body.f32(map.config().free_weight);
  body.u32(identity.robot);
  body.u32(identity.epoch);
  body.u32(map.revision());
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 4; ++c) body.f64(identity.T_global_map(r, c));
  }
  body.u64(counts.blocks);
  body.u64(counts.label_pages);
  body.u64(counts.free_pages);
  body.u64(counts.octets);
  for (int label = 1; label <= map.classes().num_classes(); ++label) {
    const SemanticClass& c = map.classes()[label];
    for (const char letter : c.name) body.u8(static_cast<std::uint8_t>(letter));
    body.u8(c.color.r);
    body.u8(c.color.g);
    body.u8(c.color.b);
  }
  body.u32(identity.settings_bytes);
  for (std::size_t i = 0; i < identity.settings_bytes; ++i)
    body.u8(static_cast<std::uint8_t>(identity.settings[i]));
  put_summary(summary, map.num_components(), body);
  TESSERA_ASSERT(body.ok());
  ByteWriter preamble(std::span(buffer.bytes).first(detail::kPreambleBytes));
  for (const char letter : detail::kMapMagic) preamble.u8(static_cast<std::uint8_t>(letter));
  preamble.u16(detail::kMapMajor);
  preamble.u16(detail::kMapMinor);
  preamble.u32(static_cast<std::uint32_t>(body.size()));
  sink.put(std::span(buffer.bytes).first(detail::kPreambleBytes + body.size()));
  sink.put_crc();
}

}  // namespace

MapFileStatus save(const LocalMap& map, const MapIdentity& identity,
                   std::span<const KeyedIndex> blocks, const BlockLookup& lookup,
                   MapFileBuffer& buffer, const ByteSink& byte_sink,
                   const MapSummary* summary) noexcept {
  if (map.classes().num_classes() == 0 || identity.settings_bytes > MapIdentity::kMaxSettings ||
      lookup.find == nullptr || byte_sink.write == nullptr) {
    return {.status = Status::kInvalidArgument,
            .what = "there is no map, workspace or sink to save"};
  }
  constexpr const char* kNoBlock = "a block cannot be read";
  CheckedSink sink(byte_sink);
  MapFileContent counts;
  if (!count(map, blocks, lookup, counts)) return {Status::kIo, kNoBlock, 0};
  put_header(map, identity, counts, summary, buffer, sink);
  for (const KeyedIndex& item : blocks) {
    if (!sink.ok()) break;
    const auto [block, head] = find(map, lookup, item);
    if (block == nullptr) return {Status::kIo, kNoBlock, sink.offset()};
    if (head.octets != 0 || head.free) put_block(map, *block, head, buffer.bytes, sink);
  }
  ByteWriter end(buffer.bytes);
  end.u32(detail::kEndMark);
  end.u64(counts.blocks);
  sink.put(end.written());
  sink.put_crc();
  if (!sink.ok()) return {Status::kIo, "the sink refused the bytes", sink.offset()};
  return {.offset_bytes = sink.offset()};
}

MapFileStatus save(const LocalMap& map, const MapIdentity& identity,
                   std::span<KeyedIndex> workspace, MapFileBuffer& buffer,
                   const ByteSink& byte_sink, const MapSummary* summary) noexcept {
  if (workspace.size() < 2 * map.block_count()) {
    return {.status = Status::kInvalidArgument,
            .what = "there is no map, workspace or sink to save"};
  }
  BlocksInMemory blocks(map);
  return save(map, identity, map.blocks_in_order(workspace), blocks.lookup(), buffer, byte_sink,
              summary);
}

}  // namespace tessera
