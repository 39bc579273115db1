// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "network/held.hpp"

#include <map>
#include <set>
#include <utility>

#include "tessera/base/internal/crc32.hpp"
#include "tessera/base/internal/digest.hpp"
#include "tessera/map/internal/packed_block.hpp"
#include "tessera/replica/contribution_kind.hpp"

namespace tessera::network {

namespace {

/// Parts that have anything, in an order that does not hang on when they arrived.
std::map<std::pair<std::uint64_t, std::uint8_t>, const Replicas::Replica*> parts_of(
    const Replicas& replicas, const Replicas::Contribution& contribution) {
  std::map<std::pair<std::uint64_t, std::uint8_t>, const Replicas::Replica*> parts;
  for (std::uint32_t at = contribution.first_block; at != 0; at = replicas.record(at).next) {
    const Replicas::Replica& part = replicas.record(at);
    if (part.live != 0 && part.bytes != 0) parts[{part.key, part.live}] = &part;
  }
  return parts;
}

}  // namespace

std::vector<Held> held(const Replicas& replicas, int num_components) {
  std::vector<Held> all;
  std::vector<std::byte> bytes(most_packed_bytes(num_components));
  for (const Replicas::Slot slot : replicas.in_order()) {
    const Replicas::Contribution& contribution = replicas.contribution(slot);
    Held here{.id = contribution.id, .frame_revision = contribution.frame_revision};
    Digest digest;
    std::set<std::uint64_t> keys;
    for (const auto& [name, part] : parts_of(replicas, contribution)) {
      const std::span<const std::byte> packed = replicas.read(*part, bytes);
      const auto is_live = [live = part->live](int row) {
        return ((unsigned{live} >> layer_of_row(row)) & 1U) != 0;
      };
      if (has_blocks(contribution.id))
        unpack_block(
            packed,
            [&](int row, int /*component*/, float count) {
              if (is_live(row)) here.label_evidence += static_cast<double>(count);
            },
            [&](int row, unsigned passes) {
              if (is_live(row)) here.passes += passes;
            });
      keys.insert(name.first);
      digest.add(name.first);
      digest.add(name.second);
      digest.add(crc32c(packed));
    }
    here.blocks = static_cast<std::uint32_t>(keys.size());
    here.digest = digest.value();
    all.push_back(here);
  }
  return all;
}

std::uint64_t content_digest(const Replicas& replicas, int num_components) {
  Digest digest;
  for (const Held& one : held(replicas, num_components)) {
    digest.add(one.id.robot);
    digest.add(one.id.epoch);
    digest.add(one.frame_revision);
    digest.add(one.digest);
  }
  return digest.value();
}

}  // namespace tessera::network
