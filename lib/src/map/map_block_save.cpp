// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cstring>

#include "map_block_format.hpp"

namespace tessera {

namespace {

using detail::CheckedSink;

/// A block of a map, by the functions that BlockSnapshot has.
class MapBlock {
 public:
  MapBlock(const LocalMap& map, const Block& block) noexcept : map_(map), block_(block) {}
  [[nodiscard]] std::uint64_t key() const noexcept { return block_.key; }
  [[nodiscard]] std::uint32_t revision() const noexcept { return block_.revision; }
  [[nodiscard]] std::uint8_t observed_labels(int octet) const noexcept {
    return map_.observed_labels(block_, octet);
  }
  [[nodiscard]] VoxelEvidence evidence(int octet, int voxel) const noexcept {
    return map_.evidence(block_, octet, voxel);
  }
  [[nodiscard]] LabelVotes votes(std::size_t layer) const noexcept {
    const bool has_them = map_.keeps_votes() && block_.labels[layer] != 0;
    return has_them ? map_.votes(block_, layer) : LabelVotes{};
  }
  /// By octets. False: there are none, and into may be not set.
  [[nodiscard]] bool passes(std::span<std::byte, kBlockVoxels> into) const noexcept {
    return block_.has_free_passes() && copy_passes(map_, block_, into);
  }

 private:
  const LocalMap& map_;
  const Block& block_;
};

/// The same of a block as another thread has read it.
class ReadBlock {
 public:
  explicit ReadBlock(const BlockSnapshot& block) noexcept : block_(block) {}
  [[nodiscard]] std::uint64_t key() const noexcept { return pack(block_.coord())->bits; }
  [[nodiscard]] std::uint32_t revision() const noexcept { return block_.revision(); }
  [[nodiscard]] std::uint8_t observed_labels(int octet) const noexcept {
    return block_.observed_labels(octet);
  }
  [[nodiscard]] VoxelEvidence evidence(int octet, int voxel) const noexcept {
    return block_.evidence(octet, voxel);
  }
  [[nodiscard]] LabelVotes votes(std::size_t layer) const noexcept { return block_.votes(layer); }
  [[nodiscard]] bool passes(std::span<std::byte, kBlockVoxels> into) const noexcept {
    std::byte any{0};
    for (int octet = 0; octet < kBlockOctets; ++octet) {
      for (int voxel = 0; voxel < kOctetVoxels; ++voxel) {
        const std::byte count{block_.free_passes(octet, voxel)};
        any |= count;
        into[static_cast<std::size_t>(octet * kOctetVoxels + voxel)] = count;
      }
    }
    return any != std::byte{0};
  }

 private:
  const BlockSnapshot& block_;
};

template <class Stored>
detail::BlockHead head_of(const Stored& block) noexcept {
  std::array<std::byte, kBlockVoxels> passes{};
  detail::BlockHead head{
      .key = block.key(), .revision = block.revision(), .free = block.passes(passes)};
  for (int octet = 0; octet < kBlockOctets; ++octet) {
    if (block.observed_labels(octet) != 0)
      head.octets |= std::uint64_t{1} << static_cast<unsigned>(octet);
  }
  // A scan opens layers for its votes before it knows whether labels come.
  for (std::size_t layer = 0; layer < kBlockLayers; ++layer) {
    if (detail::octets_of_layer(head.octets, layer) != 0 && block.votes(layer).begun)
      head.votes |= 1U << static_cast<unsigned>(layer);
  }
  return head;
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

void put_votes(const LabelVotes& votes, std::span<std::byte> buffer, CheckedSink& sink) noexcept {
  ByteWriter out(buffer);
  std::array<std::uint8_t, LabelVotes::kClasses> slots{};
  const std::size_t classes = votes.by_class(slots);
  out.u8(static_cast<std::uint8_t>(classes));
  for (const std::uint8_t slot : std::span(slots).first(classes)) {
    out.u8(votes.labels[slot]);
    for (const std::uint16_t count : votes.votes[slot]) out.u16(count);
  }
  TESSERA_ASSERT(out.ok());
  sink.put(out.written());
}

template <class Stored>
void put_octet(const Stored& block, int octet, std::span<std::byte> buffer,
               CheckedSink& sink) noexcept {
  ByteWriter out(buffer);
  const unsigned observed = block.observed_labels(octet);
  out.u8(static_cast<std::uint8_t>(observed));
  for (int voxel = 0; voxel < kOctetVoxels; ++voxel) {
    if (((observed >> static_cast<unsigned>(voxel)) & 1U) == 0) continue;
    const VoxelEvidence evidence = block.evidence(octet, voxel);
    const std::uint64_t present = present_counts(evidence);
    out.u8(static_cast<std::uint8_t>(std::popcount(present)));
    out.u8(evidence.centroid.code());
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

template <class Stored>
void put_block(const Stored& block, const detail::BlockHead& head, std::span<std::byte> buffer,
               CheckedSink& sink) noexcept {
  ByteWriter out(buffer);
  out.u64(head.key);
  out.u32(head.revision);
  out.u8(static_cast<std::uint8_t>((head.free ? 1U : 0U) | head.votes << detail::kVotesShift));
  out.u64(head.octets);
  sink.put(out.written());
  // Of its own, so that a reader takes no storage on the word of a damaged head.
  sink.put_crc();
  if (head.free) {
    const std::span<std::byte, kBlockVoxels> passes = buffer.first<kBlockVoxels>();
    static_cast<void>(block.passes(passes));
    sink.put(passes);
  }
  for (unsigned rest = head.votes; rest != 0; rest &= rest - 1)
    put_votes(block.votes(static_cast<std::size_t>(std::countr_zero(rest))), buffer, sink);
  for (std::uint64_t rest = head.octets; rest != 0; rest &= rest - 1)
    put_octet(block, std::countr_zero(rest), buffer, sink);
  sink.put_crc();
}

template <class Stored>
std::size_t save_into(const Stored& block, std::span<std::byte> into) noexcept {
  const detail::BlockHead head = head_of(block);
  if (head.octets == 0 && !head.free) return 0;
  SpanWriter writer{into};
  CheckedSink sink({&writer, &SpanWriter::write});
  std::array<std::byte, detail::kOctetPieceBytes> buffer{};
  put_block(block, head, buffer, sink);
  return sink.ok() ? writer.size : 0;
}

}  // namespace

detail::BlockHead detail::head_of(const LocalMap& map, const Block& block) noexcept {
  return tessera::head_of(MapBlock(map, block));
}

void detail::put_block(const LocalMap& map, const Block& block, const BlockHead& head,
                       std::span<std::byte> buffer, CheckedSink& sink) noexcept {
  tessera::put_block(MapBlock(map, block), head, buffer, sink);
}

std::size_t save_block(const LocalMap& map, const Block& block,
                       std::span<std::byte> into) noexcept {
  return save_into(MapBlock(map, block), into);
}

std::uint32_t revision_of_stored(std::span<const std::byte> bytes) noexcept {
  ByteReader in(bytes);
  static_cast<void>(in.u64());  // its key
  return in.u32();
}

std::size_t save_block(const BlockSnapshot& block, std::span<std::byte> into) noexcept {
  return block.empty() ? 0 : save_into(ReadBlock(block), into);
}

}  // namespace tessera
