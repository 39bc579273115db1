// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "map_file_format.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

using detail::CheckedSink;

bool has_free(const LocalMap& map, const Block& block) noexcept {
  if (!block.has_free_passes()) return false;
  for (int octet = 0; octet < kBlockOctets; ++octet) {
    for (int voxel = 0; voxel < kOctetVoxels; ++voxel) {
      if (map.free_passes(block, octet, voxel) != 0) return true;
    }
  }
  return false;
}

std::uint64_t octet_mask(const LocalMap& map, const Block& block) noexcept {
  std::uint64_t mask = 0;
  for (int octet = 0; octet < kBlockOctets; ++octet) {
    if (map.observed_labels(block, octet) != 0)
      mask |= std::uint64_t{1} << static_cast<unsigned>(octet);
  }
  return mask;
}

MapFileContent count(const LocalMap& map, std::span<const KeyedIndex> blocks) noexcept {
  MapFileContent counts;
  for (const KeyedIndex& item : blocks) {
    const Block& block = map.block_at(item.index);
    const std::uint64_t octets = octet_mask(map, block);
    const bool free = has_free(map, block);
    if (octets == 0 && !free) continue;
    ++counts.blocks;
    counts.label_pages += octets != 0 ? 1U : 0U;
    counts.free_pages += free ? 1U : 0U;
    counts.octets += static_cast<std::uint64_t>(std::popcount(octets));
  }
  return counts;
}

void put_header(const LocalMap& map, const MapIdentity& identity, const MapFileContent& counts,
                MapFileBuffer& buffer, CheckedSink& sink) noexcept {
  ByteWriter body(std::span(buffer.bytes).subspan(detail::kPreambleBytes));
  body.u8(static_cast<std::uint8_t>(identity.kind));
  body.u8(static_cast<std::uint8_t>(map.config().tuple));
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
  TESSERA_ASSERT(body.ok());
  ByteWriter preamble(std::span(buffer.bytes).first(detail::kPreambleBytes));
  for (const char letter : detail::kMapMagic) preamble.u8(static_cast<std::uint8_t>(letter));
  preamble.u16(detail::kMapMajor);
  preamble.u16(detail::kMapMinor);
  preamble.u32(static_cast<std::uint32_t>(body.size()));
  sink.put(std::span(buffer.bytes).first(detail::kPreambleBytes + body.size()));
  sink.put_crc();
}

void put_octet(const LocalMap& map, const Block& block, int octet, MapFileBuffer& buffer,
               CheckedSink& sink) noexcept {
  ByteWriter out(buffer.bytes);
  const unsigned observed = map.observed_labels(block, octet);
  out.u8(static_cast<std::uint8_t>(observed));
  for (int voxel = 0; voxel < kOctetVoxels; ++voxel) {
    if (((observed >> static_cast<unsigned>(voxel)) & 1U) == 0) continue;
    const VoxelEvidence evidence = map.evidence(block, octet, voxel);
    std::uint64_t present = 0;
    for (unsigned l = 1; l < static_cast<unsigned>(evidence.num_components); ++l) {
      if (evidence.sigma[l] > 0.0F) present |= std::uint64_t{1} << l;
    }
    if (evidence.rest > 0.0F) present |= 1U;
    out.u8(static_cast<std::uint8_t>(std::popcount(present)));
    for (std::uint64_t rest = present; rest != 0; rest &= rest - 1) {
      const int l = std::countr_zero(rest);
      out.u8(static_cast<std::uint8_t>(l));
      out.f32(l == 0 ? evidence.rest : evidence.sigma[static_cast<std::size_t>(l)]);
    }
  }
  TESSERA_ASSERT(out.ok());
  sink.put(out.written());
}

void put_block(const LocalMap& map, const Block& block, MapFileBuffer& buffer,
               CheckedSink& sink) noexcept {
  const std::uint64_t octets = octet_mask(map, block);
  const bool free = has_free(map, block);
  if (octets == 0 && !free) return;
  ByteWriter out(buffer.bytes);
  out.u64(block.key);
  out.u32(block.revision);
  out.u8(free ? 1 : 0);
  out.u64(octets);
  sink.put(out.written());
  // Of its own, so that a reader takes no storage on the word of a damaged head.
  sink.put_crc();
  if (free) {
    ByteWriter passes(buffer.bytes);
    for (int octet = 0; octet < kBlockOctets; ++octet) {
      for (int voxel = 0; voxel < kOctetVoxels; ++voxel)
        passes.u8(map.free_passes(block, octet, voxel));
    }
    sink.put(passes.written());
  }
  for (std::uint64_t rest = octets; rest != 0; rest &= rest - 1) {
    put_octet(map, block, std::countr_zero(rest), buffer, sink);
  }
  sink.put_crc();
}

}  // namespace

MapFileStatus save(const LocalMap& map, const MapIdentity& identity,
                   std::span<KeyedIndex> workspace, MapFileBuffer& buffer,
                   const ByteSink& byte_sink) noexcept {
  if (map.classes().num_classes() == 0 || workspace.size() < 2 * map.block_count() ||
      identity.settings_bytes > MapIdentity::kMaxSettings || byte_sink.write == nullptr) {
    return {.status = Status::kInvalidArgument,
            .what = "there is no map, workspace or sink to save"};
  }
  CheckedSink sink(byte_sink);
  const std::span<const KeyedIndex> blocks = map.blocks_in_order(workspace);
  const MapFileContent counts = count(map, blocks);
  put_header(map, identity, counts, buffer, sink);
  for (const KeyedIndex& item : blocks) {
    if (!sink.ok()) break;
    put_block(map, map.block_at(item.index), buffer, sink);
  }
  ByteWriter end(buffer.bytes);
  end.u32(detail::kEndMark);
  end.u64(counts.blocks);
  sink.put(end.written());
  sink.put_crc();
  if (!sink.ok()) return {Status::kIo, "the sink refused the bytes", sink.offset()};
  return {.offset_bytes = sink.offset()};
}

}  // namespace tessera
