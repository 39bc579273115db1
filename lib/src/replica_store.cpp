// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/exchange_config.hpp"
#include "tessera/fusion/global_map.hpp"

namespace tessera {

ReplicaStore store_of(GlobalMap& global) noexcept {
  using Slot = Replicas::Slot;
  ReplicaStore store;
  store.context = &global;
  store.replicas = &global.replicas();
  store.open = [](void* context, const ContributionId& id, const GridTransform& frame) noexcept {
    GlobalMap& all = *static_cast<GlobalMap*>(context);
    // One of that name that is being removed has to be gone first.
    const Result<Slot> known = all.replicas().find(id);
    if (known.ok() && all.leaving(*known)) return Result<Slot>(Status::kBusy);
    return all.open(id, frame);
  };
  store.put = [](void* context, Slot slot, BlockKey key, const PartVersion& version,
                 std::span<const std::byte> packed, std::span<const std::byte> wire) noexcept {
    return static_cast<GlobalMap*>(context)->put(slot, key, version, packed, wire);
  };
  store.set_frame = [](void* context, Slot slot, const GridTransform& frame,
                       std::uint32_t revision) noexcept {
    static_cast<void>(static_cast<GlobalMap*>(context)->set_frame(slot, frame, revision));
  };
  store.remove = [](void* context, Slot slot) noexcept {
    static_cast<GlobalMap*>(context)->remove(slot);
  };
  return store;
}

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
  store.set_frame = [](void* context, Slot slot, const GridTransform& frame,
                       std::uint32_t revision) noexcept {
    static_cast<Replicas*>(context)->set_frame(slot, frame, revision);
  };
  store.remove = [](void* context, Slot slot) noexcept {
    Replicas& all = *static_cast<Replicas*>(context);
    while (all.contribution(slot).first_block != 0) all.drop(all.contribution(slot).first_block);
    all.close(slot);
  };
  return store;
}

}  // namespace tessera
