// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Loading blocks trusts nothing: every count and value is checked before it is used.
#include <algorithm>
#include <bit>

#include "map_block_format.hpp"

namespace tessera {

namespace {

using detail::BlockHead;
using detail::CheckedSource;
using detail::failed;

constexpr const char* kEndsInBlock = "the file ends inside a block";

/// The counts of one voxel with label evidence.
MapFileStatus load_counts(CheckedSource& source, VoxelEvidence& evidence) noexcept {
  std::array<std::byte, 2> head{};
  if (!source.get(head)) return failed(source, Status::kTruncated, kEndsInBlock);
  const int count = std::to_integer<int>(head[0]);
  if (count == 0) return failed(source, Status::kCorrupt, "an observed voxel has no count");
  const auto centroid = std::to_integer<std::uint8_t>(head[1]);
  if (centroid >= Centroid::kCodes) return failed(source, Status::kCorrupt, "returns are nowhere");
  evidence.centroid = Centroid::of_code(centroid);
  int last = -1;  // 0 stands for the rest
  for (int i = 0; i < count; ++i) {
    std::array<std::byte, 5> bytes{};
    if (!source.get(bytes)) return failed(source, Status::kTruncated, kEndsInBlock);
    ByteReader in(bytes);
    const int component = in.u8();
    const float value = in.f32();
    if (component <= last || component >= evidence.num_components || value == 0.0F ||
        !is_count(value)) {
      return failed(source, Status::kCorrupt, "a count is out of range");
    }
    last = component;
    (component == 0 ? evidence.rest : evidence.sigma[static_cast<std::size_t>(component)]) = value;
  }
  return {};
}

/// Float rounding may leave a sum a little over the cap.
bool over_cap(const MapConfig& config, const VoxelEvidence& evidence,
              std::uint8_t passes) noexcept {
  if (!(config.max_evidence > 0.0F)) return false;
  float sum = static_cast<float>(passes) * config.free_weight;
  for (int l = 1; l < evidence.num_components; ++l)
    sum += evidence.sigma[static_cast<std::size_t>(l)];
  return sum + evidence.rest > config.max_evidence * 1.001F;
}

/// What a map says of content that it was given.
MapFileStatus told(const CheckedSource& source, Status status) noexcept {
  if (status == Status::kOk) return {};
  if (status == Status::kInvalidArgument)
    return failed(source, Status::kCorrupt, "a voxel has counts that no map can hold");
  return failed(source, status, "the map's storage is too small for this file");
}

/// labelled: the octet's label evidence follows. passes: of the whole block; empty: none.
MapFileStatus load_octet(CheckedSource& source, LocalMap& map, SlabHandle block, int octet,
                         bool labelled, std::span<const std::byte> passes) noexcept {
  std::array<std::byte, 1> observed{};
  if (labelled && !source.get(observed)) return failed(source, Status::kTruncated, kEndsInBlock);
  if (labelled && observed[0] == std::byte{0})
    return failed(source, Status::kCorrupt, "an octet without an observed voxel");
  constexpr std::array<std::byte, kOctetVoxels> kNone{};
  const std::span<const std::byte> free =
      passes.empty() ? std::span<const std::byte>(kNone)
                     : passes.subspan(static_cast<std::size_t>(octet) * kOctetVoxels, kOctetVoxels);
  const unsigned with_labels = std::to_integer<unsigned>(observed[0]) |
                               unsigned{map.observed_labels(map.block_at(block), octet)};
  const MapFileStatus added =
      told(source, map.merge_passes(block, octet, free, ~with_labels & 0xffU));
  if (!added.ok()) return added;
  for (unsigned rest = with_labels; rest != 0; rest &= rest - 1) {
    const auto voxel = static_cast<unsigned>(std::countr_zero(rest));
    VoxelEvidence evidence;
    evidence.num_components = map.num_components();
    if (((std::to_integer<unsigned>(observed[0]) >> voxel) & 1U) != 0) {
      const MapFileStatus status = load_counts(source, evidence);
      if (!status.ok()) return status;
    }
    const auto passed = std::to_integer<std::uint8_t>(free[voxel]);
    if (over_cap(map.config(), evidence, passed))
      return failed(source, Status::kCorrupt, "a voxel's evidence is over the cap");
    const MapFileStatus status =
        told(source, map.merge(block, octet, static_cast<int>(voxel), evidence, passed));
    if (!status.ok()) return status;
  }
  return {};
}

using BlockVotes = std::array<LabelVotes, kBlockLayers>;

/// Votes of the layers that have them, as classes ascend.
MapFileStatus load_votes(CheckedSource& source, const BlockHead& head, int num_classes,
                         BlockVotes& votes) noexcept {
  for (unsigned layers = head.votes; layers != 0; layers &= layers - 1) {
    LabelVotes& of_layer = votes[static_cast<std::size_t>(std::countr_zero(layers))];
    of_layer.begun = true;
    std::array<std::byte, 1> classes{};
    if (!source.get(classes)) return failed(source, Status::kTruncated, kEndsInBlock);
    const auto count = std::to_integer<std::size_t>(classes[0]);
    bool valid = count <= LabelVotes::kClasses;
    std::array<std::uint32_t, LabelVotes::kCells> in_cell{};
    for (std::size_t slot = 0; valid && slot < count; ++slot) {
      std::array<std::byte, 1 + 2 * LabelVotes::kCells> bytes{};
      if (!source.get(bytes)) return failed(source, Status::kTruncated, kEndsInBlock);
      ByteReader in(bytes);
      const std::uint8_t label = in.u8();
      std::uint32_t of_class = 0;
      for (std::size_t cell = 0; cell < LabelVotes::kCells; ++cell) {
        of_layer.votes[slot][cell] = in.u16();
        in_cell[cell] += of_layer.votes[slot][cell];
        of_class += of_layer.votes[slot][cell];
        valid = valid && in_cell[cell] <= LabelVotes::kMostOfCell;
      }
      const int least = slot == 0 ? 1 : of_layer.labels[slot - 1] + 1;
      valid = valid && of_class != 0 && label >= least && label <= num_classes;
      of_layer.labels[slot] = label;
    }
    if (!valid) return failed(source, Status::kCorrupt, "a layer's votes are out of range");
  }
  return {};
}

/// To what came from a file is added what the layers have. Labels that come with these votes do not
/// vote for themselves.
void add_to_votes(LocalMap& map, SlabHandle block, const BlockHead& head,
                  BlockVotes& votes) noexcept {
  if (!map.keeps_votes()) return;
  for (unsigned layers = head.votes; layers != 0; layers &= layers - 1) {
    const auto layer = static_cast<std::size_t>(std::countr_zero(layers));
    if (map.block_at(block).labels[layer] == 0) continue;
    LabelVotes sum = map.begun_votes(block, layer);
    sum.add(votes[layer]);
    sum.begun = true;
    votes[layer] = sum;
    map.set_votes(block, layer, {});  // so that the labels do not vote
  }
}

/// Of layers that have a page still: labels may have given way to passes.
void set_votes(LocalMap& map, SlabHandle block, const BlockHead& head,
               const BlockVotes& votes) noexcept {
  if (!map.keeps_votes()) return;
  for (unsigned layers = head.votes; layers != 0; layers &= layers - 1) {
    const auto layer = static_cast<std::size_t>(std::countr_zero(layers));
    if (map.block_at(block).labels[layer] != 0) map.set_votes(block, layer, votes[layer]);
  }
}

/// Whether the map has room for all that a stored block may bring; a refusal is counted.
bool has_room(LocalMap& map, const BlockHead& head) noexcept {
  const Block* const block = map.find(unpack(BlockKey{head.key}));
  SlabPool::Counts wanted{};
  wanted[kBlockSlab] = block == nullptr ? 1 : 0;
  for (std::size_t layer = 0; layer < kBlockLayers; ++layer) {
    const bool labelled = detail::octets_of_layer(head.octets, layer) != 0;
    if (labelled && (block == nullptr || block->labels[layer] == 0)) ++wanted[kLabelSlab];
    // The head does not tell which layers have passes: a bound.
    if (head.free && (block == nullptr || block->free_passes[layer] == 0)) ++wanted[kFreeSlab];
  }
  for (std::uint64_t rest = head.octets; rest != 0; rest &= rest - 1) {
    const bool there = block != nullptr && map.octet_handle(*block, std::countr_zero(rest)) != 0;
    wanted[kOctetSlab] += there ? 0U : 1U;
  }
  return map.fits_or_refuse(wanted);
}

/// Bytes that are in memory as a whole.
struct SpanReader {
  std::span<const std::byte> left;
  static std::size_t read(void* context, std::span<std::byte> into) noexcept {
    auto& self = *static_cast<SpanReader*>(context);
    const std::size_t n = std::min(self.left.size(), into.size());
    if (n > 0) std::memcpy(into.data(), self.left.data(), n);
    self.left = self.left.subspan(n);
    return n;
  }
};

}  // namespace

MapFileStatus detail::read_head(CheckedSource& source, std::span<std::byte, kPieceBytes> buffer,
                                BlockHead& head) noexcept {
  constexpr std::size_t kHead = 8 + 4 + 1 + 8;
  const std::span<std::byte> bytes = buffer.first(kHead);
  if (!source.get(bytes))
    return failed(source, Status::kTruncated, "the file ends before its last block");
  const MapFileStatus intact = check(source, "a block's head is damaged");
  if (!intact.ok()) return intact;
  ByteReader in(bytes);
  head.key = in.u64();
  head.revision = in.u32();
  const unsigned parts = in.u8();
  head.octets = in.u64();
  const unsigned free = parts & ((1U << kVotesShift) - 1U);
  head.free = free == 1;
  head.votes = parts >> kVotesShift;
  bool valid = head.key >> 63U == 0 && free <= 1 && (head.free || head.octets != 0);
  for (std::size_t layer = 0; layer < kBlockLayers; ++layer)
    valid =
        valid && (((head.votes >> layer) & 1U) == 0 || octets_of_layer(head.octets, layer) != 0);
  if (!valid) return failed(source, Status::kCorrupt, "a block's head is not valid");
  return {};
}

MapFileStatus detail::read_content(CheckedSource& source, std::span<std::byte, kPieceBytes> buffer,
                                   const BlockHead& head, LocalMap& map) noexcept {
  std::span<std::byte> passes;
  if (head.free) {
    passes = buffer.first(kBlockVoxels);
    if (!source.get(passes)) return failed(source, Status::kTruncated, kEndsInBlock);
    if (std::ranges::all_of(passes, [](std::byte n) { return n == std::byte{0}; }))
      return failed(source, Status::kCorrupt, "a block's free layer is empty");
  }
  BlockVotes votes{};
  const MapFileStatus voted = load_votes(source, head, map.classes().num_classes(), votes);
  if (!voted.ok()) return voted;
  const Result<SlabHandle> block = map.open_block(unpack(BlockKey{head.key}));
  if (!block.ok()) return failed(source, block.status(), "the map has no room for a block");
  if (map.block_at(*block).revision < head.revision) map.restore_revision(*block, head.revision);
  add_to_votes(map, *block, head, votes);
  MapFileStatus status;
  for (int octet = 0; octet < kBlockOctets && status.ok(); ++octet) {
    const bool labelled = ((head.octets >> static_cast<unsigned>(octet)) & 1U) != 0;
    if (labelled || !passes.empty())
      status = load_octet(source, map, *block, octet, labelled, passes);
  }
  set_votes(map, *block, head, votes);  // also where it failed: those of before are among them
  return status.ok() ? check(source, "a block's checksum does not match") : status;
}

MapFileStatus restore_block(std::span<const std::byte> bytes, LocalMap& map) noexcept {
  SpanReader reader{bytes};
  CheckedSource source({&reader, &SpanReader::read}, 0);
  std::array<std::byte, detail::kPieceBytes> buffer{};
  BlockHead head;
  const MapFileStatus status = detail::read_head(source, buffer, head);
  if (!status.ok()) return status;
  if (bytes.size() < source.offset() + 4)
    return failed(source, Status::kTruncated, "the file ends before a checksum");
  // Content starts a checksum of its own: whole before any of it is added to the map.
  const std::size_t content = static_cast<std::size_t>(source.offset());
  ByteReader stored(bytes.last(4));
  if (crc32c(bytes.subspan(content, bytes.size() - content - 4)) != stored.u32())
    return failed(source, Status::kCorrupt, "a block's checksum does not match");
  if (!has_room(map, head))
    return failed(source, Status::kResourceExhausted, "the map has no room for a block");
  return detail::read_content(source, buffer, head, map);
}

}  // namespace tessera
