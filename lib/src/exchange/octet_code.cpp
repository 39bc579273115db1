// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "octet_code.hpp"

namespace tessera::detail {

namespace {

/// False iff the voxel has no label evidence.
bool read_labels(const BlockContent& content, int row, VoxelCode& voxel) noexcept {
  voxel.set = {};
  for (std::uint64_t rest = content.components(); rest != 0; rest &= rest - 1) {
    const int component = std::countr_zero(rest);
    const float count = content.count(component, row);
    if (!(count > 0.0F)) continue;
    TESSERA_ASSERT(voxel.set.classes < kCodedClasses);
    if (voxel.set.classes == kCodedClasses) break;
    const std::size_t slot = voxel.set.classes++;
    voxel.set.components[slot] = static_cast<std::uint8_t>(component);
    voxel.levels[slot] = static_cast<std::uint8_t>(level_of(count));
  }
  voxel.set.rest = content.any_rest() && content.rest(row) > 0.0F;
  if (voxel.set.rest)
    voxel.levels[kRestSlot] = static_cast<std::uint8_t>(level_of(content.rest(row)));
  voxel.centroid = content.centroid(row);
  TESSERA_ASSERT(!voxel.set.full() || !voxel.centroid.known());
  return voxel.set.any();
}

}  // namespace

void read_octet(const BlockContent& content, int octet, bool labels, bool passes,
                OctetCode& code) noexcept {
  code.labelled = code.freed = 0;
  if (!labels && !passes) return;
  for (int v = 0; v < kOctetVoxels; ++v) {
    const int row = row_order(octet, v);
    const auto bit = static_cast<std::uint8_t>(1U << static_cast<unsigned>(v));
    VoxelCode& voxel = code.voxels[static_cast<std::size_t>(v)];
    const int level = passes ? passes_level_of(content.passes(row)) : 0;
    voxel.passes = 0;
    if (labels && read_labels(content, row, voxel)) {
      code.labelled |= bit;
      voxel.passes = static_cast<std::uint8_t>(level);
    } else if (level != 0) {
      code.freed |= bit;
      code.passes = static_cast<std::uint8_t>(level);
    }
  }
}

void add_octet(const OctetCode& code, int octet, BlockContent& content) noexcept {
  for (int v = 0; v < kOctetVoxels; ++v) {
    const int row = row_order(octet, v);
    const unsigned bit = 1U << static_cast<unsigned>(v);
    const VoxelCode& voxel = code.voxels[static_cast<std::size_t>(v)];
    if ((code.freed & bit) != 0) content.add_passes(row, passes_of_level(code.passes));
    if ((code.labelled & bit) == 0) continue;
    for (std::size_t slot = 0; slot < voxel.set.classes; ++slot)
      content.add(voxel.set.components[slot], row, count_of_level(voxel.levels[slot]));
    if (voxel.set.rest) content.add_rest(row, count_of_level(voxel.levels[kRestSlot]));
    if (voxel.centroid.known()) content.set_centroid(row, voxel.centroid);
    if (voxel.passes != 0) content.add_passes(row, passes_of_level(voxel.passes));
  }
}

}  // namespace tessera::detail
