// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A global map as the exchange sees it.
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
  store.set_frame = [](void* context, Slot slot, const GridTransform& frame, std::uint32_t revision,
                       const MapSession& session) noexcept {
    static_cast<void>(static_cast<GlobalMap*>(context)->set_frame(slot, frame, revision, session));
  };
  store.remove = [](void* context, Slot slot) noexcept {
    static_cast<GlobalMap*>(context)->remove(slot);
  };
  store.fullness = [](const void* context) noexcept {
    return static_cast<const GlobalMap*>(context)->fullness();
  };
  return store;
}

}  // namespace tessera
