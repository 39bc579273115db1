// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What replicas hold, and how full they are.
#include <algorithm>

#include "tessera/map/internal/packed_block.hpp"
#include "tessera/replica/replicas.hpp"

namespace tessera {

bool Replicas::read_block(const Replica* first, std::span<std::byte> packed,
                          BlockContent& content) const noexcept {
  bool any = false;
  for (const Replica* part = first; part != nullptr; part = next_part(*part)) {
    const auto is_live = [part](int row) { return ((part->live >> layer_of_row(row)) & 1U) != 0; };
    any = any || part->bytes != 0;
    unpack_block(
        read(*part, packed),
        [&](int row, Centroid centroid) {
          if (is_live(row) && centroid.known()) content.set_centroid(row, centroid);
        },
        [&](int row, int component, float count) {
          if (!is_live(row)) return;
          component == 0 ? content.add_rest(row, count) : content.add(component, row, count);
        },
        [&](int row, unsigned passes) {
          if (is_live(row)) content.add_passes(row, passes);
        });
  }
  return any;
}

std::uint32_t Replicas::fullness() const noexcept {
  return std::max(share_in_1024(segments_.used_segments(), config_.segments),
                  share_in_1024(blocks_, config_.blocks));
}

ReplicasUsage Replicas::usage() const noexcept {
  ReplicasUsage usage = counted_;
  usage.contributions = present_;
  usage.replica_blocks = blocks_;
  usage.segments = segments_.used_segments();
  usage.replica_bytes = std::size_t{usage.segments} * SegmentStore::kSegmentBytes +
                        std::size_t{blocks_} * sizeof(Replica) + index_.used_bytes();
  return usage;
}

}  // namespace tessera
