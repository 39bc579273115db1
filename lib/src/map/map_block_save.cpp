// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cstring>

#include "map_block_format.hpp"

namespace tessera {

namespace {

using detail::CheckedSink;

bool has_free(const LocalMap& map, const Block& block) noexcept {
  std::array<std::byte, kBlockVoxels> passes{};
  return block.has_free_passes() && copy_passes(map, block, passes);
}

std::uint64_t octet_mask(const LocalMap& map, const Block& block) noexcept {
  std::uint64_t mask = 0;
  for (int octet = 0; octet < kBlockOctets; ++octet) {
    if (map.observed_labels(block, octet) != 0)
      mask |= std::uint64_t{1} << static_cast<unsigned>(octet);
  }
  return mask;
}

/// A bit for each label component with evidence, and bit 0 for the rest.
std::uint64_t present_counts(const VoxelEvidence& evidence) noexcept {
  std::uint64_t present = 0;
  // Most are zero, so two at once. No count is negative: bits tell.
  for (std::size_t l = 0; l < kMaxComponents; l += 2) {
    std::uint64_t pair = 0;
    std::memcpy(&pair, &evidence.sigma[l], sizeof(pair));
    if (pair == 0) continue;
    present |= (evidence.sigma[l] > 0.0F ? std::uint64_t{1} : 0) << l;
    present |= (evidence.sigma[l + 1] > 0.0F ? std::uint64_t{1} : 0) << (l + 1);
  }
  return (present & ~std::uint64_t{1}) | (evidence.rest > 0.0F ? 1U : 0U);
}

void put_octet(const LocalMap& map, const Block& block, int octet, std::span<std::byte> buffer,
               CheckedSink& sink) noexcept {
  ByteWriter out(buffer);
  const unsigned observed = map.observed_labels(block, octet);
  out.u8(static_cast<std::uint8_t>(observed));
  for (int voxel = 0; voxel < kOctetVoxels; ++voxel) {
    if (((observed >> static_cast<unsigned>(voxel)) & 1U) == 0) continue;
    const VoxelEvidence evidence = map.evidence(block, octet, voxel);
    const std::uint64_t present = present_counts(evidence);
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

/// Bytes of memory as a sink.
struct SpanWriter {
  std::span<std::byte> into;
  std::size_t size = 0;
  static bool write(void* context, std::span<const std::byte> bytes) noexcept {
    auto& self = *static_cast<SpanWriter*>(context);
    if (bytes.size() > self.into.size() - self.size) return false;
    std::memcpy(self.into.data() + self.size, bytes.data(), bytes.size());
    self.size += bytes.size();
    return true;
  }
};

}  // namespace

detail::BlockHead detail::head_of(const LocalMap& map, const Block& block) noexcept {
  return {.key = block.key,
          .revision = block.revision,
          .free = has_free(map, block),
          .octets = octet_mask(map, block)};
}

void detail::put_block(const LocalMap& map, const Block& block, const BlockHead& head,
                       std::span<std::byte> buffer, CheckedSink& sink) noexcept {
  ByteWriter out(buffer);
  out.u64(head.key);
  out.u32(head.revision);
  out.u8(head.free ? 1 : 0);
  out.u64(head.octets);
  sink.put(out.written());
  // Of its own, so that a reader takes no storage on the word of a damaged head.
  sink.put_crc();
  if (head.free) {
    const std::span<std::byte> passes = buffer.first(kBlockVoxels);
    copy_passes(map, block, passes);
    sink.put(passes);
  }
  for (std::uint64_t rest = head.octets; rest != 0; rest &= rest - 1) {
    put_octet(map, block, std::countr_zero(rest), buffer, sink);
  }
  sink.put_crc();
}

std::size_t save_block(const LocalMap& map, const Block& block,
                       std::span<std::byte> into) noexcept {
  const detail::BlockHead head = detail::head_of(map, block);
  if (head.octets == 0 && !head.free) return 0;
  SpanWriter writer{into};
  CheckedSink sink({&writer, &SpanWriter::write});
  std::array<std::byte, detail::kOctetPieceBytes> buffer{};
  detail::put_block(map, block, head, buffer, sink);
  return sink.ok() ? writer.size : 0;
}

}  // namespace tessera
