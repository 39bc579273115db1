// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/replica/replica_store.hpp"

namespace tessera {

ReplicaStore store_of(Replicas& replicas) noexcept {
  using Slot = Replicas::Slot;
  ReplicaStore store;
  store.context = &replicas;
  store.replicas = &replicas;
  store.open = [](void* context, const ContributionId& id, const GridTransform& frame) noexcept {
    Replicas& all = *static_cast<Replicas*>(context);
    const Result<Slot> slot = all.open(id);
    if (slot.ok()) all.set_frame(*slot, frame, 0);
    return slot;
  };
  store.put = [](void* context, Slot slot, BlockKey key, const PartVersion& version,
                 std::span<const std::byte> packed, std::span<const std::byte> wire) noexcept {
    return static_cast<Replicas*>(context)->put(slot, key, version, packed, wire);
  };
  store.set_frame = [](void* context, Slot slot, const GridTransform& frame, std::uint32_t revision,
                       const MapSession& session) noexcept {
    static_cast<Replicas*>(context)->set_frame(slot, frame, revision, session);
  };
  store.remove = [](void* context, Slot slot) noexcept {
    Replicas& all = *static_cast<Replicas*>(context);
    while (all.contribution(slot).first_block != 0) all.drop(all.contribution(slot).first_block);
    all.close(slot);
  };
  store.fullness = [](const void* context) noexcept {
    return static_cast<const Replicas*>(context)->fullness();
  };
  return store;
}

}  // namespace tessera
