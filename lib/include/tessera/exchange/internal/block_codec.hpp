// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A block's content in as few bytes as go over the air: counts and passes as levels
// (evidence_levels.hpp), decisions that are each coded by how likely they were before
// (range_coder.hpp). A code stands alone. docs/reference/wire-format.md has it bit by bit.
#pragma once

#include <cstddef>
#include <span>

#include "tessera/base/status.hpp"
#include "tessera/map/block_content.hpp"

namespace tessera {

/// The most bytes that the code of so many layers can have: of one 1,113, of four 4,447.
[[nodiscard]] constexpr std::size_t most_coded_bytes(int layers) noexcept {
  // Decisions where they are coded as equally likely. Of a voxel: whether its components are the
  // last one's, a rest, how many, three of six bits, four levels of nine, whether it has passes,
  // and their level. Of an octet whose voxels are all such: whether any is, all, any with passes;
  // octets with fewer have fewer. Then what is there at all, and that the coding is this one.
  constexpr int kOfVoxel = 1 + 1 + 3 + 3 * 6 + 4 * 9 + 1 + 9;
  constexpr int kOfOctet = 3 + kOctetVoxels * kOfVoxel;
  const int bits = layers * kLayerOctets * kOfOctet + 2 + 12;
  // A decision costs less than 1 + 1 / 2048 bits.
  return static_cast<std::size_t>((bits + bits / 1024) / 8 + 1);
}

/// Makes content what decoding its code gives. Doing it twice is doing it once; packing it
/// (packed_block.hpp) loses nothing.
///
/// Label evidence: a voxel keeps the three components with the largest counts, of equal ones the
/// lower; the others go to the rest, and so does what is under 1/32 of the largest count. Counts
/// become levels: at most 1/9 off between 2^-12 and 1.5 * 2^19, with smaller ones 2^-12 and larger
/// ones 1.5 * 2^19. Where two counts have one level and the lower component the smaller count, that
/// one is a level lower, so that their order stays, and with it the label: it changes only where
/// component C + 1 has over 32 times its evidence. A rest under 1/32 of the largest count is left
/// out. A voxel that keeps three components and a rest loses its centroid.
///
/// Passes: of a voxel with label evidence at most 1/8 off, over 224 as 224. The voxels of an octet
/// that have passes and no label evidence share the rounded mean of theirs, as such a level.
///
/// O(512 * components present).
void quantise(BlockContent& content) noexcept;

/// Codes the layers of quantised content. Returns the bytes written, the same for the same content
/// and layers: 0 iff these layers hold no evidence or into is too small; most_coded_bytes is always
/// enough. layers: 1 .. kAllLayers. O(512 * components present), 4 KiB of stack.
[[nodiscard]] std::size_t encode_block(const BlockContent& content, unsigned layers,
                                       std::span<std::byte> into) noexcept;

/// Adds the content of layers to content, which is clear. Fails with kCorrupt iff the bytes are not
/// what encode_block gives for any content of so many components; content then holds some of what
/// they say. No bytes are no evidence. num_components: C + 2, at most what content was made for.
/// O(512 * components), whatever the bytes, of which none beyond the span is read. 4 KiB of stack.
Status decode_block(std::span<const std::byte> bytes, unsigned layers, int num_components,
                    BlockContent& content) noexcept;

}  // namespace tessera
